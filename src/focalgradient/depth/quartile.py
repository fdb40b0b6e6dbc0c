"""Noise by the lower quartile of the residual's power: contradictions of the model only increase power."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy import stats

from focalgradient.depth.filters import FloatArray

__all__ = ["QUARTER", "lower_quartile", "quartile_by_chance"]

QUARTER = 0.25
"""Quantile of the grid points' power that is compared: the lower quartile."""


def lower_quartile(values: FloatArray) -> float:
    """Return the lower quartile of one or more `values`, as `numpy.quantile` does, in a fifth of the time for few.

    >>> lower_quartile(np.array([4.0, 1.0, 3.0, 2.0]))
    1.75
    """
    place = QUARTER * (values.size - 1)
    low = int(place)
    high = min(low + 1, values.size - 1)
    ordered = np.partition(values, (low, high))
    return float(ordered[low] + (place - low) * (ordered[high] - ordered[low]))


def quartile_by_chance(freedom: FloatArray) -> FloatArray:
    """Return the lower quartile of chi-square over its degrees of `freedom`, by interpolation, to 1e-3.

    >>> quartile_by_chance(np.array([2.0, 2000.0])).round(3).tolist()
    [0.288, 0.978]
    """
    return np.interp(freedom, *_table())


@cache
def _table() -> tuple[FloatArray, FloatArray]:
    freedom = np.geomspace(1, 1e6, 512)
    return freedom, stats.chi2.ppf(QUARTER, freedom) / freedom
