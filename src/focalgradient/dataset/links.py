"""Read and redact a server's file of links, which assign labels to links and to platform identifiers.

The file is stored beside the data set, with one line of JSON per link and per stopped session. Lines of a participant
who withdraws are overwritten in place, which requires no disk space and does not disturb a running server.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from focalgradient.dataset.append import UNDONE, writing
from focalgradient.dataset.lock import try_lock
from focalgradient.errors import InputError
from focalgradient.files import flush, read_bytes

__all__ = ["Link", "Links", "forget_links", "links_beside", "number_of", "read_links"]

START = b'{"participant": '
"""Start of each line of a file of links."""

BEGINNING = START + b'"'
"""Start of a line that names a participant."""

NOBODY = START + b"null, "
"""Start of an overwritten line, which is padded with spaces."""


@dataclass(frozen=True, slots=True)
class Link:
    """Entry of a link.

    Parameters
    ----------
    participant
        Label in the data.
    sha256
        Digest of the link's secret.
    platform
        Identifiers at a platform.
    offset
        Position of the line in the file, in bytes.
    """

    participant: str
    sha256: str
    platform: Mapping[str, str]
    offset: int


@dataclass
class Links:
    """Content of a file of links.

    Parameters
    ----------
    links
        Links of participants who have not withdrawn.
    stopped
        Labels whose sessions were stopped.
    labels
        Highest label number assigned, including withdrawn participants; numbers up to it are not reused. Overwritten
        lines store it instead of a participant.
    lines
        Label, offset and size in bytes of each participant's line.
    torn
        Offset and size in bytes of each truncated line, including those truncated while being overwritten.
    """

    links: list[Link] = field(default_factory=list)
    stopped: set[str] = field(default_factory=set)
    labels: int = 0
    lines: list[tuple[str, int, int]] = field(default_factory=list)
    torn: list[tuple[int, int]] = field(default_factory=list)

    def add(self, line: object, offset: int, size: int) -> bool:
        """Add a line; return whether it is a valid line of a file of links."""
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
    """Return a label as a number; 0 if it is not one.

    >>> number_of("007"), number_of("k7")
    (7, 0)
    """
    return int(label) if label.isascii() and label.isdigit() else 0


def links_beside(root: Path) -> Path:
    """Return the default path of a data set's file of links."""
    place = Path(os.path.abspath(root)) if root.name in ("", "..") else root
    return place.parent / f"{place.name}-links.jsonl"


def read_links(path: Path) -> Links:
    """Read a file of links; lines truncated by a full disk, a crash or a power failure are skipped.

    Raises
    ------
    InputError
        If it cannot be read, or contains an invalid line.
    """
    found, offset = Links(), 0
    for number, line in enumerate(read_bytes(path, "the links of a server").split(b"\n"), 1):
        content = line.strip()
        try:
            known = not content or found.add(json.loads(content), offset, len(line))
            torn = line.startswith(NOBODY) or (line.startswith(START) and line.endswith(b" "))
        except (ValueError, RecursionError):
            known, torn = False, content.startswith(START) or START.startswith(content)
        if not (known or torn):
            raise InputError(f"{path}, line {number}, is not a link: give a file of links of 'focalgradient serve'.")
        if not known:
            found.torn.append((offset, len(line)))
        offset += len(line) + 1
    return found


def forget_links(path: Path, participant: str | None = None, *, owned: bool = False) -> int:
    """Overwrite all lines of a participant, and truncated lines; return the number of lines overwritten.

    Parameters
    ----------
    path
        Path of the file, which a running server may have open.
    participant
        Label in the data; None: only truncated lines.
    owned
        Whether the caller has locked the file.

    Raises
    ------
    InputError
        If the file cannot be read or written, or is not a file of links.
    """
    with writing(path, UNDONE), path.open("r+b") as file:
        alone = owned or try_lock(file.fileno(), path)  # otherwise a server may be writing the last line
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
