"""Cells of an Excel sheet (XLSX) as text, which then pass the same checks as those of a CSV file."""

from __future__ import annotations

import datetime
import io
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

from focalgradient.errors import InputError
from focalgradient.files.names import printable

__all__ = ["sheet_rows"]

LARGEST = 64 * 2**20
"""Maximum size of one unpacked part of a workbook, in bytes: some 500,000 rows of six cells."""

MOST_ROWS, MOST_COLUMNS = 1_048_576, 16_384
"""Excel's maximum number of rows and of columns of a sheet."""

CELL = re.compile(r"([A-Z]{1,3})([0-9]{1,7})")


DAY_ZERO = datetime.datetime(1899, 12, 30)
"""Day 0 of the numbers by which Excel stores dates."""

DATE_FORMATS = frozenset((*range(14, 23), *range(27, 37), *range(45, 48), *range(50, 59)))
"""Numbers of Excel's own formats that show dates and times."""


def sheet_rows(data: bytes, name: str) -> list[tuple[int, list[str]]]:
    """Return the rows of the only non-empty sheet, with their numbers; dates are texts like 2026-06-05.

    Parameters
    ----------
    data
        Content of the file, in bytes.
    name
        File name shown in messages.

    Raises
    ------
    InputError
        If it is not a workbook, is too large, or does not have exactly one sheet with cells.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            parts = archive.namelist()
            sheets = sorted(part for part in parts if re.fullmatch(r"xl/worksheets/[^/]+\.xml", part))
            texts = _texts(_part(archive, "xl/sharedStrings.xml", name)) if "xl/sharedStrings.xml" in parts else []
            dates = _dates(_part(archive, "xl/styles.xml", name)) if "xl/styles.xml" in parts else frozenset()
            filled = {part: rows for part in sheets if (rows := _rows(_part(archive, part, name), texts, dates))}
            names = _sheet_names(archive, name) if len(filled) > 1 else {}
    except (InputError, MemoryError):
        raise
    except Exception as error:  # damaged archives and XML fail in many ways
        raise InputError(f"{name} cannot be read as a workbook ({error}): save its sheet as a CSV file.") from error
    if not filled:
        raise InputError(f"{name} has no sheet with cells: give one that has a table.")
    if len(filled) > 1:
        ordered = sorted(filled, key=[*names, *filled].index)
        listed = ", ".join(printable(names.get(part, Path(part).stem)) for part in ordered)
        raise InputError(
            f"{name} has {len(filled)} sheets with cells ({listed}), but must have one: save the right one as a CSV "
            "file."
        )
    (rows,) = filled.values()
    if sum(max(cells) for cells in rows.values()) > LARGEST:  # empty cells before one far to the right
        raise InputError(f"{name} is too large for a table: leave out what is not needed, or save it as a CSV file.")
    return [
        (number, [cells.get(column, "") for column in range(1, max(cells) + 1)])
        for number, cells in sorted(rows.items())
    ]


def _sheet_names(archive: zipfile.ZipFile, name: str) -> dict[str, str]:
    """Return the names of the sheets by the parts of the archive that hold them; none if the parts are not listed."""
    try:
        relations = _part(archive, "xl/_rels/workbook.xml.rels", name)
        places = {one.get("Id", ""): one.get("Target", "") for one in relations}
        sheets = [one for one in _part(archive, "xl/workbook.xml", name).iter() if _local(one) == "sheet"]
    except (KeyError, ElementTree.ParseError):
        return {}
    found = {}
    for sheet in sheets:
        relation = next((value for key, value in sheet.attrib.items() if key.endswith("}id")), "")
        found["xl/" + places.get(relation, "").removeprefix("/xl/")] = sheet.get("name", "")
    return found


def _dates(root: ElementTree.Element) -> frozenset[str]:
    """Return the numbers of the cell styles that show dates or times."""
    own = {
        element.get("numFmtId", ""): re.sub(r'"[^"]*"|\[[^\]]*\]|\\.', "", element.get("formatCode", ""))
        for element in root.iter()
        if _local(element) == "numFmt"
    }
    styles = [element for element in root.iter() if _local(element) == "cellXfs"]
    return frozenset(
        str(number)
        for number, style in enumerate(styles[0] if styles else ())
        if (kind := style.get("numFmtId", "0"))
        and (
            re.search("[dmyhs]", own[kind], re.IGNORECASE)
            if kind in own
            else kind.isdigit() and int(kind) in DATE_FORMATS
        )
    )


def _part(archive: zipfile.ZipFile, part: str, name: str) -> ElementTree.Element:
    with archive.open(part) as file:
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise InputError(f"{name} is too large for a table: leave out what is not needed, or save it as a CSV file.")
    if b"<!DOCTYPE" in content[:1000] or b"<!ENTITY" in content:
        raise InputError(f"{name} defines entities, which no spreadsheet writes: save its sheet as a CSV file.")
    return ElementTree.fromstring(content)


def _local(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _text(element: ElementTree.Element) -> str:
    """Return the text of a cell or shared string, without phonetic hints."""
    return "".join(
        each.text or ""
        for run in (element, *(one for one in element if _local(one) == "r"))
        for each in run
        if _local(each) == "t"
    )


def _texts(root: ElementTree.Element) -> list[str]:
    return [_text(one) for one in root if _local(one) == "si"]


def _rows(root: ElementTree.Element, texts: list[str], dates: frozenset[str]) -> dict[int, dict[int, str]]:
    """Return the texts of non-empty cells by row and column, both counted from 1."""
    rows: dict[int, dict[int, str]] = {}
    for cell in (one for one in root.iter() if _local(one) == "c"):
        found = CELL.fullmatch(cell.get("r", ""))
        if found is None:
            raise KeyError("a cell without a place")
        column = 0
        for letter in found[1]:
            column = 26 * column + ord(letter) - ord("A") + 1
        value = _value(cell, texts, dates)
        if value.strip() and int(found[2]) <= MOST_ROWS and column <= MOST_COLUMNS:
            rows.setdefault(int(found[2]), {})[column] = value
    return rows


def _value(cell: ElementTree.Element, texts: list[str], dates: frozenset[str]) -> str:
    """Return a cell's text; numbers are rounded to 15 significant digits, and formulas without a value stay."""
    kind = cell.get("t", "n")
    held = {_local(one): one for one in cell}
    if kind == "inlineStr":
        return _text(held["is"]) if "is" in held else ""
    text = (held["v"].text or "") if "v" in held else ""
    if kind == "n" and not text and "f" in held:
        return f"={held['f'].text or ''}"  # a formula that no program has computed
    if kind == "s" and text.isdecimal() and len(text) < 10:
        return texts[int(text)] if int(text) < len(texts) else ""
    try:
        if kind == "n" and text and cell.get("s") in dates and 0 < float(text) < 3e6:
            day = DAY_ZERO + datetime.timedelta(days=float(text))
            return day.isoformat(" ") if day.time() != datetime.time() else day.date().isoformat()
        return f"{float(text):.15g}" if kind == "n" and text else text
    except ValueError:
        return text
