"""Answers at levels from a table of one's own, right or wrong, or in one of two intervals; for thresholds."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import binom

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.statistics.own_names import clean, rows_named
from focalgradient.statistics.own_rows import without_codes
from focalgradient.statistics.own_tables import (
    ABSENT,
    PARTICIPANT,
    answered,
    catch_trials,
    columns_like,
    few,
    found_columns,
    no_column,
    numbers,
    place,
    read_table,
    unused,
    with_participants,
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
"""Our columns, and the names by which they are found where the caller does not give them."""

WORDS = {
    **dict.fromkeys(("1", "true", "yes", "y", "t", "correct", "right", "hit", "1.0", "richtig", "juste"), True),
    **dict.fromkeys(("0", "false", "no", "n", "f", "incorrect", "wrong", "error", "miss", "0.0", "falsch"), False),
}
"""Words of right and wrong answers."""

UNIT = re.compile(r"(?:[\s_(\[]|^)(dioptres?|diopters?|D|mm|deg|arcmin|arcsec|px|pixels?|%|cpd|ms|s)[\s)\]]*$")
"""A unit at the end of a column's name."""

IMPROBABLE = 0.001
"""Probability, times the number of levels, of as few right answers by guessing among two; below, the rate is another.
Our choice: one table in a thousand of two alternatives is refused."""

RATE_NEAR = 0.005
"""Difference between a guess rate and 1 / m that rounding explains: 0.33 for a third."""

MOST_TRIALS = 1_000_000
"""Trials that counts may stand for."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnThresholds:
    """A table of one's own as `focalgradient.statistics.blur_thresholds` takes it.

    Parameters
    ----------
    table
        One row a trial: participant_id, session, condition, level, correct, catch and kind. The index gives file and
        row.
    unit
        Of the levels, as the column's name has it; "" where it has none.
    notes
        What was assumed, left out or changed, a sentence each.
    notices
        What was taken otherwise than it stands, and changes the results, a sentence each: for the top of a report.
    guess
        Share of right answers without a stimulus.
    """

    table: pd.DataFrame
    unit: str
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()
    guess: float = 0.5


def holds_thresholds(path: str | os.PathLike[str], columns: Mapping[str, str] | None = None) -> bool:
    """Whether a table is of answers at levels: right or wrong, or of two intervals, and none of ratings is named."""
    columns = columns or {}
    if {"rating", "percept", "aperture", "fixation"} & set(columns):
        return False
    path = Path(path)
    table = read_table(path)
    names = {clean(str(name)).casefold() for name in table}
    if not names.isdisjoint(("rating", "percept")):
        return False
    ours = {role: name for role, name in columns.items() if role in (*ROLES, "participant")}
    found = _columns(path, table, ours)
    return "level" in found and ("correct" in found or {"interval", "response"} <= set(found))


def read_thresholds(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    guess: float | None = None,
) -> OwnThresholds:
    r"""Read answers at levels from a CSV, TSV or XLSX file, a row a trial or a row for each level's counts.

    Parameters
    ----------
    path
        Commas, semicolons or tabs between the cells; decimal points or commas.
    columns
        The file's name of each of our columns: participant, level (above 0), and correct (0 or 1); or, of two
        intervals, interval (which was right) and response (which was chosen). Where there are such, condition,
        session and catch; and trials, the number of trials of which `correct` counts the right ones.
    conditions
        Our word for each of the file's in correct, interval and response: {"richtig": "1", "links": "first"}.
    guess
        Share of right answers without a stimulus, from 0 to below 1. None: 1 / m of a column `alternatives` with m in
        each row, else one half, unless the answers contradict it.

    Raises
    ------
    InputError
        If a column is missing or a cell cannot be understood: it is named. Or if the guess rate is not known.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "own.csv")
    ...     _ = file.write_text("subject;level (D);interval;response\nA;0,1;1;2\nA;0,2;2;2\n")
    ...     own = read_thresholds(file)
    >>> own.table[["participant_id", "level", "correct"]].values.tolist(), own.unit
    ([['A', 0.1, False], ['A', 0.2, True]], 'D')
    """
    path = Path(path)
    notes: list[str] = []
    notices: list[str] = []
    table = read_table(path)
    theirs = _columns(path, table, columns or {})
    notes += unused([str(name) for name in table if name not in theirs.values()])
    table = pd.DataFrame({role: table[name] for role, name in theirs.items()}, index=table.index)
    table = with_participants(path, table, theirs, notes, notices)
    table = _levels(path, table, notes, notices)
    table = _right(path, table, _meanings(conditions or {}), notes)
    table = catch_trials(table, notes)
    for role, plain in (("session", ""), ("condition", ""), ("kind", "human")):
        table[role] = table[role].str.strip() if role in table else plain
    kept = ["participant_id", "session", "condition", "level", "correct", "catch", "kind"]
    rate = _guess(path, table, guess, notes)
    return OwnThresholds(table[kept].copy(), _unit(theirs["level"]), tuple(notes), tuple(notices), rate)


def _guess(path: Path, table: pd.DataFrame, given: float | None, notes: list[str]) -> float:
    """The guess rate that was given, that of the alternatives, or one half where the answers allow it."""
    if given is not None and not 0 <= given < 1:
        raise InputError(f"guess is {given:g}, but must be a rate from 0 to below 1, like 0.25 for four alternatives.")
    stated = 0.5 if "interval" in table and "response" in table else None
    if "alternatives" in table:
        counts = numbers(table, "alternatives", table["alternatives"].str.strip())
        if counts.nunique() != 1 or counts.iloc[0] < 2 or counts.iloc[0] % 1:
            raise InputError(
                f"{printable(path)} has the alternatives {few(sorted(map(str, counts.unique())))}, but must have one "
                "whole number of 2 or more in all rows: analyse each by itself."
            )
        stated = 1 / float(counts.iloc[0])
    if given is not None and stated is not None and abs(given - stated) > RATE_NEAR:
        raise InputError(f"guess is {given:g}, but the table's alternatives give {stated:.3g}: leave one of them out.")
    if given is not None:
        return given
    if stated is not None:
        return stated
    below = _below_half(table)
    if below is not None:
        level, right, shown = below
        raise InputError(
            f"{printable(path)}: at level {level:g} {right} of {shown} answers are right, fewer than guessing among "
            "two gives, so the guess rate is not known: give it, like 0.25 for four alternatives and 0 for yes and no, "
            "or a column alternatives."
        )
    notes.append("The guess rate was taken to be one half, as of two alternatives.")
    return 0.5


def _below_half(table: pd.DataFrame) -> tuple[float, int, int] | None:
    """Level, right answers and answers where guessing among two is improbable; None where it is nowhere."""
    counted = table[~table["catch"]].groupby("level")["correct"].agg(["sum", "count"])
    p = np.atleast_1d(binom.cdf(counted["sum"].to_numpy(), counted["count"].to_numpy(), 0.5)) * len(counted)
    at = int(np.argmin(p)) if len(p) else 0
    if not len(p) or p[at] >= IMPROBABLE:
        return None
    return float(counted.index[at]), int(counted["sum"].iloc[at]), int(counted["count"].iloc[at])


def _columns(path: Path, table: pd.DataFrame, columns: Mapping[str, str]) -> dict[str, str]:
    """The file's column for each of ours; that of levels is found with a unit at its end, too."""
    theirs = found_columns(path, table, ROLES, columns)
    if "level" not in theirs:
        bare = {_bare(str(name)): str(name) for name in table if str(name) not in theirs.values()}
        found = next((bare[name] for name in ("level", *ROLES["level"], "blur") if name in bare), None)
        if found is not None:
            theirs["level"] = found
    return theirs


def _bare(header: str) -> str:
    """A column's name without its unit.

    >>> _bare("Level (D)"), _bare("blur_mm"), _bare("defocus")
    ('level', 'blur', 'defocus')
    """
    return (UNIT.sub("", clean(header)) or header).strip(" _([").casefold()


def _unit(header: str) -> str:
    found = UNIT.search(header)
    if found is None:
        return ""
    return "D" if found.group(1).lower().startswith("diopt") else found.group(1)


def _meanings(conditions: Mapping[str, str]) -> dict[str, str]:
    return {clean(word).casefold(): clean(meaning).casefold() for word, meaning in conditions.items()}


def _levels(path: Path, table: pd.DataFrame, notes: list[str], notices: list[str]) -> pd.DataFrame:
    """The rows with a level above 0, as numbers."""
    if "level" not in table:
        raise no_column(path, "level")
    table = without_codes(table, "level", notices, signed=True)
    table = answered(path, table, "level", "level", notes)
    table["level"] = numbers(table, "level", table["level"])
    if (table["level"] < 0).any():
        below = table["level"] < 0
        raise InputError(
            f"{place(table, below)}: level is {table['level'][below].iloc[0]:g}, but must be above 0, as thresholds "
            "are sought on its logarithm: give amounts (of decibels or log units the antilogarithm)."
        )
    none = table["level"] == 0
    if none.all():
        raise InputError(f"{printable(path)} holds no level above 0: give the amounts that were shown.")
    if none.any():
        notices.append(f"Trials of level 0 were left out ({rows_named(table, none)}): without a stimulus all guess.")
    table = table[~none].copy()
    if table["level"].nunique() < 2:
        raise InputError(
            f"{printable(path)} has the one level {table['level'].iloc[0]:g}, but a threshold needs several: give "
            "answers at two levels or more."
        )
    return table


def _right(path: Path, table: pd.DataFrame, words: Mapping[str, str], notes: list[str]) -> pd.DataFrame:
    """The rows with an answer, as `correct`, one a trial."""
    if "correct" not in table:
        return _of_intervals(path, table, words, notes)
    table = answered(path, table, "correct", "answer", notes)
    cells = table["correct"].map(lambda cell: words.get(cell.casefold(), cell.casefold()))
    if "trials" in table:
        return _of_counts(table, cells, notes)
    wrong = ~cells.isin(list(WORDS))
    if wrong.any():
        raise InputError(
            f"{place(table, wrong)}: correct is {printable(table['correct'][wrong].iloc[0])!r}, but must be 1 for a "
            'right and 0 for a wrong answer: give the words\' meaning with conditions={"NAME": "1"}, or the counts of '
            "trials in a column of its own (trials)."
        )
    return table.assign(correct=cells.map(WORDS).astype(bool))


def _of_counts(table: pd.DataFrame, cells: pd.Series[str], notes: list[str]) -> pd.DataFrame:
    """One row a trial of a table with the number of trials and of right ones."""
    right = numbers(table, "correct", cells)
    shown = numbers(table, "trials", table["trials"].str.strip())
    wrong = (shown < 0) | (right < 0) | (right > shown) | (right % 1 != 0) | (shown % 1 != 0)
    if wrong.any():
        raise InputError(
            f"{place(table, wrong)}: correct is {right[wrong].iloc[0]:g} of {shown[wrong].iloc[0]:g} trials, but must "
            "be a whole number of them."
        )
    if shown.sum() > MOST_TRIALS:
        raise InputError(f"There are {shown.sum():,.0f} trials, but may be {MOST_TRIALS:,} at most.")
    notes.append("Each row holds a number of trials, and how many were right.")
    counts = shown.astype(int).to_numpy()
    number = np.concatenate([np.arange(count) for count in counts])
    whole = table.iloc[np.repeat(np.arange(len(table)), counts)]
    return whole.assign(correct=number < np.repeat(right.to_numpy(), counts))


def _of_intervals(path: Path, table: pd.DataFrame, words: Mapping[str, str], notes: list[str]) -> pd.DataFrame:
    """Right where the interval that was chosen is the one that was right."""
    for role in ("interval", "response"):
        if role not in table:
            other = f", or the right one of two intervals and the one chosen ({columns_like(role)})"
            raise no_column(path, "correct", other)
    table = answered(path, table, "response", "answer", notes)
    asked, given = (
        table[role].str.casefold().map(lambda cell: re.sub(r"[.,]0+$", "", words.get(cell, cell)))
        for role in ("interval", "response")
    )
    known = sorted(set(asked) - ABSENT)
    if len(known) > 2:
        raise InputError(f"{printable(path)} has the intervals {few(known)}, but must have two: give a column correct.")
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
    notes.append("An answer is right where the interval chosen is the one given as right.")
    return table.assign(correct=(asked == given).to_numpy())
