"""Depth from colour for the eyes of a population, each with its own aberrations.

Measured eyes, and estimators with less knowledge of them, are the subject of `benchmarks/depth_of_people.py --out DIR`;
`python analysis/people.py DIR/people.json errors.png` draws its results.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from population import CORRELATION, FOCUS, NOISE, PUPILS, Look, Row, drawn, looked, population, walls
from report import Progress, Shown, alone

from focalgradient.parallel import completed, cores, shared
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

READERS = {"own": "its own optics", "mean": "the mean eye's", "learned": "learned by experience"}
LOOKS = {
    "own": {"color": BLUE, "marker": "o"},
    "mean": {"color": ORANGE, "marker": "s"},
    "learned": {"color": GREY, "marker": "^"},
}


def measure(eyes: int, distances: int, *, progress: Progress | None = None) -> list[Row]:
    """Estimate the depth of walls at `distances` vergences by a number of eyes through each pupil."""
    people, beyond = population(None), tuple(walls(distances).tolist())
    looks = [Look(number, pupil, drawn(people, number), beyond) for number in range(eyes) for pupil in PUPILS]
    rows: dict[int, list[Row]] = {}
    with shared(cores() if len(looks) > cores() else 1) as executor:
        for number, some in completed(executor, looked, looks):
            rows[number] = some
            if progress is not None:
                progress(len(rows) / len(looks))
    return [row for number in sorted(rows) for row in rows[number]]


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    eyes, distances = (100, 20) if full else (3, 4)
    rows = measure(eyes, distances, progress=progress)
    found = {f"{1e3 * pupil:g} mm": _told([r for r in rows if r["pupil_mm"] == 1e3 * pupil]) for pupil in PUPILS}
    said = "; ".join(
        f"{pupil}: {100 * one['valid']:.0f} % of the pixels claimed, median error {one['median_error_D']:.3f} D, side "
        f"right in {100 * one['side_right']:.0f} %, {100 * one['within_2_sd']:.0f} % within two stated standard "
        f"deviations"
        for pupil, one in found.items()
    )
    return Shown(
        title="Depth by colour over a population of eyes",
        caption=(
            f"{eyes} simulated eyes, each with wavefront aberrations drawn from a population of our own choice "
            "(independent coefficients of the third to sixth order; measured eyes are tried with "
            f"`benchmarks/depth_of_people.py`), focused at {1 / FOCUS:g} m, look at walls at {distances} distances "
            "through two pupils. Depth is estimated from two wavebands of as many wavelengths as the pupil needs, each "
            f"eye's own optics known; noise of {100 * NOISE:g} %, textures correlated at {CORRELATION:g}. Median and "
            "quartiles over eyes, all pixels, claimed or not.",
            f"Medians over walls and eyes: {said}.",
        ),
        figure=draw(rows),
        summary={name: {pupil: one[name] for pupil, one in found.items()} for name in next(iter(found.values()))},
        plotted={"rows": rows},
    )


def _told(rows: Sequence[Mapping[str, float | str]]) -> dict[str, float]:
    """Summarise over eyes and walls: fractions of pixels by mean, errors by median."""
    values = {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name not in ("views", "reader")}
    return {
        "valid": float(values["valid"].mean()),
        "median_error_D": float(np.nanmedian(values["median_error_D"])),
        "unmasked_median_error_D": float(np.median(values["unmasked_error_D"])),
        "side_right": float(np.nanmean(values["side_right"])),
        "within_2_sd": float(np.nansum(values["within_2_sd"] * values["valid"]) / values["valid"].sum()),
    }


def draw(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the median error over eyes, with quartiles, at each wall: one panel per kind of views and pupil."""
    kinds = list(dict.fromkeys(str(row["views"]) for row in rows))
    readers = [name for name in READERS if any(row["reader"] == name for row in rows)]
    pupils = sorted({float(row["pupil_mm"]) for row in rows})
    with style():
        figure = new_figure(180, 20 + 55 * len(kinds), layout="constrained")
        axes = figure.subplots(len(kinds), len(pupils), sharex=True, sharey=True, squeeze=False)
        for ax_row, kind in zip(axes, kinds, strict=True):
            for ax, pupil in zip(ax_row, pupils, strict=True):
                for number, reader in enumerate(readers):
                    some = [r for r in rows if (r["pupil_mm"], r["views"], r["reader"]) == (pupil, kind, reader)]
                    places = sorted({float(row["beyond_D"]) for row in some})
                    errors = [[float(r["unmasked_error_D"]) for r in some if r["beyond_D"] == x] for x in places]
                    low, middle, high = np.array([np.quantile(one, [0.25, 0.5, 0.75]) for one in errors]).T
                    at, bars = np.array(places) + 0.015 * (number - len(readers) // 2), [middle - low, high - middle]
                    ax.errorbar(at, middle, bars, markersize=4, label=READERS[reader], **LOOKS[reader])
                ax.set(yscale="log", title=f"{kind}, pupil {pupil:g} mm, simulated eyes")
                ax.axvline(0, color=GREY, linewidth=0.6)
        for ax in axes[-1]:
            ax.set_xlabel("wall, dioptres beyond focus")
        for ax in axes[:, 0]:
            ax.set_ylabel("median error of depth (D)")
        if len(readers) > 1:
            axes[-1, 0].legend(title="optics assumed", loc="upper left")
    return figure


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1].endswith(".json"):
        draw(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["rows"]).savefig(sys.argv[2], dpi=150)
    else:
        alone("people", make)
