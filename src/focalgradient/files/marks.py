"""Provenance marks in output files, by which a command recognises its own earlier results before replacing them.

A mark is a comment, key or chunk that readers of the format ignore: "Written by focalgradient depth". Files in formats
without comments (CSV, .npy) are listed in the marks of the other files of their set.
"""

from __future__ import annotations

import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from urllib.parse import quote

from focalgradient.errors import InputError
from focalgradient.files.names import printable

__all__ = ["earlier_files", "mark", "marked_by", "refuse_foreign"]

EDGE = 1 << 16
"""Number of bytes searched for a mark at the beginning and at the end of a file."""

_PNG_HEADER = 33
"""Length in bytes of a PNG's signature and IHDR chunk, after which further chunks may follow (PNG specification,
5.6).
"""


def mark(paths: Iterable[Path], by: str) -> None:
    """Mark the files of one set as written by the command `by`, such as "focalgradient depth"."""
    paths = list(paths)
    others = [quote(path.name, safe="") for path in paths if path.suffix.lower() not in _MARKS]
    text = f"Written by {by}" + (f", with {','.join(others)}" if others else "")
    for path in paths:
        if path.suffix.lower() in _MARKS and marked_by(path, by) is None:
            _MARKS[path.suffix.lower()](path, text)


def marked_by(path: Path, by: str) -> Sequence[str] | None:
    """Return the file names listed in the mark that the command `by` left in `path`; None without such a mark."""
    try:
        with path.open("rb") as file:
            head = file.read(EDGE)
            file.seek(0, 2)
            file.seek(max(len(head), file.tell() - EDGE))
            edges = head + file.read(EDGE)
    except OSError:
        return None
    text = rb"[Ww]ritten[ _]by\W{1,6}" + re.escape(by.encode()) + rb"(?![\w-])(?:, with ([\w.,%~-]+))?"
    match = re.search(text, edges)
    return None if match is None else (match[1] or b"").decode().split(",")


def earlier_files(folder: Path, new: Iterable[str], by: str) -> list[Path]:
    """Return the files in a folder that the command `by` wrote and that are not among its `new` ones, by name."""
    new = set(new)
    return sorted(
        path
        for path in folder.iterdir()
        if path.name not in new and path.suffix.lower() in _MARKS and path.is_file() and marked_by(path, by) is not None
    )


def refuse_foreign(places: Iterable[Path], by: str, remedy: str) -> None:
    """Raise `InputError` for existing files that the command `by` did not write; `remedy` ends the message.

    Raises
    ------
    InputError
        If one of `places` is an existing file that neither contains the mark nor is listed in the mark of another.
    """
    places = list(places)
    there = [place for place in places if place.is_file()]
    marks = {place: marked_by(place, by) for place in there if place.suffix.lower() in _MARKS}
    named = {(place.parent, name) for place, names in marks.items() for name in names or ()}
    for place in there:
        is_marked = marks[place] is not None if place in marks else (place.parent, quote(place.name, safe="")) in named
        if not is_marked:
            raise InputError(f"{printable(place)} is there already and was not written by '{by}': {remedy}.")


def _json(path: Path, text: str) -> None:
    content = path.read_bytes()
    first, rest = content[:1], content[1:]
    if first == b"{":
        more = b"" if rest.lstrip().startswith(b"}") else b","
        path.write_bytes(b'{\n  "written_by": "' + text.removeprefix("Written by ").encode() + b'"' + more + rest)


def _png(path: Path, text: str) -> None:
    content = path.read_bytes()
    body = b"tEXtComment\0" + text.encode() + b"\n"
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    path.write_bytes(content[:_PNG_HEADER] + chunk + content[_PNG_HEADER:])


def _zip(path: Path, text: str) -> None:
    with zipfile.ZipFile(path, "a") as archive:
        archive.comment = text.encode()


def _appended(around: Callable[[bytes], bytes]) -> Callable[[Path, str], None]:
    """Return a writer that appends a mark, formatted by `around`, to a file."""

    def append(path: Path, text: str) -> None:
        with path.open("ab") as file:
            file.write(around(text.encode()))

    return append


def _free_box(text: bytes) -> bytes:
    """Return an ignored 'free' box that contains `text` (ISO/IEC 14496-12, 8.1.2)."""
    return struct.pack(">I", 8 + len(text)) + b"free" + text


def _void_element(text: bytes) -> bytes:
    """Return a Void element of Matroska (RFC 8794, 11.3.2) that contains `text`, with an 8-byte size."""
    return b"\xec" + struct.pack(">Q", 1 << 56 | len(text)) + text


def _junk_chunk(text: bytes) -> bytes:
    """Return an ignored JUNK chunk of AVI that contains `text`, padded to even length."""
    text += b" " * (len(text) % 2)
    return b"JUNK" + struct.pack("<I", len(text)) + text


_MARKS: dict[str, Callable[[Path, str], None]] = {
    ".json": _json,
    ".png": _png,
    ".npz": _zip,
    ".pdf": _appended(lambda text: b"% " + text + b"\n%%EOF\n"),
    ".avi": _appended(_junk_chunk),
    ".txt": _appended(lambda text: b"\n" + text + b"\n"),
    **dict.fromkeys((".toml", ".r"), _appended(lambda text: b"\n# " + text + b"\n")),
    **dict.fromkeys((".md", ".html"), _appended(lambda text: b"\n<!-- " + text + b" -->\n")),
    **dict.fromkeys((".mp4", ".mov"), _appended(_free_box)),
    **dict.fromkeys((".mkv", ".webm"), _appended(_void_element)),
}
"""Function that writes the mark, by file extension."""
