"""What a slope leaves open: whether answers rise in order, and whether a rise is as good as none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from focalgradient.statistics.means import paired_effect
from focalgradient.statistics.records import ALPHA, Effect, NotComputed

__all__ = ["Equivalence", "Trend", "equivalence", "trend"]


@dataclass(frozen=True, slots=True)
class Trend:
    """Whether answers rise in the stated order of the conditions, by ranks alone.

    Parameters
    ----------
    statistic, p
        Page's (1963) L, and the probability of one as large (one-sided) if *no subject's* answers followed the order.
    over_subjects
        Mean of the subjects' own rank correlations with the order (two-sided, t-test): whether people's do on the mean.
    subjects
        With an answer in each condition.

    Notes
    -----
    Where some people's answers rise and others' fall, Page's test finds an order too often for it to hold for people at
    large: up to twice as often as it says (benchmarks/statistics_error_rates.py). The test over subjects does not.
    """

    statistic: float
    p: float
    over_subjects: Effect | NotComputed
    subjects: int


@dataclass(frozen=True, slots=True)
class Equivalence:
    """Two one-sided tests (Schuirmann 1987) of an effect against bounds stated in advance.

    Parameters
    ----------
    bound
        The effect is as good as none within -bound ... bound.
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


def trend(cells: ArrayLike) -> Trend | NotComputed:
    """Page's trend test, and one over subjects.

    Parameters
    ----------
    cells
        A row a subject, a column a condition in the order in which answers should rise.

    Examples
    --------
    >>> trend([[1, 2, 3], [1, 3, 2], [2, 1, 3]]).statistic
    40.0
    """
    cells = np.asarray(cells, dtype=float)
    subjects, conditions = cells.shape
    if subjects < 2 or conditions < 3:
        return NotComputed(
            "Page's test needs two or more subjects with answers in each of three or more conditions, and there are "
            f"{subjects} with {conditions}."
        )
    if not np.ptp(cells, axis=1).any():
        return NotComputed("Every subject answered all conditions alike: there is no order to test.")
    outcome = stats.page_trend_test(cells)
    ranks = stats.rankdata(cells, axis=1) - (conditions + 1) / 2
    order = np.arange(conditions) - (conditions - 1) / 2
    length = np.sqrt((ranks**2).sum(axis=1) * (order**2).sum())
    own = np.divide(ranks @ order, length, out=np.zeros(subjects), where=length > 0)  # alike: neither up nor down
    over_subjects = paired_effect(own, "rank correlation of each subject's own with the order, t-test of their mean")
    return Trend(float(outcome.statistic), float(outcome.pvalue), over_subjects, subjects)


def equivalence(estimate: float, standard_error: float, subjects: int, bound: float) -> Equivalence:
    """Whether an effect is as good as none: t-tests against both bounds, with a degree of freedom less than subjects.

    Examples
    --------
    >>> outcome = equivalence(0.02, 0.05, subjects=12, bound=0.2)
    >>> round(outcome.p, 4), outcome.equivalent
    (0.0021, True)
    """
    df = subjects - 1
    half = float(stats.t.ppf(1 - ALPHA, df)) * standard_error
    below = float(stats.t.sf((estimate + bound) / standard_error, df))
    above = float(stats.t.cdf((estimate - bound) / standard_error, df))
    p = max(below, above)
    return Equivalence(bound, estimate, estimate - half, estimate + half, below, above, p, p < ALPHA, subjects)
