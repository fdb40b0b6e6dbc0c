"""Equivalence tests: whether an effect lies within bounds stated in advance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from focalgradient.errors import InputError, described
from focalgradient.statistics.records import ALPHA, Effect
from focalgradient.statistics.skewness import Scatter, half_widths, one_sided_p

__all__ = [
    "DECIDING_TESTS",
    "LARGEST_BOUND",
    "Equivalence",
    "check_bound",
    "equivalence",
    "one_sided",
    "robust_decides",
]

FloatArray = NDArray[np.float64]

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


DECIDING_TESTS = ("robust", "t")
"""Deciding tests of ratios: robust to skewed subjects, or Student's t."""


def robust_decides(deciding_test: object) -> bool:
    """Return whether the robust test decides; raise `InputError` unless `deciding_test` is one of `DECIDING_TESTS`.

    >>> robust_decides("robust"), robust_decides("t")
    (True, False)
    """
    if not isinstance(deciding_test, str) or deciding_test not in DECIDING_TESTS:
        raise InputError(
            f"deciding_test is {described(deciding_test)}, but must be 'robust' (the test robust to skewed subjects) "
            "or 't' (Student's t)."
        )
    return deciding_test == DECIDING_TESTS[0]


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
    p_by_t
        p value by Student's t, which assumes symmetric effects of people.
    p_robust
        p value by tests robust to skewness; None if not computed.
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
    p_by_t: float
    p_robust: float | None = None


def one_sided(
    mean: ArrayLike, standard_error: ArrayLike, df: ArrayLike, bound: float, scatter: Scatter | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return p values against means of -bound or less, and of bound or more; arrays are broadcast.

    Parameters
    ----------
    mean, standard_error, df
        Mean, standard error and degrees of freedom of each effect.
    bound
        Equivalence bound, above 0.
    scatter
        Scatter of the subjects, for tests robust to its skewness (`focalgradient.statistics.skewness`); None for
        Student's t.

    Examples
    --------
    >>> [float(p.round(4)) for p in one_sided(0.02, 0.05, 11, 0.2)]
    [0.0005, 0.0021]
    >>> [float(p.round(4)) for p in one_sided(0.02, 0.05, 11, 0.2, Scatter(12, 0.3, 0.2))]
    [0.0005, 0.0198]
    """
    centre, error, freedom = (np.asarray(each, dtype=float) for each in (mean, standard_error, df))
    above_lower, below_upper = (centre + bound) / error, (bound - centre) / error
    if scatter is None:
        return np.asarray(stats.t.sf(above_lower, freedom)), np.asarray(stats.t.sf(below_upper, freedom))
    return one_sided_p(above_lower, freedom, scatter), one_sided_p(below_upper, freedom, scatter.mirrored)


def equivalence(effect: Effect, bound: float) -> Equivalence:
    """Test whether an effect lies within -bound to bound, with the effect's degrees of freedom.

    Parameters
    ----------
    effect
        Effect; the tests are robust to skewness if the deciding test of the effect is.
    bound
        Equivalence bound above 0, in the unit of the effect.

    Examples
    --------
    >>> from focalgradient.statistics.means import student_effect
    >>> outcome = equivalence(student_effect(0.02, 0.05, 12, "an example"), bound=0.2)
    >>> round(outcome.p, 4), outcome.equivalent
    (0.0021, True)
    """
    distances = effect.estimate, effect.standard_error, effect.df, bound
    reach = [float(stats.t.isf(ALPHA, effect.df))] * 2
    below, above = (float(p) for p in one_sided(*distances))
    by_t, robust = max(below, above), None
    if effect.robust is not None:
        scatter = Scatter(effect.subjects, effect.robust.skewness, effect.robust.noise)
        sides = [float(p) for p in one_sided(*distances, scatter)]
        robust = max(sides)
        if effect.robust.decides:
            below, above = sides
            reach = [float(each) for each in half_widths(effect.df, scatter, 2 * ALPHA)]
    low = effect.estimate - reach[0] * effect.standard_error
    high = effect.estimate + reach[1] * effect.standard_error
    p = max(below, above)
    return Equivalence(bound, effect.estimate, low, high, below, above, p, p < ALPHA, effect.subjects, by_t, robust)
