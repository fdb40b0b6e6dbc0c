"""Means over subjects with their intervals: within subjects, and by resampling whole subjects."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from focalgradient.statistics.records import CONFIDENCE, Effect, Interval, NotComputed

__all__ = ["bootstrap_interval", "family", "paired_effect", "student_effect", "within_half_widths"]

RESAMPLES = 9999
SEED = 1987


def within_half_widths(cells: ArrayLike) -> NDArray[np.float64]:
    """Half widths of the 95 % within-subject intervals of the means of conditions.

    What subjects differ by as a whole is taken out (Cousineau 2005), and what this takes too much is given back: a
    factor sqrt(C / (C - 1)) for C conditions (Morey 2008). For comparing conditions by eye, not for their level.

    Parameters
    ----------
    cells
        A row a subject, a column a condition; no gaps.

    Returns
    -------
    ndarray
        One a condition; NaN for one subject or one condition.

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


def bootstrap_interval(values: ArrayLike) -> Interval:
    """The mean over subjects and its 95 % interval by resampling subjects: bias-corrected, accelerated (Efron 1987).

    The same values give the same interval: the seed is fixed. Equal values have no width.

    Examples
    --------
    >>> mean = bootstrap_interval([0.1, 0.4, 0.2, 0.3, 0.9, 0.2])
    >>> round(mean.estimate, 2), round(mean.low, 2), round(mean.high, 2)
    (0.35, 0.2, 0.68)
    """
    values = np.sort(np.asarray(values, dtype=float))  # the same whatever the order of subjects
    mean = float(values.mean())
    if values.size < 2:
        return Interval(mean, None, None)
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        return Interval(mean, mean, mean)
    ends = stats.bootstrap(
        (values,), np.mean, confidence_level=CONFIDENCE, n_resamples=RESAMPLES, method="BCa", rng=SEED
    ).confidence_interval
    return Interval(mean, float(ends.low), float(ends.high))


def student_effect(
    estimate: float,
    standard_error: float,
    subjects: int,
    method: str,
    *,
    dz: float | None = None,
    remarks: tuple[str, ...] = (),
) -> Effect:
    """An estimate and its standard error referred to Student's t with a degree of freedom less than subjects.

    Examples
    --------
    >>> round(student_effect(2.0, 1.0, 10, "an example").p, 4)
    0.0766
    """
    df = subjects - 1
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, df)) * standard_error
    statistic = estimate / standard_error
    p = 2 * float(stats.t.sf(abs(statistic), df))
    return Effect(
        estimate, estimate - half, estimate + half, standard_error, statistic, df, p, dz, subjects, method, remarks
    )


def paired_effect(differences: ArrayLike, method: str) -> Effect | NotComputed:
    """The mean of the subjects' own differences, by a paired t-test.

    Parameters
    ----------
    differences
        One a subject.
    method
        What is said of it.

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


def family(tests: Iterable[Effect | NotComputed]) -> list[Effect | NotComputed]:
    """The tests of one family, with probabilities corrected by Holm's (1979) step-down method.

    Examples
    --------
    >>> tests = [student_effect(t, 1.0, 10, "an example") for t in (2.0, 4.0)]
    >>> [round(test.p_holm, 4) for test in family([*tests, NotComputed("There is no third.")])[:2]]
    [0.0766, 0.0062]
    """
    tests = list(tests)
    done = sorted((test.p, place) for place, test in enumerate(tests) if isinstance(test, Effect))
    corrected, least = {}, 0.0
    for step, (p, place) in enumerate(done):
        corrected[place] = least = min(1.0, max(least, (len(done) - step) * p))
    return [
        replace(test, p_holm=corrected[place]) if isinstance(test, Effect) else test for place, test in enumerate(tests)
    ]
