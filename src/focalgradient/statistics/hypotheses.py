"""Equivalence: whether an effect lies within bounds stated in advance."""

from __future__ import annotations

from dataclasses import dataclass

from scipy import stats

from focalgradient.statistics.records import ALPHA, Effect

__all__ = ["Equivalence", "equivalence"]


@dataclass(frozen=True, slots=True)
class Equivalence:
    """Two one-sided tests (Schuirmann 1987) of an effect against bounds stated in advance.

    Parameters
    ----------
    bound
        The effect is equivalent to zero within -bound ... bound.
    estimate, low, high
        The effect and its 90 % interval: inside the bounds just where both tests reject at .05.
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


def equivalence(effect: Effect, bound: float) -> Equivalence:
    """Test whether an effect lies within -bound ... bound: t-tests against both, with the effect's degrees of freedom.

    Examples
    --------
    >>> from focalgradient.statistics.means import student_effect
    >>> outcome = equivalence(student_effect(0.02, 0.05, 12, "an example"), bound=0.2)
    >>> round(outcome.p, 4), outcome.equivalent
    (0.0021, True)
    """
    half = float(stats.t.ppf(1 - ALPHA, effect.df)) * effect.standard_error
    below = float(stats.t.sf((effect.estimate + bound) / effect.standard_error, effect.df))
    above = float(stats.t.cdf((effect.estimate - bound) / effect.standard_error, effect.df))
    p = max(below, above)
    low, high = effect.estimate - half, effect.estimate + half
    return Equivalence(bound, effect.estimate, low, high, below, above, p, p < ALPHA, effect.subjects)
