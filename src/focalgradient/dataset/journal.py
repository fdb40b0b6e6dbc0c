"""The journal of a session: one line of JSON an event, on the disk before the next trial begins.

Lines are only ever added, by one program at a time, which holds the file's lock. Whatever kills the program, a kill of
the process or of the power, finished lines stay and at most the last one is cut short: it is passed over and listed,
and what goes on after it begins on a line of its own.

Each line ends in its "chain": the digest of the line before it, and its own, of that and of the rest of the line. A
line that was changed, added or taken away later no longer fits. Journals of earlier versions have no chain; what is
added to them chains all that stands above it.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from focalgradient.dataset.append import append, writing
from focalgradient.dataset.events import Event, Tests, trial_tests, wrong_event
from focalgradient.dataset.lock import try_lock, unlock
from focalgradient.errors import InputError
from focalgradient.files import flush, is_text, move, read_bytes, staged

__all__ = [
    "Journal",
    "Log",
    "create_whole",
    "make_folder",
    "read_journal",
    "scan_journal",
    "whole_lines",
    "writing",
]

CHAIN = re.compile(rb', "chain": \["([0-9a-f]{32})?", "([0-9a-f]{32})"\]\}$')
"""How a line ends."""

LONGEST_CHAIN = 90
"""Bytes of that."""

MOST_BYTES = 1 << 30
"""Of a journal that is read: two thousand trials (the most of a design) of half a megabyte each."""


@dataclass(frozen=True, slots=True)
class Log:
    """What a journal holds.

    Parameters
    ----------
    path
        The file.
    events
        All that can be read, in order; the first describes the session.
    broken
        Numbers of the lines, from 1, that a kill cut short.
    damaged
        What no kill explains, a sentence each: the journal cannot be relied on.
    changed
        Where the chain does not hold, a sentence each: lines were changed, added or taken away after they were written.
    altered
        Numbers of the lines whose own digest does not hold.
    lines
        Number of the line of each event.
    chained
        Whether every line has its chain.
    last
        Digest of the last line, "" where there is none.
    """

    path: Path
    events: tuple[Event, ...]
    broken: tuple[int, ...]
    damaged: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    altered: tuple[int, ...] = ()
    lines: tuple[int, ...] = ()
    chained: bool = False
    last: str = ""

    @property
    def head(self) -> Event:
        """The event that began it."""
        return self.events[0]

    def of(self, kind: str) -> list[Event]:
        """Events of one kind."""
        return [event for event in self.events if event["event"] == kind]


class Journal:
    """A journal that is being written; nobody else can write to it meanwhile.

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
        """Begin a journal where there is none; from its first moment it has its `head`.

        Parameters
        ----------
        path
            Of the file; its folder is made.
        head
            Its first event.
        durable
            Whether to wait, at each line, until it is on the disk: a few milliseconds, and safe from a loss of power.
            Without it lines are safe from a kill of the process alone.

        Raises
        ------
        FileExistsError
            If there is one already.
        InputError
            If it cannot be written.
        """
        line, last = _line(head, "")
        with writing(path):
            make_folder(path.parent)
            create_whole(path, line)
        journal = cls.take(path)
        journal._durable, journal._last = durable, last
        return journal

    @classmethod
    def take(cls, path: Path) -> Journal:
        """Become the owner of a journal that is there: nobody else can write to it until it is closed.

        Raises
        ------
        InputError
            If there is none, another program has it, or it cannot be written.
        """
        try:
            file = os.open(path, os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0))
        except FileNotFoundError as error:
            raise InputError(f"{path} is missing: there is no such session to resume; begin it.") from error
        except OSError as error:
            raise InputError(f"{path} cannot be written ({error.strerror}): see who may write to it.") from error
        try:
            if not try_lock(file, path):
                raise InputError(
                    f"{path} is being recorded by another program: let that go on, or end it and resume the session."
                )
        except InputError:
            os.close(file)
            raise
        return cls(path, file, True, "")

    def resume(self, log: Log, event: Mapping[str, Any], *, durable: bool = True) -> None:
        """Go on after what was read, after its broken line if it ends in one; `event` says that it goes on.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        self.follow(log, durable=durable)
        self.write(event)

    def follow(self, log: Log, *, durable: bool = True) -> None:
        """Go on after what was read, which ends in a whole line, in the same sitting."""
        self._durable, self._last = durable, log.last

    def write(self, *events: Mapping[str, Any]) -> None:
        """Add a line for each event, and come back when all are safe: however many, the disk is waited for once.

        Raises
        ------
        InputError
            If it cannot be written, as on a full disk.
        """
        lines, last = _lines(events, self._last)
        try:
            append(self._file, self.path, lines, durable=self._durable)
        except InputError:
            self.close()  # the session is resumed when there is room again
            raise
        self._last = last

    def close(self) -> None:
        """Let go of the file."""
        file, self._file = self._file, -1  # first: cut off by a signal, it must not be closed twice
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
    """A line of a journal, and its digest."""
    body = json.dumps(event, allow_nan=False, ensure_ascii=False, default=_plain).encode()
    own = _digest(before, body)
    return body[:-1] + f', "chain": ["{before}", "{own}"]}}\n'.encode(), own


def _lines(events: Iterable[Mapping[str, Any]], last: str) -> tuple[bytes, str]:
    """Lines of a journal after one of digest `last`, and the digest of the last of them."""
    lines = []
    for event in events:
        line, last = _line(event, last)
        lines.append(line)
    return b"".join(lines), last


def whole_lines(events: Iterable[Mapping[str, Any]]) -> bytes:
    """Lines of a journal that holds these events from its beginning."""
    return _lines(events, "")[0]


def _digest(before: str, body: bytes) -> str:
    """128 bits: a change by accident or by hand alters them."""
    return hashlib.sha256(before.encode() + body).hexdigest()[:32]


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, as JSON knows them."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be written as JSON.")


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it that are missing, for their owner alone."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    for one in reversed(missing):
        one.mkdir(mode=0o700, exist_ok=True)


def create_whole(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Write a file for its owner alone, so that it is never there in part: out of sight, to the disk, into its place.

    Raises
    ------
    FileExistsError
        If it is there already, and is not to be replaced: of several programs that try at once, one succeeds.
    """
    if not replace and os.path.lexists(path):
        raise FileExistsError(f"{path} is there already.")
    with staged(path.parent) as folder:
        hidden = folder / path.name
        with os.fdopen(
            os.open(hidden, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600), "wb"
        ) as stream:
            stream.write(content)
            stream.flush()
            flush(stream.fileno())
        if replace:
            move(hidden, path)
        else:
            _place(hidden, path, content)
    if os.name == "posix":  # elsewhere folders cannot be opened, and need not be
        number = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _place(hidden: Path, path: Path, content: bytes) -> None:
    """Give a file its name, if nothing has that name."""
    if sys.platform == "win32":
        os.rename(hidden, path)  # refuses there what is taken
        return
    try:
        os.link(hidden, path)
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOSYS, errno.EMLINK):
            raise
        # Without hard links, as on a memory stick's file system, a kill may leave it in part; never two owners.
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as stream:
            stream.write(content)
            stream.flush()
            flush(stream.fileno())


def read_journal(path: Path) -> Log:
    """Read a journal, also one that is being written or was cut off.

    Raises
    ------
    InputError
        If it cannot be read, or a line is damaged as no kill explains; the first such line is named.
    """
    log = scan_journal(path)
    if log.damaged:
        raise InputError(log.damaged[0])
    return log


def scan_journal(path: Path) -> Log:
    """Read what can be read of a journal, and list what is wrong with it.

    Raises
    ------
    InputError
        If the file cannot be read at all.
    """
    scan = _Scan(path)
    content = read_bytes(path, "a journal", MOST_BYTES)
    for number, line in enumerate(content.split(b"\n"), start=1):
        if line.strip():
            scan.add(number, line)
    return scan.done()


class _Scan:
    """A journal while it is read, line by line."""

    def __init__(self, path: Path):
        self.path = path
        self.events: list[Event] = []
        self.lines: list[int] = []
        self.broken: list[int] = []
        self.damaged: list[str] = []
        self.changed: list[str] = []
        self.altered: list[int] = []
        self.tests: Tests | None = None
        self.last = ""
        self.first_chained = 0
        self.cut = 0
        self.beheaded = False

    def add(self, number: int, line: bytes) -> None:
        event = _parsed(line)
        if event is None:
            self.broken.append(number)
            self.cut = self.cut or number
            self.beheaded = self.beheaded or not self.events
            return
        if self.cut and event["event"] != "resumed":
            self._damage(f"line {self.cut} is damaged, which no kill of the program explains")
        self.cut = 0
        self._follow(number, line.rstrip(b"\r"), event)
        if not self.events and event["event"] != "begun":
            self.beheaded = True
        if self.beheaded:
            return
        head = self.events[0] if self.events else event
        wrong = "a session begins here, but it began above" if self.events and event["event"] == "begun" else None
        wrong = wrong or wrong_event(event, head, self.tests)
        if wrong is not None:
            self._damage(f"line {number}: {wrong}")
            if not self.events:
                self.beheaded = True
            return
        if not self.events:
            self.tests = trial_tests(event)
        self.events.append(event)
        self.lines.append(number)

    def _damage(self, what: str) -> None:
        self.damaged.append(f"{self.path}: {what}: restore the file from a copy, or use 'focalgradient repair'.")

    def _change(self, what: str) -> None:
        self.changed.append(f"{self.path}: {what}: restore the file from a copy, or use 'focalgradient repair'.")

    def _follow(self, number: int, line: bytes, event: Event) -> None:
        """Follow the chain over a line."""
        found = CHAIN.search(line, max(len(line) - LONGEST_CHAIN, 0))
        if found is None:
            if self.first_chained or "chain" in event:
                self._change(f"line {number} was added or changed after the session: it has no chain")
                self.altered.append(number)
            self.last = _digest(self.last, line)
            return
        self.first_chained = self.first_chained or number
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
            sentence = f"{self.path} does not begin as a journal does: restore the file from a copy."
            self.damaged.insert(0, sentence)
        first = self.lines[0] if self.lines else 0
        return Log(
            self.path,
            tuple(self.events),
            tuple(self.broken),
            tuple(self.damaged),
            tuple(self.changed),
            tuple(self.altered),
            tuple(self.lines),
            bool(self.lines) and self.first_chained == first,
            self.last,
        )


def _parsed(line: bytes) -> Event | None:
    """What a line holds; None if it is broken: no piece of a line is JSON itself."""
    try:
        event = DECODER.decode(line.decode())
    except (ValueError, RecursionError):
        return None
    whole = isinstance(event, dict) and isinstance(event.get("event"), str) and is_text(line, event)
    return event if whole else None


def _no_number(name: str) -> Any:
    raise ValueError(f"{name} is no number that a journal holds.")


DECODER = json.JSONDecoder(parse_constant=_no_number)
