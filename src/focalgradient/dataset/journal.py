"""The journal of a session: one line of JSON an event, on the disk before the next trial begins.

Lines are only ever added. Whatever kills the program, a kill of the process or of the power, finished lines stay and
at most the last one is broken: it is passed over, told, and what goes on after it begins on a line of its own.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from focalgradient.errors import InputError

__all__ = ["Event", "Journal", "Log", "create_whole", "read_journal", "writing"]

Event = dict[str, Any]
"""What a line says; its kind stands under "event"."""


@dataclass(frozen=True, slots=True)
class Log:
    """What a journal holds.

    Parameters
    ----------
    path
        The file.
    events
        All that can be read, in order; the first tells the session.
    broken
        Numbers of the lines, from 1, that a kill cut short.
    """

    path: Path
    events: tuple[Event, ...]
    broken: tuple[int, ...]

    @property
    def head(self) -> Event:
        """The event that began it."""
        return self.events[0]

    def of(self, kind: str) -> list[Event]:
        """Events of one kind."""
        return [event for event in self.events if event["event"] == kind]


class Journal:
    """A journal that is being written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "journal.jsonl")
    ...     with Journal.begin(path, {"event": "begun", "participant": "01"}) as journal:
    ...         journal.write({"event": "trial", "rating": 1.5})
    ...     [event["event"] for event in read_journal(path).events]
    ['begun', 'trial']
    """

    def __init__(self, path: Path, file: int, durable: bool):
        self.path = path
        self._file = file
        self._durable = durable

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
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            create_whole(path, _line(head))
            return cls._opened(path, durable)

    @classmethod
    def resume(cls, path: Path, event: Mapping[str, Any], *, durable: bool = True) -> Journal:
        """Go on with a journal, after its broken line if it ends in one; `event` tells that it does.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        with writing(path):
            journal = cls._opened(path, durable)
            if not path.read_bytes().endswith(b"\n"):
                os.write(journal._file, b"\n")
        journal.write(event)
        return journal

    @classmethod
    def _opened(cls, path: Path, durable: bool) -> Journal:
        return cls(path, os.open(path, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0)), durable)

    def write(self, event: Mapping[str, Any]) -> None:
        """Add a line, and come back when it is safe.

        Raises
        ------
        InputError
            If it cannot be written, as on a full disk.
        """
        rest = memoryview(_line(event))
        try:
            with writing(self.path):
                while rest:
                    rest = rest[os.write(self._file, rest) :]
                if self._durable:
                    os.fsync(self._file)
        except InputError:
            self.close()  # what would follow a line cut short would be lost with it
            raise

    def close(self) -> None:
        """Let go of the file."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Say in one sentence, as an InputError, that a file cannot be written, as on a full disk."""
    try:
        yield
    except FileExistsError:
        raise
    except OSError as error:
        raise InputError(
            f"{error.filename or path} cannot be written ({error.strerror or error}): make room on the disk or choose "
            "a folder that you may write in; what was recorded before is safe, and can be resumed."
        ) from error


def _line(event: Mapping[str, Any]) -> bytes:
    return (json.dumps(event, allow_nan=False, ensure_ascii=False, default=_plain) + "\n").encode()


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays, as JSON knows them."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"{value!r} cannot be written as JSON.")


def create_whole(path: Path, content: bytes, *, replace: bool = False) -> None:
    """Write a file so that it is never there in part: out of sight, to the disk, then into its place.

    Raises
    ------
    FileExistsError
        If it is there already, and is not to be replaced.
    """
    if not replace and os.path.lexists(path):
        raise FileExistsError(f"{path} is there already.")
    hidden = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with hidden.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        hidden.replace(path)
    finally:
        hidden.unlink(missing_ok=True)
    if os.name == "posix":  # elsewhere folders cannot be opened, and need not be
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def read_journal(path: Path) -> Log:
    """Read a journal, also one that is being written or was cut off.

    Raises
    ------
    InputError
        If it cannot be read, or a line is broken that no kill explains: one followed by other than a resumption.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): give the path of a journal.") from error
    events: list[Event] = []
    broken: list[int] = []
    cut = False
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        event = _parsed(line)
        if event is None:
            broken.append(number)
            cut = True
        elif cut and event["event"] != "resumed":
            raise InputError(
                f"{path}: line {broken[-1]} is damaged, which no kill of the program explains: restore the file from "
                "a copy."
            )
        else:
            events.append(event)
            cut = False
    if not events or events[0]["event"] != "begun":
        raise InputError(f"{path} does not begin as a journal does: restore the file from a copy.")
    return Log(path, tuple(events), tuple(broken))


def _parsed(line: bytes) -> Event | None:
    """What a line says; None if it is broken: no piece of a line is JSON itself."""
    try:
        event = json.loads(line)
    except ValueError:
        return None
    return event if isinstance(event, dict) and isinstance(event.get("event"), str) else None
