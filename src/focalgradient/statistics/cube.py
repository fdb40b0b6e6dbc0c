"""Experiment 2: effect of a focal gradient on the reported reading (rigid or nonrigid) of a rotating Necker cube.

Two alternating readings are reported about equally often, whatever their relative strength; the test is therefore of
the odds of *time*. Proportions of time and of reports, and percept durations, describe how it comes about.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError
from focalgradient.statistics.criteria import SHORTEST_BOTH, Rules
from focalgradient.statistics.dominance import DominanceModel, PerceptDurations, fit_dominance
from focalgradient.statistics.durations import (
    DurationFit,
    DurationsOfPeople,
    Family,
    fit_durations,
    fit_durations_of_people,
)
from focalgradient.statistics.exclusions import quality
from focalgradient.statistics.means import paired_effect, share_interval
from focalgradient.statistics.questions import NO_ANSWERS, Analysis, Answer, Answers, Question, in_r, stated
from focalgradient.statistics.records import Effect, Interval, NotComputed, line
from focalgradient.statistics.wording import SPACE, decimals, ratio_ci, statistic
from focalgradient.statistics.wording import size as effect_size
from focalgradient.user_tables.schema import GRADIENTS, PERCEPTS
from focalgradient.user_tables.tidy import report_table

__all__ = [
    "Dominance",
    "GradientEffect",
    "NeckerResult",
    "PeopleDominance",
    "PerceptShare",
    "SubjectShare",
    "cube_questions",
    "necker",
    "own_odds",
    "percepts_in_order",
]

READINGS = ("rigid", "nonrigid")


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


def main_reports(table: pd.DataFrame, shortest_both: float) -> pd.DataFrame:
    """Return a validated copy of a table of reports without catch trials and overlaps of keys: see `necker`."""
    table = report_table(table)
    table = table[~table["catch"]].copy()
    if table.empty:
        raise InputError("All trials are catch trials: there are no reports to analyse.")
    brief = (table["percept"] == "both") & (table["duration"] < shortest_both)
    table["percept"] = table["percept"].mask(brief, "none")
    return table


ODDS = "log odds of the nonrigid reading"
HEADLINE = "odds ratio of the nonrigid reading's time, {level}"
PLAIN = ("none", 0.0)
"""Condition without a gradient."""

SHARES = {
    "of_readings": "share of both readings’ time",
    "time": "share of the time",
    "reports": "share of the reports",
}


def condition_name(condition: tuple[str, float]) -> str:
    """Name a gradient with its strength.

    >>> condition_name(("rigid", 4.0))
    'rigid gradient, 4 mm'
    """
    return f"{condition[0]} gradient, {condition[1]:g} mm"


def _described(shares: tuple[PerceptShare, ...], subjects: Mapping[tuple[str, float], int]) -> Iterator[Answer]:
    """Yield the mean shares of each condition and percept."""
    for share in shares:
        condition = (share.gradient, share.strength)
        for field, name in SHARES.items():
            level = f"{condition_name(condition)}, {share.percept}"
            yield stated(name, level, getattr(share, field), "description", n=subjects[condition])


def cube_questions(
    remarks: list[str], gradients: Iterable[str] = (), largest_mm: float = 0.0, rules: Rules | None = None
) -> Analysis:
    """Return the question about the cube, asked of `own_odds`; notes on the data are appended to `remarks`.

    Parameters
    ----------
    remarks
        List to which notes are appended.
    gradients, largest_mm
        Gradients of the design, and their largest aperture, for the hypotheses; not needed for the answers.
    rules
        Exclusion rules; None: the defaults.

    Examples
    --------
    >>> cube_questions([], ["none", "rigid"], 8.9).hypotheses[0][:63]
    'H1 (primary). Blur that agrees with the rigid reading (8.9 mm) '
    """
    rules = rules or Rules()
    claimed = [(name, verb) for name, verb in (("nonrigid", "raises"), ("rigid", "lowers")) if name in gradients]
    first = claimed[0][0] if claimed else ""

    def sentence(level: str, answers: Answers) -> str:
        tests = answers.to(ODDS)
        gradient = level.partition(" ")[0]
        if level != next(name for name in tests if name.startswith(f"{gradient} ")):  # the largest aperture comes first
            return ""
        test, size = tests[level], level.rpartition(", ")[2]
        blur = f"Blur that agrees with the {gradient} reading ({size})"
        if isinstance(test, NotComputed):
            return f"{blur} was not tested: {test.reason}"
        verb = "was not shown to change" if not test.significant else "raised" if test.estimate > 0 else "lowered"
        shares = answers.to(SHARES["of_readings"])
        without, with_ = (
            f"{decimals(100 * shares[f'{name}, nonrigid'].estimate, 1)}{SPACE}%"
            for name in (condition_name(PLAIN), level)
        )
        return (
            f"{blur} {verb} the nonrigid share of the time (odds ratio {ratio_ci(test)}; {statistic(test)}"
            f"{effect_size(test)}; mean share {without} without, {with_} with it)."
        )

    asked = Question(
        ODDS,
        lambda own: _effects(own, remarks),
        "primary",
        "log odds ratio",
        ODDS,
        HEADLINE,
        ratio=True,
        sentence=sentence,
        hypothesis=tuple(
            f"Blur that agrees with the {name} reading ({largest_mm:g} mm) {verb} the odds of the nonrigid reading "
            "(two-sided test)."
            for name, verb in claimed
        ),
        method=METHOD.format(shortest_both=rules.shortest_both),
        r_code=ODDS_R,
    )
    outcome = (
        "The primary outcome is the log odds of the nonrigid reading (its time over that of the rigid reading) with "
        f"blur that agrees with the {first} reading ({largest_mm:g} mm) less those without blur, one value for each "
        "subject."
    )
    return Analysis(
        [asked],
        outcome,
        prepare=lambda table: own_odds(main_reports(table, rules.shortest_both)),
        exclusions=partial(quality, rules=rules),
    )


METHOD = (
    "The log odds of the nonrigid reading (its time over that of the rigid reading) were computed for each subject "
    "and gradient; half of the mean duration of a report was added to each time, which keeps log odds finite and "
    "reduces their bias. Each gradient was compared with none by a paired t-test over subjects. Primary "
    "is the nonrigid gradient (without one the rigid gradient) at its largest aperture, uncorrected; the others "
    "are secondary, one family by Holm’s method. Intervals are 95 % intervals over subjects by t; "
    "shares of time only describe, with intervals on the log odds of their mean. "
    "Both keys held for less than {shortest_both:g} s counted as a transition, not as a report. Gamma and "
    "log-normal distributions were fitted to the durations of each percept by maximum likelihood, with durations "
    "cut off by the end of a trial as lower limits."
)


ODDS_R = f"""tested <- unique(d[d$gradient != "none", c("gradient", "strength")])
tested <- tested[order(tested$gradient, -tested$strength), ]  # the primary one first
changes <- lapply(paste(tested$gradient, tested$strength), function(name) over_people(odds[, name] - odds[, "none 0"]))
names(changes) <- sprintf("%s gradient, %g mm", tested$gradient, tested$strength)
others <- names(changes)[-1][!sapply(changes[-1], is.character)]  # the primary p is not corrected
holm <- p.adjust(sapply(changes[others], `[[`, "p"), "holm")
for (name in others) changes[[name]] <- c(changes[[name]], p_corrected = holm[[name]])
{in_r(ODDS, "changes", "identity")}"""


def own_odds(table: pd.DataFrame) -> dict[tuple[str, float], pd.DataFrame]:
    """Return each subject's times, reports and log odds of the nonrigid reading, for each gradient and strength.

    Parameters
    ----------
    table
        Valid reports without catch trials.
    """
    summed = _trials(table).groupby(["gradient", "strength", "participant_id"]).sum(numeric_only=True)
    nonrigid, rigid = summed["nonrigid_time"], summed["rigid_time"]
    whole = (nonrigid + rigid).where(nonrigid + rigid > 0)  # NaN without either report
    weight = half_report(table["duration"][table["percept"].isin(READINGS)])
    odds = np.where(whole.notna(), log_odds(nonrigid, rigid, weight), np.nan)
    summed = summed.assign(nonrigid=nonrigid / whole, log_odds=odds)
    conditions = {(str(gradient), float(strength)) for gradient, strength, _ in summed.index}
    order = sorted(conditions, key=lambda key: (GRADIENTS.index(key[0]), key[1]))
    return {condition: pd.DataFrame(summed.xs(condition, level=(0, 1))) for condition in order}


def _trials(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row per trial: time and number of reports of each percept; time without a report is "none"."""
    keys = [name for name in ("participant_id", "session", "trial", "gradient", "strength") if name in table]
    summed = table.groupby([*keys, "percept"])["duration"].agg(time="sum", reports="size").unstack()
    times, reports = (
        pd.DataFrame(summed[what]).reindex(columns=list(PERCEPTS)).fillna(0.0).add_suffix(f"_{what}")
        for what in ("time", "reports")
    )
    lasted = table.groupby(keys)["trial_duration"].first()
    times["none_time"] += (lasted - times.sum(axis=1)).clip(lower=0.0)
    return pd.concat([times, reports], axis=1).assign(lasted=lasted, trials=1).reset_index()


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


def _effects(own: dict[tuple[str, float], pd.DataFrame], remarks: list[str]) -> dict[str, Effect | NotComputed]:
    """Test each gradient against none."""
    tests: dict[str, Effect | NotComputed] = {}
    for gradient, strength in primary_first(own):
        level = condition_name((gradient, strength))
        if PLAIN not in own:
            tests[level] = NotComputed("There are no trials without a gradient to compare with.")
            continue
        what = f"The odds of {gradient} ({strength:g} mm)"
        change = own[gradient, strength]["log_odds"] - own[PLAIN]["log_odds"]
        if change.isna().any():
            remarks.append(
                f"{what} leave out {', '.join(map(str, change.index[change.isna()]))}: neither reading was reported "
                "with it, or with none."
            )
        never = [_never(own[condition]) for condition in ((gradient, strength), PLAIN)]
        if never[0] and never[0] == never[1]:
            tests[level] = NotComputed(f"The {never[0]} reading was never reported: there are no odds to compare.")
            continue
        for reading, when in zip(never, ("with it", "without a gradient"), strict=True):
            if reading:
                remarks.append(
                    f"{what} rest on the half report that is added, as nobody reported the {reading} reading {when}: "
                    "the true ratio is further from 1."
                )
        method = "the subjects' own bias-reduced log odds of time, paired t-test"
        tests[level] = paired_effect(change.dropna(), method)
    return tests


def primary_first(conditions: Iterable[tuple[str, float]]) -> list[tuple[str, float]]:
    """Return gradients with their strengths, the one of the primary hypothesis first.

    >>> primary_first([("rigid", 8.9), ("none", 0.0), ("nonrigid", 4.5), ("nonrigid", 8.9)])
    [('nonrigid', 8.9), ('nonrigid', 4.5), ('rigid', 8.9)]
    """
    gradients = (condition for condition in conditions if condition != PLAIN)
    return sorted(gradients, key=lambda condition: (-GRADIENTS.index(condition[0]), -condition[1]))


def _never(own: pd.DataFrame) -> str | None:
    """Return the reading that no subject reported, if the other was."""
    seen = {reading: bool(own[f"{reading}_time"].any()) for reading in READINGS}
    return None if sum(seen.values()) != 1 else next(reading for reading in READINGS if not seen[reading])


def half_report(durations: pd.Series[float]) -> float:
    """Return half of the mean duration of a report in seconds, which `log_odds` adds; 0.5 s if there are none."""
    return 0.5 * float(durations.mean()) if len(durations) else 0.5


def log_odds(part: ArrayLike, other: ArrayLike, weight: float) -> NDArray[np.float64]:
    """Return log odds of two times (s) after adding half a report to each (Haldane 1956; Anscombe 1956).

    Finite if one is zero. As for counts, it removes the first-order bias of log odds: a report of mean duration takes
    the place of an observation.

    >>> log_odds([10.0, 0.0], [20.0, 30.0], 2.5).round(3)
    array([-0.588, -2.565])
    """
    return np.log((np.asarray(part, float) + weight) / (np.asarray(other, float) + weight))
