"""Result files of an exported study, read record by record: text and archives of JATOS, CSV and JSON files."""

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
from focalgradient.files import decoded, printable, read_bytes
from focalgradient.web.answers import first_problem
from focalgradient.web.messages import Note, Record

__all__ = ["read_results"]

LARGEST = 1 << 30
"""Maximum size in bytes of a file, and of an unpacked archive: a thousand sessions of 1 MB."""

MOST_MEMBERS = 100_000
"""Maximum number of files in an archive."""

LARGEST_CELL = 8 << 20
"""Maximum number of characters in a CSV cell: a response with its time stamps has at most some 4 MB."""

COLUMN = "record"
"""Name of the CSV column that contains the records."""

RECORD_KEY = "focalgradient"
"""Key that identifies a record of an exported study."""

RESULT_FILE = "a result file of a study exported by 'focalgradient serve --export'"

_note: TypeAdapter[Record] = TypeAdapter(Note)


def read_results(paths: Sequence[Path]) -> dict[str, dict[int, Record]]:
    """Read the records of all sessions in result files, by session and number.

    Raises
    ------
    InputError
        If a file cannot be read, contains no record of an exported study, or an invalid or contradictory one.
    """
    sessions: dict[str, dict[int, Record]] = {}
    for path in paths:
        found = 0
        for where, text in _texts(path):
            for value in _values(text, where):
                if not (isinstance(value, dict) and RECORD_KEY in value):
                    continue  # not a record, such as the metadata of an archive
                found += 1
                line = _checked(value, where)
                lines = sessions.setdefault(line.session, {})
                if lines.setdefault(line.line, line) != line:
                    raise InputError(
                        f"{where}: line {line.line} of session {line.session} occurs twice with different contents: "
                        "leave out the file that was changed after its download."
                    )
        if not found:
            raise InputError(f"{printable(path)} contains no responses: give {RESULT_FILE}.")
    return sessions


def _texts(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the texts of a file, or of those in an archive, each with its name for messages."""
    content, name = read_bytes(path, RESULT_FILE, LARGEST), printable(path)
    if not content.startswith(b"PK"):
        yield name, decoded(content, name, RESULT_FILE)
        return
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            if len(members) > MOST_MEMBERS or sum(member.file_size for member in members) > LARGEST:
                raise InputError(f"{name} unpacks to more than {LARGEST >> 20} MB: give {RESULT_FILE}.")
            for member in members:
                inner = archive.read(member)
                if RECORD_KEY.encode() in inner:
                    where = f"{name}, {printable(member.filename)[:200]}"
                    yield where, decoded(inner, where, RESULT_FILE)
    except InputError:
        raise
    except MemoryError as error:
        raise InputError(f"{name} is too large for the available memory: give fewer results at once.") from error
    except Exception as error:  # damaged archives fail in many ways
        raise InputError(f"{name} is a damaged archive: download it again.") from error


def _values(text: str, where: str) -> Iterator[Any]:
    """Yield the JSON values in a text: consecutive values, also in lists, or the cells of a CSV file."""
    if text.lstrip()[:1] in ("{", "["):
        for value in _json(text, where):
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, dict) and isinstance(one.get(COLUMN), str):  # table rows as JSON
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
        raise InputError(f"{where} cannot be read as CSV ({error}): give {RESULT_FILE}.") from error
    finally:
        csv.field_size_limit(before)


def _json(text: str, where: str) -> Iterator[Any]:
    """Yield consecutive JSON values."""
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
                f"{where} is damaged at character {place + 1}, where JSON should begin: give {RESULT_FILE}."
            ) from error
        yield value


def _checked(value: dict[str, Any], where: str) -> Record:
    try:
        return _note.validate_json(json.dumps(value))
    except ValidationError as error:
        problem = printable(first_problem(error))
        raise InputError(
            f"{where}: a line is not a valid record of a session ({problem}): give {RESULT_FILE}."
        ) from error
    except RecursionError as error:
        raise InputError(f"{where}: a line is nested too deeply: give {RESULT_FILE}.") from error
