"""The population's depth error by what the estimator knows of the eye's optics.

It draws what `benchmarks/depth_of_people.py --out DIR` wrote: ``python analysis/people.py DIR/people.json people.png``.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

COLOURS = {"own": BLUE, "mean": ORANGE, "learned": GREY}
READERS = {"own": "its own optics", "mean": "the mean eye's", "learned": "learned by experience"}
MARKS = {"own": "o", "mean": "s", "learned": "^"}


def draw(rows: Sequence[Mapping[str, float | str]]) -> Figure:
    """Median error over eyes, with its quartiles, at each wall: a panel for each kind of views and pupil."""
    kinds = list(dict.fromkeys(str(row["views"]) for row in rows))
    pupils = sorted({float(row["pupil_mm"]) for row in rows})
    eyes = len({row["eye"] for row in rows})
    with style():
        figure = new_figure(180, 130)
        axes = figure.subplots(len(kinds), len(pupils), sharex=True, sharey=True, squeeze=False)
        for ax_row, kind in zip(axes, kinds, strict=True):
            for ax, pupil in zip(ax_row, pupils, strict=True):
                for number, (reader, words) in enumerate(READERS.items()):
                    some = [r for r in rows if (r["pupil_mm"], r["views"], r["reader"]) == (pupil, kind, reader)]
                    places = sorted({float(row["beyond_D"]) for row in some})
                    errors = {x: [float(r["unmasked_error_D"]) for r in some if r["beyond_D"] == x] for x in places}
                    low, middle, high = np.array([np.quantile(errors[x], [0.25, 0.5, 0.75]) for x in places]).T
                    at = np.array(places) + 0.015 * (number - 1)
                    look = {"color": COLOURS[reader], "marker": MARKS[reader], "markersize": 4, "label": words}
                    ax.errorbar(at, middle, [middle - low, high - middle], **look)
                ax.set(yscale="log", title=f"{kind}, pupil {pupil:g} mm")
                ax.axvline(0, color=GREY, linewidth=0.6)
        for ax in axes[-1]:
            ax.set_xlabel("wall, dioptres beyond focus")
        for ax in axes[:, 0]:
            ax.set_ylabel("median error of depth (D)")
        axes[-1, 0].legend(title="optics assumed", loc="upper left")
        figure.suptitle(f"{eyes} simulated eyes: median and quartiles, all pixels, valid or not", fontsize=9)
        figure.tight_layout()
    return figure


if __name__ == "__main__":
    source, target = map(Path, sys.argv[1:])
    draw(json.loads(source.read_text(encoding="utf-8"))["rows"]).savefig(target, dpi=150)
