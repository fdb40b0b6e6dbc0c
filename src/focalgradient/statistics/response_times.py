"""Response times with the answer as a covariate.

Fast and slow trials differ in their answers; a condition that changes the answers therefore changes the mean response
time. Regressing each person's log response time on condition and answer separates the two effects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from focalgradient.errors import InputError
from focalgradient.statistics.means import family, paired_effect, t_interval
from focalgradient.statistics.questions import less
from focalgradient.statistics.records import Effect, Interval, NotComputed, line

__all__ = ["ResponseTimes", "response_times"]


METHOD = "log response time, each person's least squares on condition and answer, t-test over people"
METHOD_ALONE = "log response time, each person's means, paired t-test over people"


@dataclass(frozen=True, slots=True, repr=False)
class ResponseTimes:
    """Results of the analysis of response times, in seconds.

    Parameters
    ----------
    times
        Geometric mean over people in each condition, with a 95 % interval.
    effects
        Differences of log time, between conditions at the same answer and between answers in the same condition,
        corrected by Holm as one family; `Effect.ratio` is the ratio of times.
    unadjusted
        Differences between conditions regardless of the answer.
    trials, left_out
        Number of trials analysed, and number without a response time.
    """

    times: Mapping[str, Interval]
    effects: Mapping[str, Effect | NotComputed]
    unadjusted: Mapping[str, Effect | NotComputed]
    trials: int
    left_out: int

    def __repr__(self) -> str:
        """Return a one-line description; `summary` gives the results."""
        return f"<ResponseTimes: {self.trials} trials, {len(self.times)} conditions>"

    def summary(self) -> str:
        """Return times and differences of log time as text, one per line."""
        lines = [f"{name or 'time'}: {one.summary()} s" for name, one in self.times.items()]
        lines += [line(f"log time, {name}", one) for name, one in self.effects.items()]
        lines += [line(f"log time whatever the answer, {name}", one) for name, one in self.unadjusted.items()]
        return "\n".join(lines)


def response_times(table: pd.DataFrame | Mapping[str, ArrayLike]) -> ResponseTimes:
    """Analyse response times with the answer as a covariate.

    Each person's log response times are regressed on condition and answer, and the coefficients are tested over people.
    Conditions of people who gave only one answer are compared without it.

    Parameters
    ----------
    table
        One row per trial, or arrays by name: `participant_id`, `response_time` (s; NaN without an answer), and `answer`
        (at least two different ones), `correct` (True or False), or both; `condition` is optional. Without `answer`,
        the covariate is `correct`.

    Raises
    ------
    InputError
        If a column is missing, a time is not positive, or `correct` is not True or False.

    Examples
    --------
    >>> rng = np.random.default_rng(2)
    >>> who, answer = np.repeat(np.arange(6), 80), rng.integers(0, 2, 480)
    >>> time = np.exp(-0.5 + 0.1 * rng.normal(size=6)[who] + 0.2 * answer + 0.2 * rng.normal(size=480))
    >>> found = response_times({"participant_id": who, "response_time": time, "answer": answer})
    >>> round(found.times[""].estimate, 2), round(found.effects["answer 1 less 0"].estimate, 2)
    (0.62, 0.22)
    """
    rows = _checked(pd.DataFrame(table))
    complete = rows[rows["response_time"].notna()]
    if complete.empty:
        raise InputError("No trial has a response time: give seconds in the column 'response_time'.")
    conditions = list(dict.fromkeys(complete["condition"]))
    answers = sorted(complete["answer"].unique())
    own = {
        str(name): _coefficients(trials, conditions, answers)
        for name, trials in complete.groupby("participant_id", sort=True)
    }
    pairs = {less(other, one): (one, other) for one, other in combinations(conditions, 2)}
    adjusted = {name: _tested([_less(each[0], *pair) for each in own.values()], METHOD) for name, pair in pairs.items()}
    for one, other in combinations(answers, 2):
        adjusted[f"answer {less(other, one)}"] = _tested([_less(each[1], one, other) for each in own.values()], METHOD)
    means = (
        complete.assign(log=np.log(complete["response_time"])).groupby(["participant_id", "condition"])["log"].mean()
    )
    wide = means.unstack().reindex(columns=conditions)
    return ResponseTimes(
        {name: t_interval(wide[name].dropna().to_numpy()).ratio for name in conditions},
        _as_family(adjusted),
        _as_family({k: _tested((wide[b] - wide[a]).tolist(), METHOD_ALONE) for k, (a, b) in pairs.items()}),
        len(complete),
        len(rows) - len(complete),
    )


def _checked(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the columns used, with condition and answer as text."""
    if not {"participant_id", "response_time"} <= set(rows) or not {"answer", "correct"} & set(rows):
        raise InputError(
            f"The table has the columns {', '.join(map(str, rows))}, but needs participant_id, response_time (s), and "
            "answer or correct."
        )
    try:
        times = rows["response_time"].to_numpy(dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError("response_time must be numbers, in seconds; leave missing ones empty.") from error
    wrong = times[(times <= 0) | np.isinf(times)]
    if wrong.size:
        raise InputError(f"response_time has {wrong[0]:g}, but must be above 0 s; leave times that are missing empty.")
    found = pd.DataFrame({"participant_id": rows["participant_id"].astype(str), "response_time": times})
    found["condition"] = rows["condition"].astype(str) if "condition" in rows else ""
    covariate = "answer" if "answer" in rows else "correct"
    given = rows[covariate]
    found["answer"] = given.astype(str) if covariate == "answer" else np.where(given == 1, "right", "wrong")
    if given.isna().any():  # trials without an answer have no response time
        found.loc[given.isna().to_numpy(), "response_time"] = np.nan
    if "correct" in rows:
        known = rows["correct"].isin([True, False]).to_numpy()
        if not known[found["response_time"].notna()].all():
            raise InputError("correct must be true or false (1 or 0) in each trial that has a response time.")
    return found


Coefficients = Mapping[str, float]


def _coefficients(
    trials: pd.DataFrame, conditions: Sequence[str], answers: Sequence[str]
) -> tuple[Coefficients, Coefficients]:
    """Return one person's log times by condition (adjusted for answer) and by answer (adjusted for condition).

    Only differences within either are meaningful. NaN or absent if the person's trials do not determine them.
    """
    where = [name for name in conditions if (trials["condition"] == name).any()]
    which = [name for name in answers if (trials["answer"] == name).any()]
    columns = [trials["condition"] == name for name in where] + [trials["answer"] == name for name in which[1:]]
    design = np.column_stack(columns).astype(float)
    if np.linalg.matrix_rank(design) < design.shape[1]:  # answer and condition are confounded
        return dict.fromkeys(where, math.nan), dict.fromkeys(which, math.nan)
    found = np.linalg.lstsq(design, np.log(trials["response_time"].to_numpy()), rcond=None)[0]
    levels = [0.0, *found[len(where) :].tolist()]
    return dict(zip(where, found.tolist(), strict=False)), dict(zip(which, levels, strict=True))


def _less(values: Coefficients, one: str, other: str) -> float:
    return values.get(other, math.nan) - values.get(one, math.nan)


def _tested(values: Sequence[float], method: str) -> Effect | NotComputed:
    differences = np.asarray(values, dtype=float)
    return paired_effect(differences[np.isfinite(differences)], method)


def _as_family(tests: Mapping[str, Effect | NotComputed]) -> dict[str, Effect | NotComputed]:
    return dict(zip(tests, family(tests.values()), strict=True))
