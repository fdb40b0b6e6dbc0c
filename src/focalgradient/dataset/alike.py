"""Comparison of derived files with the content that the journal implies: keys of JSON, and rows of samples."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError
from focalgradient.files import parse_json, read_bytes, read_json

__all__ = ["REMEDY", "differences", "same_content", "same_json"]

REMEDY = "move it away, and write it again with 'focalgradient validate --export'."


def differences(found: Mapping[str, Any], made: Mapping[str, Any], remedy: str = REMEDY) -> Iterator[str]:
    """Yield sentences on keys of a sidecar that differ from those that its journal implies, and on additional keys.

    >>> list(differences({"Seed": True, "Note": 1}, {"Seed": 1}, "restore it."))
    ['Seed differs from the journal: restore it.', 'Note is not in the journal: restore it.']
    """
    other = [key for key, value in made.items() if key not in found or not same_json(found[key], value)]
    if other:
        yield f"{', '.join(other)} {'differs' if len(other) == 1 else 'differ'} from the journal: {remedy}"
    besides = [str(key) for key in found if key not in made]
    if besides:
        named = ", ".join(key[:40] for key in besides[:5])
        yield f"{named} {'is' if len(besides) == 1 else 'are'} not in the journal: {remedy}"


def same_json(one: Any, other: Any) -> bool:
    """Return whether two values are equal as JSON, where true differs from 1.

    >>> same_json({"a": [1]}, {"a": [1.0]}), same_json({"a": [1]}, {"a": [True]})
    (True, False)
    """
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same_json(value, other[key]) for key, value in one.items())
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same_json, one, other))
    return isinstance(one, bool) is isinstance(other, bool) and one == other


def same_content(path: Path, made: bytes) -> bool:
    """Return whether a gaze file has the expected content: equal rows, or equal keys of a sidecar."""
    content = read_bytes(path, "a file of the gaze")
    if content == made:
        return True
    try:
        if path.suffix == ".gz":  # another machine may compress differently
            wanted = gzip.decompress(made)
            with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
                return file.read(len(wanted) + 1) == wanted
        return path.suffix == ".json" and same_json(read_json(path, "a sidecar"), parse_json(made, "the journal"))
    except (OSError, EOFError, zlib.error, InputError):
        return False
