"""Means over subjects: within- and between-subject intervals, tests, and correction of families of tests."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from focalgradient.arrays import FloatArray
from focalgradient.statistics.records import CONFIDENCE, Effect, Interval, NotComputed, size_interval

__all__ = [
    "between_levels",
    "family",
    "holm",
    "only_difference",
    "paired_effect",
    "share_interval",
    "student_effect",
    "t_interval",
    "welch",
    "within_half_widths",
]


def within_half_widths(cells: ArrayLike) -> FloatArray:
    """Return half widths of the 95 % within-subject intervals of condition means.

    Subject means are removed (Cousineau 2005), and the resulting bias is corrected by the factor sqrt(C / (C - 1)) for
    C conditions (Morey 2008). The intervals serve to compare conditions visually, not to judge their level.

    Parameters
    ----------
    cells
        One row per subject, one column per condition; no gaps.

    Returns
    -------
    ndarray
        One value per condition; NaN for one subject or one condition.

    Examples
    --------
    >>> within_half_widths([[1, 2], [11, 13], [21, 22]]).round(3)
    array([1.014, 1.014])
    """
    cells = np.asarray(cells, dtype=float)
    subjects, conditions = cells.shape
    if subjects < 2 or conditions < 2:
        return np.full(conditions, np.nan)
    normed = cells - cells.mean(axis=1, keepdims=True)
    error = normed.std(axis=0, ddof=1) * math.sqrt(conditions / (conditions - 1) / subjects)
    return stats.t.ppf((1 + CONFIDENCE) / 2, subjects - 1) * error


def t_interval(values: ArrayLike) -> Interval:
    """Return the mean over subjects and its 95 % interval by Student's t.

    Examples
    --------
    >>> mean = t_interval([0.1, 0.4, 0.2, 0.3, 0.9, 0.2])
    >>> round(mean.estimate, 2), round(mean.low, 2), round(mean.high, 2)
    (0.35, 0.05, 0.65)
    """
    values = np.asarray(values, dtype=float)
    mean = float(values.mean())
    if values.size < 2:
        return Interval(mean, None, None)
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, values.size - 1) * values.std(ddof=1) / math.sqrt(values.size))
    return Interval(mean, mean - half, mean + half)


def share_interval(shares: ArrayLike) -> Interval:
    """Return the mean of the subjects' proportions and its 95 % interval, which lies within 0 and 1.

    The interval is Student's t on the log odds of the mean, by the delta method. It is undefined for one subject, or if
    all proportions are 0 (or all are 1).

    Examples
    --------
    >>> mean = share_interval([0.02, 0.01, 0.08, 0.0, 0.05])
    >>> round(mean.estimate, 3), round(mean.low, 3), round(mean.high, 3)
    (0.032, 0.009, 0.109)
    """
    values = np.asarray(shares, dtype=float)
    mean = float(values.mean())
    if values.size < 2 or not 0 < mean < 1:
        return Interval(mean, None, None)
    error = float(values.std(ddof=1)) / math.sqrt(values.size) / (mean * (1 - mean))
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, values.size - 1)) * error
    middle = math.log(mean / (1 - mean))
    return Interval(mean, *(1 / (1 + math.exp(-end)) for end in (middle - half, middle + half)))


def student_effect(
    estimate: float,
    standard_error: float,
    subjects: int,
    method: str,
    *,
    df: float | None = None,
    dz: float | None = None,
    remarks: tuple[str, ...] = (),
) -> Effect:
    """Test an estimate by Student's t, with `df` degrees of freedom (by default subjects - 1).

    Examples
    --------
    >>> round(student_effect(2.0, 1.0, 10, "an example").p, 4)
    0.0766
    """
    df = subjects - 1 if df is None else df
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, df)) * standard_error
    statistic = estimate / standard_error
    p = 2 * float(stats.t.sf(abs(statistic), df))
    return Effect(
        estimate,
        estimate - half,
        estimate + half,
        standard_error,
        statistic,
        df,
        p,
        dz,
        subjects,
        method,
        remarks,
    )


def paired_effect(differences: ArrayLike, method: str) -> Effect | NotComputed:
    """Test the mean within-subject difference by a paired t-test.

    Parameters
    ----------
    differences
        One difference per subject.
    method
        Description of the method for the report.

    Examples
    --------
    >>> effect = paired_effect([0.1, 0.4, 0.2, 0.3], "an example")
    >>> round(effect.estimate, 3), round(effect.p, 4), round(effect.dz, 2)
    (0.25, 0.0305, 1.94)
    """
    differences = np.asarray(differences, dtype=float)
    subjects = differences.size
    if subjects < 2:
        return NotComputed(f"A test over subjects needs two or more, and there {'is 1' if subjects else 'are none'}.")
    mean, sd = float(differences.mean()), float(differences.std(ddof=1))
    if sd <= 1e-12 * max(1.0, float(np.abs(differences).max())):
        return NotComputed(
            f"All {subjects} subjects have the same value ({mean:.3g}): there is no variation to test against."
        )
    return student_effect(mean, sd / math.sqrt(subjects), subjects, method, dz=mean / sd)


def between_levels(
    one: pd.Series[float],
    other: pd.Series[float],
    *,
    paired: bool | None = None,
    method: str = "paired t over subjects",
) -> Effect | NotComputed:
    """Test the difference of two levels over subjects (their index), paired or of separate groups.

    Parameters
    ----------
    one, other
        Values of subjects at each level.
    paired
        True for a paired t-test, False for Welch's test; None: paired if a subject has both levels.
    method
        Description of the paired test.

    Examples
    --------
    >>> one, other = pd.Series({"a": 0.5, "b": 0.9, "c": 0.4}), pd.Series({"a": 0.1, "b": 0.2, "c": 0.2})
    >>> round(between_levels(one, other).estimate, 3), between_levels(one, other, paired=False).method[:7]
    (0.433, "Welch's")
    """
    both = (one - other).dropna()
    if paired or (paired is None and len(both)):
        return paired_effect(both.to_numpy(), method)
    groups = [values.dropna().to_numpy(float) for values in (one, other)]
    if not all(map(len, groups)):
        return NotComputed(
            f"A comparison needs subjects at both levels, and there are {len(groups[0])} and {len(groups[1])}."
        )
    return welch(*groups)


def welch(one: NDArray[Any], other: NDArray[Any]) -> Effect | NotComputed:
    """Compare the means of two groups of subjects with unequal variances (Welch 1947); d is Cohen's, by pooled SD.

    >>> round(welch(np.array([4.0, 5.0, 6.0]), np.array([1.0, 2.0, 3.0])).d.estimate, 3)
    3.0
    """
    if min(len(one), len(other)) < 2:
        return NotComputed(
            f"A test between groups needs two subjects in each, and there are {len(one)} and {len(other)}."
        )
    parts = [float(values.var(ddof=1)) / len(values) for values in (one, other)]
    error = math.sqrt(sum(parts))
    if error == 0:
        return NotComputed("All subjects of a group have the same value: there is no variation to test against.")
    df = sum(parts) ** 2 / sum(part**2 / (len(values) - 1) for part, values in zip(parts, (one, other), strict=True))
    estimate, subjects, least = float(one.mean() - other.mean()), len(one) + len(other), min(len(one), len(other))
    remarks = (FEW.format(least),) if least < FEWEST else ()
    test = student_effect(estimate, error, subjects, "Welch's t between groups of subjects", df=df, remarks=remarks)
    freedom = [len(values) - 1 for values in (one, other)]
    pooled = math.sqrt(np.average([one.var(ddof=1), other.var(ddof=1)], weights=freedom))
    return replace(test, d=size_interval(test.statistic, df, error / pooled))


FEWEST = 4
"""Number of subjects of a group below which Welch's test does not keep its level (20,000 sets beside 8 and 20)."""

FEW = "A group has {} subjects: of true null hypotheses Welch's test rejects 12 % with 2 subjects, 7 % with 3."


def holm(probabilities: ArrayLike) -> FloatArray:
    """Correct the p values of one family by Holm's (1979) step-down method, along the last axis.

    NaN (a test that was not done) stays NaN and is not counted. It equals `multipletests` of statsmodels, which takes
    one family at a time and collects garbage in each call (0.1 s): too slow for simulated experiments.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).round(3)
    array([0.03, 0.06, 0.06])
    """
    p = np.asarray(probabilities, dtype=float)
    order = np.argsort(p, axis=-1)  # NaN last
    tests = np.isfinite(p).sum(axis=-1, keepdims=True)
    factor = tests - np.arange(p.shape[-1])
    stepped = np.minimum(np.maximum.accumulate(np.take_along_axis(p, order, -1) * factor, axis=-1), 1.0)
    corrected = np.empty_like(p)
    np.put_along_axis(corrected, order, stepped, -1)
    return corrected


def only_difference(differences: Mapping[tuple[str, str], Effect | NotComputed]) -> Effect | NotComputed:
    """Return the difference if there are exactly two fixations, else the reason why there is none.

    >>> only_difference({}).reason
    'There is only one fixation: nothing can be compared.'
    """
    if len(differences) > 1:
        return NotComputed("There are more than two fixations: each pair is compared.")
    return next(iter(differences.values()), NotComputed("There is only one fixation: nothing can be compared."))


def family(tests: Iterable[Effect | NotComputed]) -> list[Effect | NotComputed]:
    """Return the tests of one family with `p_holm` from `holm`.

    Examples
    --------
    >>> tests = [student_effect(t, 1.0, 10, "an example") for t in (2.0, 4.0)]
    >>> [round(test.p_holm, 4) for test in family([*tests, NotComputed("There is no third.")])[:2]]
    [0.0766, 0.0062]
    """
    tests = list(tests)
    corrected = holm([test.p if isinstance(test, Effect) else math.nan for test in tests])
    return [
        replace(test, p_holm=float(p)) if isinstance(test, Effect) else test
        for test, p in zip(tests, corrected, strict=True)
    ]
