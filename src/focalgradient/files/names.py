"""File names: portability, printing, and detection of outputs that would overwrite inputs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from focalgradient.errors import InputError

__all__ = ["inner_name", "plain_name", "printable", "refuse_overwriting"]

_RESERVED = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}
"""Device names reserved by Windows, with any extension."""


def printable(name: str | os.PathLike[str]) -> str:
    r"""Return a file name as printable text: invalid UTF-8 becomes U+FFFD, control characters become spaces.

    >>> printable("a\udcff.png")
    'a�.png'
    """
    text = "".join("\ufffd" if "\ud800" <= letter <= "\udfff" else letter for letter in os.fspath(name))
    return "".join(letter if letter.isprintable() else " " for letter in text)


def plain_name(name: str, where: str = "a file's name") -> str:
    """Return `name` after checking that it is a plain file name on every platform: no folder, no reserved name.

    Raises
    ------
    InputError
        If it is not; `where` names its source in the message.

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
    """Return `name` after checking that it is a relative path of plain names separated by "/".

    Raises
    ------
    InputError
        If it is not; `where` names its source in the message.

    Examples
    --------
    >>> inner_name("none/0001.png")
    'none/0001.png'
    """
    for part in name.split("/") if isinstance(name, str) else [name]:
        plain_name(part, where)
    return name


def refuse_overwriting(inputs: Iterable[str | os.PathLike[str]], outputs: Iterable[str | os.PathLike[str]]) -> None:
    """Raise `InputError` for outputs that are also inputs, comparing the files themselves, also through links.

    Raises
    ------
    InputError
        If an output file is also an input file.
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
    """Yield the resolved path, and device and inode numbers where the file exists."""
    with suppress(OSError, ValueError, RuntimeError):  # RuntimeError: links in a circle
        yield os.path.normcase(Path(path).resolve())
    with suppress(OSError, ValueError):
        status = os.stat(path)
        yield status.st_dev, status.st_ino
