"""Import of reports on the rotating Necker cube from the user's own table; assumptions are noted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files.cells import codes_of
from focalgradient.user_tables.cleaning import check_seconds
from focalgradient.user_tables.files import Paths, read_table
from focalgradient.user_tables.imported import ImportedAnswers
from focalgradient.user_tables.names import place
from focalgradient.user_tables.schema import ABSENT, CUBE, PERCEPTS
from focalgradient.user_tables.source import Source, Where, completed, conditions_like, holds
from focalgradient.user_tables.tidy import CLOCK, report_table
from focalgradient.user_tables.words import not_understood

__all__ = ["OwnReports", "holds_reports", "read_reports"]

ONE_STRENGTH = 1.0
"""Placeholder strength in mm of all gradients if the table gives none; this is noted."""

LONGEST_REPORT_S = 200.0
"""Maximum median duration in seconds; larger values indicate another unit: percepts last some 5 s."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnReports(ImportedAnswers):
    """Imported reports, in the form that `necker` accepts: see `focalgradient.user_tables.tidy.report_table`."""


def holds_reports(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table contains reports on the cube: percepts, or columns by which `CUBE` is recognised."""
    columns = columns or {}
    if "percept" in columns or "rating" in columns:
        return "percept" in columns
    names = {str(name).lower() for name in read_table(path).cells}
    return (not {"percept", "gradient"}.isdisjoint(names) and "rating" not in names) or holds(CUBE, path, columns)


def read_reports(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    where: Where | None = None,
) -> OwnReports:
    r"""Read reports on the rotating Necker cube from a CSV or TSV file with one row per report.

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set.
    columns
        Name in the file of each column: participant, gradient, percept, duration (or onset and end); optionally onset,
        trial, strength, trial_duration, censored, catch, session. Without a trial column, a new trial starts when the
        onset decreases or the condition changes; without onsets, reports are consecutive.
    conditions
        Meanings of the file's own words: {"starr": "rigid", "weich": "nonrigid", "ohne": "none"}.

    where
        Values by column: only rows that have one of them are read.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> from focalgradient.user_tables.files import text_table
    >>> reports = read_reports(text_table("subject,trial,blur,seen,dur\nA,1,sharp,rigid,6\nA,1,sharp,non-rigid,4\n"))
    >>> reports.table[["gradient", "percept", "onset", "duration", "censored"]].values.tolist()
    [['none', 'rigid', 0.0, 6.0, False], ['none', 'nonrigid', 6.0, 4.0, True]]
    """
    source = Source.read(path, CUBE, columns, where, conditions)
    source.require()
    table = source.without_pasted(source.rows(), ("gradient",), ("percept", "duration", "onset", "end"))
    table = source.answers(table, "percept")
    table = _meant(source, table)
    table["strength"] = _strengths(source, table)
    table = source.with_catch(_in_trials(source, _timed(source, table)))
    table = source.optional(completed(_ended(source, table), "kind"), "dropped_frames")
    return OwnReports.of(source, report_table(table))


def _meant(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Translate percepts and gradients to the standard names; report all unknown words in one error."""
    wrong: list[tuple[str, str, str]] = []
    meant = table
    for role in ("percept", "gradient"):
        known = source.schema.columns[role].words
        found = table[role].map(lambda cell: source.meanings.get(cell.casefold(), cell)).str.casefold().map(known)
        expected = f"must be one of {', '.join(dict.fromkeys(map(str, known.values())))}"
        wrong += [(role, cell, expected) for cell in table[role][found.isna()].unique()]
        meant = meant.assign(**{role: found})
    if wrong:
        raise not_understood(table, wrong, f": {conditions_like(PERCEPTS[0])}")
    return meant


def _strengths(source: Source, table: pd.DataFrame) -> pd.Series[float]:
    """Return the strengths in mm of aperture; 0 without a gradient, where the cell may be empty."""
    plain = table["gradient"] == "none"
    if "strength" not in table:
        if not plain.all():
            source.notes.append(
                f"No strength column: each gradient is treated as of one strength, written as {ONE_STRENGTH:g} mm."
            )
        return plain.map({True: 0.0, False: ONE_STRENGTH}).astype(float)
    texts = table["strength"].str.strip()
    filled = table.assign(strength=texts.mask(plain & texts.str.lower().isin(ABSENT), "0"))
    return source.numbers(filled, "strength")


def _timed(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Return the reports that lasted, with times as numbers and durations completed."""
    for role in ("onset", "duration", "end", "trial_duration"):
        if role in table:
            if (wrong := table[role].isin(codes_of(table[role].unique()))).any():
                code = f"{place(table, wrong)}: {role} is {table[role][wrong].iloc[0]}"
                raise InputError(f"{code}, which marks a missing value: remove that row.")
            table[role] = source.numbers(table, role)
            check_seconds(table, role, LONGEST_REPORT_S if role == "duration" else math.inf)
    if "duration" not in table:
        table["duration"] = table["end"] - table["onset"]
        check_seconds(table, "duration", LONGEST_REPORT_S)
    momentary = table["duration"] == 0  # simultaneous key changes produce them
    if momentary.all():
        raise InputError(f"{source.name} holds no report that lasted: durations are all 0.")
    if momentary.any():
        source.notes.append(f"Reports that lasted no time were left out: {momentary.sum()}.")
    return table[~momentary].copy()


def _in_trials(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Complete trials and onsets from one another."""
    people = [name for name in ("participant_id", "session") if name in table]
    condition = ["gradient", "strength"]
    if "trial" not in table:
        rows = table[[*people, *condition]]
        new = (rows != rows.shift()).any(axis=1) | (table["onset"] <= table["onset"].shift())
        table["trial"] = new.cumsum()
        source.notes.append("Trials are counted: a new one begins where the onset falls or the condition changes.")
    elif (table.groupby([*people, "trial"])[condition].nunique() > 1).any(axis=None):
        table["trial"] = table["gradient"] + table["strength"].map(" {:g} ".format) + table["trial"].str.strip()
        source.notes.append("Trials of different conditions have one number: they count as trials of their own.")
    if "onset" not in table:
        lasts = table.groupby([*people, "trial"], sort=False)["duration"]
        table["onset"] = lasts.cumsum() - table["duration"]
        source.notes.append("No onset column: the reports of a trial follow one another as in the file.")
    ordered = table.sort_values([*people, "trial", "onset"], kind="stable")
    trials = [ordered[name] for name in [*people, "trial"]]
    ends = (ordered["onset"] + ordered["duration"]).groupby(trials).cummax()
    late = ordered["onset"] < ends.groupby(trials).shift() - CLOCK
    if late.any():
        raise InputError(f"{place(ordered, late)}: the report begins before another of its trial has ended.")
    return table


def _ended(source: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Add trial durations, and mark the reports that the end of the trial cut off."""
    ends = table["onset"] + table["duration"]
    if "trial_duration" not in table:
        table["trial_duration"] = latest = float(np.max(ends))
        source.notes.append(
            f"No column trial_duration: all trials are treated as of {latest:g} s, the latest end of a report."
        )
    if "censored" in table:
        table["censored"] = source.truths(table, "censored")
    else:
        table["censored"] = ends >= table["trial_duration"] - CLOCK
        source.notes.append("Reports that last till the end of their trial count as cut off by it.")
    return table
