"""Cells of an Excel sheet (XLSX) as text, which then pass the same checks as those of a CSV file."""

from __future__ import annotations

import datetime
import io
import warnings
import zipfile
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files.names import printable

__all__ = ["sheet_rows"]

LARGEST = 64 * 2**20
"""Maximum size of one unpacked part of a workbook, in bytes: some 500,000 rows of six cells."""

MOST_CELLS = 2**24
"""Maximum number of cells, empty ones included: 80 columns of 200,000 rows."""


def sheet_rows(data: bytes, name: str, notes: list[str]) -> list[tuple[int, list[str]]]:
    """Return the rows of the only sheet of cells, with their numbers; dates are texts like 2026-06-05.

    Sheets of one column, as of remarks, are left out beside one of several, which is noted.

    Parameters
    ----------
    data
        Content of the file, in bytes.
    name
        File name shown in messages.
    notes
        Notes on the file, to which one may be added.

    Raises
    ------
    InputError
        If it is not a workbook, is too large, or does not have exactly one sheet with cells.
    """
    import openpyxl  # deferred: slow to import

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            has_formulas = False
            for part in archive.infolist():
                has_formulas |= b"<f" in _part(archive, part, name) and "worksheets" in part.filename
        with warnings.catch_warnings(action="ignore"):  # of styles and extensions, which are not read
            values = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
            written = openpyxl.load_workbook(io.BytesIO(data), read_only=True) if has_formulas else None
            filled = {}
            for sheet in values.worksheets:
                if rows := _rows(sheet, written and written[sheet.title], name):
                    filled[sheet.title] = rows
    except (InputError, MemoryError):
        raise
    except Exception as error:  # damaged archives and XML fail in many ways
        raise InputError(f"{name} cannot be read as a workbook ({error}): save its sheet as a CSV file.") from error
    if not filled:
        raise InputError(f"{name} has no sheet with cells: give one that has a table.")
    tables = {title: rows for title, rows in filled.items() if max(len(cells) for _, cells in rows) > 1}
    if len(tables) == 1 < len(filled):
        notes.append(f"Of the sheets of {name} only {printable(next(iter(tables)))} has several columns, and was read.")
        filled = tables
    if len(filled) > 1:
        raise InputError(
            f"{name} has {len(filled)} sheets with cells ({', '.join(map(printable, filled))}), but must have one: "
            "save the right one as a CSV file."
        )
    return next(iter(filled.values()))


def _part(archive: zipfile.ZipFile, part: zipfile.ZipInfo, name: str) -> bytes:
    """Return a part's content; raise `InputError` if it is too large, or declares entities, by which it may expand."""
    if part.file_size > LARGEST:
        raise _too_large(name)
    content = archive.read(part)
    if b"<!DOCTYPE" in content[:1000] or b"<!ENTITY" in content:
        raise InputError(f"{name} defines entities, which no spreadsheet writes: save its sheet as a CSV file.")
    return content


def _rows(sheet: Any, written: Any | None, name: str) -> list[tuple[int, list[str]]]:
    """Return the rows of a sheet that have cells, with their numbers from 1; `written` is the sheet with formulas."""
    rows, count = [], 0
    sheet.reset_dimensions()  # programs state them wrongly
    if written is not None:
        written.reset_dimensions()
    formulas = None if written is None else written.iter_rows(values_only=True)
    for number, cells in enumerate(sheet.iter_rows(values_only=True), start=1):
        count += len(cells)
        if count > MOST_CELLS:  # empty cells before one far to the right
            raise _too_large(name)
        behind = cells if formulas is None else next(formulas)
        texts = [_text(value, formula) for value, formula in zip(cells, behind, strict=True)]
        while texts and not texts[-1].strip():
            texts.pop()
        if texts:
            rows.append((number, texts))
    return rows


def _text(value: Any, formula: Any) -> str:
    """Return a cell's text; numbers are rounded to 15 significant digits, and formulas without a value stay."""
    if value is None:
        return "" if formula is None else str(formula)  # a formula that no program has computed
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, int | float):
        return f"{value:.15g}"
    if isinstance(value, datetime.datetime):
        return value.isoformat(" ") if value.time() != datetime.time() else value.date().isoformat()
    return str(value)


def _too_large(name: str) -> InputError:
    return InputError(f"{name} is too large for a table: leave out rows or columns, or save it as a CSV file.")
