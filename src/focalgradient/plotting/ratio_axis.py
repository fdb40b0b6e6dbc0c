"""Logarithmic axis of ratios, on which half and twice are equally far from 1."""

from __future__ import annotations

import math

from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

__all__ = ["ratio_axis"]

TICKS = (1, 2, 0.5, 5, 0.2, 10, 0.1, 1.5, 0.7, 3, 1.2, 0.8, 0.9, 1.1)
"""Candidate ticks of a ratio axis in order of priority; a tick too close to earlier ones is omitted."""

MIN_TICK_GAP = 0.12
"""Minimum distance between two ticks, as a fraction of the axis, so that labels do not overlap."""

MIN_RANGE = 1.1
"""Smallest ratio of the largest to the smallest value that sets the limits."""


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


def ratio_axis(ax: Axes, which: str) -> None:
    """Make the "x" or "y" axis of a drawn plot logarithmic, with ticks at simple ratios."""
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    low, high = ax.dataLim.intervalx if which == "x" else ax.dataLim.intervaly
    if low > 0 and high < MIN_RANGE * low:  # all values are (nearly) equal
        (ax.set_xlim if which == "x" else ax.set_ylim)(low / MIN_RANGE, high * MIN_RANGE)
    axis, limits = (ax.xaxis, ax.get_xlim()) if which == "x" else (ax.yaxis, ax.get_ylim())
    ends = float(limits[0]), float(limits[1])
    ticks = _apart([tick for tick in TICKS if ends[0] < tick < ends[1]], ends)
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_minor_formatter(NullFormatter())
