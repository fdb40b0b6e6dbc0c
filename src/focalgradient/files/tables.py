"""Reading of users' tables as text cells: container, encoding, delimiter, header, decimal mark and units."""

from __future__ import annotations

import codecs
import csv
import io
import math
import os
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from focalgradient.errors import InputError
from focalgradient.files.cells import NUMBER, SUFFIXES, as_number, codes_of, is_date, name_and_unit
from focalgradient.files.containers import is_workbook, records_of, refuse_other_container
from focalgradient.files.names import printable
from focalgradient.files.reading import MOST_COLUMNS, check_width, read_bytes
from focalgradient.files.workbooks import sheet_rows

__all__ = [
    "RaggedTableError",
    "TextTable",
    "parse_table",
    "read_cells",
    "unique_names",
]

MOST_ROWS = 200_000
"""Maximum number of rows: 200 participants x 1,000 trials take half a minute, 900,000 rows take three."""

LARGEST_TABLE = 256 * 2**20
"""Maximum file size in bytes: the maximum number of rows at 1,300 characters each."""

SAMPLE = 200
"""Number of lines by which the delimiter is chosen."""

WITH_COMMA = re.compile(r"[+-]?\d*,\d+(?:e[+-]?\d+)?", re.IGNORECASE)
"""Number with one comma."""

GROUPED = re.compile(
    r"[+-]?\d{1,3}(?:([.,'’ \u00a0\u202f])\d{3})(?:(?:\1\d{3})+(?:[.,]\d+)?|(?!\1)[.,]\d+)", re.IGNORECASE
)
"""Number with a thousands separator beyond doubt: several separators, or another mark behind it."""

MAYBE_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
"""Number that may have a thousands separator or three decimals, like 1,050."""


@dataclass(frozen=True, slots=True, eq=False)
class TextTable:
    """Table of a user as text cells.

    Parameters
    ----------
    name
        File name, for messages.
    header
        Names of the columns; empty if the table has none.
    rows
        Cells of the non-empty rows below the header, one for each of its cells (without a header as they are).
    places
        Number of each row in the file, from 1.
    delimiter
        Delimiter of the columns; "" if the container separates them.
    comments
        Comment lines.
    notes
        Assumptions, one sentence each.
    """

    name: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    places: tuple[int, ...]
    delimiter: str = ""
    comments: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def decimal(self, columns: Sequence[int] | None = None) -> Literal[".", ","]:
        """Return the decimal mark of the numbers in `columns` (all by default), one for the whole table.

        Raises
        ------
        InputError
            If numbers have thousands separators, or marks are mixed: both readings are given.
        """
        first: dict[str, tuple[int, int, str]] = {}
        clear = set()
        for number, row in enumerate(self.rows):
            for column in range(len(row)) if columns is None else columns:
                cell = row[column].strip() if column < len(row) else ""
                mark = "," if "," in cell else "." if "." in cell else ""
                if not mark:
                    continue
                if GROUPED.fullmatch(cell) and not is_date(cell):
                    raise InputError(
                        f"{self._place(number, column)} is {printable(cell)!r}, which is "
                        f"{' or '.join(_readings(cell))}: write numbers without thousands separators."
                    )
                if (NUMBER if mark == "." else WITH_COMMA).fullmatch(cell):
                    first.setdefault(mark, (number, column, cell))
                    if not MAYBE_GROUPED.fullmatch(cell):
                        clear.add(mark)
        if len(first) == 2:
            (number, column, comma), (_, _, point) = first[","], first["."]
            raise InputError(
                f"{self._place(number, column)} is {comma!r}, but other cells have a decimal point, like {point!r}: it "
                f"is {' or '.join(_readings(comma))}; write all numbers with one decimal mark."
            )
        decimal: Literal[".", ","] = "," if "," in first else "."
        usual = "." if self.delimiter != ";" else ","
        if first and decimal not in clear and decimal != usual:
            number, column, cell = first[decimal]
            raise InputError(
                f"{self._place(number, column)} is {cell!r}, which is {' or '.join(_readings(cell))}: write all "
                "numbers with a decimal point, and without thousands separators."
            )
        return decimal

    def records(self, numeric: Collection[str] | None = None) -> list[dict[str, str]]:
        """Return the rows as cells by column, with decimal points in the columns `numeric` (all by default).

        Raises
        ------
        InputError
            If a column has no name or occurs twice, there are no rows, or as for `decimal`.
        """
        twice = [name for name, count in Counter(self.header).items() if name and count > 1]
        wrong = (
            f"has the column {twice[0]} twice"
            if twice
            else "is empty"
            if not self.header
            else "has a column without a name"
            if not all(self.header)
            else "has no rows below its header"
            if not self.rows
            else ""
        )
        if wrong:
            raise InputError(f"{self.name} {wrong}: give one row for each record below a header of their names.")
        columns = None if numeric is None else [at for at, name in enumerate(self.header) if name in numeric]
        rows = self.with_points(columns).rows
        return [dict(zip(self.header, map(str.strip, row), strict=True)) for row in rows]

    def with_points(self, columns: Sequence[int] | None = None) -> TextTable:
        """Return the table with decimal points in the numbers of `columns` (all by default).

        Raises
        ------
        InputError
            As for `decimal`.
        """
        if self.decimal(columns) == ".":
            return self
        chosen = None if columns is None else frozenset(columns)

        def cells(row: tuple[str, ...]) -> tuple[str, ...]:
            return tuple(
                cell.replace(",", ".")
                if (chosen is None or column in chosen) and WITH_COMMA.fullmatch(cell.strip())
                else cell
                for column, cell in enumerate(row)
            )

        return replace(self, rows=tuple(map(cells, self.rows)))

    def numbers(
        self, column: int, expected: str = "a number", *, lowest: float = -math.inf, empty: bool = False
    ) -> list[float]:
        """Return the numbers of a column with decimal points; NaN where cells may be `empty`.

        Raises
        ------
        InputError
            If a cell is not a number, is below `lowest`, or is a code of missing values.
        """
        cells = [row[column].strip() for row in self.rows]
        codes, numbers = codes_of(cells, signed=lowest < 0), []
        for row, cell in enumerate(cells):
            value = math.nan if empty and not cell else as_number(cell)
            if cell in codes and not lowest > float(cell):
                raise InputError(f"{self._place(row, column)} is {cell}, which marks a missing value: remove it.")
            if value is None or value < lowest:
                raise InputError(f"{self._place(row, column)} is {printable(cell)!r}, but must be {expected}.")
            numbers.append(value)
        return numbers

    def _place(self, row: int, column: int) -> str:
        named = self.header[column] if column < len(self.header) else ""
        return f"{self.name}, row {self.places[row]}: {printable(named) or f'cell {column + 1}'}"


def _unwrapped(cell: str) -> str:
    """Return the text of a cell that keeps spreadsheet programs from converting it, like ="01"."""
    return cell[2:-1] if cell.startswith('="') and cell.endswith('"') and len(cell) > 2 else cell


def _readings(cell: str) -> list[str]:
    """Return the numbers that a cell with a comma or a point may be."""
    bare = re.sub(r"['’ \u00a0\u202f]", "", cell)
    last = max(bare.rfind(","), bare.rfind("."))
    readings = [re.sub("[.,]", "", bare)]
    if len({mark for mark in ",." if mark in bare}) == 2:
        readings = [re.sub("[.,]", "", bare[:last]) + "." + bare[last + 1 :], bare.replace(",", "")]
    elif bare.count(",") + bare.count(".") == 1:
        readings.insert(0, bare.replace(",", "."))
    return list(dict.fromkeys(readings))


def _like_number(cell: str) -> bool:
    """Return whether a cell is a number with either decimal mark, or nan or inf, and so no heading."""
    text = cell.strip().casefold().lstrip("+-")
    return as_number(text.replace(",", ".")) is not None or text in ("nan", "inf", "infinity", "1e999")


def read_cells(
    path: str | os.PathLike[str],
    what: str = "a table",
    *,
    largest: int = LARGEST_TABLE,
    header: bool = True,
    spaces: bool = False,
    columns: int | None = None,
) -> TextTable:
    """Read a CSV, TSV, XLSX or JSON file, recognised by its content, as text cells.

    Parameters
    ----------
    path
        Path of the file.
    what
        Kind of table, with its article, for messages.
    largest
        Maximum size in bytes.
    header
        True if the first row names the columns; False if it may: then it does where no cell is a number.
    spaces
        True if spaces may separate columns.
    columns
        Number of columns that the table must have, if that is known.

    Raises
    ------
    InputError
        If the file is of another kind (which is named), or no table.
    """
    return parse_table(
        read_bytes(path, what, largest), printable(path), what, header=header, spaces=spaces, columns=columns
    )


class RaggedTableError(InputError):
    """A row has more cells than the header."""


def parse_table(
    data: bytes,
    name: str,
    what: str = "a table",
    *,
    header: bool = True,
    spaces: bool = False,
    columns: int | None = None,
) -> TextTable:
    r"""Parse the content of a file, as `read_cells` does.

    >>> parse_table(b"sep=;\n# a comment\na;b\n1,5;2\n", "x.csv").with_points().rows
    (('1.5', '2'),)
    """
    notes, comments, delimiter = list[str](), list[str](), ""
    refuse_other_container(data, name, what)
    if is_workbook(data):
        lines = sheet_rows(data, name, notes)
    else:
        text = _decoded(data, name, what, notes)
        records = records_of(text, name)
        if records is None:
            lines, delimiter = _split(text, name, spaces=spaces, columns=columns)
        else:
            lines = [(number, cells) for number, cells in enumerate(records)]
    check_width(("\t" * (len(cells) - 1) for _, cells in lines), "\t", name)
    if len(lines) > MOST_ROWS:
        raise InputError(
            f"{name} has {len(lines):,} rows, but a table may have {MOST_ROWS:,} at most: leave out rows or columns."
        )
    kept = list[tuple[int, list[str]]]()
    for number, cells in lines:
        filled = [cell for cell in cells if cell.strip()]
        if not filled:
            continue
        if filled[0] == cells[0] and cells[0].lstrip().startswith(("#", "%")) and (len(filled) == 1 or not kept):
            comments.append(" ".join(filled))
            continue
        kept.append((number, cells))
    names: list[str] = []
    if header:
        titles = _titles(kept)
        comments += [" ".join(cells).strip() for _, cells in kept[:titles]]
        notes += [
            f"Above the names of the columns stands a title: {printable(row)}." for row in comments[-titles:] if titles
        ]
        kept = kept[titles:]
    if kept and (header or not any(map(_like_number, kept[0][1]))):
        names = [" ".join(_unwrapped(cell).split()) for cell in kept.pop(0)[1]]  # headings of several lines
    if names and kept and header and (second := _second_header(names, [cells for _, cells in kept[:SAMPLE]])):
        names = second
        place, _ = kept.pop(0)
        notes.append(f"The column names are in two rows, of which {place} is the second: {', '.join(names)}.")
    if names and kept and header and (delimiter == " " or data.lstrip(b"\xef\xbb\xbf").startswith(b'"')):
        first = [cells[0] for _, cells in kept]
        if all(len(cells) == len(names) + 1 for _, cells in kept) and len(set(first)) == len(first):
            names.insert(0, "")
            notes.append(f"The first cells of {name} are the names of rows, as R writes them.")
    width = len(names)
    if delimiter and kept and not data.rstrip(b" \0").endswith((b"\n", b"\r")):
        (number, last), others = kept[-1], {len(cells) for _, cells in kept[:-1]}
        if others == {width} and 1 < len(last) < width:
            raise InputError(
                f"{name} ends within row {number}, after {len(last)} of {width} cells: copy the whole file again, or "
                "remove that row."
            )
    for number, cells in kept:
        if width and any(cell.strip() for cell in cells[width:]):
            why = "decimal commas need semicolons or tabs between the columns" if delimiter == "," else "one a name"
            raise RaggedTableError(f"{name}, row {number}: there are {len(cells)} cells, but must be {width} ({why}).")
    rows = tuple(tuple(map(_unwrapped, (cells + [""] * width)[: width or len(cells)])) for _, cells in kept)
    places = tuple(number for number, _ in kept)
    return TextTable(name, tuple(names), rows, places, delimiter, tuple(comments), tuple(notes))


def _titles(rows: Sequence[tuple[int, Sequence[str]]]) -> int:
    """Return the number of rows of one cell above a row of names, as titles are."""
    filled = [sum(bool(cell.strip()) for cell in cells) for _, cells in rows]
    start = next((number for number, count in enumerate(filled) if count > 1), 0)
    usual = Counter(filled).most_common(1)[0][0] if filled else 0
    return start if usual > 2 and not any(map(_like_number, rows[start][1])) else 0


def _second_header(names: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the names joined with those in the row below, if that row holds units, or the parts of spanning names.

    >>> _second_header(["near", "", "far", ""], [["sharp", "open", "sharp", "open"], ["1", "2", "1", "3"]])
    ['near sharp', 'near open', 'far sharp', 'far open']
    >>> _second_header(["id", "rt"], [["", "ms"], ["a", "300"]]), _second_header(["id", "sex"], [["1", "m"]])
    (['id', 'rt (ms)'], [])
    """
    names = [*names, *[""] * (len(rows[0]) - len(names))]  # those of merged cells
    width = len(names)
    second = [cell.strip() for cell in (*rows[0], *[""] * width)][:width]
    below = [[cell.strip() for cell in (*row, *[""] * width)][:width] for row in rows[1:]]
    numeric = [all(_like_number(row[at]) for row in below if row[at]) for at in range(width)]
    if not below or any(map(_like_number, second)) or not any(map(all, zip(second, numeric, strict=True))):
        return []
    named = [(name, cell.strip("[]()")) for name, cell in zip(names, second, strict=True)]
    are_units = (unit.casefold() in (*SUFFIXES, "-", "") for _, unit in named)
    if all(not cell or all(parts) for cell, *parts in zip(second, are_units, numeric, strict=True)):
        stated = (unit.casefold() in ("", "-", name_and_unit(name)[1]) for name, unit in named)
        return [name if there else f"{name} ({unit})" for (name, unit), there in zip(named, stated, strict=True)]
    gaps = [at for at in range(1, width) if not names[at] or names[at] == names[at - 1]]
    if not (names[0] or second[0]) or not gaps or not all(second[at] for at in gaps):
        return []
    joined: list[str] = []
    top = ""
    for name, part in zip(names, second, strict=True):
        top = name or top
        joined.append(f"{top} {part}".strip())
    return joined if len({*joined}) == width else []


def unique_names(header: Sequence[str]) -> list[str]:
    """Return the names, a repeated one with the number of its column.

    >>> unique_names(["a", "b", "a", "", ""])
    ['a', 'b', 'a (column 3)', '', ' (column 5)']
    """
    seen: Counter[str] = Counter()
    names = []
    for number, name in enumerate(header, start=1):
        seen[name] += 1
        names.append(name if seen[name] == 1 else f"{name} (column {number})")
    return names


def _decoded(data: bytes, name: str, what: str, notes: list[str]) -> str:
    """Decode text: UTF-8, UTF-16 or UTF-32, else Windows-1252, which is noted; UTF-16 needs no byte order mark."""
    marks = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE, codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    for start, mark in ((1, codecs.BOM_UTF16_LE), (0, codecs.BOM_UTF16_BE)):
        high = data[start:1000:2]
        if not data.startswith(marks) and high.count(0) > len(high) / 2:
            data = mark + data
            notes.append(f"{name} was read as UTF-16, though it has no byte order mark.")
    for mark, encoding in (
        (codecs.BOM_UTF32_LE, "utf-32"),
        (codecs.BOM_UTF32_BE, "utf-32"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
        (b"", "utf-8-sig"),
        (b"", "cp1252"),
    ):
        if data.startswith(mark):
            try:
                text = data.decode(encoding)
            except UnicodeDecodeError:
                continue
            if "\0" in text:
                break
            if encoding == "cp1252":
                notes.append(f"{name} is not UTF-8: its letters were read as Windows-1252.")
            return text
    raise InputError(f"{name} is not text in a known encoding: give {what}, saved as CSV UTF-8.")


def _split(text: str, name: str, *, spaces: bool, columns: int | None) -> tuple[list[tuple[int, list[str]]], str]:
    """Split text into rows of cells with their line numbers; return them and the delimiter."""
    lines = text.splitlines()
    start, given = 0, ""
    if lines and (stated := re.fullmatch(r'"?sep=(.|\\t)"?[,;\t]*', lines[0].strip(" "), re.IGNORECASE)):
        start, given = 1, stated[1].replace("\\t", "\t")
        text = text.partition("\n")[2]
    sample = [line for line in lines[start:] if line.strip() and not line.lstrip().startswith(("#", "%"))][:SAMPLE]
    check_width(sample, ",", name)
    delimiter = given or _delimiter(sample, name, spaces=spaces, columns=columns)
    if delimiter == " ":
        return [(number, _words(line)) for number, line in enumerate(lines[start:], start=start + 1)], delimiter
    rows: list[tuple[int, list[str]]] = []
    padded = any(f'{delimiter} "' in line for line in sample)
    try:
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True, skipinitialspace=padded)
        for cells in reader:
            rows.append((start + len(rows) + 1, cells))
            if len(rows) > MOST_ROWS + 1:
                break
    except csv.Error as error:
        raise InputError(
            f"{name}, row {start + len(rows) + 1}: a quotation mark is not closed, or stands within a cell: double or "
            "remove it."
            if '"' in text
            else f"{name} cannot be read as a table ({error}): give a CSV or TSV file."
        ) from error
    width = max((len(cells) for _, cells in rows), default=0)
    for number, cells in rows if width > 2 else ():
        if any("\n" in cell and cell.count(delimiter) >= width - 1 for cell in cells):
            raise InputError(f"{name}, row {number}: a quotation mark opens a cell that holds whole rows: close it.")
    return rows, delimiter


def _words(line: str) -> list[str]:
    """Split a line at spaces; quotation marks hold words together."""
    if '"' not in line:
        return line.split()
    try:
        return next(csv.reader([line.strip()], delimiter=" ", skipinitialspace=True), [])
    except csv.Error:
        return line.split()


def _delimiter(sample: Sequence[str], name: str, *, spaces: bool, columns: int | None) -> str:
    """Return the delimiter by which most lines have as many cells as the first."""
    commas = columns is not None and all(line.count(",") == columns - 1 for line in sample)
    if commas and not any(mark in line for mark in ";\t" for line in sample):
        return ","
    best, chosen = (0.0, False, 1), " " if spaces else ","
    words = [word for line in sample for word in line.split()] if spaces else [","]
    by_spaces = not any(word.startswith(",") or word.endswith((",", ";")) for word in words)
    for mark in ("\t", ";", *([" "] if by_spaces else []), ",", "|"):
        if mark == "," and all(re.fullmatch(r"[^,]*\d,\d[^,]*|[^,]*", line) for line in sample) and spaces:
            single = [line for line in sample if "," in line]
            if single and any("," not in line for line in sample):
                continue  # a heading of one column above decimal commas
        try:
            widths = (
                [len(cells) for cells in csv.reader(sample, delimiter=mark)]
                if mark != " "
                else [len(_words(line)) for line in sample]
            )
        except csv.Error:
            continue
        if not widths or max(widths) > MOST_COLUMNS:
            continue
        most = Counter(widths).most_common(1)[0][0]
        if widths[0] < 2 and not (min(widths[1:], default=1) > 1 if spaces else most > 2):  # a title may stand above
            continue
        like = most if spaces or widths[0] < 2 else widths[0]
        score = (sum(width == like for width in widths) / len(widths), like == columns, like)
        if score > best and like > 1:
            best, chosen = score, mark
    if chosen == "," and spaces and sample and all(re.fullmatch(r"\s*[+-]?\d+,\d+\s*", line) for line in sample):
        raise InputError(
            f"{name}: {sample[0].strip()!r} is {sample[0].strip().replace(',', '.')} with a decimal comma, or two "
            "numbers with a comma as separator: put semicolons between columns, or write decimal points."
        )
    if not spaces and not best[0]:  # as R's write.table separates columns
        heading, *widths = [len(_words(line)) for line in sample] or [0]
        if heading > 1 and len(set(widths)) == 1 and widths[0] - heading in (0, 1):
            return " "
    return chosen
