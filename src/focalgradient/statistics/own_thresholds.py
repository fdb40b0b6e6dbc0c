"""Import of threshold data, correct or incorrect answers at stimulus levels, from the user's own table."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import binom

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.statistics.own_files import Paths, read_table
from focalgradient.statistics.own_names import ABSENT, clean, few, place, rows_named
from focalgradient.statistics.own_numbers import numbers
from focalgradient.statistics.own_rows import without_codes
from focalgradient.statistics.own_tables import (
    PARTICIPANT,
    Source,
    Where,
    answered,
    catch_trials,
    columns_like,
    completed,
    folded,
    found_columns,
    truths,
)

__all__ = ["OwnThresholds", "holds_thresholds", "read_thresholds"]

ROLES = {
    "participant_id": PARTICIPANT,
    "level": ("intensity", "stimulus_level", "stim_level", "blur_level", "defocus", "defocus_d", "contrast", "delta"),
    "correct": ("right", "hit", "hits", "accuracy", "acc", "is_correct", "n_correct", "ncorrect", "num_correct"),
    "interval": ("target_interval", "signal_interval", "test_interval", "target", "correct_interval", "correct_answer"),
    "response": ("answer", "chosen", "choice", "resp", "chosen_interval", "response_interval"),
    "trials": ("n", "n_trials", "ntrials", "num_trials", "shown", "total"),
    "alternatives": ("intervals", "n_alternatives", "n_intervals", "nafc", "mafc", "n_afc"),
    "condition": ("group", "cond"),
    "session": (),
    "catch": (),
    "trial": (),
    "kind": (),
}
"""Required and optional columns, each with the names recognised automatically."""

WORDS = {
    **dict.fromkeys(("correct", "right", "hit", "richtig", "juste"), True),
    **dict.fromkeys(("incorrect", "wrong", "error", "miss"), False),
}
"""Recognised words for correct and incorrect answers."""

UNIT = re.compile(r"(?:[\s_(\[]|^)(dioptres?|diopters?|D|mm|deg|arcmin|arcsec|px|pixels?|%|cpd|ms|s)[\s)\]]*$")
"""Unit at the end of a column name."""

MAX_P_OF_TWO_ALTERNATIVES = 0.001
"""p value (times the number of levels) of so few correct answers with two alternatives, below which a guess rate of one
half is rejected; 1 in 1,000 tables with two alternatives is rejected wrongly (our choice).
"""

LOWEST_SHARE = 0.4
"""Share of correct answers at the lowest level below which two alternatives are not assumed."""

FEWEST = 20
"""Minimum number of trials at the lowest level by which its share is judged."""

RATE_TOLERANCE = 0.005
"""Tolerance for rounding in a guess rate of 1 / m, such as 0.33 for a third."""

MAX_TRIALS = 1_000_000
"""Maximum number of trials that the counts may represent."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnThresholds:
    """Imported threshold data, in the form that `focalgradient.statistics.blur_thresholds` accepts.

    Parameters
    ----------
    table
        One row per trial: participant_id, session, condition, level, correct, catch, kind. The index contains file and
        row.
    unit
        Unit of the levels from the column name; "" without one.
    notes
        Assumptions, omissions and changes, one sentence each.
    notices
        Interpretations that change the results, one sentence each, shown at the top of a report.
    guess
        Guess rate: proportion of correct answers without a stimulus.
    """

    table: pd.DataFrame
    unit: str
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()
    guess: float = 0.5


def holds_thresholds(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table contains answers at levels (correct/incorrect, or chosen intervals), and no ratings."""
    columns = columns or {}
    if {"rating", "percept", "aperture", "fixation"} & set(columns):
        return False
    table = read_table(path)
    names = {clean(str(name)).casefold() for name in table.cells}
    if not names.isdisjoint(("rating", "percept")):
        return False
    ours = {role: name for role, name in columns.items() if role in (*ROLES, "participant")}
    found = _columns(table.name, table.cells, ours)
    return "level" in found and ("correct" in found or {"interval", "response"} <= set(found))


def read_thresholds(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    guess: float | None = None,
    where: Where | None = None,
) -> OwnThresholds:
    r"""Read threshold data from a CSV, TSV or XLSX file, with one row per trial or one row per level with counts.

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set.
    columns
        Name in the file of each column: participant, level (above 0), and correct (0 or 1); or for two intervals,
        interval (the correct one) and response (the chosen one). Optionally condition, session, catch; and trials, the
        number of trials of which `correct` is the number of correct ones.
    conditions
        Meanings of the file's own words in correct, interval and response: {"richtig": "1", "links": "first"}.
    guess
        Guess rate, from 0 to below 1. None: 1 / m from a column `alternatives` with m in each row, else one half,
        unless the answers contradict it.
    where
        Values by column: only rows that have one of them are read.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid (the message names it), or the guess rate cannot be determined.

    Examples
    --------
    >>> from focalgradient.statistics.own_files import text_table
    >>> own = read_thresholds(text_table("subject;level (D);interval;response\nA;0,1;1;2\nA;0,2;2;2\n"))
    >>> own.table[["participant_id", "level", "correct"]].values.tolist(), own.unit
    ([['A', 0.1, False], ['A', 0.2, True]], 'D')
    """
    own = Source.read(path, ROLES, columns, where)
    own.columns.update(_columns(own.name, own.cells, columns or {}))
    _check_columns(own)
    table = own.rows(["level", "correct", "trials", "alternatives"], ["level"])
    table = _levels(own, table)
    table = _right(own, table, folded(conditions))
    table = completed(catch_trials(table, own.notes), "session", "condition", "kind")
    kept = ["participant_id", "session", "condition", "level", "correct", "catch", "kind"]
    rate = _guess(own, table, guess)
    return OwnThresholds(table[kept].copy(), _unit(own.columns["level"]), tuple(own.notes), tuple(own.notices), rate)


def _check_columns(own: Source) -> None:
    """Raise `InputError` that names the missing columns."""
    missing = [role for role in ("interval", "response") if role not in own.columns]
    answers = ["correct"] if missing and "correct" not in own.columns else []
    other = f", or the right one of two intervals and the one chosen ({columns_like(*missing)})" if answers else ""
    own.require("participant_id", "level", *answers, otherwise=other)


def _guess(own: Source, table: pd.DataFrame, given: float | None) -> float:
    """Return the given guess rate, that of the alternatives, or one half if the answers are consistent with it."""
    if given is not None and not 0 <= given < 1:
        raise InputError(f"guess is {given:g}, but must be a rate from 0 to below 1, like 0.25 for four alternatives.")
    stated = 0.5 if "interval" in table and "response" in table else None
    if "alternatives" in table:
        counts = numbers(table, "alternatives", table["alternatives"])
        if counts.nunique() != 1 or counts.iloc[0] < 2 or counts.iloc[0] % 1:
            raise InputError(
                f"{own.name} has the alternatives {few(sorted(map(str, counts.unique())))}, but must have one "
                "whole number of 2 or more in all rows: analyse each by itself."
            )
        stated = 1 / float(counts.iloc[0])
    if given is not None and stated is not None and abs(given - stated) > RATE_TOLERANCE:
        raise InputError(f"guess is {given:g}, but the table's alternatives give {stated:.3g}: leave one of them out.")
    if given is not None:
        return given
    if stated is not None:
        return stated
    at_level = _below_half(table)
    below, at = at_level or _below_guess(table), "at" if at_level else "up to"
    if below is not None:
        level, right, shown = below
        raise InputError(
            f"{own.name}: {at} level {level:g} {right} of {shown} answers are right, fewer than guessing among "
            "two gives, so the guess rate is not known: give it, 0.5 for a staircase with two alternatives, 0.25 for "
            "four and 0 for yes and no, or a column alternatives."
        )
    own.notes.append("The guess rate was taken to be one half, as of two alternatives.")
    return 0.5


def _below_guess(table: pd.DataFrame) -> tuple[float, int, int] | None:
    """Return level, correct answers and trials if those at the lowest levels have a share below `LOWEST_SHARE`.

    Levels are counted upwards until there are `FEWEST` trials, as staircases show each level a few times.
    """
    counted = table[~table["catch"]].groupby("level")["correct"].agg(["sum", "count"]).cumsum()
    enough = counted[counted["count"] >= FEWEST]
    if enough.empty or enough["sum"].iloc[0] / enough["count"].iloc[0] >= LOWEST_SHARE:
        return None
    return float(enough.index[0]), int(enough["sum"].iloc[0]), int(enough["count"].iloc[0])


def _below_half(table: pd.DataFrame) -> tuple[float, int, int] | None:
    """Return level, correct answers and trials if two alternatives are improbable at some level, else None."""
    counted = table[~table["catch"]].groupby("level")["correct"].agg(["sum", "count"])
    p = np.atleast_1d(binom.cdf(counted["sum"].to_numpy(), counted["count"].to_numpy(), 0.5)) * len(counted)
    at = int(np.argmin(p)) if len(p) else 0
    if not len(p) or p[at] >= MAX_P_OF_TWO_ALTERNATIVES:
        return None
    return float(counted.index[at]), int(counted["sum"].iloc[at]), int(counted["count"].iloc[at])


def _columns(name: str, table: pd.DataFrame, columns: Mapping[str, str]) -> dict[str, str]:
    """Return the file's column for each role; the level column may end with a unit."""
    theirs = found_columns(name, table, ROLES, columns)
    if "level" not in theirs:
        bare = {_bare(str(name)): str(name) for name in table if str(name) not in theirs.values()}
        found = next((bare[one] for one in ("level", *ROLES["level"], "blur") if one in bare), None)
        if found is not None:
            theirs["level"] = found
    return theirs


def _bare(header: str) -> str:
    """Remove unit and logarithm from a column name.

    >>> _bare("Level (D)"), _bare("blur_mm"), _bare("log10_level"), _bare("level (dB)")
    ('level', 'blur', 'level', 'level')
    """
    name = (UNIT.sub("", clean(header)) or header).strip(" _([").casefold()
    return re.sub(r"^(log10|log|ln|db)[ _-]+|[ _(\[]+(db|log10|log|ln)[\])]*$", "", name)


def _unit(header: str) -> str:
    found = UNIT.search(header)
    if found is None:
        return ""
    return "D" if found.group(1).lower().startswith("diopt") else found.group(1)


def _levels(own: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with a level above 0, parsed as numbers."""
    table = without_codes(table, "level", own.notices, signed=True)
    table = answered(own, table, "level", "level")
    table["level"] = _amounts(own, table)
    if (table["level"] < 0).any():
        below = table["level"] < 0
        raise InputError(
            f"{place(table, below)}: level is {table['level'][below].iloc[0]:g}, but must be above 0, as thresholds "
            "are sought on its logarithm: give amounts (of decibels or log units the antilogarithm)."
        )
    none = table["level"] == 0
    if none.all():
        raise InputError(f"{own.name} holds no level above 0: give the amounts that were shown.")
    if none.any():
        own.notices.append(
            f"Trials of level 0 were excluded ({rows_named(table, none)}): without a stimulus all guess."
        )
    table = table[~none].copy()
    if table["level"].nunique() < 2:
        raise InputError(
            f"{own.name} has the one level {table['level'].iloc[0]:g}, but a threshold needs several: give "
            "answers at two levels or more."
        )
    return table


LOGARITHMS = {"log10": 10.0, "ln": math.e}
"""Bases of logarithms that a heading of levels may state."""


def _amounts(own: Source, table: pd.DataFrame) -> pd.Series[float]:
    """Return the levels as amounts: logarithms with a stated base are converted, others are refused."""
    values = numbers(table, "level", table["level"], own=own)
    header = own.columns["level"]
    words = re.findall(r"[a-z]+\d*", clean(header).casefold())
    for word in words:
        if word in LOGARITHMS:
            own.notices.append(
                f"The column {header} holds logarithms: levels are {word} undone, and so are thresholds."
            )
            return pd.Series(LOGARITHMS[word] ** values)
        if word in ("log", "db", "decibel", "decibels", "logmar", "logcs") or word.startswith("log"):
            raise InputError(
                f"the heading {printable(header)!r} says that levels are in {word}, but they must be amounts above 0, "
                "as thresholds are sought on their logarithm: convert them, or name the column log10_level."
            )
    return values


def _right(own: Source, table: pd.DataFrame, words: Mapping[str, str]) -> pd.DataFrame:
    """Return the answered rows, one per trial, with `correct` as a boolean."""
    if "correct" not in table:
        return _of_intervals(own, table, words)
    table = answered(own, table, "correct", "answer")
    if "trials" in table:
        return _of_counts(own, table)
    expected = (
        '1 for a right and 0 for a wrong answer: give the words\' meaning with conditions={"NAME": "1"}, or the counts '
        "of trials in a column of its own (trials)"
    )
    return table.assign(correct=truths(table, "correct", WORDS, words, expected))


def _of_counts(own: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Expand counts of trials and of correct answers to one row per trial."""
    right = numbers(table, "correct", table["correct"])
    shown = numbers(table, "trials", table["trials"])
    wrong = (shown < 0) | (right < 0) | (right > shown) | (right % 1 != 0) | (shown % 1 != 0)
    if wrong.any():
        raise InputError(
            f"{place(table, wrong)}: correct is {right[wrong].iloc[0]:g} of {shown[wrong].iloc[0]:g} trials, but must "
            "be a whole number of them."
        )
    if shown.sum() > MAX_TRIALS:
        raise InputError(f"There are {shown.sum():,.0f} trials, but may be {MAX_TRIALS:,} at most.")
    own.notes.append("Each row holds a number of trials, and how many were right.")
    counts = shown.astype(int).to_numpy()
    number = np.concatenate([np.arange(count) for count in counts])
    whole = table.iloc[np.repeat(np.arange(len(table)), counts)]
    return whole.assign(correct=number < np.repeat(right.to_numpy(), counts))


def _of_intervals(own: Source, table: pd.DataFrame, words: Mapping[str, str]) -> pd.DataFrame:
    """Set `correct` if the chosen interval is the correct one."""
    table = answered(own, table, "response", "answer")
    asked, given = (
        table[role].str.casefold().map(lambda cell: re.sub(r"[.,]0+$", "", words.get(cell, cell)))
        for role in ("interval", "response")
    )
    known = sorted(set(asked) - ABSENT)
    if len(known) > 2:
        raise InputError(f"{own.name} has the intervals {few(known)}, but must have two: give a column correct.")
    strange = ~given.isin(known) | asked.isin(list(ABSENT))
    one_sided = (
        len(known) == 1 and strange.any() and given[strange].nunique() == 1 and not asked.isin(list(ABSENT)).any()
    )
    if strange.any() and not one_sided:
        word = printable(table["response"][strange].iloc[0])
        raise InputError(
            f"{place(table, strange)}: response is {word!r}, but the intervals are {few(known)}: "
            f'give the words\' meaning with conditions={{"NAME": "{(known or ["1"])[0]}"}}.'
        )
    own.notes.append("An answer is right where the interval chosen is the one given as right.")
    return table.assign(correct=(asked == given).to_numpy())
