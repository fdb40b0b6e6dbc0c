"""Names of files: safe to write under, fit to print, and whether two lead to one file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from focalgradient.errors import InputError

__all__ = ["inner_name", "plain_name", "printable", "refuse_overwriting"]

_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
"""Names that Windows keeps for devices, whatever their ending."""


def printable(name: str | os.PathLike[str]) -> str:
    r"""A file's name as text can hold it: what is not UTF-8 in it becomes U+FFFD, and control characters spaces.

    >>> printable("a\udcff.png")
    'a�.png'
    """
    text = "".join("\ufffd" if "\ud800" <= letter <= "\udfff" else letter for letter in os.fspath(name))
    return "".join(letter if letter.isprintable() else " " for letter in text)


def plain_name(name: str, where: str = "a file's name") -> str:
    """Give `name` back if it is a plain file name on every platform: no folder, nothing above, no device.

    Raises
    ------
    InputError
        If it is not; `where` says where it stands.

    Examples
    --------
    >>> plain_name("confidence_design.csv")
    'confidence_design.csv'
    """
    bad = (
        not isinstance(name, str)
        or name in ("", ".", "..")
        or not name.isprintable()
        or any(letter in '/\\:*?"<>|' for letter in name)
        or name != name.rstrip(" .")
        or name.partition(".")[0].lower() in _RESERVED
        or len(name.encode("utf-8", "surrogatepass")) > 255
    )
    if bad:
        raise InputError(f"{where} is {printable(str(name))[:80]!r}, but must be a plain file name without a folder.")
    return name


def inner_name(name: str, where: str = "a file's name") -> str:
    """Give `name` back if it is the path of a file within a folder, its parts plain names with / between.

    Raises
    ------
    InputError
        If it is not; `where` says where it stands.

    Examples
    --------
    >>> inner_name("none/0001.png")
    'none/0001.png'
    """
    for part in name.split("/") if isinstance(name, str) else [name]:
        plain_name(part, where)
    return name


def refuse_overwriting(inputs: Iterable[str | os.PathLike[str]], outputs: Iterable[str | os.PathLike[str]]) -> None:
    """Refuse outputs that are inputs, by the file itself: also through links and other spellings.

    Raises
    ------
    InputError
        If an output is an input.
    """
    read = {identity: Path(path) for path in inputs for identity in _identities(path)}
    for path in outputs:
        for identity in _identities(path):
            if identity in read:
                raise InputError(
                    f"{printable(path)} would be overwritten, but it is read ({printable(read[identity])}): "
                    "choose another place to write to."
                )


def _identities(path: str | os.PathLike[str]) -> Iterator[object]:
    """The file that a path leads to: its number on the disk where it exists, and where it would be."""
    with suppress(OSError, ValueError, RuntimeError):  # RuntimeError: links in a circle
        yield os.path.normcase(Path(path).resolve())
    with suppress(OSError, ValueError):
        found = os.stat(path)
        yield found.st_dev, found.st_ino
