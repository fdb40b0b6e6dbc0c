"""Read and redact the links of a server: which label belongs to which link, and to which name at a platform.

The file lies beside the data set and has one line of JSON for each link and for each session that was stopped. Lines of
a participant who withdraws are overwritten where they stand, which needs no room on the disk and leaves the other lines
to a server that is running.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from focalgradient.dataset.append import writing
from focalgradient.dataset.lock import try_lock
from focalgradient.errors import InputError
from focalgradient.files import flush, read_bytes

__all__ = ["Link", "Links", "forget_links", "links_beside", "number_of", "read_links"]

START = b'{"participant": '
"""First bytes of each line."""

BEGINNING = START + b'"'
"""First bytes of a line that names a participant."""

NOBODY = START + b"null, "
"""First bytes of a line that was overwritten, whose end is filled with spaces."""

PIECES = re.compile(b"(?=%s)" % re.escape(START))
"""Where a line begins, also behind one cut short: its quotes cannot stand in an identifier."""


@dataclass(frozen=True, slots=True)
class Link:
    """A line of a link.

    Parameters
    ----------
    participant
        Label in the data.
    sha256
        Digest of the link's secret.
    platform
        Names at a platform.
    offset
        Bytes of the file before the line.
    """

    participant: str
    sha256: str
    platform: Mapping[str, str]
    offset: int


@dataclass
class Links:
    """All lines of a file of links.

    Parameters
    ----------
    links
        Of participants who have not withdrawn.
    stopped
        Labels whose sessions were stopped.
    labels
        Number of labels that have been given, also to those who have withdrawn; none is given again. Overwritten lines
        have it, and no participant.
    lines
        Offset and bytes of each line of a participant.
    torn
        Offset and bytes of each line that was cut short, also while it was overwritten.
    """

    links: list[Link] = field(default_factory=list)
    stopped: set[str] = field(default_factory=set)
    labels: int = 0
    lines: list[tuple[str, int, int]] = field(default_factory=list)
    torn: list[tuple[int, int]] = field(default_factory=list)

    def add(self, line: object, offset: int, size: int) -> bool:
        """Add a line; False if it is none of a file of links."""
        match line:
            case {"participant": str(participant), "sha256": str(digest), "platform": dict(platform)}:
                self.links.append(Link(participant, digest, platform, offset))
            case {"participant": str(participant), "stopped": True}:
                self.stopped.add(participant)
            case {"participant": None, "labels": int(labels)}:
                self.labels = max(self.labels, labels)
                return True
            case _:
                return False
        self.lines.append((participant, offset, size))
        self.labels = max(self.labels, number_of(participant))
        return True


def number_of(label: str) -> int:
    """Return the number that a label is; 0 if it is none."""
    return int(label) if label.isascii() and label.isdigit() else 0


def links_beside(root: Path) -> Path:
    """Return the place of a data set's links, unless its server was given another."""
    place = Path(os.path.abspath(root)) if root.name in ("", "..") else root
    return place.parent / f"{place.name}-links.jsonl"


def read_links(path: Path) -> Links:
    """Read a file of links; lines that a full disk, a kill or a loss of power cut short are passed over.

    Raises
    ------
    InputError
        If it cannot be read, or a line is of something else.
    """
    found, offset = Links(), 0
    for number, line in enumerate(read_bytes(path, "the links of a server").split(b"\n"), 1):
        for piece in PIECES.split(line):
            content = piece.strip()
            try:
                known = not content or found.add(json.loads(content), offset, len(piece))
                torn = piece.startswith(NOBODY) or (piece.startswith(START) and piece.endswith(b" "))
            except (ValueError, RecursionError):
                known, torn = False, content.startswith(START) or START.startswith(content)
            if not (known or torn):
                raise InputError(f"{path}, line {number}, is no link: give a file of links of 'focalgradient serve'.")
            if not known:
                found.torn.append((offset, len(piece)))
            offset += len(piece)
        offset += 1
    return found


def forget_links(path: Path, participant: str | None = None, *, owned: bool = False) -> int:
    """Overwrite all lines of a participant, and those that were cut short; gives how many these were.

    Parameters
    ----------
    path
        The file; a server that is running may have it.
    participant
        Label in the data; without it, lines that were cut short alone.
    owned
        Whether the caller has locked the file.

    Raises
    ------
    InputError
        If the file cannot be read or written, or is no file of links.
    """
    with writing(path), path.open("r+b") as file:
        alone = owned or try_lock(file.fileno(), path)  # else a server may be adding the last line
        found, end = read_links(path), file.seek(0, os.SEEK_END)
        gone = [(offset, size) for label, offset, size in found.lines if label == participant]
        gone += [(offset, size) for offset, size in found.torn if alone or offset + size < end]
        for offset, size in gone:
            line = NOBODY + b'"labels": %d}' % found.labels
            file.seek(offset)
            file.write(line.ljust(size) if len(line) <= size else b" " * size)
        file.flush()
        flush(file.fileno())
    return len(gone)
