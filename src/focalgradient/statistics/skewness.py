"""Tests and intervals of a mean that stay valid where the people's own effects are skewed.

Few skewed people mislead Student's t: a sample without the rare large effects has too small a mean and too small a
standard deviation, and its skewness hardly shows it. So t is corrected for the sample's skewness (Johnson 1978) where
that makes the test more conservative, and probabilities are multiplied by 2.5 for the skewness that does not show.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from focalgradient.statistics.records import ALPHA, Robust

__all__ = ["FACTOR", "WORST_LEVEL_OF_T", "error_skewness", "half_widths", "one_sided_p", "robust", "two_sided_p"]

FloatArray = NDArray[np.float64]

FACTOR = 2.5
"""Factor of every probability. It is the smallest (in steps of 0.25) with which gamma and log-normal people of a
skewness of up to 4 are tested at .06 or less, 6 to 40 of them (benchmarks/statistics_error_rates.py). No test of a mean
keeps its level for all distributions (Bahadur and Savage 1956)."""

WORST_LEVEL_OF_T = 0.105
"""Largest false positive rate of Student's t at .05, of the rise over subjects and scenes: 10 subjects whose rises have
a skewness of 4 (benchmarks/statistics_error_rates.py, the table in docs/statistics.md)."""


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


def one_sided_p(t: ArrayLike, df: ArrayLike, skewness: ArrayLike) -> FloatArray:
    """Probability of a `t` as large, of a mean whose error has this skewness; arrays are done at once.

    Parameters
    ----------
    t, df
        Student's t, positive in favour of the effect, and its degrees of freedom.
    skewness
        Of the mean's error, positive towards the side of the effect: see `error_skewness`. Only a negative one, which
        makes a large t likely, is corrected for.

    Examples
    --------
    >>> [float(one_sided_p(3.0, 7, skewness).round(4)) for skewness in (0.0, 0.3, -0.3)]
    [0.0249, 0.0249, 0.0609]
    """
    t, df, against = (np.asarray(each, dtype=float) for each in (t, df, skewness))
    corrected = _corrected(t, np.maximum(-against, 0))
    return np.asarray(np.minimum(FACTOR * stats.t.sf(corrected, df), 1.0))


def two_sided_p(t: ArrayLike, df: ArrayLike, skewness: ArrayLike) -> FloatArray:
    """Two-sided probability of `t`, of a mean whose error has this skewness; arrays are done at once.

    Examples
    --------
    >>> [float(two_sided_p(t, 7, 0.3).round(4)) for t in (3.0, -3.0)]
    [0.0499, 0.1218]
    """
    t = np.asarray(t, dtype=float)
    return np.asarray(np.minimum(2 * one_sided_p(np.abs(t), df, np.sign(t) * np.asarray(skewness)), 1.0))


def half_widths(df: ArrayLike, skewness: ArrayLike, level: float = ALPHA) -> tuple[FloatArray, FloatArray]:
    """Distances of the ends of the interval of 1 - `level` below and above the mean, in standard errors.

    Examples
    --------
    >>> [float(each.round(2)) for each in half_widths(7, 0.3)]
    [3.0, 3.95]
    """
    skewness = np.asarray(skewness, dtype=float)
    quantile = stats.t.isf(level / FACTOR / 2, np.asarray(df, dtype=float))
    longer = (1 + 2 * quantile**2) / 6
    return np.asarray(quantile + longer * np.maximum(-skewness, 0)), np.asarray(
        quantile + longer * np.maximum(skewness, 0)
    )


def robust(estimate: float, standard_error: float, df: float, skewness: float, *, decides: bool = True) -> Robust:
    """The interval and the two-sided test of a mean whose error has a skewness.

    Examples
    --------
    >>> found = robust(0.3, 0.1, 7, 0.3)
    >>> round(found.low, 3), round(found.high, 3), round(found.p, 4)
    (0.0, 0.695, 0.0499)
    """
    below, above = half_widths(df, skewness)
    ends = estimate - float(below) * standard_error, estimate + float(above) * standard_error
    return Robust(skewness, *ends, float(two_sided_p(estimate / standard_error, df, skewness)), decides=decides)


def _corrected(t: FloatArray, skewness: FloatArray) -> FloatArray:
    """The q of t = q + skewness (1 + 2 q^2) / 6, for a skewness of 0 or more: at most t, and rising with it."""
    under = 1 + 4 / 3 * skewness * (t - skewness / 6)
    root = 2 * (t - skewness / 6) / (1 + np.sqrt(np.maximum(under, 0)))
    far = -3 / (2 * np.maximum(skewness, 1e-3))  # where there is no root, beyond the turning point
    return np.asarray(np.where(under > 0, root, np.minimum(t, far)))
