"""Forest plot: one effect in several data sets, and the pooled effect."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from focalgradient.plotting.figures import BLUE, GREY, ORANGE, new_figure, shortened, style
from focalgradient.plotting.subjects import SIMULATED

__all__ = ["forest_figure"]

TICKS = (1, 2, 0.5, 5, 0.2, 10, 0.1, 1.5, 0.7, 3, 1.2, 0.8, 0.9, 1.1)
"""Candidate ticks of a ratio axis in order of priority; a tick too close to earlier ones is omitted."""

MIN_TICK_GAP = 0.06
"""Minimum distance between two ticks, as a fraction of the axis, so that labels do not overlap."""


def _apart(ticks: list[float], ends: tuple[float, float]) -> list[float]:
    """Return those ticks, in ascending order, that are at least `MIN_TICK_GAP` apart on a logarithmic axis.

    >>> _apart([1, 2, 1.1], (0.5, 5.0))
    [1, 2]
    """
    kept: list[float] = []
    for tick in ticks:
        if all(abs(math.log(tick / other)) > MIN_TICK_GAP * math.log(ends[1] / ends[0]) for other in kept):
            kept.append(tick)
    return sorted(kept)


def forest_figure(
    what: str,
    studies: Sequence[tuple[str, float, float, float]],
    pooled: tuple[float, float, float],
    predicted: tuple[float, float] | None,
    *,
    none: float,
    simulated: bool,
) -> Figure:
    """Draw each data set's effect with its 95 % interval, the pooled mean as a diamond, and the prediction interval.

    Parameters
    ----------
    what
        Axis label.
    studies
        Name, estimate and interval limits of each data set.
    pooled
        Pooled mean and interval limits.
    predicted
        Limits of the prediction interval for a new data set, if available.
    none
        Value without an effect: 1 for ratios, whose axis is then logarithmic, otherwise 0.
    simulated
        Whether the observers were simulated.
    """
    with style():
        figure = new_figure(150, 24 + 7 * (len(studies) + 2), layout="constrained")
        ax = figure.add_subplot()
        rows = range(len(studies) + 1, 1, -1)
        for row, (_, estimate, low, high) in zip(rows, studies, strict=True):
            ax.plot([low, high], [row, row], color=BLUE, linewidth=1.4)
            ax.plot(estimate, row, "s", color=BLUE, markersize=5)
        mean, low, high = pooled
        ax.fill([low, mean, high, mean], [1, 1.3, 1, 0.7], color=ORANGE, linewidth=0)
        if predicted is not None:
            ax.plot(predicted, [0.4, 0.4], color=ORANGE, linewidth=1.2, linestyle=(0, (2, 1)))
        ax.axvline(none, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)), zorder=0)
        names = [shortened(name, 30) for name, *_ in studies]
        ax.set_yticks([*rows, 1], [*names, "pooled mean"])
        ax.set(ylim=(0, len(studies) + 1.6), xlabel=what)
        if none == 1:
            ax.set_xscale("log")
            ends = ax.get_xlim()
            ticks = _apart([one for one in TICKS if ends[0] < one < ends[1]], ends)
            ax.set_xticks(ticks, [f"{one:g}" for one in ticks])
            ax.xaxis.set_minor_formatter(NullFormatter())
        if simulated:
            ax.text(0.99, 0.98, SIMULATED, transform=ax.transAxes, va="top", ha="right")
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure
