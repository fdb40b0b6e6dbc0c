"""Import of cue-combination judgements and of comparisons of differences from the user's own tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.own_tables import (
    PARTICIPANT,
    Paths,
    Source,
    Where,
    answered,
    found_columns,
    place,
    read_table,
    truths,
)

__all__ = [
    "OwnJudgements",
    "holds_cue_judgements",
    "holds_difference_judgements",
    "read_cue_judgements",
    "read_difference_judgements",
]

LARGER = ("deeper", "response", "resp", "answer")
"""Recognised names of the answer column, besides "larger"."""

CUES = {
    "participant_id": PARTICIPANT,
    "first": ("first_cue", "cue_1", "cue1"),
    "second": ("second_cue", "cue_2", "cue2"),
    "larger": LARGER,
    "kind": (),
}
"""Columns of cue judgements, each with the names recognised automatically."""

STIMULI = ("s1", "s2", "s3", "s4")

DIFFERENCES = {
    "participant_id": PARTICIPANT,
    **{name: (f"stimulus_{name[1]}",) for name in STIMULI},
    "larger": LARGER,
    "kind": (),
}
"""Columns of comparisons of differences, each with the names recognised automatically."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnJudgements:
    """Imported judgements.

    Parameters
    ----------
    table
        One row per trial: participant_id, larger (bool), kind; for cues, first and second (NaN if a cue was absent);
        for differences, s1, s2, s3 and for quadruples s4.
    notes, notices
        As in `focalgradient.statistics.OwnThresholds`.
    """

    table: pd.DataFrame
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()


def _holds(
    path: Paths,
    columns: Mapping[str, str] | None,
    roles: Mapping[str, tuple[str, ...]],
    needed: set[str],
) -> bool:
    ours = {role: column for role, column in (columns or {}).items() if role in (*roles, "participant")}
    if set(columns or {}) - set(ours):
        return False
    name, table, _ = read_table(path)
    return needed <= set(found_columns(name, table, roles, ours))


def holds_cue_judgements(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table has columns of two cues and of an answer."""
    return _holds(path, columns, CUES, {"first", "second", "larger"})


def holds_difference_judgements(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table has columns of three or four stimuli and of an answer."""
    return _holds(path, columns, DIFFERENCES, {"s1", "s2", "s3", "larger"})


def _read(
    path: Paths,
    columns: Mapping[str, str] | None,
    where: Where | None,
    roles: Mapping[str, tuple[str, ...]],
    shown: tuple[str, ...],
    *,
    empty: bool,
) -> OwnJudgements:
    own = Source.read(path, roles, columns, where)
    table = own.rows(shown, [], one="one")
    table = answered(own, table, "larger", "answer")
    table["larger"] = truths(table, "larger")
    present = [name for name in shown if name in table]
    for name in present:
        table[name] = own.numbers(table, name, empty=empty)
    table["kind"] = table["kind"].str.strip() if "kind" in table else "human"
    return OwnJudgements(
        table[["participant_id", *present, "larger", "kind"]].copy(), tuple(own.notes), tuple(own.notices)
    )


def read_cue_judgements(
    path: Paths, columns: Mapping[str, str] | None = None, where: Where | None = None
) -> OwnJudgements:
    r"""Read judgements by two cues from a CSV, TSV or XLSX file with one row per trial.

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set.
    columns
        Name in the file of each column: participant; first and second (difference between test and standard by each
        cue, in a common unit; empty if the cue was absent); larger (1 if the test was judged larger or deeper, else 0).

    where
        Values by column: only rows that have one of them are read.

    Raises
    ------
    InputError
        If a cell is invalid or a trial has neither cue; the message names it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "own.csv")
    ...     _ = file.write_text("subject,first,second,deeper\nA,0.5,,1\nA,0.5,0.4,0\n")
    ...     own = read_cue_judgements(file)
    >>> own.table[["first", "larger"]].values.tolist()
    [[0.5, True], [0.5, False]]
    """
    own = _read(path, columns, where, CUES, ("first", "second"), empty=True)
    neither = own.table["first"].isna() & own.table["second"].isna()
    if neither.any():
        raise InputError(f"{place(own.table, neither)}: neither cue was offered: leave the trial out.")
    return own


def read_difference_judgements(
    path: Paths, columns: Mapping[str, str] | None = None, where: Where | None = None
) -> OwnJudgements:
    r"""Read comparisons of differences from a CSV, TSV or XLSX file with one row per trial.

    Parameters
    ----------
    path
        CSV, TSV, XLSX or JSON file, or several of one data set.
    columns
        Name in the file of each column: participant; s1, s2, s3 and for quadruples s4 (magnitude or number of each
        stimulus); larger (1 if s3 and s4, or for triads s2 and s3, were judged to differ more than s1 and s2).

    where
        Values by column: only rows that have one of them are read.

    Raises
    ------
    InputError
        If a cell is invalid; the message names it.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "own.csv")
    ...     _ = file.write_text("subject,s1,s2,s3,response\nA,0.1,0.3,0.9,1\n")
    ...     own = read_difference_judgements(file)
    >>> own.table[["s1", "s3", "larger"]].values.tolist()
    [[0.1, 0.9, True]]
    """
    own = _read(path, columns, where, DIFFERENCES, STIMULI, empty=False)
    shown = own.table.filter(items=STIMULI).to_numpy()
    names = STIMULI[: shown.shape[1]]
    for one, other in ((0, 1), (-2, -1)):
        alike = pd.Series(np.isclose(shown[:, one], shown[:, other]), index=own.table.index)
        if alike.any():
            raise InputError(
                f"{place(own.table, alike)}: {names[one]} and {names[other]} are the same stimulus, so that they do "
                "not differ: leave the trial out."
            )
    return own
