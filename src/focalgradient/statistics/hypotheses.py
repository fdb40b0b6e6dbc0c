"""Equivalence tests: whether an effect lies within bounds stated in advance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.statistics.records import ALPHA, Effect

__all__ = ["LARGEST_BOUND", "Equivalence", "check_bound", "equivalence", "one_sided"]


LARGEST_BOUND = 10.0
"""Maximum equivalence bound, a ratio: no measured depth effect is as large, and 20 is most likely a percentage."""


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
        Equivalence bound: the effect is equivalent to zero within -bound to bound.
    estimate, low, high
        Effect and its 90 % interval, which lies within the bounds if and only if both tests reject at .05.
    p_below, p_above
        p values against an effect of -bound or less, and against one of bound or more; `p_above` alone tests for the
        absence of an *increase*.
    p
        p value of equivalence: the larger of the two.
    equivalent
        True if p is below .05.
    subjects
        Number of subjects.
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


def one_sided(mean: ArrayLike, standard_error: ArrayLike, df: ArrayLike, bound: float) -> tuple[FloatArray, FloatArray]:
    """Return p values against means of -bound or less, and of bound or more; arrays are broadcast.

    Parameters
    ----------
    mean, standard_error, df
        Mean, standard error and degrees of freedom of each effect.
    bound
        Equivalence bound, above 0.

    Examples
    --------
    >>> [float(p.round(4)) for p in one_sided(0.02, 0.05, 11, 0.2)]
    [0.0005, 0.0021]
    """
    centre, error, freedom = (np.asarray(values, dtype=float) for values in (mean, standard_error, df))
    above_lower, below_upper = (centre + bound) / error, (bound - centre) / error
    return np.asarray(stats.t.sf(above_lower, freedom)), np.asarray(stats.t.sf(below_upper, freedom))


def equivalence(effect: Effect, bound: float) -> Equivalence:
    """Test whether an effect lies within -bound to bound, with the effect's degrees of freedom.

    Parameters
    ----------
    effect
        Effect.
    bound
        Equivalence bound above 0, in the unit of the effect.

    Examples
    --------
    >>> from focalgradient.statistics.means import student_effect
    >>> outcome = equivalence(student_effect(0.02, 0.05, 12, "an example"), bound=0.2)
    >>> round(outcome.p, 4), outcome.equivalent
    (0.0021, True)
    """
    below, above = (float(p) for p in one_sided(effect.estimate, effect.standard_error, effect.df, bound))
    half = float(stats.t.isf(ALPHA, effect.df)) * effect.standard_error
    p = max(below, above)
    ends = effect.estimate - half, effect.estimate + half
    return Equivalence(bound, effect.estimate, *ends, below, above, p, p < ALPHA, effect.subjects)
