"""Equivalence: whether an effect lies within bounds stated in advance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from focalgradient.errors import InputError
from focalgradient.statistics.records import ALPHA, Effect

__all__ = ["LARGEST_BOUND", "Equivalence", "check_bound", "equivalence", "one_sided"]

FloatArray = NDArray[np.float64]

LARGEST_BOUND = 10.0
"""Largest bound of equivalence, a ratio: no measured depth effect is as large, and 20 is most likely a percentage."""

SHRINKAGE = 12
"""The sample's skewness is taken 1 + 12 / N times. 1 + 8 / N makes up for what samples of a gamma distribution show too
little of it on average (3.3, 2.4, 1.8 and 1.4 times with 4, 6, 10 and 20 subjects); 12 holds the tests' level in every
cell of benchmarks/statistics_error_rates.py, at most .060 (20,000 sets a cell)."""


def check_bound(name: str, bound: object) -> None:
    """Raise `InputError` unless the bound of equivalence is a ratio above 1 and at most `LARGEST_BOUND`.

    >>> check_bound("bound", 1.2)
    """
    if isinstance(bound, bool) or not isinstance(bound, int | float) or not 1 < bound <= LARGEST_BOUND:
        raise InputError(
            f"{name} is {bound!r}, but must be a ratio above 1 and at most {LARGEST_BOUND:g}: give the smallest rise "
            "that matters, 1.2 for 20 %."
        )


@dataclass(frozen=True, slots=True)
class Equivalence:
    """Two one-sided tests (Schuirmann 1987) of an effect against bounds stated in advance.

    Parameters
    ----------
    bound
        The effect is equivalent to zero within -bound ... bound.
    estimate, low, high
        The effect and its 90 % interval: inside the bounds just where both tests reject at .05. An end is farther out
        than Student's t has it where the subjects' values are skewed to its side.
    p_below, p_above
        Probabilities against an effect of -bound or less, and against one of bound or more: `p_above` alone tests for
        no *increase*.
    p
        Of equivalence: the larger of the two.
    equivalent
        Whether p is below .05.
    subjects
        How many the estimate rests on.
    """

    bound: float
    estimate: float
    low: float
    high: float
    p_below: float
    p_above: float
    p: float
    equivalent: bool
    subjects: int


def one_sided(
    mean: ArrayLike,
    standard_error: ArrayLike,
    df: ArrayLike,
    bound: float,
    subjects: int = 2,
    skewness: ArrayLike = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Probabilities against means of -bound or less, and of bound or more; arrays are done at once.

    By Student's t; where the subjects' values are skewed to the side of the bound, by t less its skewness (Johnson
    1978, with the quantile in place of t, so that it rises with t everywhere). A skewness that would make the test less
    careful is not used: few subjects show it badly.

    Parameters
    ----------
    mean, standard_error, df
        Of each effect.
    bound
        Above 0.
    subjects
        How many the skewness was estimated from.
    skewness
        Of the mean's error: see `focalgradient.statistics.crossed.error_skewness`.

    Examples
    --------
    >>> [float(p.round(4)) for p in one_sided(0.02, 0.05, 11, 0.2)]
    [0.0005, 0.0021]
    >>> [float(p.round(4)) for p in one_sided(0.02, 0.05, 11, 0.2, 12, skewness=0.3)]
    [0.0005, 0.0185]
    """
    centre, error, freedom = (np.asarray(each, dtype=float) for each in (mean, standard_error, df))
    more = (1 + SHRINKAGE / subjects) * np.asarray(skewness, dtype=float)
    below = stats.t.sf(_corrected((centre + bound) / error, np.maximum(-more, 0)), freedom)
    above = stats.t.sf(_corrected((bound - centre) / error, np.maximum(more, 0)), freedom)
    return np.asarray(below), np.asarray(above)


def equivalence(effect: Effect, bound: float, skewness: float = 0.0) -> Equivalence:
    """Test whether an effect lies within -bound ... bound: tests against both, with the effect's degrees of freedom.

    Parameters
    ----------
    effect
        Its estimate, standard error and degrees of freedom are used.
    bound
        Above 0, in the effect's unit.
    skewness
        Of the estimate's error: see `one_sided`.

    Examples
    --------
    >>> from focalgradient.statistics.means import student_effect
    >>> outcome = equivalence(student_effect(0.02, 0.05, 12, "an example"), bound=0.2)
    >>> round(outcome.p, 4), outcome.equivalent
    (0.0021, True)
    """
    distances = effect.estimate, effect.standard_error, effect.df, bound
    below, above = (float(p) for p in one_sided(*distances, effect.subjects, skewness))
    p = max(below, above)
    quantile = float(stats.t.ppf(1 - ALPHA, effect.df))
    longer = (1 + SHRINKAGE / effect.subjects) * (1 + 2 * quantile**2) / 6
    low = effect.estimate - (quantile + longer * max(-skewness, 0)) * effect.standard_error
    high = effect.estimate + (quantile + longer * max(skewness, 0)) * effect.standard_error
    return Equivalence(bound, effect.estimate, low, high, below, above, p, p < ALPHA, effect.subjects)


def _corrected(t: FloatArray, skewness: FloatArray) -> FloatArray:
    """The q of t = q + skewness (1 + 2 q^2) / 6, for a skewness of 0 or more: at most t, and rising with it."""
    s = np.where(skewness > 0, skewness, 1.0)
    under = 1 + 4 / 3 * s * (t - s / 6)
    q = np.where(under > 0, (np.sqrt(np.maximum(under, 0)) - 1) * 3 / (2 * s), np.minimum(t, -3 / (2 * s)))
    return np.asarray(np.where(skewness > 0, q, t))
