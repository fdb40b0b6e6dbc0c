"""Question about the rotating Necker cube: change of the odds of the nonrigid reading with each focal gradient."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.statistics.criteria import OF_CUBE, Rules
from focalgradient.statistics.exclusions import quality
from focalgradient.statistics.means import paired_effect
from focalgradient.statistics.questions import Analysis, Answers, Question, in_r
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import SPACE, decimals, ratio_ci, statistic
from focalgradient.statistics.wording import size as effect_size
from focalgradient.user_tables.schema import GRADIENTS, PERCEPTS
from focalgradient.user_tables.tidy import report_table

__all__ = [
    "ODDS",
    "PLAIN",
    "READINGS",
    "SHARES",
    "condition_name",
    "cube_questions",
    "main_reports",
    "own_odds",
    "primary_first",
]

READINGS = ("rigid", "nonrigid")

ODDS = "log odds of the nonrigid reading"
HEADLINE = "odds ratio of the nonrigid reading's time, {level}"
PLAIN = ("none", 0.0)
"""Condition without a gradient."""

MOST_UNEQUAL = 1.25
"""Ratio of the times of two conditions from which the report warns: at 3 (bias 12 to 1), .5 of experiments without an
effect are significant.
"""

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
        outcome if claimed else "",
        prepare=lambda table: own_odds(main_reports(table, rules.shortest_both)),
        exclusions=partial(quality, rules=rules),
        kind="cube",
        rules=OF_CUBE,
        choices=("exclusions", "odds", "holm"),
    )


def cube_questions_of(table: pd.DataFrame, rules: Rules | None = None) -> Analysis:
    """Return the question about the gradients in a table of reports."""
    shown = table[~table["catch"]]
    largest = 0.0 if shown.empty else float(shown["strength"].max())
    return cube_questions([], {*shown["gradient"]}, largest, rules)


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


def main_reports(table: pd.DataFrame, shortest_both: float) -> pd.DataFrame:
    """Return a validated copy of a table of reports without catch trials and overlaps of keys: see `necker`."""
    table = report_table(table)
    table = table[~table["catch"]].copy()
    if table.empty:
        raise InputError("All trials are catch trials: there are no reports to analyse.")
    brief = (table["percept"] == "both") & (table["duration"] < shortest_both)
    table["percept"] = table["percept"].mask(brief, "none")
    return table


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
        ratio = float((own[gradient, strength]["lasted"] / own[PLAIN]["lasted"]).median())
        if max(ratio, 1 / ratio) > MOST_UNEQUAL:
            remarks.append(
                f"{what} are of {ratio:.2g} times the time without a gradient: the half report that is added draws "
                "the odds of the shorter time further towards 1, which alone can be a difference where one reading "
                "prevails. Choose as many trials of each by where."
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


def log_odds(part: ArrayLike, other: ArrayLike, weight: float) -> FloatArray:
    """Return log odds of two times (s) after adding half a report to each (Haldane 1956; Anscombe 1956).

    Finite if one is zero. As for counts, it removes the first-order bias of log odds: a report of mean duration takes
    the place of an observation.

    >>> log_odds([10.0, 0.0], [20.0, 30.0], 2.5).round(3)
    array([-0.588, -2.565])
    """
    return np.log((np.asarray(part, float) + weight) / (np.asarray(other, float) + weight))
