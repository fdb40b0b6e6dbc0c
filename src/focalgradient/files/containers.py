"""Recognition of what a file contains, whatever its name: tables as text, XLSX or JSON; anything else is named."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files.reading import PICTURES, parse_json

__all__ = ["is_workbook", "records_of", "refuse_other_container", "with_parts"]

SIGNATURES: dict[str, tuple[bytes, ...]] = {
    "a picture": PICTURES,
    "a PDF document": (b"%PDF",),
    "an old Excel (XLS) or SPSS workbook": (b"\xd0\xcf\x11\xe0",),
    "an SQLite database": (b"SQLite format 3",),
    "an HDF5 file (as PsychoPy's eye trackers and MATLAB 7.3 write it)": (b"\x89HDF",),
    "a MATLAB file": (b"MATLAB 5.0",),
    "a NumPy array": (b"\x93NUMPY",),
    "a Parquet file": (b"PAR1",),
    "a Feather file": (b"ARROW1", b"FEA1"),
    "an SPSS file": (b"$FL2", b"$FL3", b"ASCII SPSS PORT FILE"),
    "a Stata file": (b"<stata_dta", *(bytes((version, order, 1)) for version in (114, 115) for order in (1, 2))),
    "a SAS file": (bytes(12) + b"\xc2\xea\x81\x60",),
    "an R data file": (b"RDX", b"RDA", b"X\n\0\0\0"),
    "a gzip archive (or an R data file)": (b"\x1f\x8b",),
    "a 7z archive": (b"7z\xbc\xaf",),
    "a bzip2 archive": (b"BZh",),
    "an RTF document": (b"{\\rtf",),
    "a film": (b"\x1aE\xdf\xa3",),
    "an eye tracker's file": (b"EDF",),
}
"""First bytes of formats other than tables."""

PSYDAT = (
    "is PsychoPy's pickled data (psydat), which can run programs when it is opened and so is not read: give the CSV "
    "file that PsychoPy wrote beside it, or write one in PsychoPy by "
    "psychopy.misc.fromFile(NAME).saveAsWideText('data.csv')"
)

BESIDE = {"trials", "data", "results", "rows", "records"}
"""Keys of an object that holds the list of rows."""


def is_workbook(data: bytes) -> bool:
    """Return whether data begin with the signature of a ZIP archive, as XLSX files do."""
    return data.startswith(b"PK\x03\x04")


def refuse_other_container(data: bytes, name: str, what: str = "a table") -> None:
    """Raise `InputError` that says what a file is, unless it may be a table."""
    if name.lower().endswith(".psydat") or re.match(rb"\x80[\x02-\x05](?=[}\]\x95ccX(])", data):
        raise InputError(f"{name} {PSYDAT}.")
    kinds = [kind for kind, starts in SIGNATURES.items() if data.startswith(starts)]
    text = data[:1000].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if text.startswith((b"<!doctype html", b"<html", b"<table", b"<meta")):
        kinds.append("a web page")
    elif b"*** header start ***" in data[:1000].replace(b"\0", b"").lower():
        kinds.append("E-Prime's log of one session, which E-DataAid and E-Merge export as a table")
    elif data[:2000].replace(b"\0", b"").lstrip(b"\xff\xfe\xef\xbb\xbf").startswith(b"Listing of Zernike"):
        kinds.append("Zemax's listing of Zernike coefficients, in waves and in another order than the OSA's")
    elif text.startswith(b"<?xml"):
        kinds.append("an XML document")
    if is_workbook(data) and (kind := _archive(data)):
        kinds.append(kind)
    if kinds:
        raise InputError(f"{name} is {kinds[0]}: give {what} instead (CSV, TSV, XLSX or JSON).")


ARCHIVES = (
    (r"internal\.sqlite|analyses\.json", "a JASP file, whose menu Export Data writes a CSV file"),
    (r"data\.bin|xdata\.json", "a jamovi file, whose menu Export writes a CSV file"),
    (r"Index/.+\.iwa", "a Numbers document, which Numbers exports as a CSV file"),
    (r"(?:word|ppt)/.+", "a document, not a workbook"),
    (r"xl/workbook\.bin", "a binary Excel (XLSB) workbook"),
)
"""Archives other than XLSX by the parts that they hold."""


def _archive(data: bytes) -> str:
    """Return what a ZIP archive is; "" if it may be an XLSX workbook."""
    if b"opendocument.spreadsheet" in data[:200]:
        return "an OpenDocument (ODS) workbook"
    with suppress(zipfile.BadZipFile, ValueError, NotImplementedError), zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = archive.namelist()
        kinds = [kind for part, kind in ARCHIVES if any(re.fullmatch(part, name) for name in parts)]
        if kinds or not any(name.startswith("xl/") for name in parts):
            return kinds[0] if kinds else "a ZIP archive, to be unpacked"
    return ""


def records_of(text: str, name: str) -> list[list[str]] | None:
    """Return the rows of cells of a JSON text, the header first; None if the text is not JSON.

    It may be a list of objects, an object of columns, an object with such a list, or one of these a line, as jsPsych,
    DataPipe, JATOS and pandas write them. Where there are several lists, the column "result" numbers them. The parts
    of an object within an object are columns of their own.

    >>> records_of('[{"a": 1, "b": "x"}, {"a": 2.5, "b": {"c": null, "d": 3}}]', "x.json")
    [['a', 'b', 'b.c', 'b.d'], ['1', 'x', '', ''], ['2.5', '', '', '3']]
    """
    start = text.lstrip("\ufeff \t\r\n")
    if not re.match(r'\[\s*[\[{\]]|\{\s*["}]', start) and not _is_json(start):
        return None
    try:
        values = [parse_json(part, name) for part in _values(start)]
    except InputError as error:
        if "NaN is not JSON" in str(error):
            raise InputError(f"{name} is JSON with NaN, which JSON lacks: write null for missing values.") from error
        raise InputError(f"{name} is JSON, but is damaged: {error}") from error
    lists = [value for value in values if isinstance(value, list)]
    results = [_objects(value, name) for value in values] if len(values) > 1 or not lists else _parts(lists[0], name)
    several = len(results) > 1 and any(len(result) > 1 for result in results)
    objects = [
        _flat({"result": number} | record if several and "result" not in record else record)
        for number, result in enumerate(results, start=1)
        for record in result
    ]
    header = list(dict.fromkeys(key for record in objects for key in record))
    whole = {key.rpartition(".")[0] for key in header}
    header = [key for key in header if key not in whole or any(record.get(key) is not None for record in objects)]
    return [header, *([_text(record.get(key)) for key in header] for record in objects)]


def with_parts(header: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return a table in which the parts of JSON objects in cells, as jsPsych writes to CSV, have columns of their own.

    >>> with_parts(["id", "response"], [["A", '{"Q0": 2}'], ["A", "yes"]])
    (['id', 'response', 'response.Q0'], [('A', '', '2'), ('A', 'yes', '')])
    >>> with_parts(["id", "response"], [["A", '{"Q0": 2}'], ["A", ""]])
    (['id', 'response.Q0'], [('A', '2'), ('A', '')])
    """
    records = [dict(zip(header, row, strict=True)) for row in rows]
    names = list(header)
    for name in header:
        begun = [record for record in records if record[name].startswith("{")]
        parts = [_object(record[name]) for record in begun]
        if None in parts:
            continue
        for record, part in zip(begun, parts, strict=True):
            record |= {name: ""} | {key: _text(value) for key, value in _flat({name: part}).items()}
        names += dict.fromkeys(key for record in begun for key in record if key not in names)
        if begun and not any(record[name] for record in records):
            names.remove(name)
    return names, [tuple(record.get(name, "") for name in names) for record in records]


def _object(text: str) -> dict[str, Any] | None:
    """Return the JSON object that a cell holds; None if it is none."""
    try:
        value = parse_json(text, "a cell")
    except InputError:
        return None
    return value if isinstance(value, dict) else None


def _values(text: str) -> Iterator[str]:
    """Yield the JSON values of a text: one, or several one behind the other, as of one a line."""
    at, decode = 0, json.JSONDecoder().raw_decode
    while at < len(text):
        try:
            end = decode(text, at)[1]
        except (ValueError, RecursionError):
            end = len(text)
        yield text[at:end]
        at = len(text) - len(text[end:].lstrip())


def _is_json(text: str) -> bool:
    """Return whether a text that begins with a bracket is JSON as a whole."""
    try:
        return text.startswith("[") and isinstance(json.loads(text), list)
    except (ValueError, RecursionError):
        return False


def _parts(value: list[Any], name: str) -> list[list[dict[str, Any]]]:
    """Return the lists of rows in a list: one, or several in a list of lists."""
    return [_objects(part, name) for part in value] if value and isinstance(value[0], list) else [_objects(value, name)]


def _objects(value: Any, name: str) -> list[dict[str, Any]]:
    """Return the rows that a JSON value holds."""
    if isinstance(value, dict):
        for key in value:
            if key.lower() in BESIDE and isinstance(value[key], list) and all(isinstance(v, dict) for v in value[key]):
                same = {other: v for other, v in value.items() if other != key and not isinstance(v, list | dict)}
                return [same | row for row in value[key]]
        if value.keys() >= {"columns", "data"} and isinstance(value["data"], list):  # pandas, orient="split"
            return [dict(zip(map(str, value["columns"]), cells, strict=True)) for cells in value["data"]]
        parts = [part for part in value.values() if isinstance(part, dict)]
        if len(parts) == len(value) > 0 and len({tuple(part) for part in parts}) == 1:
            if all(key.isdigit() for key in parts[0]):  # pandas, orient="columns"
                return [{name: value[name][key] for name in value} for key in parts[0]]
            if all(key.isdigit() for key in value):  # pandas, orient="index"
                return parts
        columns = [v for v in value.values() if isinstance(v, list)]
        if columns and len(columns) == len(value) and len({len(v) for v in columns}) == 1:
            return [dict(zip(value, cells, strict=True)) for cells in zip(*columns, strict=True)]
        return [value]
    if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
        raise InputError(
            f"{name} is JSON, but not a list of objects with a value for each column: save it as such a list, or as a "
            "CSV, TSV or XLSX file."
        )
    return value


def _flat(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row whose objects are replaced by their parts, named like response.Q0."""
    parts: dict[str, Any] = {}
    for key, value in row.items():
        parts |= (
            {f"{key}.{name}": part for name, part in _flat(value).items()} if isinstance(value, dict) else {key: value}
        )
    return parts


def _text(value: Any) -> str:
    """Return a JSON value as the text of a cell."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
