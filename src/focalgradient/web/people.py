"""Who may take part: secret links, and what a platform calls its people, both kept apart from the data.

The file has one line of JSON a person: the label in the data, the digest of the secret in the link, and identifiers of
a platform; and one for each session that was stopped. Whoever has the data without this file cannot tell who is who;
whoever has this file cannot take part.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focalgradient.dataset.lock import try_lock
from focalgradient.errors import InputError
from focalgradient.files import flush, parse_json, read_bytes

__all__ = ["People", "Person", "Roster"]

PLATFORM = ("PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "survey_code", "workerId", "id")
"""Parameters of links that are kept: Prolific's, SONA's, Mechanical Turk's, and a plain one."""

OF_PERSON = ("PROLIFIC_PID", "survey_code", "workerId", "id")
"""Those that name a person: with the same one again, the same session goes on."""

VALUE = re.compile(r"[\w.@-]{1,100}")

BEGINNING = b'{"participant": "'
"""Of each line."""

DIGITS = 3
"""Of labels, at least: 001, 002, ..."""


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody who may take part.

    Parameters
    ----------
    participant
        Label in the data.
    platform
        Identifiers of the platform that the person comes from.
    """

    participant: str
    platform: Mapping[str, str]


class Roster:
    """Everybody who may take part; where that is kept, a subclass says."""

    def __init__(self, taken: frozenset[str] = frozenset()) -> None:
        self._taken, self._stopped, self._guard = set(taken), set[str](), threading.Lock()
        self._of_digest: dict[str, Person] = {}

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Nobody else adds people meanwhile, and those that others have added are known."""
        with self._guard:
            yield

    def _keep(self, participant: str, digest: str, platform: dict[str, str]) -> None:
        """Write down a link; called within `_alone`."""
        raise NotImplementedError

    def _keep_stopped(self, participant: str) -> None:
        """Write down that a session was stopped; called within `_alone`."""
        raise NotImplementedError

    def of(self, token: str) -> Person | None:
        """Give the person that a link's secret is of; None where there is none."""
        return self._of_digest.get(digest_of_token(token))

    def everybody(self) -> dict[str, Person]:
        """Everybody, by label."""
        return {person.participant: person for person in self._of_digest.values()}

    def is_stopped(self, participant: str) -> bool:
        """Whether a participant's session was stopped for good."""
        return participant in self._stopped

    def stop(self, participant: str) -> None:
        """Take nothing more from a participant, also after the server was started anew."""
        with self._alone():
            if participant not in self._stopped:
                self._keep_stopped(participant)
                self._stopped.add(participant)

    def invite(self, count: int) -> list[str]:
        """Make so many links for new people; gives their secrets, which are kept nowhere."""
        with self._alone():
            return [self._new(self._label(), {}) for _ in range(count)]

    def join(self, given: Mapping[str, str]) -> str:
        """Give a secret to who comes by the open link: a new person, or the one of the same platform's name.

        Raises
        ------
        InputError
            If an identifier is not one.
        """
        platform = {name: given[name] for name in PLATFORM if name in given}
        for name, value in platform.items():
            if not VALUE.fullmatch(value):
                raise InputError(
                    f"{name} is not an identifier of at most 100 letters and digits: follow the link again."
                )
        with self._alone():
            named = {name: value for name, value in platform.items() if name in OF_PERSON}
            for person in self._of_digest.values():
                if named and all(person.platform.get(name) == value for name, value in named.items()):
                    return self._new(person.participant, platform)
            return self._new(self._label(), platform)

    def _label(self) -> str:
        number = len(self._taken) + 1
        while f"{number:0{DIGITS}}" in self._taken:
            number += 1
        self._taken.add(f"{number:0{DIGITS}}")
        return f"{number:0{DIGITS}}"

    def _new(self, participant: str, platform: dict[str, str]) -> str:
        token = secrets.token_urlsafe(18)
        digest = digest_of_token(token)
        self._keep(participant, digest, platform)
        self._of_digest[digest] = Person(participant, platform)
        return token

    def close(self) -> None:
        """Let go of what it is kept in."""


class People(Roster):
    """Everybody who may take part, kept in one file that one server owns.

    Parameters
    ----------
    path
        The file; made where it is missing, readable by its owner alone.
    taken
        Labels that are in the data already.
    data
        Folder of the data set, which no other server may have either, whatever its links.

    Raises
    ------
    InputError
        If the file cannot be read or written, is damaged, or another server has it or the data.
    """

    def __init__(self, path: Path, taken: frozenset[str] = frozenset(), data: Path | None = None):
        super().__init__(taken)
        self._path = path
        self._lock = None if data is None else _Owned(data)
        try:
            self._open(path)
        except BaseException:
            self._let_go()
            raise

    def _open(self, path: Path) -> None:
        if path.exists():
            read_bytes(path, "the links of a server")  # refuses what is no regular file
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o600)
        except OSError as error:
            raise InputError(f"{path} cannot be written ({error.strerror}): give another place.") from error
        try:
            if not try_lock(self._file, path):
                raise InputError(f"another server uses {path}: end it; a study with other data needs other links.")
            self._read(read_bytes(path, "the links of a server"))
        except BaseException:
            os.close(self._file)
            raise

    def _read(self, content: bytes) -> None:
        whole, _, rest = content.rpartition(b"\n")
        for number, line in enumerate(whole.splitlines(), 1):
            self._add(parse_json(line, f"{self._path}, line {number}", "the links of a server"), number)
        if rest:  # cut short by a kill: that link was never given out
            if not (rest.startswith(BEGINNING) or BEGINNING.startswith(rest)):
                self._add(None, whole.count(b"\n") + 2 if whole else 1)
            os.ftruncate(self._file, len(content) - len(rest))

    def _add(self, line: object, number: int) -> None:
        match line:
            case {"participant": str(participant), "sha256": str(digest), "platform": dict(platform)}:
                self._of_digest[digest] = Person(participant, platform)
                self._taken.add(participant)
            case {"participant": str(participant), "stopped": True}:
                self._stopped.add(participant)
            case _:
                raise InputError(
                    f"{self._path}, line {number}, is no link: give a file of links of 'focalgradient serve'."
                )

    def _keep(self, participant: str, digest: str, platform: dict[str, str]) -> None:
        self._write({"participant": participant, "sha256": digest, "platform": platform})

    def _keep_stopped(self, participant: str) -> None:
        self._write({"participant": participant, "stopped": True})

    def _write(self, line: Mapping[str, Any]) -> None:
        os.write(self._file, json.dumps(line).encode() + b"\n")
        flush(self._file)

    def close(self) -> None:
        """Let another server have the file; one that names nobody goes."""
        if not os.fstat(self._file).st_size:
            with suppress(OSError):  # Windows lets nobody remove an open file
                self._path.unlink(missing_ok=True)
        os.close(self._file)
        self._let_go()

    def _let_go(self) -> None:
        if self._lock is not None:
            self._lock.close()


class _Owned:
    """One server's lock of a folder of data, which need not be there yet: a hidden file beside it."""

    def __init__(self, data: Path):
        real = Path(os.path.realpath(data))
        self._path = real.with_name(f".{real.name}-server")
        try:
            real.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError as error:
            raise InputError(f"{self._path} cannot be written ({error.strerror}): give another folder.") from error
        if not try_lock(self._file, self._path):
            os.close(self._file)
            raise InputError(f"another server keeps its data in {data}: end it, or give this one another folder.")

    def close(self) -> None:
        """Let another server have the data."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
        os.close(self._file)


def digest_of_token(token: str) -> str:
    """What is kept of a link's secret."""
    return hashlib.sha256(token.encode()).hexdigest()
