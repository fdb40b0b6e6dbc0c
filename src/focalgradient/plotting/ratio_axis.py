"""Logarithmic axis of ratios, on which half and twice are equally far from 1."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

__all__ = ["ratio_axis", "ratio_ticks"]

TICKS = (
    *(1, 2, 0.5, 5, 0.2, 10, 0.1, 100, 0.01, 1000, 0.001, 20, 0.05, 50, 0.02),
    *(1.5, 0.7, 3, 1.2, 0.8, 0.9, 1.1, 1.4, 1.3, 1.7),
)
"""Candidate ticks of a ratio axis in order of priority; a tick too close to earlier ones is omitted."""

MIN_TICK_GAP = 0.12
"""Minimum distance between two ticks, as a fraction of the axis, so that labels do not overlap."""

MIN_RANGE = 1.1
"""Smallest ratio of the largest to the smallest value that sets the limits."""


def ratio_ticks(low: float, high: float) -> list[float]:
    """Return ticks between two ratios, in ascending order, far enough apart on a logarithmic axis.

    >>> ratio_ticks(0.5, 5.0), ratio_ticks(1e-3, 1e3)
    ([0.7, 1, 1.5, 2, 3], [0.01, 0.1, 1, 10, 100])
    """
    kept, gap = list[float](), MIN_TICK_GAP * math.log(high / low)
    for tick in TICKS:
        if low < tick < high and all(abs(math.log(tick / other)) > gap for other in kept):
            kept.append(tick)
    return sorted(kept)


def ratio_axis(ax: Axes, which: str) -> None:
    """Make the "x" or "y" axis of a drawn plot logarithmic, with ticks at simple ratios."""
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    low, high = ax.dataLim.intervalx if which == "x" else ax.dataLim.intervaly
    if low > 0 and high < MIN_RANGE * low:  # all values are (nearly) equal
        (ax.set_xlim if which == "x" else ax.set_ylim)(low / MIN_RANGE, high * MIN_RANGE)
    axis, limits = (ax.xaxis, ax.get_xlim()) if which == "x" else (ax.yaxis, ax.get_ylim())
    ticks = ratio_ticks(*map(float, limits))
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_minor_formatter(NullFormatter())
