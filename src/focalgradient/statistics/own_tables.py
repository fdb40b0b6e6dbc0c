"""Parsing of the user's own tables: column lookup, conversion of cells, and location of invalid cells for messages."""

from __future__ import annotations

import codecs
import csv
import io
import math
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import check_width, printable, read_bytes
from focalgradient.files.workbooks import is_workbook, sheet_text
from focalgradient.statistics.own_names import clean, united
from focalgradient.statistics.own_rows import without_headers, without_summaries

__all__ = [
    "ABSENT",
    "PARTICIPANT",
    "TABLES",
    "answered",
    "by_role",
    "catch_trials",
    "columns_like",
    "conditions_like",
    "few",
    "found_columns",
    "numbers",
    "others",
    "place",
    "read_table",
    "renamed",
    "rows_of",
    "truths",
    "unused",
    "with_participants",
]

ABSENT = frozenset({"", "na", "n/a", "nan", "null", "none", ".", "-", "#n/a"})
"""Cells that count as empty."""

TRUTH = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False, "": False, "n/a": False}

PARTICIPANT = ("participant", "subject", "subj", "id", "observer")
"""Recognised names of the participant column."""


MOST_ROWS = 200_000
"""Maximum number of rows: 200 participants x 1,000 trials take half a minute, 900,000 rows take three."""

LARGEST_TABLE = 256 * 2**20
"""Maximum file size in bytes: the maximum number of rows at 1,300 characters each."""


LISTED = 12
"""Maximum number of columns listed in an error message."""


TABLES = (".csv", ".tsv", ".xlsx")
"""Extensions of tables; a file with another extension is a table only if its text has the form of one."""

TABLE_OR_DATA_SET = "a CSV, TSV or XLSX file, or the folder of a data set (with dataset_description.json)"
"""Remedy for a file that is not a table."""


def columns_like(role: str) -> str:
    """Return the remedy that names the column of a role, in terms of `read_ratings` and `read_reports`."""
    return f'name it with columns={{"{role}": "NAME"}}'


def no_column(path: Path, role: str, otherwise: str = "") -> InputError:
    """Return the error for a missing column, listing those present; `otherwise` adds another remedy."""
    there = ", ".join(str(name)[:40] for name in read_table(path).columns[:LISTED])
    return InputError(
        f"{printable(path)} has no column for {role} (its columns are {there}): {columns_like(role)}{otherwise}."
    )


def conditions_like(meaning: str) -> str:
    """Return the remedy that gives the meaning of a word."""
    return f'give its meaning with conditions={{"NAME": "{meaning}"}}'


def read_table(path: Path) -> pd.DataFrame:
    """Read the cells of a CSV, TSV or XLSX file as text, without blank rows; the index is (file, row).

    The delimiter is the most frequent one of the header: comma, semicolon or tab. Blank lines and lines beginning with
    # before the header are skipped. Files with more than 4,096 columns or `MOST_ROWS` rows, or larger than
    `LARGEST_TABLE`, raise `InputError` before their cells are parsed.
    """
    text = _text(path)
    lines = text.splitlines()
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    delimiter = max(";\t,", key=first.count)
    check_width(lines, delimiter, printable(path))
    if len(lines) > MOST_ROWS:
        raise InputError(
            f"{printable(path)} has {len(lines):,} rows, but a table may have {MOST_ROWS:,} at most: leave out what is "
            "not needed."
        )
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
    except csv.Error as error:
        raise InputError(f"{printable(path)} cannot be read as a table ({error}): give a CSV or TSV file.") from error
    top = next((number for number, row in enumerate(rows) if any(row) and not row[0].startswith("#")), len(rows))
    header = [name.strip() for name in rows[top]] if top < len(rows) else []
    again = [name for name, count in Counter(header).items() if name and count > 1]
    if not any(header) or again:
        what = f"the column {again[0]} twice" if again else "no header"
        raise InputError(f"{printable(path)} has {what}: give each column a name of its own in the first row.")
    width = len(header)
    ragged = any("".join(row[width:]).strip() for row in rows[top + 1 :])
    if path.suffix.lower() not in TABLES and (width == 1 or ragged):
        raise InputError(f"{printable(path)} is not a table: give {TABLE_OR_DATA_SET}.")
    kept, places = [], []
    for number, row in enumerate(rows[top + 1 :], start=top + 2):
        if any(cell.strip() for cell in row[width:]):
            raise InputError(f"{printable(path)}, row {number}: there are {len(row)} cells, but must be {width}.")
        if any(cell.strip() for cell in row):
            kept.append((row + [""] * width)[:width])
            places.append((path.name, number))
    index = pd.MultiIndex.from_tuples(places, names=["file", "row"]) if places else None
    return pd.DataFrame(kept, columns=header, dtype=str, index=index)


def _text(path: Path) -> str:
    data = read_bytes(path, "a table", LARGEST_TABLE)
    if is_workbook(data):
        return sheet_text(data, printable(path))
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):  # "Unicode text" of spreadsheet programs
        return data.decode("utf-16", "replace")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    if "\0" in text:
        raise InputError(f"{printable(path)} is not a table of text: give {TABLE_OR_DATA_SET}.")
    return text


def found_columns(
    path: Path, table: pd.DataFrame, roles: Mapping[str, tuple[str, ...]], columns: Mapping[str, str]
) -> dict[str, str]:
    """Return the file's column for each role: the one given in `columns`, else one with a recognised name."""
    header = [str(name) for name in table.columns]
    by_name = {clean(name).casefold(): name for name in header} | {name: name for name in header}
    found: dict[str, str] = {}
    wrong = []
    for given, name in columns.items():
        role = "participant_id" if given == "participant" else given
        theirs = by_name.get(name, by_name.get(clean(name).casefold()))
        if role not in roles:
            wrong.append(f"{given} is not known: use {', '.join(['participant', *list(roles)[1:]])} = the file's name")
        elif theirs is None:
            wrong.append(f"{printable(path)} has no column {name} for {given}: it has {few(header)}")
        elif theirs in found.values():
            wrong.append(f"{name} is given for {given}, but for another column, too: give each a column of its own")
        else:
            found[role] = theirs
    if wrong:
        raise InputError(f"columns: {'; '.join(wrong)}.")
    lower = {clean(name).casefold(): name for name in header if name not in found.values()}
    for role, others in roles.items():
        if role not in found:
            near = next((lower[name] for name in (role, *others) if name in lower), None)
            if near is not None:
                found[role] = near
    return found


NAMED = {"participant_id": "participant", "session": "session", "scene": "scene"}
"""Roles whose spellings are merged, with the noun used in messages."""


def with_participants(
    path: Path, table: pd.DataFrame, theirs: Mapping[str, str], notes: list[str], notices: list[str]
) -> pd.DataFrame:
    """Return the rows with cleaned cells and merged spellings; a missing participant column or name is an error."""
    if "participant_id" not in table:
        raise no_column(path, "participant")
    table = without_summaries(without_headers(table, theirs, notices), notices)
    if any(table["participant_id"] != table["participant_id"].str.strip()):
        notes.append("Spaces at the ends of participants’ names were removed.")
    for role in table:
        if role in NAMED:
            table = united(table, str(role), NAMED[str(role)], notices)
        else:
            table[role] = table[role].map({cell: clean(cell) for cell in table[role].unique()})
    unnamed = table["participant_id"].str.lower().isin(ABSENT)
    if unnamed.any():
        raise InputError(f"{place(table, unnamed)}: the participant is missing: name it.")
    return table


def renamed(table: pd.DataFrame, theirs: Mapping[str, str]) -> pd.DataFrame:
    """Return the columns in use, named by role."""
    return pd.DataFrame({role: table[name] for role, name in theirs.items()}, index=table.index)


def by_role(
    path: Path, table: pd.DataFrame, theirs: Mapping[str, str], notes: list[str], notices: list[str], one: str = ""
) -> pd.DataFrame:
    """Name the columns in use by role and clean them; `one`, if set, replaces a missing participant column."""
    notes += unused([str(name) for name in table if name not in theirs.values()])
    table = renamed(table, theirs)
    if one and "participant_id" not in table:
        table["participant_id"] = one
        notes.append("There is no column of participants: all trials are one person's.")
    return with_participants(path, table, theirs, notes, notices)


def answered(
    path: Path, table: pd.DataFrame, role: str, record: str, notes: list[str], absent: frozenset[str] = ABSENT
) -> pd.DataFrame:
    """Return the rows with a value in the column `role`; note the others."""
    missing = table[role].str.strip().str.lower().isin(absent)
    if missing.all():
        raise InputError(f"{printable(path)} holds no {record}: the column given for {role}s is empty.")
    if not missing.any():
        return table
    who = few(sorted(set(table["participant_id"][missing])))
    notes.append(f"{rows_of(missing)} left out, without a {role} (participants {who}).")
    return table[~missing].copy()


def catch_trials(table: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Add the boolean column `catch`; without such a column no trial is a catch trial, which is noted."""
    if "catch" in table:
        return table.assign(catch=truths(table, "catch"))
    notes.append("There is no column of catch trials: no trial counts as one.")
    return table.assign(catch=False)


def rows_of(left_out: pd.Series[bool]) -> str:
    """Format a number of rows for a note: "1 row was", "3 rows were"."""
    count = int(left_out.sum())
    return "1 row was" if count == 1 else f"{count:,} rows were"


def few(names: list[str]) -> str:
    """Join up to ten distinct names."""
    several = list(dict.fromkeys(names))
    return ", ".join(several[:10]) + (f" and {len(several) - 10} more" if len(several) > 10 else "")


def unused(names: list[str]) -> list[str]:
    """Return a note that lists unused columns, if any."""
    named = [printable(name) for name in names if name]
    return [f"Columns that were not used: {few(named)}."] if named else []


def place(table: pd.DataFrame, wrong: pd.Series[bool]) -> str:
    """Return file, row, and in a wide table column, of the first invalid row."""
    file, row, *column = table.index[int(wrong.to_numpy().argmax())]
    return f"{file}, row {row}" + (f", column {printable(column[0])}" if column else "")


def truths(table: pd.DataFrame, role: str) -> pd.Series[bool]:
    """Convert yes/no cells to booleans."""
    texts = table[role].str.strip().str.lower()
    wrong = ~texts.isin(list(TRUTH))
    if wrong.any():
        raise InputError(f"{place(table, wrong)}: {role} is {table[role][wrong].iloc[0]!r}, but must be 0 or 1.")
    return texts.map(TRUTH).astype(bool)


def numbers(table: pd.DataFrame, role: str, texts: pd.Series[str], *, empty: bool = False) -> pd.Series[float]:
    """Parse numbers with a decimal point or comma; empty cells become NaN if `empty` is True, else an error."""
    absent = texts.str.lower().isin(ABSENT)
    values = pd.to_numeric(texts.str.replace(",", ".", regex=False), errors="coerce").astype(float)
    wrong = ~values.map(math.isfinite).astype(bool)
    if empty:
        wrong &= ~absent
    if wrong.any():
        raise InputError(
            f"{place(table, wrong)}: {role} is {printable(texts[wrong].iloc[0])!r}, but must be a number, like 1.4"
            f"{others(texts[wrong])}."
        )
    return values


def others(cells: pd.Series[str]) -> str:
    """Return a parenthetical list of further invalid cells, to follow a sentence on the first."""
    more = [repr(printable(one)) for one in cells.unique()[1:]]
    return f" (and so are {few(more)}, {len(cells):,} cells)" if more else ""
