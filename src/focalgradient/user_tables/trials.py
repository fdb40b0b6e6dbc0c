"""Numbers of trials in the user's own table, by which copies and several rows of one trial are told apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.user_tables.cleaning import without_copies
from focalgradient.user_tables.names import few, place, rows_named
from focalgradient.user_tables.source import Source, where_like
from focalgradient.user_tables.wide import MEASURES

__all__ = ["note_order", "numbered"]

MIN_REPEATED_NUMBERS = 0.3
"""Fraction of repeated trial numbers above which they count within blocks; below it, trials are duplicates."""

MIN_SHARED_CONDITION = 0.9
"""Fraction of rows with a repeated trial number that repeat its condition, above which a trial has several rows."""


def numbered(source: Source, table: pd.DataFrame, conditions: Sequence[str]) -> pd.DataFrame:
    """Return the table without copies, with valid trial numbers: the trials are numbered if necessary."""
    table = without_copies(table, conditions, source.notices, source.notes)
    by = [name for name in ("participant_id", "session") if name in table]
    condition = [*conditions]
    note_order(table, [name for name in conditions if name != "scene"], source.notices)
    if "trial" in table:
        again, same = table.duplicated([*by, "trial"]), table.duplicated()
        if not again.any():
            return table
        if same.equals(again):
            raise InputError(f"{place(table, same)}: a row above is the same in every cell: leave one of them out.")
        in_files = table.assign(file=table.index.get_level_values(0)).duplicated(["file", "participant_id", "trial"])
        if "session" not in table and not same.any() and not in_files.any():
            source.notes.append("Trial numbers count within files.")
            return _counted(source, table, by)
        shown = table.duplicated([*by, "trial", *condition])
        keys = table[[*by, "trial", *condition]]
        after = (keys == keys.shift()).all(axis=1)
        beside = shown.sum() >= MIN_SHARED_CONDITION * again.sum() and after.sum() >= shown.sum() / 2
        if shown.any() and (again.mean() < MIN_REPEATED_NUMBERS or beside):
            raise InputError(
                f"{place(table, shown)}: trial {printable(str(table['trial'][shown].iloc[0]))} of participant "
                f"{table['participant_id'][shown].iloc[0]} occurs in a row above with another answer: leave one of "
                f"them out ({rows_named(table, shown)}){_distinguished(source, table, keys)}."
            )
        if block := _block(source, table, by):
            source.notes.append(f"Trial numbers count within {printable(block)}.")
            return _counted(source, table, by)
        source.notices.append(
            "The column of trials does not tell all trials apart and was not used: if each trial has several rows, "
            'choose that of the answer with where={"COLUMN": "VALUE"}.'
        )
    else:
        keys = table[[*by, *condition]]
        if remedy := _distinguished(source, table, keys):
            source.notices.append(f"Rows come in groups of one condition, as several rows of one trial do{remedy}.")
        elif start := _same_start(table["rating"], keys):
            source.notices.append(start)
    return _counted(source, table, by)


def note_order(table: pd.DataFrame, conditions: Sequence[str], notices: list[str]) -> None:
    """Note conditions that change with time alike in all subjects: by session, or by blocks of numbered trials.

    >>> trials = pd.DataFrame({"participant_id": [*"AAAABBBB"], "trial": [1, 2, 3, 4] * 2, "eye": [*"LLRRLLRR"]})
    >>> note_order(trials, ["eye"], notices := [])
    >>> notices[0][:67]
    'All subjects answered at the levels of eye in one order (L, R), so '
    """
    time = [name for name in ("session", "trial") if name in table]
    for name in conditions if time else ():
        keys = pd.DataFrame({of: pd.to_numeric(table[of], errors="coerce").fillna(0) for of in time})
        ordered = table.assign(**keys).sort_values(["participant_id", *time], kind="stable")[["participant_id", name]]
        blocks = ordered[(ordered != ordered.shift()).any(axis=1)]
        orders = blocks.groupby("participant_id")[name].agg(tuple)
        levels, what = table[name].nunique(), ""
        in_blocks = "trial" in table and len(orders) > 1 == orders.nunique() and len(orders.iloc[0]) == levels
        if "session" in table and len(table[["session", name]].drop_duplicates()) == table["session"].nunique():
            what = f"Each session has one level of {printable(name)}"
        elif in_blocks:
            shown = few([f"{level:g}" if isinstance(level, float) else str(level) for level in orders.iloc[0]])
            what = f"All subjects answered at the levels of {printable(name)} in one order ({shown})"
        if what and levels > 1:
            notices.append(f"{what}, so that its effect cannot be separated from practice or fatigue.")


def _block(source: Source, table: pd.DataFrame, by: Sequence[str]) -> str:
    """Return the unused column of blocks, consecutive rows of a subject within which no number occurs twice, or ""."""
    if table.index.nlevels != 2:
        return ""
    for name in source.unused:
        blocks = table.assign(block=source.cells.loc[table.index, name])[[*by, "trial", "block"]]
        runs = blocks[[*by, "block"]]
        is_start = (runs != runs.shift()).any(axis=1)
        if is_start.sum() == len(runs.drop_duplicates()) < len(runs) / 2 and not blocks.duplicated().any():
            return name
    return ""


def _counted(source: Source, table: pd.DataFrame, by: Sequence[str]) -> pd.DataFrame:
    """Return the table with the trials numbered in the order of the rows."""
    table["trial"] = table.groupby([*by], sort=False).cumcount() + 1
    source.notes.append("Trials are numbered in the order of the file.")
    return table


def _same_start(ratings: pd.Series[float], keys: pd.DataFrame) -> str:
    """Return a notice if rows come in groups of one condition, of which one row always has the same rating."""
    group = (keys != keys.shift()).any(axis=1).cumsum()
    sizes = group.value_counts()
    if len(sizes) < 4 or sizes.nunique() != 1 or sizes.iloc[0] < 2:
        return ""
    values = ratings.groupby(group.groupby(group).cumcount().to_numpy()).agg(["nunique", "first"])
    same = values["nunique"] == 1
    if not same.any() or same.all():
        return ""
    return (
        f"Rows come in groups of {sizes.iloc[0]} of one condition, and row {int(np.argmax(same)) + 1} of each group "
        f"always has the rating {values['first'][same].iloc[0]:g}, as the start of a slider has: leave such rows out."
    )


def _distinguished(source: Source, table: pd.DataFrame, keys: pd.DataFrame) -> str:
    """Return the remedy that names a column which distinguishes the rows of each trial; "" if none does.

    Such a column has a few words, each once in every group of consecutive rows of one condition.
    """
    if table.index.nlevels != 2:
        return ""
    group = (keys != keys.shift()).any(axis=1).cumsum().to_numpy()
    size, count = len(table), int(group[-1]) if len(group) else 0
    if count < 2 or size % count or size == count:
        return ""
    cells = source.cells.loc[table.index]
    for name in cells:
        values = cells[name]
        if (
            name not in source.columns.values()
            and values.nunique() == size // count
            and not pd.DataFrame({"group": group, "value": values.to_numpy()}).duplicated().any()
        ):
            words = [*dict.fromkeys(values)]
            likely = next((word for word in words if word.casefold() in MEASURES), values.iloc[-1])
            return (
                f"; {printable(str(name))} ({few(words)}) separates them: choose with {where_like(str(name), likely)}"
            )
    return ""
