"""Files that platforms give of an exported study, line by line: text and archives of JATOS, files of CSV or JSON."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from focalgradient.dataset.journal import DECODER
from focalgradient.errors import InputError
from focalgradient.files import printable, read_bytes
from focalgradient.web.answers import first_problem
from focalgradient.web.messages import Answered, Begun, Note, Resumed

__all__ = ["read_results"]

LARGEST = 1 << 30
"""Bytes of a file, and of an archive unpacked: a thousand sessions of one megabyte."""

MOST_MEMBERS = 100_000
"""Of an archive."""

LARGEST_CELL = 8 << 20
"""Characters of a cell of CSV: an answer with its time stamps has at most some 4 MB."""

COLUMN = "record"
"""Of CSV, which holds the lines."""

MARK = "focalgradient"
"""The key by which a line is known for one of ours."""

WHAT = "a file of results of a study that 'focalgradient serve --export' made"

_note: TypeAdapter[Begun | Resumed | Answered] = TypeAdapter(Note)


def read_results(paths: Sequence[Path]) -> dict[str, dict[int, Begun | Resumed | Answered]]:
    """Read the lines of all sessions in files of results, by session and number.

    Raises
    ------
    InputError
        If a file cannot be read, holds no line of ours, or one that is none or that another line contradicts.
    """
    sessions: dict[str, dict[int, Begun | Resumed | Answered]] = {}
    for path in paths:
        found = 0
        for where, text in _texts(path):
            for value in _values(text, where):
                if not (isinstance(value, dict) and MARK in value):
                    continue  # somebody else's, as the metadata of an archive
                found += 1
                line = _checked(value, where)
                lines = sessions.setdefault(line.session, {})
                if lines.setdefault(line.line, line) != line:
                    raise InputError(
                        f"{where}: line {line.line} of session {line.session} is there twice, with two contents: leave "
                        "out the file that is not the platform's own."
                    )
        if not found:
            raise InputError(f"{printable(path)} holds no answers: give {WHAT}.")
    return sessions


def _texts(path: Path) -> Iterator[tuple[str, str]]:
    """Texts of a file, or of those in an archive, each with its name for messages."""
    content, name = read_bytes(path, WHAT, LARGEST), printable(path)
    if not content.startswith(b"PK"):
        yield name, _decoded(content, name)
        return
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            if len(members) > MOST_MEMBERS or sum(member.file_size for member in members) > LARGEST:
                raise InputError(f"{name} unpacks to more than {LARGEST >> 20} MB: give {WHAT}.")
            for member in members:
                inner = archive.read(member)
                if MARK.encode() in inner:
                    where = f"{name}, {printable(member.filename)[:200]}"
                    yield where, _decoded(inner, where)
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{name} is too large for the memory: give fewer results at once.") from error
    except Exception as error:  # damaged archives fail in many ways
        raise InputError(f"{name} is no archive that can be read: download it again.") from error


def _decoded(content: bytes, where: str) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{where} is not text in UTF-8 (byte {error.start + 1}): give {WHAT}.") from error


def _values(text: str, where: str) -> Iterator[Any]:
    """What a text holds: values of JSON one after the other, in lists or not, or CSV whose cells hold them."""
    if text.lstrip()[:1] in ("{", "["):
        for value in _json(text, where):
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, dict) and isinstance(one.get(COLUMN), str):  # rows of a table, as JSON
                    yield from _json(one[COLUMN], where)
                else:
                    yield one
        return
    before = csv.field_size_limit(LARGEST_CELL)
    try:
        for row in csv.DictReader(io.StringIO(text, newline="")):
            if row.get(COLUMN):
                yield from _json(row[COLUMN], where)
    except csv.Error as error:
        raise InputError(f"{where} is no CSV that can be read ({error}): give {WHAT}.") from error
    finally:
        csv.field_size_limit(before)


def _json(text: str, where: str) -> Iterator[Any]:
    """Values of JSON that stand one after the other."""
    place = 0
    while True:
        while place < len(text) and text[place] in " \t\r\n,":
            place += 1
        if place == len(text):
            return
        try:
            value, place = DECODER.raw_decode(text, place)
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"{where} is damaged at character {place + 1}, where JSON should begin: give {WHAT}."
            ) from error
        yield value


def _checked(value: dict[str, Any], where: str) -> Begun | Resumed | Answered:
    try:
        return _note.validate_json(json.dumps(value))
    except ValidationError as error:
        problem = printable(first_problem(error))
        raise InputError(f"{where}: a line is none of a session ({problem}): give {WHAT}.") from error
    except RecursionError as error:
        raise InputError(f"{where}: a line is nested too deeply: give {WHAT}.") from error
