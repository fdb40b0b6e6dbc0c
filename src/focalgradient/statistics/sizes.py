"""Effect size d of Westfall, Kenny and Judd (2014) for a mean over subjects and scenes, with its interval.

d is the mean divided by the root of the summed variance components of the tested model. The interval is that of a
generalised pivotal quantity (Weerahandi 1993): each mean square is its expectation times chi-squared over its degrees
of freedom, so that each draw of chi-squared values gives variance components, and with a draw of the error of the mean
a value of d.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special, stats
from scipy.stats import qmc

from focalgradient.statistics.records import CONFIDENCE, Interval

__all__ = ["crossed_size"]

FloatArray = NDArray[np.float64]

DRAWS = 4096
"""Number of points of a scrambled Sobol sequence: the ends are accurate to 1 % of the width of the interval."""


def crossed_size(
    mean: float, squares: tuple[float, float, float], subjects: float, scenes: float, cells: int
) -> Interval:
    """Compute d of the mean of a table of subjects x scenes.

    Parameters
    ----------
    mean
        Mean over subjects and scenes.
    squares
        Mean squares of subjects, scenes and residuals.
    subjects, scenes
        Number of subjects per scene, and of scenes per subject; harmonic means in incomplete tables.
    cells
        Number of non-empty cells.

    Examples
    --------
    >>> size = crossed_size(0.3, (0.5, 0.1, 0.04), 8, 12, 96)
    >>> round(size.estimate, 2), round(size.low, 2), round(size.high, 2)
    (1.02, 0.32, 1.53)
    """
    of_subjects, of_scenes, residual = (np.asarray(square) for square in squares)
    total = float(_total(_components(of_subjects, of_scenes, residual, subjects, scenes)))
    people, pictures = round(cells / scenes), round(cells / subjects)
    dfs = max(people - 1, 1), max(pictures - 1, 1), max(cells - people - pictures + 1, 1)
    uniform = _uniform()
    first, second, third = (square / _scaled(k, df) for k, (square, df) in enumerate(zip(squares, dfs, strict=True)))
    parts = _components(first, second, third, subjects, scenes)
    error = parts[0] / people + parts[1] / pictures + parts[2] / cells
    of_mean = mean - special.ndtri(uniform[:, 3]) * np.sqrt(error)
    low, high = np.quantile(of_mean / np.sqrt(_total(parts)), [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(mean / math.sqrt(total), float(low), float(high))


def _components(
    of_subjects: FloatArray, of_scenes: FloatArray, residual: FloatArray, subjects: float, scenes: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the variances of subjects, scenes and residuals, bounded from below by zero."""
    return (
        np.maximum(of_subjects - residual, 0.0) / scenes,
        np.maximum(of_scenes - residual, 0.0) / subjects,
        residual,
    )


def _total(parts: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
    return parts[0] + parts[1] + parts[2]


@lru_cache(maxsize=64)
def _scaled(column: int, df: int) -> FloatArray:
    """Return quantiles of chi-squared over its degrees of freedom."""
    return np.asarray(stats.chi2.ppf(_uniform()[:, column], df) / df)


@cache
def _uniform() -> FloatArray:
    """Return the four-dimensional quasi-random points, with a fixed seed."""
    return np.clip(qmc.Sobol(4, seed=1).random(DRAWS), 1e-9, 1 - 1e-9)
