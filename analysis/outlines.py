"""Depth near occlusion boundaries: sixteen scenes, half of them held out during development."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from outline_scenes import HELD_BACK, MADE_WITH, near_outlines, recovered, score, views_and_truth
from report import Progress, Shown, alone

from focalgradient import DepthMap, View
from focalgradient.plotting import BLUE, GREY, ORANGE, draw_depth, draw_view, new_figure, style

DRAWN = "leaves, foci"
COLUMNS = ("valid", "off_10_percent", "beyond_5_sd", "within_2_sd")
TITLES = ("valid", "off by > 10 %", "off by > 5 sd", "within 2 sd")


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    cases = {**MADE_WITH, **HELD_BACK}
    found: dict[str, dict[str, dict[str, float]]] = {}
    drawn = {}
    for name, case in cases.items():
        views, vergence = views_and_truth(name, case)
        near = near_outlines(vergence)
        found[name] = {}
        for label, outlines in (("without", False), ("with", True)):
            depth, _ = recovered(case, views, outlines)
            found[name][f"near_{label}"] = score(depth, vergence, near)
            found[name][f"all_{label}"] = score(depth, vergence, np.ones_like(near))
            if name == DRAWN:
                drawn[label] = views[0], depth
        report(len(found) / len(cases))
    groups = {"made_with": list(MADE_WITH), "held_back": list(HELD_BACK)}
    return Shown(
        title="Depth near occlusion boundaries",
        caption=(
            "Spheres, leaves, bars, a blob, steps and slanted surfaces, one before another, by rays; two apertures or "
            "two foci, blur of up to 12 pixels, noise of 0.2 to 3 % of the mean. Where one surface ends before "
            "another, windows reach across, so that most pixels near boundaries are rejected (above, middle). Each "
            "surface is continued up to the outline, whose place follows from which pixels either surface explains "
            "(right; black: the outlines found).",
            f"Below, within 10 pixels of the true outlines, each scene a line from windows alone (grey) to surfaces "
            f"continued to outlines (blue: the scenes that the method was made with; orange: {len(HELD_BACK)} scenes "
            "not looked at before). In bars narrower than about twice their blur every pixel is mixed with the far "
            "side: most stay rejected.",
        ),
        figure=_figure(drawn, found),
        summary={
            f"{group}_{where}_{column}": float(np.mean([found[name][where].get(column, np.nan) for name in names]))
            for group, names in groups.items()
            for where in ("near_without", "near_with", "all_without", "all_with")
            for column in (*COLUMNS, "median_percent")
        },
        plotted=found,
    )


def _figure(drawn: dict[str, tuple[View, DepthMap]], found: dict[str, dict[str, dict[str, float]]]) -> Figure:
    """Draw a scene's map without and with boundary treatment, and the change of each scene's score."""
    page = (170.0, 118.0)
    with style():
        figure = new_figure(*page)
        view, _ = drawn["without"]
        for x, what in ((2.0, "view"), (47.0, "without"), (108.0, "with")):
            ax = figure.add_axes((x / page[0], 76 / page[1], 40 / page[0], 30 / page[1]))
            if what == "view":
                draw_view(ax, view, "first view")
            else:
                depth = replace(drawn[what][1], beyond=None)  # of no interest here: some blocks beside an outline
                titles = {"without": "windows alone", "with": "continued to outlines"}
                draw_depth(ax, depth, title=titles[what], outlines=what == "with")
                ax.child_axes[-1].set_ylabel("distance (m)")
        for number, (column, title) in enumerate(zip(COLUMNS, TITLES, strict=True)):
            ax = figure.add_axes(((12 + 41 * number) / page[0], 12 / page[1], 32 / page[0], 44 / page[1]))
            for name, one in found.items():
                colour = BLUE if name in MADE_WITH else ORANGE
                ends = [one["near_without"].get(column, np.nan), one["near_with"].get(column, np.nan)]
                ax.plot((0, 1), ends, color=colour, linewidth=0.7, marker="o", markersize=3)
                ax.plot(0, ends[0], color=GREY, marker="o", markersize=3)
            ax.set(xlim=(-0.3, 1.3), title=f"{title} (%)")
            ax.set_xticks((0, 1), ("windows", "outlines"))
        for x, colour, words in ((12, BLUE, "made with"), (32, ORANGE, "held back")):
            figure.text(x / page[0], 62.5 / page[1], words, color=colour, weight="bold", fontsize=8)
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("outlines", make)
