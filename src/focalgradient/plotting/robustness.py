"""Specification curve: the effect by exclusion rules, transformation and test, and with each participant omitted."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from focalgradient.plotting.figures import BLUE, GREY, ORANGE, new_figure, shortened, style
from focalgradient.plotting.subjects import SIMULATED
from focalgradient.statistics.robustness import LOGARITHM, TESTS, Variant, most_influential

__all__ = ["robustness_figure"]

MIN_VARIANTS = 8
"""Minimum number of variants that determines the width of a panel."""

ROW_MM = 6.5
"""Height of a row of choices in mm: two lines of text."""


def robustness_figure(variants: Sequence[Variant], names: Mapping[str, str], *, simulated: bool) -> Figure:
    """Draw the variants of one fixation sorted by estimate: one panel per transformation, and one of omitted subjects.

    Parameters
    ----------
    variants
        Variants of one fixation; those that were not computed, or leave the same data as another set of rules, are
        omitted.
    names
        Labels of the sets of exclusion rules, in display order.
    simulated
        Whether the observers were simulated.
    """
    shown = [each for each in variants if each.distinct and each.estimate is not None]
    panels = [
        (name.capitalize(), [each for each in shown if each.transformation == name and not each.without])
        for name in dict.fromkeys(each.transformation for each in shown)
    ]
    left = [each for each in shown if each.without]
    panels += [("One omitted", left)] if left else []
    rules = [name for name in names if any(each.rules == name for each in shown)]
    choices = [*((names[name], "rules", name) for name in rules), *((test, "test", test) for test in TESTS)]
    with style():
        figure = new_figure(190, 62 + ROW_MM * len(choices), layout="constrained")
        axes = figure.subplots(
            2,
            len(panels),
            squeeze=False,
            sharex="col",
            height_ratios=[50, ROW_MM * len(choices)],
            width_ratios=[max(len(own), MIN_VARIANTS) for _, own in panels],
        )
        for column, (title, own) in enumerate(panels):
            curve, marks = axes[0][column], axes[1][column]
            ordered = sorted(own, key=lambda each: each.estimate or 0.0)
            _curve(curve, ordered)
            curve.set_title(title)
            marks.spines[:].set_visible(False)
            marks.tick_params(length=0, labelbottom=False)
            marks.set_yticks([])
            if own is left:
                _name_person(marks, ordered, most_influential(variants, left[0].fixation))
                continue
            marks.set_ylim(len(choices) - 0.4, -0.6)
            if column == 0:
                marks.set_yticks(range(len(choices)), [textwrap.fill(label, 22) for label, _, _ in choices])
            for row, (_, field, value) in enumerate(choices):
                marks.axhline(row, color=GREY, linewidth=0.3, alpha=0.4, zorder=0)
                at = [place for place, each in enumerate(ordered) if getattr(each, field) == value]
                marks.plot(at, [row] * len(at), "s", color=GREY, markersize=2.6)
        if simulated:
            figure.suptitle(SIMULATED, fontsize=8, x=0.99, ha="right")
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def _curve(ax: Axes, ordered: Sequence[Variant]) -> None:
    """Draw estimates with their intervals: filled where p < .05; the main analysis in another colour."""
    log = ordered[0].transformation == LOGARITHM
    ends = []
    for place, each in enumerate(ordered):
        values = [end for end in (each.low, each.high) if end is not None and math.isfinite(end)]
        low_high = [math.exp(end) if log else end for end in values]
        estimate = each.estimate or 0.0
        estimate = math.exp(estimate) if log else estimate
        ends += [estimate, *low_high]
        colour = ORANGE if each.main else BLUE
        if len(values) == 2:
            ax.plot([place, place], low_high, color=colour, linewidth=1.2 if each.main else 0.7, alpha=0.9)
        face = colour if each.significant else "white"
        ax.plot(place, estimate, "o", color=colour, markerfacecolor=face, markersize=4.5 if each.main else 3)
    none = 1.0 if log else 0.0
    ax.axhline(none, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
    ax.margins(x=0.04)
    ax.set_xlim(-0.8, max(len(ordered), MIN_VARIANTS) - 0.2)
    ax.tick_params(axis="x", length=0, labelbottom=False)
    if log:
        ax.set_ylabel("ratio, largest aperture to pinhole")


def _name_person(ax: Axes, ordered: Sequence[Variant], person: Variant | None) -> None:
    if person is None:
        return
    place = next(at for at, each in enumerate(ordered) if each.without == person.without)
    ax.annotate(
        f"without {shortened(person.without, 16)}",
        (place, 0.98),
        xycoords=("data", "axes fraction"),
        va="top",
        ha="left" if place < len(ordered) / 2 else "right",
    )
