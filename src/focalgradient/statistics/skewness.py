"""Tests and intervals of a mean that remain valid for skewed distributions of subjects.

Few skewed subjects mislead Student's t: a sample without the rare large effects underestimates both mean and standard
deviation. There are two signs of this: the sample is skewed against the effect, or the subjects scatter hardly more
than the noise of their answers, as they do if the rare large effect is missing. The p value of Student's t is therefore
multiplied by a factor of at least 1 that increases with both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from focalgradient.statistics.records import ALPHA, Robust

__all__ = [
    "WORST_LEVEL_OF_T",
    "Scatter",
    "error_skewness",
    "half_widths",
    "one_sided_p",
    "robust",
    "robust_factor",
    "two_sided_p",
]

FloatArray = NDArray[np.float64]

BASE, BASE_OF_FEW = -1.0, 9.0
"""Intercept of the log factor: BASE + BASE_OF_FEW / subjects.

These five constants were fitted by simulation (benchmarks/robust_tests.py) as the smallest factors with which
symmetric, gamma, log-normal and mixture distributions of 6 to 40 subjects are tested at .06 or less: for a skewness up
to 2 with and without noise of the answers, and up to 4 if that noise is at least .4 of their standard deviation.
"""

NOISE, NOISE_OF_FEW = 3.2, -13.0
"""Increase of the log factor with the noise fraction: NOISE + NOISE_OF_FEW / subjects."""

SKEW = 2.0
"""Decrease of the log factor with the skewness of the subjects towards the effect."""

FEWEST = 5
"""Minimum number of subjects in the constants' formulas: the calibration covers 5 to 40 subjects."""

WORST_LEVEL_OF_T = 0.105
"""Largest false-positive rate of Student's t at .05, for the depth effect over subjects and scenes: 10 subjects whose
effects have a skewness of 4 (benchmarks/statistics_error_rates.py, table in docs/statistics-measured.md).
"""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Scatter of the subject means, for one or many means.

    Parameters
    ----------
    subjects
        Number of subjects.
    skewness
        Skewness of the error of the mean: see `error_skewness`.
    noise
        Fraction (0 to 1) of the variance of subject means that is due to noise of the answers; 1 if unknown.
    """

    subjects: int
    skewness: ArrayLike
    noise: ArrayLike

    @property
    def mirrored(self) -> Scatter:
        """Scatter of the negated values."""
        return replace(self, skewness=-np.asarray(self.skewness, dtype=float))


def error_skewness(cells: ArrayLike, standard_error: ArrayLike) -> FloatArray:
    """Return the skewness of the error of each table's mean, estimated from the subject means.

    Parameters
    ----------
    cells
        Shape (..., subjects, scenes); NaN without a value.
    standard_error
        Standard error of each table's mean; the contribution of scenes is taken as symmetric.

    Returns
    -------
    ndarray
        Shape (...). Unbiased third moment of the subjects, divided by the squared number of subjects (giving that of
        the mean) and by the cubed standard error; 0 with two subjects.

    Examples
    --------
    >>> round(float(error_skewness([[0.1], [0.2], [0.1], [0.6]], 0.11)), 2)
    1.13
    """
    cells = np.asarray(cells, dtype=float)
    own = np.nanmean(cells, axis=-1)
    own = own[np.isfinite(own)] if own.ndim == 1 else own
    subjects = own.shape[-1]
    away = own - own.mean(axis=-1, keepdims=True)
    if subjects < 3:
        return np.zeros(own.shape[:-1])
    third = subjects / ((subjects - 1) * (subjects - 2)) * (away**3).sum(axis=-1)  # unbiased third moment
    return np.asarray(third / subjects**2 / np.asarray(standard_error) ** 3)


def robust_factor(scatter: Scatter) -> FloatArray:
    """Return the factor (at least 1) that multiplies Student's p value of a positive effect.

    exp(max(0, b + n r - 2 g)), where r is the noise fraction and g the skewness of the subjects (skewness of the error
    of the mean times the root of their number); b = 9 / N - 1 and n = 3.2 - 13 / N, with N the number of subjects, at
    least 5.

    Examples
    --------
    >>> [float(robust_factor(Scatter(6, skewness, 0.2)).round(2)) for skewness in (-0.4, 0.0, 0.4)]
    [14.39, 2.03, 1.0]
    >>> [float(robust_factor(Scatter(20, 0.0, noise)).round(2)) for noise in (0.0, 0.3, 0.6)]
    [1.0, 1.24, 2.66]
    """
    few = 1 / max(scatter.subjects, FEWEST)
    of_noise = (NOISE + NOISE_OF_FEW * few) * np.asarray(scatter.noise, dtype=float)
    skewness = np.asarray(scatter.skewness, dtype=float) * np.sqrt(scatter.subjects)
    return np.asarray(np.exp(np.maximum(BASE + BASE_OF_FEW * few + of_noise - SKEW * skewness, 0.0)))


def one_sided_p(t: ArrayLike, df: ArrayLike, scatter: Scatter) -> FloatArray:
    """Return the one-sided p value of `t`; arrays are broadcast.

    Parameters
    ----------
    t, df
        Student's t, positive in favour of the effect, and its degrees of freedom.
    scatter
        Scatter of the subjects, with positive skewness towards the effect.

    Examples
    --------
    >>> [float(one_sided_p(3.0, 7, Scatter(8, skewness, 0.2)).round(4)) for skewness in (0.0, 0.3, -0.3)]
    [0.0155, 0.01, 0.0845]
    """
    above = stats.t.sf(np.asarray(t, dtype=float), np.asarray(df, dtype=float))
    return np.asarray(np.minimum(robust_factor(scatter) * above, 1.0))


def two_sided_p(t: ArrayLike, df: ArrayLike, scatter: Scatter) -> FloatArray:
    """Return the two-sided p value of `t`; arrays are broadcast.

    Examples
    --------
    >>> [float(two_sided_p(t, 7, Scatter(8, 0.3, 0.2)).round(4)) for t in (3.0, -3.0)]
    [0.0199, 0.169]
    """
    t = np.asarray(t, dtype=float)
    towards = replace(scatter, skewness=np.sign(t) * np.asarray(scatter.skewness, dtype=float))
    return np.asarray(np.minimum(2 * one_sided_p(np.abs(t), df, towards), 1.0))


def half_widths(df: ArrayLike, scatter: Scatter, level: float = ALPHA) -> tuple[FloatArray, FloatArray]:
    """Return the distances of the ends of the interval of 1 - `level` below and above the mean, in standard errors.

    Examples
    --------
    >>> [float(each.round(2)) for each in half_widths(7, Scatter(8, 0.3, 0.2))]
    [2.36, 3.9]
    """
    below, above = (
        np.asarray(stats.t.isf(level / 2 / robust_factor(side), np.asarray(df, dtype=float)))
        for side in (scatter, scatter.mirrored)
    )
    return below, above


def robust(estimate: float, standard_error: float, df: float, scatter: Scatter, *, decides: bool = True) -> Robust:
    """Return the robust interval and two-sided test of a mean.

    Examples
    --------
    >>> found = robust(0.3, 0.1, 7, Scatter(8, 0.3, 0.2))
    >>> round(found.low, 3), round(found.high, 3), round(found.p, 4)
    (0.064, 0.69, 0.0199)
    """
    below, above = half_widths(df, scatter)
    ends = estimate - float(below) * standard_error, estimate + float(above) * standard_error
    p = float(two_sided_p(estimate / standard_error, df, scatter))
    return Robust(float(np.asarray(scatter.skewness)), float(np.asarray(scatter.noise)), *ends, p, decides=decides)
