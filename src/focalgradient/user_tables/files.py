"""Reading of the user's own files as cells of text: one file, or the files of one data set."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable, read_bytes, read_json
from focalgradient.files.cells import as_number
from focalgradient.files.containers import with_parts
from focalgradient.files.tables import LARGEST_TABLE, RaggedTableError, TextTable, parse_table, unique_names
from focalgradient.user_tables.names import clean, few
from focalgradient.user_tables.schema import ABSENT

__all__ = [
    "SUBJECT",
    "TABLES",
    "Paths",
    "UserTable",
    "Where",
    "chosen_rows",
    "file_labels",
    "person_of",
    "read_table",
    "states_simulated",
    "text_table",
    "with_points",
]

SUBJECT = re.compile(r"sub-[^_]+_")
"""Begin of names of files in the Brain Imaging Data Structure (BIDS)."""

SESSION = re.compile(r"(?:^|[\s_.-]+)(?:sess?|session|run|block|day|visit|sitzung|tag)[\s_-]*\d+$", re.IGNORECASE)
"""End of a file's name that numbers the sessions of a participant."""

TABLES = (".csv", ".tsv", ".xlsx", ".json", ".jsonl", ".ndjson")
"""Extensions of tables; a file with another extension is a table only if its text has the form of one."""

WHAT = "a table, or the folder of a data set"

TABLE_OR_DATA_SET = "a CSV, TSV, XLSX or JSON file, or the folder of a data set (with dataset_description.json)"
"""Remedy for a file that is not a table."""


@dataclass(frozen=True, slots=True, eq=False)
class UserTable:
    """Cells of a file, or of the files of one data set, as `read_table` returns them.

    Parameters
    ----------
    paths
        Files.
    name
        Name for messages.
    cells
        All cells as text; the index is (file, row). Its attribute "delimiter" holds that of each file.
    notes
        Assumptions, one sentence each.
    lacking
        Columns that only some of the files have, with a file that lacks them.
    chosen
        Columns by whose values rows were chosen.
    """

    paths: tuple[Path, ...]
    name: str
    cells: pd.DataFrame
    notes: tuple[str, ...]
    lacking: Mapping[str, str] = field(default_factory=dict)
    chosen: tuple[str, ...] = ()


Paths = str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | UserTable
"""One file, or the files of one data set, or what `read_table` read of them."""

Where = Mapping[str, str | Sequence[str]]
"""Value or values by column: the rows that are analysed."""


def read_table(paths: Paths | Sequence[Paths]) -> UserTable:
    """Read the cells of a CSV, TSV, XLSX or JSON file, or of several, as text, without blank rows.

    Raises
    ------
    InputError
        If a file is not a table; the message says what it is.
    """
    if isinstance(paths, UserTable):
        return paths
    if isinstance(paths, str | os.PathLike):
        return _user_table(Path(paths), read_bytes(paths, WHAT, LARGEST_TABLE))
    tables = [read_table(path) for path in paths]
    if len(tables) == 1:
        return tables[0]
    files = tuple(path for table in tables for path in table.paths)
    spelt: dict[str, str] = {}
    parts, delimiters = dict[str, pd.DataFrame](), dict[str, str]()
    for label, table in zip(file_labels(files), tables, strict=True):
        (delimiters[label],) = table.cells.attrs["delimiter"].values()
        names = [str(name) for name in table.cells]
        if len({clean(name).casefold() for name in names}) == len(names):
            names = [spelt.setdefault(clean(name).casefold(), name) for name in names]
        cells = table.cells.set_axis(names, axis=1)
        if len(cells):
            parts[label] = cells.droplevel(0)
    if not parts:
        return tables[0]
    cells = pd.concat(parts, names=["file"]).fillna("")
    cells.attrs = {"delimiter": delimiters}
    lacking = {str(name): label for name in cells for label, part in parts.items() if name not in part}
    name = f"the table of {tables[0].name} and {len(files) - 1} more"
    return UserTable(files, name, cells, _united_notes(tables), lacking)


def chosen_rows(table: UserTable, where: Where | None, named: Collection[str] = ()) -> UserTable:
    """Return the table with the rows whose columns have one of the values of `where`, which is noted.

    Columns that are empty in all chosen rows are left out, but for those `named`.
    """
    if not where:
        return table
    by_name = {clean(str(column)).casefold(): column for column in table.cells}
    for column, given in where.items():
        cells, values = table.cells, [given] if isinstance(given, str) else [*given]
        theirs = by_name.get(clean(column).casefold())
        if theirs is None:
            raise InputError(f"where: {table.name} has no column {column}: it has {few([*map(str, cells)])}.")
        wanted = {clean(value).casefold() for value in values}
        kept = cells[theirs].map(lambda cell, wanted=wanted: clean(cell).casefold() in wanted).astype(bool)
        if not kept.any():
            raise InputError(
                f"where: {table.name} has no row whose {column} is {' or '.join(values)}: it has "
                f"{few([*cells[theirs]])}."
            )
        note = f"Of {len(cells):,} rows {kept.sum():,} were chosen, whose {theirs} is {' or '.join(values)}."
        notes, chosen = (*table.notes, note), (*table.chosen, str(theirs))
        table = replace(table, cells=cells[kept].copy(), notes=notes, chosen=chosen)
    names = {clean(name).casefold() for name in named}
    filled = [
        not table.cells[name].str.strip().str.casefold().isin([*ABSENT]).all() or clean(str(name)).casefold() in names
        for name in table.cells
    ]
    return replace(table, cells=table.cells.loc[:, filled])


def _united_notes(tables: Sequence[UserTable]) -> tuple[str, ...]:
    """Return the notes of all files; of those that differ in the file's name only the first, with their number."""
    alike: dict[str, list[str]] = {}
    for table in tables:
        for note in table.notes:
            alike.setdefault(note.replace(table.paths[0].name, ""), []).append(note)
    return tuple(
        notes[0] if len(notes) == 1 else f"{notes[0]} This applies to {len(notes)} files." for notes in alike.values()
    )


def text_table(text: str, name: str = "own.csv") -> UserTable:
    r"""Read the cells of a table from its text, as `read_table` from a file of that name.

    >>> text_table("subject;rating\nA;1,4\n").cells.to_numpy().tolist()
    [['A', '1,4']]
    """
    return _user_table(Path(name), text.encode())


def _user_table(path: Path, data: bytes) -> UserTable:
    """Parse the content of one file."""
    is_named = path.suffix.lower() in TABLES
    no_table = InputError(f"{printable(path)} is not a table: give {TABLE_OR_DATA_SET}.")
    if path.suffix.lower() == ".toml":
        raise InputError(
            f"{printable(path)} is a settings file: give {TABLE_OR_DATA_SET}; 'focalgradient report --preregister' "
            "takes a design."
        )
    try:
        table = parse_table(data, printable(path), WHAT)
    except RaggedTableError as error:
        if is_named:
            raise
        raise no_table from error
    if not data.strip():
        raise InputError(f"{table.name} is empty: give a header and a row for each trial.")
    header, rows, places = list(table.header), list(table.rows), list(table.places)
    numbers = [as_number(name.replace(",", ".")) is not None for name in header]
    again = [sum(cell == name for cell in cells) for name, cells in zip(header, zip(*rows, strict=False), strict=False)]
    is_trial = any(numbers) and any(
        count > max(1, len(rows) / 4) for count, is_number in zip(again, numbers, strict=False) if not is_number
    )
    if not any(header) or all(numbers) or is_trial:
        raise InputError(f"{table.name} has no header: give each column a name of its own in the first row.")
    if len(header) == 1 and is_named:
        raise InputError(
            f"{table.name} has the one column {printable(header[0][:60])!r}: separate columns by commas, "
            "semicolons or tabs."
        )
    if not is_named and (len(header) == 1 or any(len(row) != len(header) for row in rows)):
        raise no_table
    notes = [note.replace(table.name, path.name) for note in table.notes]
    if len(rows) > 1 and sum("ImportId" in cell for cell in rows[1]) > len(header) / 2:  # Qualtrics
        notes.append(f"Rows {places[0]} and {places[1]} of {path.name} repeat the header, and were left out.")
        rows, places = rows[2:], places[2:]
    header = unique_names(header)
    if any(cell.startswith("{") for row in rows for cell in row):
        header, rows = with_parts(header, rows)
    index = pd.MultiIndex.from_tuples([(path.name, place) for place in places], names=["file", "row"])
    cells = pd.DataFrame(rows, columns=header, dtype=str, index=index if rows else None)
    cells.attrs["delimiter"] = {path.name: table.delimiter}
    return UserTable((path,), printable(path), cells, tuple(notes))


def file_labels(files: Sequence[Path]) -> list[str]:
    """Return the names of files, with their folders where names are equal, as JATOS calls all files data.txt."""
    labels = [path.name for path in files]
    if len({*labels}) == len(labels):
        return labels
    root = os.path.commonpath([path.absolute().parent for path in files])
    return [path.absolute().relative_to(root).as_posix() for path in files]


def states_simulated(path: Path) -> bool:
    """Return whether the sidecar beside a table, as of a data set in BIDS, says that its observers were simulated."""
    sidecar = path.with_suffix(".json")
    if sidecar == path or not sidecar.is_file():
        return False
    with suppress(InputError):
        content = read_json(sidecar, "a sidecar")
        return isinstance(content, dict) and content.get("Simulated") is True
    return False


def person_of(file: str) -> str:
    """Return the participant whom a file's name states, or the name.

    >>> person_of("sub-01_task-depth_run-2_events.tsv"), person_of("anna.csv"), person_of("P01_session2.csv")
    ('sub-01', 'anna', 'P01')
    """
    path = Path(file)
    if SUBJECT.match(path.name):
        return path.stem.partition("_")[0]
    rest = SESSION.sub("", path.stem)
    return (path.with_name(rest) if rest else path.parent if path.parent.name else path.with_suffix("")).as_posix()


def with_points(table: pd.DataFrame, roles: Sequence[str], delimiters: Mapping[str, str]) -> pd.DataFrame:
    """Return the table with decimal points in the columns of numbers; the mark is decided for all of a file."""
    if not roles or table.empty:
        return table
    files, places = (table.index.get_level_values(level) for level in (0, 1))
    texts = table[[*roles]].to_numpy(object, copy=True)
    changed = False
    for file, rows in table.groupby(files, sort=False).indices.items():
        cells = tuple(tuple(map(clean, row)) for row in texts[rows])
        whole = TextTable(str(file), tuple(roles), cells, tuple(places[rows]), delimiters[str(file)])
        if (pointed := whole.with_points()) is not whole:
            texts[rows], changed = pointed.rows, True
    return table.assign(**dict(zip(roles, texts.T, strict=True))) if changed else table
