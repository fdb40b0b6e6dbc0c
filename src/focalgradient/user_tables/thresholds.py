"""Import of threshold data, correct or incorrect answers at stimulus levels, from the user's own table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import binom

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number
from focalgradient.user_tables.cleaning import TRUTH, few_levels, note_groups
from focalgradient.user_tables.conditions import name_and_reference
from focalgradient.user_tables.files import Paths, read_table
from focalgradient.user_tables.imported import ImportedAnswers
from focalgradient.user_tables.names import UNIT, clean, few, heading, invalid, place, rows_named
from focalgradient.user_tables.schema import ABSENT, LOGARITHMS, THRESHOLDS
from focalgradient.user_tables.source import Source, Where, completed, conditions_like, where_like
from focalgradient.user_tables.trials import note_order

__all__ = ["OwnThresholds", "read_thresholds"]

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
class OwnThresholds(ImportedAnswers):
    """Imported threshold data, in the form that `focalgradient.statistics.blur_thresholds` accepts.

    The columns are participant_id, session, condition, level, correct, catch and kind.

    Parameters
    ----------
    unit
        Unit of the levels from the column name; "" without one.
    guess
        Guess rate: proportion of correct answers without a stimulus.
    conditions
        Conditions in the order of comparison, the reference last.
    """

    unit: str = ""
    guess: float = 0.5
    conditions: Sequence[str] = ("",)


def read_thresholds(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    guess: float | None = None,
    where: Where | None = None,
    by: Sequence[str] = (),
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
        Meanings of words in correct, interval, response and catch: {"richtig": "1", "links": "first"}; "NA" for
        a missing answer.
    guess
        Guess rate, from 0 to below 1. None: 1 / m from a column `alternatives` with m in each row, else one half,
        unless the answers contradict it.
    where
        Values by column: only rows that have one of them are read.
    by
        Column of the condition, as "NAME" or "NAME=LEVEL" with the level over which the others' ratios are.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid (the message names it), or the guess rate cannot be determined.

    Examples
    --------
    >>> from focalgradient.user_tables.files import text_table
    >>> answers = read_thresholds(text_table("subject;level (D);interval;response\nA;0,1;1;2\nA;0,2;2;2\n"))
    >>> answers.table[["participant_id", "level", "correct"]].values.tolist(), answers.unit
    ([['A', 0.1, False], ['A', 0.2, True]], 'D')
    """
    if len(by) > 1:
        raise InputError(f"by names {few(by)}, but thresholds are compared by one condition: give one.")
    file, reference = read_table(path), ""
    for stated in by:
        condition, reference = name_and_reference(stated, {clean(str(name)).casefold() for name in file.cells})
        columns = {**(columns or {}), "condition": (columns or {}).get(condition, condition)}
    source = Source.read(file, THRESHOLDS, columns, where, conditions)
    source.require()
    table = source.without_pasted(source.rows(), ("condition", "level"), ("correct", "interval", "response"))
    table = _above_zero(source, source.answers(table, "level"))
    table = source.with_catch(_judged(source, table))
    table = completed(table, "session", "condition", "kind")
    _note_conditions(source, table)
    note_order(table[["participant_id", "session", "condition"]], ["condition"], source.notices)
    rate = _guess(source, table, guess)
    unit = UNIT.search(source.columns["level"])
    name = "" if unit is None else "D" if unit[1].lower().startswith("diopt") else unit[1]
    kept = ["participant_id", "session", "condition", "level", "correct", "catch", "kind"]
    levels = list(map(str, table["condition"].unique()))
    levels.sort(key=lambda level: (level == reference, as_number(level) or 0, level))
    if reference not in ("", "factor", *levels):
        raise InputError(
            f"by states {printable(by[0])}, but no level is {printable(reference)}: give one of {few(levels)} as the "
            "reference."
        )
    named = {level: level if as_number(level) is None else f"{source.columns['condition']} {level}" for level in levels}
    table = table[kept].assign(condition=table["condition"].replace(named))
    return OwnThresholds.of(source, table, unit=name, guess=rate, conditions=list(named.values()))


def _note_conditions(source: Source, table: pd.DataFrame) -> None:
    """Note unused columns of few levels that vary within a person, over which a threshold is fitted.

    Raises
    ------
    InputError
        If the name of such a column says that it is a condition, and another column is compared.
    """
    cells = source.cells.loc[table.index.unique()]
    judged = {*TRUTH, *THRESHOLDS.columns["correct"].words}
    others = [
        name
        for name in source.unused
        if not {cell.strip().casefold() for cell in cells[name].unique()} <= judged  # else it may repeat the answer
        or table["correct"].groupby(source.cells.loc[table.index, name].to_numpy()).nunique().max() > 1
    ]
    people, compared = [cells[source.columns["participant_id"]]], source.columns.get("condition", "")

    if not compared:
        note_groups(cells[others], people[0], source.notices, ())
    split = few_levels(cells[others], [*people, cells[compared]] if compared else people)
    for name in split if compared else ():
        if heading(name) in ("condition", *THRESHOLDS.columns["condition"].names):
            raise InputError(
                f"{source.name} has two conditions, {printable(compared)} and {printable(name)} ({split[name]}), and "
                f"each threshold would be over all levels of {printable(name)}: choose one with "
                f"{where_like(name, min(cells[name]))}."
            )
    if split and not (compared and cells[compared].groupby(people).nunique().max() > 1):
        first = next(iter(split))
        shown = "; ".join(f"{printable(name)} ({levels})" for name, levels in split.items())
        one = "it" if len(split) == 1 else "one of them"
        remedy = f'give columns={{"condition": "{printable(first)}"}}'
        if compared:
            remedy = f"choose a level with {where_like(first, min(cells[first]))}"
        source.notices.append(f"Each threshold is over all levels of {shown}: if {one} is a condition, {remedy}.")


def _guess(source: Source, table: pd.DataFrame, given: float | None) -> float:
    """Return the given guess rate, that of the alternatives, or one half if the answers are consistent with it."""
    if given is not None and not 0 <= given < 1:
        raise InputError(f"guess is {given:g}, but must be a rate from 0 to below 1, like 0.25 for four alternatives.")
    stated = 0.5 if "interval" in table and "response" in table else None
    if "alternatives" in table:
        counts = source.numbers(table, "alternatives")
        if counts.nunique() != 1 or counts.iloc[0] < 2 or counts.iloc[0] % 1:
            raise InputError(
                f"{source.name} has the alternatives {few(sorted(map(str, counts.unique())))}, but must have one "
                "whole number of 2 or more in all rows: analyse each by itself."
            )
        stated = 1 / float(counts.iloc[0])
    if given is not None and stated is not None and abs(given - stated) > RATE_TOLERANCE:
        raise InputError(f"guess is {given:g}, but the table's alternatives give {stated:.3g}: leave one of them out.")
    rate = stated if given is None else given
    if rate is not None:
        return rate
    counted = table[~table["catch"]].groupby("level")["correct"].agg(["sum", "count"])
    at_level = _below_half(counted)
    if (below := at_level or _below_guess(counted.cumsum())) is not None:
        level, right, shown = below
        raise InputError(
            f"{source.name}: {'at' if at_level else 'up to'} level {level:g} {right:g} of {shown:g} answers are right, "
            "fewer than guessing among two gives, so the guess rate is not known: give it, 0.5 for a staircase with "
            "two alternatives, 0.25 for four and 0 for yes and no, or a column alternatives."
        )
    source.notes.append("The guess rate was taken to be one half, as of two alternatives.")
    return 0.5


def _below_guess(counted: pd.DataFrame) -> tuple[float, float, float] | None:
    """Return level, correct answers and trials if those at the lowest levels have a share below `LOWEST_SHARE`.

    Counts are cumulative from the lowest level, until there are `FEWEST` trials, as staircases show each level a few
    times.
    """
    enough = counted[counted["count"] >= FEWEST]
    if enough.empty or enough["sum"].iloc[0] / enough["count"].iloc[0] >= LOWEST_SHARE:
        return None
    return enough.index[0], *enough.iloc[0]


def _below_half(counted: pd.DataFrame) -> tuple[float, float, float] | None:
    """Return level, correct answers and trials if two alternatives are improbable at some level, else None."""
    p = np.atleast_1d(binom.cdf(counted["sum"].to_numpy(), counted["count"].to_numpy(), 0.5)) * len(counted)
    at = int(np.argmin(p)) if len(p) else 0
    if not len(p) or p[at] >= MAX_P_OF_TWO_ALTERNATIVES:
        return None
    return counted.index[at], *counted.iloc[at]


UNITS_NAMED = dict.fromkeys(("db", "decibel"), "decibels (dB)")
"""Names of units in messages, by their words in headings."""


def _above_zero(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with a level above 0, with the logarithms that the heading states undone."""
    header = printable(source.columns["level"])
    remedy = f'of logarithms, such as those of QUEST in PsychoPy, give columns={{"log10_level": "{header}"}}'
    stated = [base for base in LOGARITHMS if f"{base}_level" in source.given]
    for word in [*stated, *re.findall(r"[a-z]+\d*", clean(header).casefold())]:
        if word in LOGARITHMS:
            source.notices.append(
                f"The column {header} holds logarithms ({word}): levels and thresholds are reported as amounts, not "
                "logarithms."
            )
            table = table.assign(level=LOGARITHMS[word] ** table["level"])
            break
        if word in ("db", "decibel", "decibels") or word.startswith("log"):
            raise InputError(
                f"the heading {header!r} says that levels are in {UNITS_NAMED.get(word, word)}, but they must be "
                f"amounts above 0, as thresholds are sought on their logarithm: convert them, or, {remedy}."
            )
    if (below := table["level"] < 0).any():
        expected = (
            "but must be above 0, as thresholds are sought on its logarithm: give amounts (of signed differences, "
            f"points of subjective equality are not computed), or, {remedy}"
        )
        raise invalid(table, "level", below, expected)
    none = table["level"] == 0
    if none.all():
        raise InputError(f"{source.name} holds no level above 0: give the amounts that were shown.")
    if none.any():
        source.notices.append(
            f"Trials of level 0 were excluded ({rows_named(table, none)}): without a stimulus all guess."
        )
    table = table[~none].copy()
    if table["level"].nunique() < 2:
        raise InputError(
            f"{source.name} has the one level {table['level'].iloc[0]:g}, but a threshold needs several: give "
            "answers at two levels or more."
        )
    return table


def _judged(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Return the answered rows, one per trial, with `correct` as a boolean."""
    if "correct" not in table:
        return _of_intervals(source, source.answers(table, "response"))
    table = source.answers(table, "correct")
    return _of_counts(source, table) if "trials" in table else table.assign(correct=source.truths(table, "correct"))


def _of_counts(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Expand counts of trials and of correct answers to one row per trial."""
    right, shown = source.numbers(table, "correct"), source.numbers(table, "trials")
    wrong = (shown < 0) | (right < 0) | (right > shown) | (right % 1 != 0) | (shown % 1 != 0)
    if wrong.any():
        raise InputError(
            f"{place(table, wrong)}: correct is {right[wrong].iloc[0]:g} of {shown[wrong].iloc[0]:g} trials, but must "
            "be a whole number of them."
        )
    if shown.sum() > MAX_TRIALS:
        raise InputError(f"There are {shown.sum():,.0f} trials, but may be {MAX_TRIALS:,} at most.")
    source.notes.append("Each row holds a number of trials, and how many were right.")
    counts = shown.astype(int).to_numpy()
    number = np.concatenate([np.arange(count) for count in counts])
    whole = table.iloc[np.repeat(np.arange(len(table)), counts)]
    return whole.assign(correct=number < np.repeat(right.to_numpy(), counts))


def _of_intervals(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Set `correct` if the chosen interval is the correct one."""
    asked, given = (
        table[role].str.casefold().map(lambda cell: re.sub(r"[.,]0+$", "", source.meanings.get(cell, cell)))
        for role in ("interval", "response")
    )
    known = sorted(set(asked) - ABSENT)
    if len(known) > 2:
        raise InputError(f"{source.name} has the intervals {few(known)}, but must have two: give a column correct.")
    unstated = asked.isin(list(ABSENT))
    strange = ~given.isin(known) | unstated
    one_sided = len(known) == 1 and given[strange].nunique() == 1 and not unstated.any()
    if strange.any() and not one_sided:
        remedy = conditions_like((known or ["1"])[0]).replace("its meaning", "the words' meaning")
        remedy += " (NA: a missing answer)"
        raise invalid(table, "response", strange, f"but the intervals are {few(known)}: {remedy}")
    source.notes.append("An answer is right where the interval chosen is the one given as right.")
    return table.assign(correct=(asked == given).to_numpy())
