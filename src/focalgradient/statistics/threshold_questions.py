"""Questions about thresholds: their mean over people, and ratios of conditions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import combinations

import pandas as pd

from focalgradient.statistics.criteria import Rules
from focalgradient.statistics.exclusions import Quality
from focalgradient.statistics.means import between_levels
from focalgradient.statistics.questions import Analysis, Answers, Question, Tested, quoted
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.thresholds import SubjectThreshold, ThresholdFit, ThresholdResult, log_thresholds
from focalgradient.statistics.wording import statistic, with_interval

__all__ = ["MEAN", "RATIO", "attending", "fitted", "threshold_questions"]

MEAN, RATIO, THRESHOLD = "geometric mean threshold", "log ratio of thresholds", "threshold"
"""Names of the questions about thresholds."""

BIAS = (
    "In simulated adaptive sessions of 60 trials the bias of such a threshold is −4 % (slope 5, no lapses) to "
    "+12 % (slope 2, 4 % lapses), as answers near threshold do not determine slope and lapse rate. A bias that "
    "conditions have in common cancels in the ratio of their thresholds."
)
"""Bias of the estimate: docs/report/thresholds.md."""


def threshold_questions(
    unit: str,
    conditions: Iterable[str] = ("",),
    guess: float = 0.5,
    of: str = "",
    compared: Iterable[tuple[str, str]] | None = None,
) -> Analysis:
    """Return the questions about thresholds, asked of a `ThresholdResult` by condition.

    Parameters
    ----------
    unit
        Unit of the levels; empty if unknown.
    conditions
        Names of the conditions. Log thresholds of each pair are compared: paired by participant, or by Welch's test if
        no participant has both; several pairs are one family by Holm.
    guess
        Guess rate.
    of
        What thresholds are of, such as "of blur"; empty if unknown.
    compared
        Pairs of conditions to compare; None: all.

    Examples
    --------
    >>> from focalgradient.statistics.thresholds import SubjectThreshold, ThresholdFit, ThresholdResult
    >>> def of(*thresholds):
    ...     fits = [ThresholdFit(at, 0.1, 0.9, 3.5, 0.0, (0.2,), (8,), (10,)) for at in thresholds]
    ...     subjects = [SubjectThreshold(who, "", 0, 0, True, fit) for who, fit in zip("abc", fits)]
    ...     return ThresholdResult("D", tuple(subjects))
    >>> results = {"dim": of(0.4, 0.6, 0.5), "bright": of(0.2, 0.3, 0.2)}
    >>> found = threshold_questions("D", results).answers(results).to("log ratio of thresholds")
    >>> round(found["dim over bright"].ratio.estimate, 2)
    2.15
    """
    together = combinations(conditions, 2) if compared is None else compared
    pairs = {f"{one} over {other}": (one, other) for one, other in together}

    def means(results: Results) -> dict[str, Tested]:
        return {name: Tested(result.mean, n=len(log_thresholds(result.subjects))) for name, result in results.items()}

    def ratios(results: Results) -> dict[str, Effect | NotComputed]:
        logs = {name: pd.Series(log_thresholds(result.subjects), dtype=float) for name, result in results.items()}
        method = "paired t over participants"
        return {level: between_levels(logs[one], logs[other], method=method) for level, (one, other) in pairs.items()}

    def mean(level: str, answers: Answers) -> str:
        found = answers.to(MEAN)[level]
        if isinstance(found, NotComputed):
            return f"{level}: {found.reason}" if level else found.reason
        return f"Geometric mean threshold{f' in {level}' if level else ''}: {with_interval(found, unit)}."

    def ratio(level: str, answers: Answers) -> str:
        found, (one, other) = answers.to(RATIO)[level], pairs[level]
        if isinstance(found, NotComputed):
            return f"The thresholds of {one} and {other} were not compared: {found.reason}"
        return f"Threshold of {one} over that of {other}: {with_interval(found.ratio)}, {statistic(found)}."

    how = "conditions are compared by t-tests of log thresholds over people (paired, of separate groups Welch’s)"
    questions = [
        Question(
            MEAN,
            means,
            "main",
            unit,
            headline=f"{MEAN} ({unit}), {{level}}" if unit else f"{MEAN}, {{level}}",
            sentence=mean,
            method="Each person’s answers in each condition were fitted by psignifit (Schütt, Harmeling, Macke & "
            f"Wichmann, 2016): Weibull’s function of the logarithm of the level, from the guess rate of {guess:.3g} "
            "upwards, threshold evenly distributed over the levels, slope from 1 to 10 evenly on its logarithm, "
            "lapse rate beta (1, 66) up to 10 %, no overdispersion. Given are the median of the posterior and its "
            f"central 95 %. At threshold {guess + (1 - guess) / 2:.3g} of the answers are right, without lapses. The "
            "mean is geometric, its interval by Student’s t over people.",
            r_code=f'for (k in unique(d$condition)) show("{MEAN}", k, exp(interval(of(k))))\n',
        ),
        Question(
            RATIO,
            ratios,
            "main",
            "log ratio",
            RATIO * (len(pairs) > 1),
            sentence=ratio,
            hypothesis=tuple(f"The thresholds of {one} and of {other} differ." for one, other in pairs.values()),
            method=f"{how[0].upper()}{how[1:]}, several by Holm’s method." if pairs else "",
            r_code="".join(
                f"show({quoted(RATIO)}, {quoted(level)}, compared(of({quoted(one)}), of({quoted(other)})))\n"
                for level, (one, other) in pairs.items()
            ),
            levels=tuple(pairs),
        ),
        Question(THRESHOLD, _sessions, "description", unit),
    ]
    outcome = f"The primary outcome is the geometric mean over participants of the threshold {of} ({unit})."
    return Analysis(
        questions,
        outcome if of else "",
        after=f"Catch trials do not count. {BIAS}",
        exclusions=attending,
        kind="thresholds",
        choices=("threshold",),
        estimates="thresholds",
    )


Results = Mapping[str, ThresholdResult]
"""Thresholds by condition."""


def attending(results: Results) -> tuple[Results, Quality]:
    """Leave out sessions with too few correct catch trials."""
    return _kept(results, lambda session: session.kept)


def fitted(results: Results) -> tuple[Results, Quality]:
    """Leave out sessions without a fitted function."""
    return _kept(results, lambda session: isinstance(session.fit, ThresholdFit))


def _kept(results: Results, keep: Callable[[SubjectThreshold], bool]) -> tuple[Results, Quality]:
    """Keep the sessions for which a function returns True; the quality has the numbers of people and of sessions."""
    kept = {name: replace(one, subjects=tuple(filter(keep, one.subjects))) for name, one in results.items()}
    before, after = (
        [session.participant for one in some.values() for session in one.subjects] for some in (results, kept)
    )
    return kept, Quality(Rules(), len({*before}), len({*after}), len(before), len(after), (), ())


def _sessions(results: Results) -> dict[str, Tested]:
    """Return the threshold of each session."""
    return {
        ", ".join(filter(None, [session.participant, session.session, name])): Tested(session.interval, n=1)
        for name, result in results.items()
        for session in result.subjects
    }
