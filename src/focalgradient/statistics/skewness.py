"""Tests and intervals of a mean that stay valid where the people's own effects are skewed.

Few skewed people mislead Student's t: a sample without the rare large effects has too small a mean and too small a
standard deviation. Two things show it. The sample is skewed against the effect; or the people scatter hardly more than
the noise of their own answers does, as they do where the rare large effect is not among them. So p of Student's t is
multiplied by a factor of 1 or more that rises with both.
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
"""Logarithm of the factor, per subject's reciprocal number in the second: BASE + BASE_OF_FEW / subjects.

This and the next two were fitted by simulation (benchmarks/robust_tests.py): the smallest factors with which people of
symmetric, gamma, log-normal and mixed distributions are tested at .06 or less, 6 to 40 of them: up to a skewness of 2
with and without noise of their answers, up to 4 where that noise is .4 or more of their standard deviation."""

NOISE, NOISE_OF_FEW = 3.2, -13.0
"""Rise of that logarithm with the share of noise: NOISE + NOISE_OF_FEW / subjects."""

SKEW = 2.0
"""Fall of that logarithm with the subjects' skewness towards the effect."""

FEWEST = 5
"""Number of subjects below which the constants are those of this number: calibrated are 5 to 40."""

WORST_LEVEL_OF_T = 0.105
"""Largest false positive rate of Student's t at .05, of the rise over subjects and scenes: 10 subjects whose rises have
a skewness of 4 (benchmarks/statistics_error_rates.py, the table in docs/statistics-measured.md)."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """How the subjects' own means scatter, of one mean or of many.

    Parameters
    ----------
    subjects
        Number of subjects.
    skewness
        Of the mean's error: see `error_skewness`.
    noise
        Share of the variance of the subjects' own means that the noise of their answers explains, 0 to 1; 1 where it is
        not known.
    """

    subjects: int
    skewness: ArrayLike
    noise: ArrayLike

    @property
    def mirrored(self) -> Scatter:
        """The same of the negative values."""
        return replace(self, skewness=-np.asarray(self.skewness, dtype=float))


def error_skewness(cells: ArrayLike, standard_error: ArrayLike) -> FloatArray:
    """Skewness of the error of the mean of each table, as the subjects' own means show it.

    Parameters
    ----------
    cells
        Shape (..., subjects, scenes); NaN where there is no value.
    standard_error
        Of each table's mean. What scenes add to it is taken as symmetric.

    Returns
    -------
    ndarray
        Shape (...). The subjects' third moment (unbiased) over their number squared, which is that of a mean, over the
        cube of the standard error; 0 with two subjects.

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
    """Factor of Student's p of a positive effect, 1 or more.

    exp(max(0, b + n r - 2 g)): r is the share of noise and g the skewness of the subjects, that of the mean's error
    times the root of their number; b = 9 / N - 1 and n = 3.2 - 13 / N, N the number of subjects, at least 5.

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
    """Probability of a `t` as large; arrays are done at once.

    Parameters
    ----------
    t, df
        Student's t, positive in favour of the effect, and its degrees of freedom.
    scatter
        Of the subjects, its skewness positive towards the side of the effect.

    Examples
    --------
    >>> [float(one_sided_p(3.0, 7, Scatter(8, skewness, 0.2)).round(4)) for skewness in (0.0, 0.3, -0.3)]
    [0.0155, 0.01, 0.0845]
    """
    above = stats.t.sf(np.asarray(t, dtype=float), np.asarray(df, dtype=float))
    return np.asarray(np.minimum(robust_factor(scatter) * above, 1.0))


def two_sided_p(t: ArrayLike, df: ArrayLike, scatter: Scatter) -> FloatArray:
    """Two-sided probability of `t`; arrays are done at once.

    Examples
    --------
    >>> [float(two_sided_p(t, 7, Scatter(8, 0.3, 0.2)).round(4)) for t in (3.0, -3.0)]
    [0.0199, 0.169]
    """
    t = np.asarray(t, dtype=float)
    towards = replace(scatter, skewness=np.sign(t) * np.asarray(scatter.skewness, dtype=float))
    return np.asarray(np.minimum(2 * one_sided_p(np.abs(t), df, towards), 1.0))


def half_widths(df: ArrayLike, scatter: Scatter, level: float = ALPHA) -> tuple[FloatArray, FloatArray]:
    """Distances of the ends of the interval of 1 - `level` below and above the mean, in standard errors.

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
    """The interval and the two-sided test of a mean of subjects who scatter so.

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
