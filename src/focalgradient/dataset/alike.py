"""Comparison of derived files with the content that the journal implies: cells of tables, keys of JSON, samples."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator, Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import parse_json, read_bytes, read_json, read_tsv

__all__ = ["REMEDY", "differences", "is_same", "same_json"]

REMEDY = "move it away, and write it again with 'focalgradient validate --export'."

WORDS = ("Description", "LongName", "TaskDescription", "HED")
"""Keys of sidecars whose texts may differ between versions of this program."""


def differences(path: Path, made: bytes, *, wording: bool = True, remedy: str = REMEDY) -> Iterator[str]:
    """Yield sentences on how a derived file differs from the content that its journal implies.

    Parameters
    ----------
    path
        Path of the file: a table, JSON, or compressed samples.
    made
        Content derived from the journal.
    wording
        Whether texts and columns must be the same, as those written by one version of this program are.
    remedy
        End of the sentences.
    """
    if path.suffix == ".gz":
        if not _same_samples(read_bytes(path, "a file of the gaze"), made):
            yield f"it differs from its journal: {remedy}"
    elif path.suffix == ".json":
        found = read_json(path, "a sidecar")
        if not isinstance(found, dict):
            yield f"it is not a JSON object: {remedy}"
        else:
            yield from _keys(found, parse_json(made, "the journal"), wording, remedy)
    else:
        text = read_tsv(path)
        if text != made.decode() and (where := _first_cell(text, made.decode(), wording)) is not None:
            yield f"it differs from its journal{where}: {remedy}"


def is_same(path: Path, made: bytes) -> bool:
    """Return whether a derived file can be read, and has the content that its journal implies."""
    try:
        return not any(differences(path, made))
    except InputError:
        return False


def _first_cell(text: str, made: str, wording: bool) -> str | None:
    """Return the place of the first cell in which a table differs; None if only columns of another version do."""
    header, *rows = [line.split("\t") for line in text.splitlines()] or [[]]
    wanted, *others = [line.split("\t") for line in made.splitlines()]
    shared = [name for name in wanted if name in header]
    for number, (row, other) in enumerate(zip_longest(rows, others), start=2):
        if row is None or other is None:
            return f", as row {number} {'is missing' if row is None else 'was added'}"
        cells, implied = dict(zip(header, row, strict=False)), dict(zip(wanted, other, strict=True))
        for name in shared:
            there, wanted_there = cells.get(name, ""), implied[name]
            if there != wanted_there:
                return f" in row {number}, where {name} is {there[:80]!r}, but {wanted_there[:80]!r} in the journal"
    return ", which has other columns or line ends" if wording else None


def _keys(found: Mapping[str, Any], made: Mapping[str, Any], wording: bool, remedy: str) -> Iterator[str]:
    if not wording:
        found, made = _without_words(found), _without_words(made)
        made = {key: value for key, value in made.items() if key in found or not isinstance(value, dict)}
    other = [key for key, value in made.items() if key not in found or not same_json(found[key], value)]
    if other:
        yield f"{', '.join(other)} {'differs' if len(other) == 1 else 'differ'} from the journal: {remedy}"
    if besides := [str(key) for key in found if key not in made]:
        named = ", ".join(key[:40] for key in besides[:5])
        yield f"{named} {'is' if len(besides) == 1 else 'are'} not in the journal: {remedy}"


def _without_words(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    return {
        key: sorted(one) if key == "Levels" and isinstance(one, dict) else _without_words(one)
        for key, one in value.items()
        if key not in WORDS
    }


def same_json(one: Any, other: Any) -> bool:
    """Return whether two values are equal as JSON, where true differs from 1.

    >>> same_json({"a": [1]}, {"a": (1.0,)}), same_json({"a": [1]}, {"a": [True]})
    (True, False)
    """
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same_json(value, other[key]) for key, value in one.items())
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(same_json, one, other))
    return isinstance(one, bool) is isinstance(other, bool) and bool(one == other)


def _same_samples(content: bytes, made: bytes) -> bool:
    if content == made:
        return True
    try:  # another machine may compress differently
        wanted = gzip.decompress(made)
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
            return file.read(len(wanted) + 1) == wanted
    except (OSError, EOFError, zlib.error):
        return False
