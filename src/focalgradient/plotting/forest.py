"""Forest plot: one effect in several data sets, and the pooled effect."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from focalgradient.plotting.figures import BLUE, ORANGE, REFERENCE, laid_out, shortened
from focalgradient.plotting.ratio_axis import ratio_axis

__all__ = ["forest_figure"]


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
    with laid_out(150, 24 + 7 * (len(studies) + 2), simulated=simulated) as figure:
        ax = figure.add_subplot()
        rows = range(len(studies) + 1, 1, -1)
        for row, (_, estimate, low, high) in zip(rows, studies, strict=True):
            ax.plot([low, high], [row, row], color=BLUE, linewidth=1.4)
            ax.plot(estimate, row, "s", color=BLUE, markersize=5)
        mean, low, high = pooled
        ax.fill([low, mean, high, mean], [1, 1.3, 1, 0.7], color=ORANGE, linewidth=0)
        if predicted is not None:
            ax.plot(predicted, [0.4, 0.4], color=ORANGE, linewidth=1.2, linestyle=(0, (2, 1)))
        ax.axvline(none, **REFERENCE)
        names = [shortened(name, 30) for name, *_ in studies]
        ax.set_yticks([*rows, 1], [*names, "pooled mean"])
        ax.set(ylim=(0, len(studies) + 1.6), xlabel=what)
        if none == 1:
            ratio_axis(ax, "x")
    return figure
