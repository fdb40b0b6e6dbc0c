"""Journal of a session: one line of JSON per event, on disk before the next trial begins.

Lines are only appended, by one program at a time, which locks the file. After a crash or power failure all finished
lines are kept, and at most the last one is truncated: it is skipped and listed, and the next line begins after a
newline.

Each line ends with its "chain": the digest of the previous line, and its own, computed from that and the rest of the
line. Lines that were changed, added or removed later break the chain.
"""

from __future__ import annotations

import codecs
import errno
import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from focalgradient.dataset.append import append, writing
from focalgradient.dataset.events import CellTests, Event, cell_tests, event_error
from focalgradient.dataset.lock import locked, try_lock, unlock
from focalgradient.errors import InputError
from focalgradient.files import is_text, move, read_bytes, staged
from focalgradient.files.writing import flush_folder, make_file

__all__ = [
    "Journal",
    "Log",
    "create_whole",
    "parsed_line",
    "read_journal",
    "rewrite",
    "scan_journal",
    "whole_lines",
    "writing",
]

CHAIN = re.compile(rb', "chain": \["([0-9a-f]{32})?", "([0-9a-f]{32})"\]\}$')
"""End of a line."""

LONGEST_CHAIN = 90
"""Maximum length of a line's end in bytes."""

MOST_BYTES = 1 << 30
"""Maximum size of a journal in bytes: 2000 trials (the maximum of a design) of 0.5 MB each."""


@dataclass(frozen=True, slots=True)
class Log:
    """Content of a journal.

    Parameters
    ----------
    path
        Path of the file.
    events
        All readable events, in order; the first describes the session.
    broken
        Numbers, from 1, of lines that a crash truncated.
    damaged
        Damage that a crash does not explain, one sentence each: the journal is unreliable.
    changed
        Breaks of the chain, one sentence each: lines were changed, added or removed after they were written.
    altered
        Numbers of lines whose own digest is wrong.
    lines
        Line number of each event.
    last
        Digest of the last line; "" for an empty journal.
    """

    path: Path
    events: tuple[Event, ...]
    broken: tuple[int, ...]
    damaged: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    altered: tuple[int, ...] = ()
    lines: tuple[int, ...] = ()
    last: str = ""

    @property
    def head(self) -> Event:
        """First event, which describes the session."""
        return self.events[0]

    def of(self, kind: str) -> list[Event]:
        """Return the events of one kind."""
        return [event for event in self.events if event["event"] == kind]


class Journal:
    """Journal open for writing, locked against other writers.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "journal.jsonl")
    ...     with Journal.begin(path, {"event": "begun", "participant": "01"}) as journal:
    ...         journal.write({"event": "note", "kind": "break"})
    ...     len(path.read_text().splitlines())
    2
    """

    def __init__(self, path: Path, file: int, durable: bool, last: str):
        self.path = path
        self._file = file
        self._durable = durable
        self._last = last

    @classmethod
    def begin(cls, path: Path, head: Mapping[str, Any], *, durable: bool = True) -> Journal:
        """Create a new journal that contains its `head` from the start.

        Parameters
        ----------
        path
            Path of the file; its folder is created.
        head
            First event.
        durable
            Whether to wait for each line until it is on disk, which takes a few ms and protects it from a power
            failure. Otherwise lines survive only a crash of the process.

        Raises
        ------
        FileExistsError
            If the journal already exists.
        InputError
            If it cannot be written.
        """
        line, last = _line(head, "")
        with writing(path):
            create_whole(path, line)
        journal = cls.take(path)
        journal._durable, journal._last = durable, last
        return journal

    @classmethod
    def take(cls, path: Path) -> Journal:
        """Lock an existing journal against other writers until it is closed.

        Raises
        ------
        InputError
            If it does not exist, another program has locked it, or it cannot be written.
        """
        try:
            file = os.open(path, os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0))
        except FileNotFoundError as error:
            raise InputError(f"{path} is missing: there is no such session to resume; begin it.") from error
        except OSError as error:
            raise InputError(f"{path} cannot be written ({error.strerror}): change its permissions.") from error
        try:
            if not try_lock(file, path):
                raise InputError(
                    f"{path} is being recorded by another program: wait for it, or end it and resume the session."
                )
        except InputError:
            os.close(file)
            raise
        return cls(path, file, True, "")

    def resume(self, log: Log, event: Mapping[str, Any], *, durable: bool = True) -> None:
        """Continue after the events read, on a new line if the last one is broken; `event` records the resumption.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        self.follow(log, durable=durable)
        self.write(event)

    def follow(self, log: Log, *, durable: bool = True) -> None:
        """Continue the same sitting after the events read, whose last line must be whole."""
        self._durable, self._last = durable, log.last

    def write(self, *events: Mapping[str, Any]) -> None:
        """Append a line for each event, and return when all are safe, after a single wait for the disk.

        Raises
        ------
        InputError
            If they cannot be written, for example because the disk is full.
        """
        lines, last = _lines(events, self._last)
        try:
            append(self._file, self.path, lines, durable=self._durable)
        except InputError:
            self.close()  # the session can be resumed when there is room
            raise
        self._last = last

    def close(self) -> None:
        """Close and unlock the file."""
        file, self._file = self._file, -1  # first: after a signal it must not be closed twice
        if file >= 0:
            with suppress(OSError):
                unlock(file)
            os.close(file)

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()


def _line(event: Mapping[str, Any], before: str) -> tuple[bytes, str]:
    """Return a line of a journal, and its digest."""
    body = json.dumps(event, allow_nan=False, ensure_ascii=False, default=_plain).encode()
    own = _digest(before, body)
    return body[:-1] + f', "chain": ["{before}", "{own}"]}}\n'.encode(), own


def _lines(events: Iterable[Mapping[str, Any]], last: str) -> tuple[bytes, str]:
    """Return lines of a journal that follow a line with digest `last`, and the digest of the last of them."""
    lines = []
    for event in events:
        line, last = _line(event, last)
        lines.append(line)
    return b"".join(lines), last


def whole_lines(events: Iterable[Mapping[str, Any]]) -> bytes:
    """Return the lines of a journal that contains these events from its start."""
    return _lines(events, "")[0]


def _digest(before: str, body: bytes) -> str:
    """Return a 128-bit digest, which detects accidental and manual changes."""
    return hashlib.sha256(before.encode() + body).hexdigest()[:32]


def _plain(value: Any) -> Any:
    """Convert NumPy numbers and arrays to types that JSON supports."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be written as JSON.")


def make_folder(folder: Path) -> None:
    """Create a folder and its missing parents, accessible only to their owner."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    for one in reversed(missing):
        one.mkdir(mode=0o700, exist_ok=True)


def create_whole(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Write a file atomically, accessible only to its owner: to a hidden file, flushed to disk, then moved.

    Its missing folders are created.

    Raises
    ------
    FileExistsError
        If it already exists and `replace` is false; if several programs create it at once, one succeeds.
    """
    if not replace and os.path.lexists(path):
        raise FileExistsError(f"{path} already exists.")
    make_folder(path.parent)
    with staged(path.parent) as folder:
        hidden = folder / path.name
        make_file(hidden, content, 0o600)
        if replace:
            move(hidden, path)
        else:
            _place(hidden, path, content)
    flush_folder(path.parent)


def rewrite(path: Path, content: Callable[[], bytes | None]) -> bool:
    """Replace a file by `content`, called while other programs cannot write it; None leaves the file as it is."""
    with locked(path):
        made = content()
        if made is not None and sys.platform != "win32":
            create_whole(path, made, replace=True)
    if made is not None and sys.platform == "win32":  # where open files cannot be replaced
        create_whole(path, made, replace=True)
    return made is not None


def _place(hidden: Path, path: Path, content: bytes) -> None:
    """Move a file to a path that must not exist."""
    if sys.platform == "win32":
        os.rename(hidden, path)  # fails on Windows if the path exists
        return
    try:
        os.link(hidden, path)
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOSYS, errno.EMLINK):
            raise
        # Without hard links, as on FAT, a crash may leave a partial file, but never two owners.
        make_file(path, content, 0o600)


def read_journal(path: Path) -> Log:
    """Read a journal, also one that is being written or was interrupted.

    Raises
    ------
    InputError
        If it cannot be read, or a line has damage that a crash does not explain; the first such line is named.
    """
    log = scan_journal(path)
    if log.damaged:
        raise InputError(log.damaged[0])
    return log


def scan_journal(path: Path) -> Log:
    """Read all readable events of a journal, and list its faults.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    scan = _Scan(path)
    content = read_bytes(path, "a journal", MOST_BYTES)
    if content.startswith(codecs.BOM_UTF8):
        content = content.removeprefix(codecs.BOM_UTF8)
        scan._change("line 1 begins with a byte order mark, which another program has added")
    for number, line in enumerate(content.split(b"\n"), start=1):
        if line.strip():
            scan.add(number, line)
    return scan.done()


class _Scan:
    """Line-by-line reader of a journal."""

    def __init__(self, path: Path):
        self.path = path
        self.events: list[Event] = []
        self.lines: list[int] = []
        self.broken: list[int] = []
        self.damaged: list[str] = []
        self.changed: list[str] = []
        self.altered: list[int] = []
        self.tests: CellTests | None = None
        self.last = ""
        self.cut = 0
        self.beheaded = False

    def add(self, number: int, line: bytes) -> None:
        event = parsed_line(line)
        if event is None:
            self.broken.append(number)
            self.cut = self.cut or number
            self.beheaded = self.beheaded or not self.events
            return
        if self.cut and event["event"] != "resumed":
            self._damage(f"line {self.cut} is damaged, which a crash of the program does not explain")
        self.cut = 0
        self._follow(number, line.rstrip(b"\r"), event)
        if not self.events and event["event"] != "begun":
            self.beheaded = True
        if self.beheaded:
            return
        head = self.events[0] if self.events else event
        wrong = "a second session begins here" if self.events and event["event"] == "begun" else None
        wrong = wrong or event_error(event, head, self.tests)
        if wrong is not None:
            self._damage(f"line {number}: {wrong}")
            if not self.events:
                self.beheaded = True
            return
        if not self.events:
            self.tests = cell_tests(event)
        self.events.append(event)
        self.lines.append(number)

    def _damage(self, what: str) -> None:
        self.damaged.append(f"{self.path}: {what}: restore the file from a copy, or use 'focalgradient repair'.")

    def _change(self, what: str) -> None:
        self.changed.append(f"{self.path}: {what}: restore the file from a copy, or use 'focalgradient repair'.")

    def _follow(self, number: int, line: bytes, event: Event) -> None:
        """Verify the chain at a line."""
        found = CHAIN.search(line, max(len(line) - LONGEST_CHAIN, 0))
        if found is None:
            self._change(f"line {number} was added or changed after the session: it has no chain")
            self.altered.append(number)
            self.last = _digest(self.last, line)
            return
        before, own = ((part or b"").decode() for part in found.groups())
        if _digest(before, line[: found.start()] + b"}") != own:
            self._change(f"line {number} was changed after it was written")
            self.altered.append(number)
        if before != self.last:
            self._change(f"lines before line {number} are missing, or were changed or moved")
        self.last = own
        del event["chain"]

    def done(self) -> Log:
        if self.beheaded or not self.events:
            sentence = f"{self.path} does not start with the first line of a journal: restore the file from a copy."
            self.damaged.insert(0, sentence)
        faults = tuple(self.broken), tuple(self.damaged), tuple(self.changed), tuple(self.altered)
        return Log(self.path, tuple(self.events), *faults, tuple(self.lines), self.last)


def parsed_line(line: bytes) -> Event | None:
    """Parse a line; return None if it is truncated, as no part of a line is valid JSON."""
    try:
        text = line.decode()
        event = DECODER.decode(text)
    except (ValueError, RecursionError):
        return None
    whole = isinstance(event, dict) and isinstance(event.get("event"), str) and is_text(text, event)
    return event if whole else None


def _no_number(name: str) -> Any:
    raise ValueError(f"{name} is not a valid number in a journal.")


DECODER = json.JSONDecoder(parse_constant=_no_number)
