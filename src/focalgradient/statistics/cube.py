"""Experiment 2: effect of a focal gradient on the reported reading (rigid or nonrigid) of a rotating Necker cube.

Two alternating readings are reported about equally often, whatever their relative strength; the test is therefore of
the odds of *time*. Proportions of time and of reports, and percept durations, describe how it comes about.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from focalgradient.statistics.criteria import SHORTEST_BOTH
from focalgradient.statistics.cube_questions import (
    ODDS,
    READINGS,
    SHARES,
    condition_name,
    cube_questions,
    main_reports,
    own_odds,
    primary_first,
)
from focalgradient.statistics.dominance import DominanceModel, PerceptDurations, fit_dominance
from focalgradient.statistics.durations import (
    DurationFit,
    DurationsOfPeople,
    Family,
    fit_durations,
    fit_durations_of_people,
)
from focalgradient.statistics.means import share_interval
from focalgradient.statistics.questions import NO_ANSWERS, Answer, Answers, stated
from focalgradient.statistics.records import Effect, Interval, NotComputed, line
from focalgradient.user_tables.schema import PERCEPTS

__all__ = [
    "Dominance",
    "GradientEffect",
    "NeckerResult",
    "PeopleDominance",
    "PerceptShare",
    "SubjectShare",
    "necker",
    "percepts_in_order",
]


@dataclass(frozen=True, slots=True)
class SubjectShare:
    """Nonrigid proportion of one subject with one gradient.

    Parameters
    ----------
    participant_id, gradient, strength
        Subject and condition (strength: aperture in mm).
    trials, reports
        Number of trials, and of rigid or nonrigid reports in them.
    nonrigid
        Nonrigid fraction of the time reported as rigid or nonrigid; None without either report.
    log_odds
        Bias-reduced log odds of the same times (`log_odds`); None without either report.
    """

    participant_id: str
    gradient: str
    strength: float
    trials: int
    reports: int
    nonrigid: float | None
    log_odds: float | None


@dataclass(frozen=True, slots=True)
class PerceptShare:
    """Proportion of one percept with one gradient, averaged over subjects.

    Parameters
    ----------
    gradient, strength, percept
        Condition and percept.
    time
        Mean proportion of trial time, with a 95 % interval over subjects (Student's t on log odds, so that the ends lie
        within 0 and 1; no interval if all subjects have 0, or 1). Time without a report counts as "none".
    of_readings
        Mean proportion of the time with one of the two readings, with its interval; not computed for other percepts.
    reports
        Mean proportion of the reports other than "none", with its interval.
    """

    gradient: str
    strength: float
    percept: str
    time: Interval
    of_readings: Interval | NotComputed
    reports: Interval | NotComputed


@dataclass(frozen=True, slots=True)
class Dominance:
    """Distribution of the durations of one percept with one gradient, pooled over subjects.

    Parameters
    ----------
    gradient, strength, percept
        Condition and percept.
    reports, censored
        Number of reports, and number censored by the end of the trial.
    gamma, lognormal
        Fits to the durations, with censored durations as lower limits.
    better
        Family with the larger likelihood.
    """

    gradient: str
    strength: float
    percept: str
    reports: int
    censored: int
    gamma: DurationFit | NotComputed
    lognormal: DurationFit | NotComputed
    better: Family | None


@dataclass(frozen=True, slots=True)
class PeopleDominance:
    """Distribution of the durations of one percept with one gradient, with a separate mean for each subject.

    Parameters
    ----------
    gradient, strength, percept
        Condition and percept.
    fit
        Gamma distributions with a common shape; durations censored by the end of the trial are lower limits.
    """

    gradient: str
    strength: float
    percept: str
    fit: DurationsOfPeople | NotComputed


@dataclass(frozen=True, slots=True)
class GradientEffect:
    """Effect of one gradient relative to none.

    Parameters
    ----------
    gradient, strength
        Condition.
    odds_of_time
        Log odds ratio of the time of the nonrigid reading: mean of the bias-reduced within-subject values
        (`log_odds`), by a paired t-test. The first effect of a result is primary: the nonrigid gradient (without one
        the rigid gradient) at its largest strength, uncorrected. The others are secondary, one family by Holm.
    """

    gradient: str
    strength: float
    odds_of_time: Effect | NotComputed


@dataclass(frozen=True, slots=True, repr=False)
class NeckerResult:
    """Results of the reports on the cube.

    Parameters
    ----------
    participants
        Participant names, sorted.
    trials, reports
        Number of trials and reports analysed, without catch trials.
    subject_shares, shares, dominance, effects
        Results by subject, averaged over subjects, of percept durations, and of each gradient relative to none (the
        primary one first).
    remarks
        Omissions and their reasons, one sentence each.
    people
        Durations of both readings without a gradient, or with the weakest one if there is no such trial.
    over_people
        Log-normal model of the same durations for both readings together, in which median, spread and preference vary
        over people; None if durations were not requested.
    answers
        All effects, by question and condition.
    """

    participants: tuple[str, ...]
    trials: int
    reports: int
    subject_shares: tuple[SubjectShare, ...]
    shares: tuple[PerceptShare, ...]
    dominance: tuple[Dominance, ...]
    effects: tuple[GradientEffect, ...]
    remarks: tuple[str, ...]
    people: tuple[PeopleDominance, ...]
    over_people: DominanceModel | NotComputed | None = None
    answers: Answers = NO_ANSWERS

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<NeckerResult: {len(self.participants)} subjects, {self.reports} reports in {self.trials} trials>"

    def summary(self) -> str:
        """Return the log odds ratio of the nonrigid time with each gradient as text, one per line."""
        lines = [f"{len(self.participants)} subjects, {self.reports} reports in {self.trials} trials"]
        lines += [
            line(f"log odds of nonrigid time, {one.gradient!r} at {one.strength:g} less none", one.odds_of_time)
            for one in self.effects
        ]
        return "\n".join(lines)


def necker(table: pd.DataFrame, *, shortest_both: float = SHORTEST_BOTH, durations: bool = True) -> NeckerResult:
    """Analyse reports on the rotating Necker cube.

    Parameters
    ----------
    table
        One row per report: see `focalgradient.user_tables.tidy.report_table`. Catch trials are excluded.
    shortest_both
        Minimum duration in seconds of a "both" report; a shorter overlap of the keys is a transition and counts as
        "none".
    durations
        True to fit distributions to the durations, which takes most of the time; otherwise `dominance` and `people` are
        empty.

    Returns
    -------
    NeckerResult
        Results that cannot be computed are `NotComputed`, with the reason.

    Raises
    ------
    InputError
        If the table is invalid; the message states the row.

    Examples
    --------
    >>> rows = [
    ...     {"participant_id": who, "trial": trial, "gradient": gradient, "strength": 10.0 * trial, "catch": False,
    ...      "onset": onset, "duration": lasts, "percept": percept, "censored": False, "trial_duration": 10.0}
    ...     for who in range(4)
    ...     for trial, (gradient, rigid) in enumerate([("none", 8.0), ("nonrigid", 5.0 - 0.5 * who)])
    ...     for onset, lasts, percept in [(0.0, rigid, "rigid"), (rigid, 10 - rigid, "nonrigid")]
    ... ]
    >>> found = necker(pd.DataFrame(rows))
    >>> found
    <NeckerResult: 4 subjects, 16 reports in 8 trials>
    >>> print(found.summary())  # doctest: +ELLIPSIS
    4 subjects, 16 reports in 8 trials
    log odds of nonrigid time, 'nonrigid' at 10 less none: 1.049, 95 % interval 0.772 to 1.327, t(3) = 12.03, ...
    """
    table = main_reports(table, shortest_both)
    reported = table[table["percept"].isin(READINGS)]
    own = own_odds(table)
    conditions = list(own)
    remarks: list[str] = []
    tests = cube_questions(remarks).answers(own)
    shares = tuple(share for condition, rows in own.items() for share in _shares(condition, rows))
    return NeckerResult(
        participants=tuple(sorted(set(table["participant_id"]))),
        trials=int(sum(rows["trials"].sum() for rows in own.values())),
        reports=len(reported),
        subject_shares=tuple(
            SubjectShare(
                str(participant),
                gradient,
                strength,
                int(row["trials"]),
                int(row["rigid_reports"] + row["nonrigid_reports"]),
                *(None if np.isnan(row[name]) else float(row[name]) for name in ("nonrigid", "log_odds")),
            )
            for (gradient, strength), rows in own.items()
            for participant, row in rows.iterrows()
        ),
        shares=shares,
        dominance=tuple(
            _dominance(condition, percept, reported) for condition in conditions for percept in READINGS if durations
        ),
        effects=tuple(
            GradientEffect(*condition, tests.to(ODDS)[condition_name(condition)]) for condition in primary_first(own)
        ),
        remarks=tuple(remarks),
        people=tuple(_people(conditions[0], percept, reported) for percept in READINGS if durations),
        over_people=_over_people(conditions[0], reported) if durations else None,
        answers=Answers((*tests, *_described(shares, {condition: len(rows) for condition, rows in own.items()}))),
    )


def _described(shares: tuple[PerceptShare, ...], subjects: Mapping[tuple[str, float], int]) -> Iterator[Answer]:
    """Yield the mean shares of each condition and percept."""
    for share in shares:
        condition = (share.gradient, share.strength)
        for field, name in SHARES.items():
            level = f"{condition_name(condition)}, {share.percept}"
            yield stated(name, level, getattr(share, field), "description", n=subjects[condition])


def _of(rows: pd.DataFrame, condition: tuple[str, float]) -> pd.Series[bool]:
    return (rows["gradient"] == condition[0]) & (rows["strength"] == condition[1])


def _shares(condition: tuple[str, float], own: pd.DataFrame) -> list[PerceptShare]:
    whole = own[[f"{percept}_time" for percept in PERCEPTS]].sum(axis=1)
    counted = own[[f"{percept}_reports" for percept in PERCEPTS if percept != "none"]].sum(axis=1)
    shares = []
    for percept in PERCEPTS:
        reports: Interval | NotComputed
        if percept == "none":
            reports = NotComputed("Holding no key is not a report.")
        elif not counted.any():
            reports = NotComputed("There are no reports.")
        else:
            reports = share_interval((own[f"{percept}_reports"] / counted)[counted > 0])
        time = share_interval(own[f"{percept}_time"] / whole)
        shares.append(PerceptShare(*condition, percept, time, _of_readings(own, percept), reports))
    return shares


def _of_readings(own: pd.DataFrame, percept: str) -> Interval | NotComputed:
    if percept not in READINGS:
        return NotComputed("It is neither of the two readings.")
    nonrigid = own["nonrigid"].dropna()
    if nonrigid.empty:
        return NotComputed("Neither reading was reported.")
    return share_interval(nonrigid if percept == "nonrigid" else 1 - nonrigid)


def _dominance(condition: tuple[str, float], percept: str, reported: pd.DataFrame) -> Dominance:
    rows = reported[_of(reported, condition) & (reported["percept"] == percept)]
    families: tuple[Family, Family] = ("gamma", "lognormal")
    gamma, lognormal = (fit_durations(rows["duration"], rows["censored"], family) for family in families)
    better: Family | None = None
    if isinstance(gamma, DurationFit) and isinstance(lognormal, DurationFit):
        better = "gamma" if gamma.log_likelihood >= lognormal.log_likelihood else "lognormal"
    return Dominance(*condition, percept, len(rows), int(rows["censored"].sum()), gamma, lognormal, better)


def _people(condition: tuple[str, float], percept: str, reported: pd.DataFrame) -> PeopleDominance:
    rows = reported[_of(reported, condition) & (reported["percept"] == percept) & (reported["duration"] > 0)]
    return PeopleDominance(
        *condition, percept, fit_durations_of_people(rows["duration"], rows["censored"], rows["participant_id"])
    )


def percepts_in_order(reported: pd.DataFrame) -> tuple[pd.DataFrame, NDArray[np.bool_]]:
    """Return the reports of either reading in the order of report, and which are the first of their trial.

    The column `reading` is 0.5 for the rigid reading, -0.5 for the nonrigid one.
    """
    rows = reported[reported["percept"].isin(READINGS) & (reported["duration"] > 0)]
    keys = [name for name in ("participant_id", "session", "trial") if name in rows]
    rows = rows.sort_values([*keys, "onset"], kind="stable")
    return rows.assign(reading=np.where(rows["percept"] == "rigid", 0.5, -0.5)), ~rows.duplicated(keys).to_numpy()


def _over_people(condition: tuple[str, float], reported: pd.DataFrame) -> DominanceModel | NotComputed:
    rows, first = percepts_in_order(reported[_of(reported, condition)])
    trial = rows[first].groupby("participant_id").cumcount() + 1
    return fit_dominance(
        PerceptDurations(
            seconds=rows["duration"].to_numpy(),
            censored=rows["censored"].to_numpy(),
            participant=rows["participant_id"].to_numpy(),
            reading=rows["reading"].to_numpy(),
            trial=np.asarray(trial.reindex(rows.index).ffill(), float),
            first=first,
        )
    )
