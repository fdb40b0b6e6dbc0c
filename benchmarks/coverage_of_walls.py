"""Coverage of the stated uncertainty of depth for flat walls seen by an eye.

    python benchmarks/coverage_of_walls.py [--kinds bands moments both] [--pupils MM ...] [--luminances CD ...]
        [--foci D ...] [--vergences D ...] [--seeds N] [--sides PIXELS ...] [--out FILE.csv]

A wall stands at each vergence before an eye focused at each of `foci`; its views have the photon noise of each
luminance (cd/m^2). Bands: images of the L and M, and of the S cones (textures correlated at 0.95). Moments: two views
of the L and M cones, 0.5 D apart in focus. Both: the four views of two bands at two moments. The noise is not given to
the estimator, and the search has its default limits; many of these walls lie beyond them, and should be rejected.

Each line states, over all walls of a kind, pupil and luminance: the fraction of valid pixels; for these, the median
error (D), the median stated SD (D), the fractions within 1, 2 and 5 SDs (normal errors: 68, 95 and 100 %), and the
fraction with an error above 0.5 D.
"""

from __future__ import annotations

import argparse
import csv
import itertools
from pathlib import Path

import numpy as np

from focalgradient import recover_depth
from focalgradient.eye import Cones, Eye, Oscillation, Photons, eye_views
from focalgradient.eye.cones import S_FINEST_CPD

PIXEL = np.radians(1 / 60)
CORRELATION, WRONG = 0.95, 0.5
PAIR = (0.125, 0.375)
"""Times of the views in seconds: the extremes of an oscillation of 0.5 D at 2 Hz."""

KINDS = ("bands", "moments", "both")
PUPILS_MM = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
LUMINANCES = (10.0, 200.0)
FOCI = (0.5, 1.5, 4.0)
VERGENCES = tuple(np.arange(0, 6.25, 0.25).tolist())
COLUMNS = (
    "kind",
    "pupil_mm",
    "luminance",
    "focus_D",
    "side_px",
    "vergence_D",
    "seed",
    "valid",
    "explained",
    "gain",
    "gain_sd",
    "error_D",
    "sd_D",
    "in1",
    "in2",
    "in5",
    "wrong",
)

Row = dict[str, float | str]


def measured(kind: str, mm: float, luminance: float, focus: float, vergence: float, seed: int, side: int) -> Row:
    """Return fractions and medians over the valid pixels of one wall."""
    eye = Eye(1e-3 * mm, focus)
    moments = [eye] if kind == "bands" else eye.through(PAIR, Oscillation())
    cones = [Cones.of(one, "L+M") for one in moments]
    if kind != "moments":
        cones += [Cones.of(one, "S", finest_cpd=S_FINEST_CPD) for one in moments]
    distance = 1 / vergence if vergence else np.inf
    views = eye_views(
        distance, cones, (side, side), PIXEL, noise=Photons(luminance), correlation=CORRELATION, seed=seed
    )
    depth = recover_depth([one.view for one in views])
    error, sd = depth.vergence[depth.valid] - vergence, depth.vergence_sd[depth.valid]
    row: Row = {"kind": kind, "pupil_mm": mm, "luminance": luminance}
    row |= {"focus_D": focus, "side_px": side, "vergence_D": vergence, "seed": seed}
    row["valid"] = float(depth.valid.mean())
    row["explained"] = float(depth.details["share_of_texture_explained"])
    if kind != "moments":
        texture = depth.details["shared_texture"]["S"]
        row |= {"gain": texture["gain"], "gain_sd": texture["gain_sd"]}
    if error.size:
        over = np.abs(error) / sd
        row |= {"error_D": float(np.median(error)), "sd_D": float(np.median(sd))}
        row |= {f"in{n}": float(np.mean(over <= n)) for n in (1, 2, 5)}
        row["wrong"] = float(np.mean(np.abs(error) > WRONG))
    return row


def table(rows: list[Row]) -> list[str]:
    """Return one line per kind, pupil and luminance, and one per kind over all."""
    lines = [
        "kind     pupil  cd/m^2  valid %  |error| D    sd D   in 1 %  in 2 %  in 5 %  off by .5 D %  walls claimed"
    ]
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    cells = list(dict.fromkeys((row["kind"], row["pupil_mm"], row["luminance"]) for row in rows))
    for cell in [*cells, *((kind, None, None) for kind in kinds)]:
        some = [
            row for row in rows if all(b is None or a == b for a, b in zip(list(row.values())[:3], cell, strict=True))
        ]
        claimed = [row for row in some if "sd_D" in row]
        weight = np.array([row["valid"] for row in claimed], float)

        def mean(name: str, claimed: list[Row] = claimed, weight: np.ndarray = weight) -> float:
            return 100 * float(np.average([float(row[name]) for row in claimed], weights=weight)) if claimed else np.nan

        error, sd = ([abs(float(row[name])) for row in claimed] or [np.nan] for name in ("error_D", "sd_D"))
        pupil, light = (f"{value:g}" if value is not None else "all" for value in cell[1:])
        lines.append(
            f"{cell[0]:8} {pupil:>5} {light:>7} {100 * np.mean([float(row['valid']) for row in some]):8.1f} "
            f"{np.median(error):10.4f} {np.median(sd):7.4f} {mean('in1'):8.1f} {mean('in2'):7.1f} {mean('in5'):7.1f} "
            f"{mean('wrong'):14.2f} {len(claimed):6} of {len(some)}"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--pupils", nargs="+", type=float, default=PUPILS_MM)
    parser.add_argument("--luminances", nargs="+", type=float, default=LUMINANCES)
    parser.add_argument("--foci", nargs="+", type=float, default=FOCI)
    parser.add_argument("--vergences", nargs="+", type=float, default=VERGENCES)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--sides", nargs="+", type=int, default=(112, 144, 192), help="taken in turn")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rows: list[Row] = []
    for kind in given.kinds:
        for mm in given.pupils:
            for luminance in given.luminances:
                for focus, vergence in itertools.product(given.foci, given.vergences):
                    for seed in range(given.first_seed, given.first_seed + given.seeds):
                        side = given.sides[len(rows) % len(given.sides)]
                        rows.append(measured(kind, mm, luminance, focus, vergence, seed, side))
    print("\n".join(table(rows)))
    if given.out is not None:
        with given.out.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
