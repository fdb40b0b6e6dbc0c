"""Signal detection theory: d' and criterion from counts, ROC from ratings with unequal variances.

Sources: Macmillan & Creelman (2005); Hautus (1995) for the log-linear correction; Galvin et al. (2003) for the
type-2 ROC.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import optimize, special, stats

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.statistics.hessian import ascending, covariance_at, free_of, polished
from focalgradient.statistics.means import paired_effect, t_interval
from focalgradient.statistics.questions import Analysis, Answers, Outcome, Question, Tested, less
from focalgradient.statistics.records import CONFIDENCE, Effect, Interval, NotComputed
from focalgradient.statistics.wording import statistic, with_interval

__all__ = [
    "Detection",
    "DetectionGroup",
    "RatingRoc",
    "detection_by_person",
    "detection_outcomes",
    "detection_questions",
    "rating_roc",
    "sensitivity",
    "type2_area",
]


LARGEST = 6.0
"""Maximum absolute d' and criterion in a search, in noise standard deviations: larger values cannot be distinguished.
"""

NORMAL = float(special.ndtri((1 + CONFIDENCE) / 2))
"""Half width of an interval, in standard errors."""


@dataclass(frozen=True, slots=True)
class Detection:
    """Equal-variance signal detection.

    Parameters
    ----------
    d_prime, criterion
        Sensitivity d' and bias c (0: unbiased; positive: towards "no"), each with a 95 % interval.
    hit_rate, false_alarm_rate
        Rates after the log-linear correction.
    """

    d_prime: Interval
    criterion: Interval
    hit_rate: float
    false_alarm_rate: float


def sensitivity(hits: int, misses: int, false_alarms: int, correct_rejections: int, *, intervals: int = 1) -> Detection:
    """Compute sensitivity and criterion from the counts of answers.

    Half a trial is added to each count (log-linear correction), so that d' is finite for rates of 0 and 1. The
    intervals are normal, with the variance of Gourevitch & Galanter (1967).

    Parameters
    ----------
    hits, misses
        Number of "yes" and "no" answers to the signal; with two intervals, of "first" and "second" answers to a signal
        in the first.
    false_alarms, correct_rejections
        The same for noise; with two intervals, for a signal in the second.
    intervals
        1 for yes/no; 2 for forced choice, for which d' is divided by the square root of 2.

    Raises
    ------
    InputError
        If a count is negative, signal or noise was never shown, or `intervals` is not 1 or 2.

    Examples
    --------
    >>> found = sensitivity(40, 10, 10, 40)
    >>> round(found.d_prime.estimate, 2), round(found.criterion.estimate, 2)
    (1.64, 0.0)
    """
    counts = (hits, misses, false_alarms, correct_rejections)
    if min(counts) < 0 or not all(float(count).is_integer() for count in counts):
        raise InputError(f"Counts must be whole numbers of 0 or more, got {counts}.")
    if not (hits + misses and false_alarms + correct_rejections):
        raise InputError("Signal and noise must each have been shown once or more.")
    if intervals not in (1, 2):
        raise InputError(f"intervals is {intervals}, but must be 1 (yes or no) or 2 (forced choice).")
    signal, noise = hits + misses + 1, false_alarms + correct_rejections + 1
    h, f = (hits + 0.5) / signal, (false_alarms + 0.5) / noise
    zh, zf = float(special.ndtri(h)), float(special.ndtri(f))
    variance = sum(p * (1 - p) / n * 2 * math.pi * math.exp(z**2) for p, n, z in ((h, signal, zh), (f, noise, zf)))
    error = math.sqrt(variance)
    unit = math.sqrt(intervals)
    d, c = (zh - zf) / unit, -(zh + zf) / 2
    return Detection(_normal(d, error / unit), _normal(c, error / 2), h, f)


def _normal(estimate: float, error: float) -> Interval:
    half = NORMAL * error
    return Interval(estimate, estimate - half, estimate + half)


@dataclass(frozen=True, slots=True)
class DetectionGroup:
    """Signal detection results of several people.

    Parameters
    ----------
    people
        Results of each person, by name and condition.
    d_prime, criterion
        Means over people for each condition, with 95 % intervals by Student's t.
    differences
        Difference in d' between each condition and the first, by a paired t-test over people with both.
    """

    people: Mapping[tuple[str, str], Detection]
    d_prime: Mapping[str, Interval]
    criterion: Mapping[str, Interval]
    differences: Mapping[str, Effect | NotComputed]


def detection_by_person(table: pd.DataFrame | Mapping[str, ArrayLike], *, intervals: int = 1) -> DetectionGroup:
    """Compute sensitivity and criterion for each person and condition, and their means over people.

    Parameters
    ----------
    table
        One row per trial, or arrays by name: `participant_id`, `signal` (True if present; with two intervals, if in the
        first), `answer` (True for "yes", or "first"), and optionally `condition`.
    intervals
        As in `sensitivity`.

    Raises
    ------
    InputError
        If a column is missing, there are no trials, `signal` or `answer` is neither True nor False, or a person lacks
        signal or noise trials in a condition.

    Examples
    --------
    >>> table = {"participant_id": ["a"] * 8 + ["b"] * 8, "signal": [1, 1, 1, 1, 0, 0, 0, 0] * 2,
    ...          "answer": [1, 1, 1, 0, 0, 0, 1, 0, 1, 1, 1, 1, 1, 0, 0, 0]}
    >>> found = detection_by_person(table)
    >>> round(found.d_prime[""].estimate, 2)
    1.43
    """
    rows = pd.DataFrame(table)
    for name in ("participant_id", "signal", "answer"):
        if name not in rows:
            raise InputError(f"The table has no column {name!r}, but needs participant_id, signal and answer.")
    if rows.empty:
        raise InputError("The table has no trials: give one row per trial.")
    for name in ("signal", "answer"):
        known = rows[name].isin([True, False])
        if not known.all():
            raise InputError(
                f"{name} is {rows[name][~known].tolist()[0]!r}, but must be True or False (1 or 0): leave out trials "
                "without an answer."
            )
    rows = rows.assign(condition=rows["condition"].astype(str) if "condition" in rows else "")
    people: dict[tuple[str, str], Detection] = {}
    for (person, condition), own in rows.groupby(["participant_id", "condition"], sort=True):
        signal, yes = own["signal"].to_numpy(bool), own["answer"].to_numpy(bool)
        if not (signal.any() and (~signal).any()):
            raise InputError(
                f"{person} was shown {'signals' if signal.any() else 'noise'} only ({condition or 'all'})."
            )
        counts = (signal & yes, signal & ~yes, ~signal & yes, ~signal & ~yes)
        people[str(person), str(condition)] = sensitivity(*(int(one.sum()) for one in counts), intervals=intervals)
    d, c = (
        pd.Series({who: getattr(one, name).estimate for who, one in people.items()}).unstack()
        for name in ("d_prime", "criterion")
    )
    first, *others = dict.fromkeys(rows["condition"])
    method = "d' of each person, paired t-test"
    d_prime, criterion = ({name: t_interval(of[name].dropna()) for name in (first, *others)} for of in (d, c))
    differences = {name: paired_effect((d[name] - d[first]).dropna(), method) for name in others}
    return DetectionGroup(people, d_prime, criterion, differences)


@dataclass(frozen=True, slots=True)
class RatingRoc:
    """ROC of confidence ratings, with the fitted unequal-variance normal model.

    Parameters
    ----------
    false_alarm_rates, hit_rates
        Points of the curve, from the strictest criterion to the most lenient, without the end points.
    area
        Area under the points joined by straight lines: the Mann-Whitney statistic, model-free.
    d_a, sd_ratio, criteria
        Normal model with unequal variances, noise with mean 0 and SD 1: difference of the means divided by the root
        mean square SD, with a 95 % interval; SD of the signal, with a 95 % interval; criteria, ascending.
    area_normal
        Area under the fitted curve.
    equal_p
        p value of the likelihood-ratio test of equal variances.
    """

    false_alarm_rates: tuple[float, ...]
    hit_rates: tuple[float, ...]
    area: float
    d_a: Interval
    sd_ratio: Interval
    criteria: tuple[float, ...]
    area_normal: float
    equal_p: float


NO_MAXIMUM = NotComputed("The ratings of signal and noise hardly overlap: the likelihood has no maximum.")


def _points(signal: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return false-alarm and hit rates of the criteria, from the strictest to the most lenient."""
    return np.cumsum(noise[::-1])[:-1] / noise.sum(), np.cumsum(signal[::-1])[:-1] / signal.sum()


def roc_area(signal: ArrayLike, noise: ArrayLike) -> float:
    """Return the area under the points of the ROC, joined by straight lines, from counts as in `rating_roc`.

    >>> round(roc_area([5, 10, 20, 30, 35], [35, 30, 20, 10, 5]), 3)
    0.82
    """
    alarms, hits = _points(np.asarray(signal, float), np.asarray(noise, float))
    return float(np.trapezoid([0, *hits, 1], [0, *alarms, 1]))


def rating_roc(signal: ArrayLike, noise: ArrayLike) -> RatingRoc | NotComputed:
    """Fit the unequal-variance normal model to ratings by maximum likelihood (Dorfman & Alf 1969).

    Parameters
    ----------
    signal, noise
        Number of answers in each rating category, from "surely noise" to "surely signal" (K >= 3 each).

    Returns
    -------
    RatingRoc
        `NotComputed` if the ratings hardly overlap, so that the likelihood has no maximum: a ratio of standard
        deviations of 0 or infinity passes through all points of the curve.

    Raises
    ------
    InputError
        If the counts have different lengths or fewer than 3 categories, or signal or noise was never shown.

    Examples
    --------
    >>> found = rating_roc([5, 10, 20, 30, 35], [35, 30, 20, 10, 5])
    >>> round(found.area, 3), round(found.sd_ratio.estimate, 2), round(found.d_a.estimate, 2)
    (0.82, 1.0, 1.36)
    """
    s, n = np.asarray(signal, float), np.asarray(noise, float)
    if s.ndim != 1 or s.shape != n.shape or len(s) < 3:
        raise InputError(
            f"signal has shape {s.shape} and noise {n.shape}, but both need the counts of 3 or more ratings."
        )
    if s.sum() < 1 or n.sum() < 1 or (s < 0).any() or (n < 0).any():
        raise InputError("Counts must be 0 or more, and signal and noise must each have been shown.")
    alarms, hits = _points(s, n)
    used = (s + n) > 0
    s, n = s[used], n[used]
    for one, other in ((alarms, hits), (hits, alarms)):
        if len(np.unique(one[(other > 0) & (other < 1)])) < 2:  # fitted exactly by a vertical or horizontal line
            return NO_MAXIMUM

    def cost(free: FloatArray, sd: float | None = None) -> float:
        spread = math.exp(free[1]) if sd is None else sd
        cuts = np.concatenate([[-np.inf], ascending(free[2:]), [np.inf]])
        p = np.diff(special.ndtr(cuts))
        q = np.diff(special.ndtr((cuts - free[0]) / spread))
        return -float((n * np.log(np.maximum(p, 1e-12))).sum() + (s * np.log(np.maximum(q, 1e-12))).sum())

    even = special.ndtri(np.clip(np.cumsum(s + n)[:-1] / (s + n).sum(), 1e-3, 1 - 1e-3))
    start = np.concatenate([[1.0, 0.0], free_of(even, 0.05)])
    bounds = [(-LARGEST, 2 * LARGEST), (-2.0, 2.0), (-LARGEST, LARGEST), *[(-6.0, 3.0)] * (len(start) - 3)]
    low, high = np.array(bounds).T
    found = polished(cost, optimize.minimize(cost, start, method="L-BFGS-B", bounds=bounds).x, low=low, high=high)
    if found is None or any(value in bound for value, bound in zip(found[:2], bounds[:2], strict=True)):
        return NO_MAXIMUM
    inner = np.flatnonzero((found > low) & (found < high))  # criteria at a limit coincide

    def of_inner(free: FloatArray) -> float:
        whole = found.copy()
        whole[inner] = free
        return cost(whole)

    covariance = covariance_at(of_inner, found[inner])
    search = optimize.minimize(cost, found, args=(1.0,), method="L-BFGS-B", bounds=bounds)
    equal = polished(lambda free: cost(free, 1.0), search.x, low=low, high=high)
    if covariance is None or equal is None:
        return NO_MAXIMUM
    mean, log_sd = found[:2]
    sd = math.exp(log_sd)
    root = math.sqrt((1 + sd**2) / 2)
    turn = np.array([1 / root, -mean * sd**2 / (2 * root**3)])
    error, sd_error = math.sqrt(turn @ covariance[:2, :2] @ turn), math.sqrt(covariance[1, 1])
    return RatingRoc(
        tuple(map(float, alarms)),
        tuple(map(float, hits)),
        roc_area(signal, noise),
        _normal(float(mean / root), error),
        _normal(log_sd, sd_error).ratio,
        tuple(map(float, ascending(found[2:]))),
        float(special.ndtr(mean / math.sqrt(1 + sd**2))),
        float(stats.chi2.sf(max(0.0, 2 * (cost(equal, 1.0) - cost(found))), 1)),
    )


D_PRIME, CRITERION, DIFFERENCE = "d′", "criterion c", "difference of d′"
"""Names of measures, and of the question about pairs of conditions."""

Who = tuple[str, str]


def detection_questions(conditions: Sequence[str], *, confidence: bool) -> Analysis:
    """Return the questions about detection, asked of `detection_outcomes`.

    Parameters
    ----------
    conditions
        Names of the conditions; d' in the others is compared with that in the first.
    confidence
        True if there are curves and areas.

    Examples
    --------
    >>> [question.name for question in detection_questions([""], confidence=False).questions][:2]
    ['mean d′', 'mean criterion c']
    """
    first, *others = conditions

    def means(level: str, answers: Answers) -> str:
        d, c = (with_interval(answers.to(f"mean {what}")[level]) for what in (D_PRIME, CRITERION))
        where = f" in {level}" if level else ""
        return f"Mean d′{where}: {d}; mean criterion c: {c} (above 0: a tendency to “no”)."

    def differed(level: str, answers: Answers) -> str:
        test, other = answers.to(DIFFERENCE)[level], level.removesuffix(less("", first))
        if isinstance(test, NotComputed):
            return f"{other} and {first} were not compared: {test.reason}"
        return f"d′ in {other} less that in {first}: {with_interval(test.interval)}, {statistic(test)}."

    r_code = {
        D_PRIME: """for (k in conditions) show("mean d'", k, interval(of(k, "d")))\n""",
        CRITERION: 'for (k in conditions) show("mean criterion c", k, interval(of(k, "c")))\n',
    }
    asked = [
        Question(f"mean {what}", role="main", headline=f"mean {what}, {{level}}", r_code=r_code.get(what, ""))
        for what in (D_PRIME, CRITERION, *(OF_CONFIDENCE if confidence else ()))
    ]
    asked[0] = replace(asked[0], sentence=means)
    if others:
        asked.append(Question(DIFFERENCE, role="main", family=DIFFERENCE, sentence=differed, r_code=DIFFERENCE_R))
    asked += [
        Question(what, role="description", r_code=code)
        for what, code in ((D_PRIME, EACH_R.format("d'", "d", 1)), (CRITERION, EACH_R.format(CRITERION, "c", 2)))
    ]
    method = " ".join([METHOD, *[CONFIDENCE_METHOD] * confidence])
    return Analysis(asked, after=method, kind="detection", choices=("d-prime", "over-subjects", "holm"))


DIFFERENCE_R = """for (k in conditions[-1]) {
  one <- of(k, "d"); other <- of(conditions[1], "d"); both <- intersect(names(one), names(other))
  show("difference of d'", paste(k, "less", conditions[1]), over_people(one[both] - other[both]))
}
"""
EACH_R = """for (i in seq_len(nrow(people))) {{
  who <- c(people$participant_id[i], people$condition[i]); m <- people${1}[i]
  half <- qnorm(.975) * people$error[i] / {2}
  show("{0}", paste(who[nzchar(who)], collapse = ", "), c(estimate = m, low = m - half, high = m + half))
}}
"""

OF_CONFIDENCE = (
    "area under the ROC",
    "d_a (unequal variances)",
    "SD of signal over noise",
    "area under the type-2 curve",
)
"""Measures of confidence."""

METHOD = (
    "Sensitivity d′ and criterion c of each person and condition follow from the rates of hits and false "
    "alarms, half a trial added to each count (log-linear correction: Hautus, 1995); their intervals are "
    "normal (Gourevitch and Galanter, 1967). Means are over people, with intervals by Student’s t; conditions "
    "were compared with the first by paired t-tests, corrected by Holm’s method. Catch trials do not count."
)
CONFIDENCE_METHOD = (
    "Answers with their confidence, from the surest “no” to the surest “yes”, give the ROC: the area "
    "under its points, and the normal model of unequal variances by maximum likelihood (Dorfman and Alf, "
    "1969) of each person. The area under the type-2 curve is the probability that a right answer is given "
    "with more confidence than a wrong one. The mean of the ratio of SDs is geometric."
)


def detection_outcomes(
    group: DetectionGroup, curves: Mapping[Who, RatingRoc | NotComputed], areas: Mapping[Who, tuple[float, float]]
) -> dict[str, dict[str, Outcome | Tested]]:
    """Return the outcomes of the questions about detection, by name and level.

    Parameters
    ----------
    group
        Results of each person and condition, and their means.
    curves, areas
        ROC, and areas under its points and under the type-2 ROC, by person and condition; empty without confidence.
    """
    found: dict[str, dict[str, Outcome | Tested]] = {
        f"mean {what}": {} for what in (D_PRIME, CRITERION, *OF_CONFIDENCE)
    }
    for condition in group.d_prime:
        count = sum(at == condition for _, at in group.people)
        fits = [fit for (_, at), fit in curves.items() if at == condition and isinstance(fit, RatingRoc)]
        points, type2 = np.reshape([pair for (_, at), pair in areas.items() if at == condition], (-1, 2)).T
        means = {D_PRIME: group.d_prime[condition], CRITERION: group.criterion[condition]}
        if len(points):
            means |= dict(zip(OF_CONFIDENCE[::3], (t_interval(points), t_interval(type2)), strict=True))
        if fits:
            means[OF_CONFIDENCE[1]] = t_interval([fit.d_a.estimate for fit in fits])
            means[OF_CONFIDENCE[2]] = t_interval(np.log([fit.sd_ratio.estimate for fit in fits])).ratio
        for what, mean in means.items():
            found[f"mean {what}"][condition] = Tested(mean, n=count)
    first = next(iter(group.d_prime))
    found[DIFFERENCE] = {less(name, first): test for name, test in group.differences.items()}
    people = {", ".join(filter(None, who)): person for who, person in group.people.items()}
    found[D_PRIME] = {level: Tested(person.d_prime, n=1) for level, person in people.items()}
    found[CRITERION] = {level: Tested(person.criterion, n=1) for level, person in people.items()}
    return found


def type2_area(signal: ArrayLike, noise: ArrayLike) -> float:
    """Return the area under the type-2 ROC: how well confidence discriminates correct from incorrect answers.

    It is the probability that a correct answer is given with more confidence than an incorrect one, ties counted by
    half.

    Parameters
    ----------
    signal, noise
        Number of answers in each of 2 K categories: "no" from the most to the least confident, then "yes" from the
        least to the most. 1 / (2 K) is added to each.

    Raises
    ------
    InputError
        If the counts differ in length, or have an odd number of categories or fewer than 4.

    Examples
    --------
    >>> round(type2_area([4, 8, 12, 16, 20, 40], [40, 20, 16, 12, 8, 4]), 3)
    0.708
    """
    s, n = np.asarray(signal, float), np.asarray(noise, float)
    if s.ndim != 1 or s.shape != n.shape or len(s) < 4 or len(s) % 2:
        raise InputError("signal and noise must each have the counts of 2 K ratings, K 2 or more.")
    k = len(s) // 2
    s, n = s + 1 / (2 * k), n + 1 / (2 * k)
    right, wrong = s[k:] + n[:k][::-1], n[k:] + s[:k][::-1]  # by confidence, in ascending order
    below = np.concatenate([[0], np.cumsum(wrong)[:-1]])
    return float((right * (below + wrong / 2)).sum() / right.sum() / wrong.sum())
