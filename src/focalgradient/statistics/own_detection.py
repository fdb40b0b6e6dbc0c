"""Import of yes/no detection data, with optional confidence ratings, from the user's own table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.own_files import Paths, read_table
from focalgradient.statistics.own_names import clean, few
from focalgradient.statistics.own_rows import in_steps, without_codes
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

__all__ = ["OwnDetection", "holds_detection", "read_detection"]

ROLES = {
    "participant_id": PARTICIPANT,
    "signal": ("signal_present", "target_present", "present", "is_signal", "signal_shown"),
    "response": ("answer", "resp", "said", "judgment", "judgement"),
    "confidence": ("conf", "certainty", "confidence_rating"),
    "condition": ("group", "cond"),
    "session": (),
    "catch": (),
    "trial": (),
    "kind": (),
}
"""Required and optional columns, each with the names recognised automatically."""

OTHERS = frozenset(("rating", "percept", "aperture", "aperture_mm", "fixation", "level", "correct", "interval"))
"""Columns that identify tables of another kind."""

WORDS = {
    **dict.fromkeys(("present", "signal", "old", "seen"), True),
    **dict.fromkeys(("absent", "noise", "new", "unseen"), False),
}
"""Recognised words for signal and noise, and for the answers yes and no."""

MOST_STEPS = 10
"""Maximum number of confidence steps: with more, each would be used too rarely for an ROC."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnDetection:
    """Imported detection data, in the form that `focalgradient.statistics.detection_by_person` accepts.

    Parameters
    ----------
    table
        One row per trial: participant_id, session, condition, signal, answer, catch, kind, and optionally confidence
        from 1 (lowest) to `steps`. The index contains file and row.
    steps
        Number of confidence steps; 0 without confidence.
    notes, notices
        As in `focalgradient.statistics.OwnThresholds`.
    """

    table: pd.DataFrame
    steps: int
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()


def holds_detection(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table contains detection data: columns of signal and answer, and none of another kind."""
    columns = columns or {}
    if OTHERS & set(columns):
        return False
    table = read_table(path)
    if not OTHERS.isdisjoint({clean(str(column)).casefold() for column in table.cells} - set(columns.values())):
        return False
    ours = {role: column for role, column in columns.items() if role in (*ROLES, "participant")}
    return {"signal", "response"} <= set(found_columns(table.name, table.cells, ROLES, ours))


def read_detection(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    where: Where | None = None,
    order: Sequence[str] = (),
) -> OwnDetection:
    r"""Read detection data from a CSV, TSV or XLSX file with one row per trial.

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set.
    columns
        Name in the file of each column: participant, signal (1 if present, else 0), response (1 for "yes", 0 for "no");
        optionally confidence (integers or ordered steps, at most 10), condition, session, catch.
    conditions
        Meanings of the file's own words in signal and response: {"links": "1"}.

    where
        Values by column: only rows that have one of them are read.
    order
        Words of the confidence, from the least to the most.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> from focalgradient.statistics.own_files import text_table
    >>> own = read_detection(text_table("subject,signal,response,confidence\nA,1,yes,4\nA,0,no,2\n"))
    >>> own.table[["participant_id", "signal", "answer", "confidence"]].values.tolist(), own.steps
    ([['A', True, True, 2], ['A', False, False, 1]], 2)
    """
    own = Source.read(path, ROLES, columns, where)
    notes, notices = own.notes, own.notices
    own.require("participant_id", "signal", "response")
    table = own.rows(["confidence"], ["signal"])
    yes_or_no = '1 or 0 (yes or no): give the words\' meaning with conditions={"NAME": "1"}'
    table = answered(own, table, "response", "answer")
    for role, ours in (("signal", "signal"), ("response", "answer")):
        table[ours] = truths(table, role, WORDS, folded(conditions), yes_or_no)
    if "confidence" in table:
        table = in_steps(table, "confidence", order, own.notes)
    table, steps = _steps(own, table)
    if table["signal"].all() or not table["signal"].any():
        shown = "signals" if table["signal"].all() else "noise"
        raise InputError(f"{own.name} has trials with {shown} only: give trials with signal and trials without.")
    table = completed(catch_trials(table, notes), "session", "condition", "kind")
    kept = ["participant_id", "session", "condition", "signal", "answer", "catch", "kind"]
    return OwnDetection(table[kept + ["confidence"] * bool(steps)].copy(), steps, tuple(notes), tuple(notices))


def _steps(own: Source, table: pd.DataFrame) -> tuple[pd.DataFrame, int]:
    """Recode confidence as 1, 2, ... in ascending order; return the table and the number of steps."""
    if "confidence" not in table:
        return table, 0
    table = without_codes(table, "confidence", own.notices, signed=False)
    table = answered(own, table, "confidence", "confidence")
    values = own.numbers(table, "confidence")
    there = sorted(set(values))
    if len(there) > MOST_STEPS:
        raise InputError(
            f"{own.name} has {len(there)} values of confidence, but may have {MOST_STEPS} at most: give it in "
            f"steps, or leave it out ({columns_like('confidence')} names another column)."
        )
    if len(there) < 2:
        own.notes.append("Confidence is the same in all trials: it is not analysed.")
        return table.drop(columns="confidence"), 0
    if there != list(range(1, len(there) + 1)):
        own.notes.append(f"Steps of confidence, from the least: {few([f'{each:g}' for each in there])}.")
    return table.assign(confidence=values.map({each: step for step, each in enumerate(there, start=1)})), len(there)
