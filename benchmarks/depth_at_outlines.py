"""Accuracy of `recover_depth` near occlusion boundaries, on synthetic scenes with known depth.

    python benchmarks/depth_at_outlines.py [--held-back] [--controls] [--drawn FIRST LAST]
                                           [--only NAME ...] [--cache DIR] [--out FILE.json]

Each scene (`analysis/outline_scenes.py`) is processed with and without the boundary treatment (``outlines=False``).
Printed are, within 10 pixels of true boundaries (where distance changes by 5 % between neighbours) and over the whole
frame, in percent: valid pixels, and of these those off by more than 10 %, by more than 5 stated SDs, and those within
2; z (1.48 times the median error in stated SDs: 1 is honest, less is too wide an SD); then the median and the 90th
percentile of the error of distance, and processor seconds. The scenes of `--held-back` were not used during
development. The scenes of `--controls` have no boundaries: depth and validity should not change, and the changes are
printed; the SD may grow where noise distorts depth. The scenes of `--drawn` are random, selected by number; printed
are, for each kind of views, the number of refused scenes (less than 5 % of the frame valid), and the mean over scenes
of the scores of whole frames.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))

from outline_scenes import (
    CONTROLS,
    HELD_BACK,
    MADE_WITH,
    Case,
    drawn,
    near_outlines,
    recovered,
    score,
    views_and_truth,
)

REFUSED = 5.0
"""Percentage of valid pixels below which a frame counts as refused."""


def measure(name: str, case: Case, cache: Path | None) -> dict[str, dict[str, float]]:
    views, vergence = views_and_truth(name, case, cache)
    near, whole = near_outlines(vergence), np.ones(vergence.shape, bool)
    found: dict[str, dict[str, float]] = {}
    for label, outlines in (("without", False), ("with", True)):
        depth, seconds = recovered(case, views, outlines)
        found[f"{label}, near outlines"] = score(depth, vergence, near) if near.any() else {}
        found[f"{label}, whole frame"] = {**score(depth, vergence, whole), "seconds": seconds}
    return found


def departure(name: str, case: Case, cache: Path | None) -> dict[str, float]:
    """Return the largest changes by the boundary treatment in a frame without boundaries: depth (SDs), SD, validity."""
    views, _ = views_and_truth(name, case, cache)
    plain, treated = (recovered(case, views, outlines)[0] for outlines in (False, True))
    both = plain.valid & treated.valid
    return {
        "vergence_in_sd": float((np.abs(treated.vergence - plain.vergence) / plain.vergence_sd)[both].max()),
        "sd_percent": 100 * float(np.abs(treated.vergence_sd / plain.vergence_sd - 1)[both].max()),
        "valid_percent": 100 * float((plain.valid != treated.valid).mean()),
    }


def show(name: str, found: dict[str, dict[str, float]]) -> None:
    for label, some in found.items():
        columns = (
            "valid",
            "off_10_percent",
            "beyond_5_sd",
            "within_2_sd",
            "z",
            "median_percent",
            "p90_percent",
            "seconds",
        )
        print(f"{name:24}{label:24}" + "".join(f"{some[c]:9.2f}" if c in some else f"{'':9}" for c in columns))


def show_drawn(found: dict[str, list[dict[str, float]]]) -> None:
    """Print the mean scores of whole frames, and the number of refused frames, for each kind of views."""
    for kind, scores in sorted(found.items()):
        valid = [one["valid"] for one in scores]
        columns = ("off_10_percent", "beyond_5_sd", "within_2_sd", "median_percent")
        means = [np.mean([one[column] for one in scores if column in one] or [np.nan]) for column in columns]
        refused = sum(one < REFUSED for one in valid)
        print(f"{kind:26}{len(scores):5}{refused:9}{np.mean(valid):9.1f}" + "".join(f"{mean:9.2f}" for mean in means))


def main() -> None:
    parser = argparse.ArgumentParser(description="depth near occlusion boundaries, with and without their treatment")
    parser.add_argument("--held-back", action="store_true", help="the scenes not looked at while the method was made")
    parser.add_argument("--controls", action="store_true", help="scenes without outlines")
    parser.add_argument("--drawn", nargs=2, type=int, metavar=("FIRST", "LAST"), help="scenes drawn by chance")
    parser.add_argument("--only", nargs="*", help="names of scenes")
    parser.add_argument("--cache", type=Path, help="keep rendered views here")
    parser.add_argument("--out", type=Path, help="also write the figures here, as JSON")
    options = parser.parse_args()
    cases = CONTROLS if options.controls else HELD_BACK if options.held_back else MADE_WITH
    cases = {name: case for name, case in cases.items() if not options.only or name in options.only}
    results: dict[str, object] = {}
    if options.drawn:
        by_kind: dict[str, list[dict[str, float]]] = {}
        for number in range(options.drawn[0], options.drawn[1] + 1):
            kind, case = drawn(number)
            views, vergence = views_and_truth(f"drawn {number}", case, options.cache)
            results[str(number)] = whole = score(recovered(case, views, True)[0], vergence, np.ones(case.size, bool))
            by_kind.setdefault(kind, []).append(whole)
        heads = ("scenes", "refused", "valid", "off>10%", "> 5 sd", "< 2 sd", "median%")
        print(f"{'':26}{heads[0]:>5}" + "".join(f"{head:>9}" for head in heads[1:]))
        show_drawn(by_kind)
    elif options.controls:
        print(f"{'':24}{'apart / sd':>12}{'sd / %':>10}{'validity / %':>14}")
        for name, case in cases.items():
            apart = departure(name, case, options.cache)
            results[name] = apart
            print(f"{name:24}{apart['vergence_in_sd']:12.3f}{apart['sd_percent']:10.2f}{apart['valid_percent']:14.3f}")
    else:
        columns = ("valid", "off>10%", "> 5 sd", "< 2 sd", "z", "median%", "p90 %", "cpu s")
        print(f"{'':48}" + "".join(f"{column:>9}" for column in columns))
        for name, case in cases.items():
            found = measure(name, case, options.cache)
            results[name] = found
            show(name, found)
    if options.out:
        options.out.write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
