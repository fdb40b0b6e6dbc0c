"""Forest plot: one effect in several data sets, and over them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from focalgradient.plotting.figures import BLUE, GREY, ORANGE, new_figure, shortened, style
from focalgradient.plotting.subjects import SIMULATED

__all__ = ["forest_figure"]

TICKS = (1, 2, 0.5, 5, 0.2, 10, 0.1, 1.5, 0.7, 3, 1.2, 0.8, 0.9, 1.1)
"""Of an axis of ratios, the most useful first: one too near to those before is left out."""

LEAST_GAP = 0.06
"""Between two ticks, in lengths of the axis: their labels do not touch."""


def _apart(ticks: list[float], ends: tuple[float, float]) -> list[float]:
    """Ticks that are `LEAST_GAP` apart on a logarithmic axis, ascending.

    >>> _apart([1, 2, 1.1], (0.5, 5.0))
    [1, 2]
    """
    kept: list[float] = []
    for tick in ticks:
        if all(abs(math.log(tick / other)) > LEAST_GAP * math.log(ends[1] / ends[0]) for other in kept):
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
    """Draw each data set's effect with its 95 % interval, the mean as a diamond, and the interval of a new data set.

    Parameters
    ----------
    what
        Label of the axis.
    studies
        Name, estimate and ends of each.
    pooled
        Mean and ends.
    predicted
        Ends of the interval of the effect in a new data set, where there is one.
    none
        Where there is no effect: 1 of ratios, whose axis is then logarithmic, else 0.
    simulated
        Whether observers were.
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
        ax.set_yticks([*rows, 1], [*names, "mean of all"])
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
