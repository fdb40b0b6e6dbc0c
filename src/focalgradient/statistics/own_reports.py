"""Import of reports on the rotating Necker cube from the user's own table; assumptions are noted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import codes_of
from focalgradient.statistics.own_files import Paths, read_table
from focalgradient.statistics.own_names import ABSENT, place, rows_named
from focalgradient.statistics.own_numbers import numbers
from focalgradient.statistics.own_rows import check_seconds
from focalgradient.statistics.own_tables import (
    NO,
    PARTICIPANT,
    Source,
    Where,
    answered,
    catch_trials,
    completed,
    conditions_like,
    folded,
    truths,
)
from focalgradient.statistics.tables import CLOCK, GRADIENTS, PERCEPTS, report_table

__all__ = ["OwnReports", "holds_reports", "read_reports"]

ROLES = {
    "participant_id": PARTICIPANT,
    "percept": ("reading", "report", "reported", "seen", "state"),
    "gradient": ("condition", "blur"),
    "strength": ("strength_mm", "aperture_mm"),
    "onset": ("onset_s", "start", "onset_ms"),
    "duration": ("duration_s", "lasted", "dur", "duration_ms", "dur_ms"),
    "end": ("offset", "end_ms", "offset_ms"),
    "trial": (),
    "session": (),
    "trial_duration": ("trial_duration_s", "trial_s", "trial_duration_ms", "trial_ms"),
    "censored": ("cut_off",),
    "catch": (),
    "kind": (),
    "dropped_frames": (),
}
"""Required and optional columns, each with the names recognised automatically."""

WORDS = {
    **{name: name for name in (*GRADIENTS, *PERCEPTS)},
    "non-rigid": "nonrigid",
    "non rigid": "nonrigid",
    "non_rigid": "nonrigid",
    "no": "none",
    "sharp": "none",
    "0": "none",
}
ONE_STRENGTH = 1.0
"""Placeholder strength in mm of all gradients if the table gives none; this is noted."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnReports:
    """Imported reports, in the form that `necker` accepts.

    Parameters
    ----------
    table
        One row per report: see `focalgradient.statistics.tables.report_table`. The index contains file and row.
    notes
        Assumptions, omissions and changes, one sentence each.
    notices
        Interpretations that change the results, one sentence each, shown at the top of a report.
    """

    table: pd.DataFrame
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()


def holds_reports(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table contains reports on the cube: a column of percepts, and no ratings."""
    columns = columns or {}
    if "percept" in columns or "rating" in columns:
        return "percept" in columns
    names = {str(name).lower() for name in read_table(path).cells}
    return not {"percept", "gradient"}.isdisjoint(names) and "rating" not in names


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
    >>> from focalgradient.statistics.own_files import text_table
    >>> own = read_reports(text_table("subject,trial,blur,seen,dur\nA,1,sharp,rigid,6\nA,1,sharp,non-rigid,4\n"))
    >>> own.table[["gradient", "percept", "onset", "duration", "censored"]].values.tolist()
    [['none', 'rigid', 0.0, 6.0, False], ['none', 'nonrigid', 6.0, 4.0, True]]
    """
    words = folded(conditions)
    own = Source.read(path, ROLES, columns, where)
    notes, notices = own.notes, own.notices
    _check_columns(own)
    times = ["onset", "duration", "end", "trial_duration"]
    table = own.rows([*times, "strength", "dropped_frames"], ["percept", "gradient"])
    table = answered(own, table, "percept", "report", ABSENT - {"none"})
    table = _meant(table, words)
    table["strength"] = _strengths(own, table)
    table = _timed(own, table)
    table = _ended(catch_trials(table, notes), notes)
    table = own.optional(completed(table, "kind"), "dropped_frames")
    return OwnReports(report_table(table), tuple(notes), tuple(notices))


def _check_columns(own: Source) -> None:
    """Raise `InputError` that names the missing columns; either trials or onsets, durations or ends, are enough."""
    times, otherwise = [], ""
    if "onset" not in own.columns and "trial" not in own.columns:
        times, otherwise = ["trial"], ", or give the onset of each report within its trial"
    if "duration" not in own.columns and not {"onset", "end"} <= set(own.columns):
        times, otherwise = [*times, "duration"], ", or give onset and end"
    own.require("participant_id", "percept", "gradient", *times, otherwise=otherwise)


def _meant(table: pd.DataFrame, words: Mapping[str, str]) -> pd.DataFrame:
    """Translate percepts and gradients to the standard names; report all unknown words in one error."""
    wrong: list[str] = []
    for role, known in (("percept", PERCEPTS), ("gradient", GRADIENTS)):
        texts = table[role].map(lambda cell: words.get(cell.casefold(), cell)).str.casefold()
        found = texts.map(lambda text: WORDS.get(text, text))
        for cell in table[role][~found.isin(known)].unique():
            rows = table[role] == cell
            where = rows_named(table, rows) if wrong else place(table, rows)
            wrong.append(f"{where}: {role} is {printable(cell)!r}, but must be one of {', '.join(known)}")
        table = table.assign(**{role: found})
    if wrong:
        more = f"; and {len(wrong) - 20} more" if len(wrong) > 20 else ""
        raise InputError(f"{'; '.join(wrong[:20])}{more}: {conditions_like(PERCEPTS[0])}.")
    return table


def _strengths(own: Source, table: pd.DataFrame) -> pd.Series[float]:
    """Return the strengths in mm of aperture; 0 without a gradient, where the cell may be empty."""
    plain = table["gradient"] == "none"
    if "strength" not in table:
        if not plain.all():
            own.notes.append(
                f"No strength column: each gradient is treated as of one strength, written as {ONE_STRENGTH:g} mm."
            )
        return plain.map({True: 0.0, False: ONE_STRENGTH}).astype(float)
    texts = table["strength"].str.strip()
    return numbers(table, "strength", texts.mask(plain & texts.str.lower().isin(ABSENT), "0"), own=own)


LONGEST_REPORT_S = 200.0
"""Maximum median duration in seconds; larger values indicate another unit: percepts last some 5 s."""


def _timed(own: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Complete trials, onsets and durations from one another."""
    notes = own.notes
    for role in ("onset", "duration", "end", "trial_duration"):
        if role in table:
            if codes := codes_of(table[role].unique()):
                wrong = table[role].isin(codes)
                raise InputError(
                    f"{place(table, wrong)}: {role} is {table[role][wrong].iloc[0]}, which marks a missing value: "
                    "remove that row."
                )
            table[role] = own.numbers(table, role)
            check_seconds(table, role, LONGEST_REPORT_S if role == "duration" else math.inf)
    if "duration" not in table:
        table["duration"] = table["end"] - table["onset"]
        check_seconds(table, "duration", LONGEST_REPORT_S)
    table = _lasting(own, table)
    people = [name for name in ("participant_id", "session") if name in table]
    condition = ["gradient", "strength"]
    if "trial" not in table:
        rows = table[[*people, *condition]]
        new = (rows != rows.shift()).any(axis=1) | (table["onset"] <= table["onset"].shift())
        table["trial"] = new.cumsum()
        notes.append("Trials are counted: a new one begins where the onset falls or the condition changes.")
    elif (table.groupby([*people, "trial"])[condition].nunique() > 1).any(axis=None):
        table["trial"] = table["gradient"] + table["strength"].map(" {:g} ".format) + table["trial"].str.strip()
        notes.append("Trials of different conditions have one number: they count as trials of their own.")
    if "onset" not in table:
        table["onset"] = table.groupby([*people, "trial"], sort=False)["duration"].transform(
            lambda lasts: lasts.cumsum() - lasts
        )
        notes.append("No onset column: the reports of a trial follow one another as in the file.")
    ordered = table.sort_values([*people, "trial", "onset"], kind="stable")
    ends = (ordered["onset"] + ordered["duration"]).groupby([ordered[name] for name in [*people, "trial"]])
    late = ordered["onset"] < ends.cummax().groupby([ordered[n] for n in [*people, "trial"]]).shift() - CLOCK
    if late.any():
        raise InputError(f"{place(ordered, late)}: the report begins before another of its trial has ended.")
    return table


def _lasting(own: Source, table: pd.DataFrame) -> pd.DataFrame:
    """Remove reports of zero duration, which simultaneous key changes produce."""
    momentary = table["duration"] == 0
    if momentary.all():
        raise InputError(f"{own.name} holds no report that lasted: durations are all 0.")
    if momentary.any():
        own.notes.append(f"Reports that lasted no time were left out: {momentary.sum()}.")
    return table[~momentary].copy()


def _ended(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Add trial durations, and mark the reports that the end of the trial cut off."""
    ends = table["onset"] + table["duration"]
    if "trial_duration" not in table:
        table["trial_duration"] = float(np.max(ends))
        notes.append(
            f"No column trial_duration: all trials are treated as of {float(np.max(ends)):g} s, the latest end of a "
            "report."
        )
    if "censored" in table:
        table["censored"] = truths(table, "censored", NO)
    else:
        table["censored"] = ends >= table["trial_duration"] - CLOCK
        notes.append("Reports that last till the end of their trial count as cut off by it.")
    return table
