"""Which tables are the parts of one data set: those of one experiment, of whose participants each file holds some."""

from __future__ import annotations

from collections.abc import Sequence

from focalgradient.errors import InputError
from focalgradient.user_tables.files import UserTable, file_labels, person_of, read_table
from focalgradient.user_tables.names import clean, few, in_several
from focalgradient.user_tables.schema import PARTICIPANT, Schema, found_columns

__all__ = ["data_sets"]


def _are_parts(tables: Sequence[UserTable], people: Sequence[set[str]]) -> bool:
    """Return whether tables of these people are the parts of one data set.

    They are if one of them has a single participant, if all have the same columns, or if a participant occurs in two.

    Raises
    ------
    InputError
        If several files hold one participant each, all of the same name.
    """
    if len(people) > 1 and all(len(names) == 1 for names in people) and len(set.union(*people)) == 1:
        raise InputError(
            f"all {len(people)} files are of the participant {min(people[0])}: give people names of their own, or "
            "sessions of one person in one table with a column session."
        )
    columns = {frozenset(clean(str(name)).casefold() for name in table.cells) for table in tables}
    return any(len(names) <= 1 for names in people) or len(columns) == 1 or bool(in_several(people))


def data_sets(
    tables: Sequence[UserTable], participant: str | None = None, *, separate: bool = False
) -> tuple[list[UserTable], list[str]]:
    """Return tables as data sets, with notices: as one if they are its parts and not `separate` experiments.

    Parameters
    ----------
    tables
        The tables.
    participant
        Column of the participants, if it was named.
    separate
        True if each table is an experiment of its own.
    """
    people = _people(tables, participant)
    if not separate and _are_parts(tables, people):
        return [read_table(tables)], []
    again = in_several(people)
    return [*tables], [
        f"{len(tables)} files taken as {len(tables)} data sets: "
        + ("they are separate experiments" if separate else "their columns differ, and no participant occurs in two")
        + (f"; taken for different people though in several of them: {few(again)}" if again else "")
        + ("." if separate else "; give them the same columns if they are parts of one table.")
    ]


def _people(tables: Sequence[UserTable], participant: str | None = None) -> list[set[str]]:
    """Return the participants of each table, by their column or by the names of the files."""
    people: list[set[str]] = []
    columns = {} if participant is None else {"participant": participant}
    for label, table in zip(file_labels([part.paths[0] for part in tables]), tables, strict=True):
        theirs = found_columns(table.name, table.cells, Schema({"participant_id": PARTICIPANT}), columns)
        cells = table.cells[theirs["participant_id"]].unique() if theirs else [person_of(label)]
        people.append({clean(cell) for cell in cells} - {""} if theirs else {*cells})
    return people
