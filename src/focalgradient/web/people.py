"""Participants: secret links and platform identifiers, both stored separately from the data.

The file has one line of JSON per person (label in the data, digest of the link's secret, identifiers of a platform),
and one for each session that was stopped. The data alone do not identify participants; the file alone does not give
access to sessions. All entries of participants who withdraw are removed from it.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focalgradient.dataset.append import append
from focalgradient.dataset.links import BEGINNING, Links, forget_links, read_links
from focalgradient.dataset.lock import try_lock
from focalgradient.errors import InputError
from focalgradient.files import read_bytes

__all__ = ["People", "Person", "Roster"]

PLATFORM = ("PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "survey_code", "workerId", "id")
"""Link parameters that are stored: those of Prolific, SONA and Mechanical Turk, and a general one."""

OF_PERSON = ("PROLIFIC_PID", "survey_code", "workerId", "id")
"""Link parameters that identify a person; others may know or guess them, so they do not give access to a session."""

VALUE = re.compile(r"[\w.@-]{1,100}")

DIGITS = 3
"""Minimum number of digits of a label: 001, 002, ..."""


@dataclass(frozen=True, slots=True)
class Person:
    """Person who may take part.

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
    """Base class of lists of participants; subclasses define the storage."""

    def __init__(self, taken: frozenset[str] = frozenset()) -> None:
        self._taken, self._stopped, self._guard = set(taken), set[str](), threading.Lock()
        self._labels = 0
        self._of_digest: dict[str, Person] = {}

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Lock the list against other writers, and load entries that they have added."""
        with self._guard:
            yield

    def _keep(self, person: Person, digest: str) -> None:
        """Store a link; called within `_alone`."""
        raise NotImplementedError

    def _keep_stopped(self, participant: str) -> None:
        """Store that a session was stopped; called within `_alone`."""
        raise NotImplementedError

    def _redact(self, participant: str) -> None:
        """Remove the stored entries of a participant; called within `_alone`."""
        raise NotImplementedError

    def _is_kept(self, digest: str) -> bool:
        """Return whether a link in memory is still stored; a withdrawal on another server removes it."""
        raise NotImplementedError

    def of(self, token: str) -> Person | None:
        """Return the person to whom a secret belongs; None if there is none."""
        return self._person(digest_of_token(token))

    def _person(self, digest: str) -> Person | None:
        person = self._of_digest.get(digest)
        return person if person is not None and self._is_kept(digest) else None

    def everybody(self) -> dict[str, Person]:
        """Return all persons by label."""
        found = (self._person(digest) for digest in list(self._of_digest))
        return {person.participant: person for person in found if person is not None}

    def is_stopped(self, participant: str) -> bool:
        """Return whether a participant's session was stopped permanently."""
        return participant in self._stopped

    def stop(self, participant: str) -> None:
        """Stop accepting responses from a participant permanently, also after the server restarts."""
        with self._alone():
            if participant not in self._stopped:
                self._keep_stopped(participant)
                self._stopped.add(participant)

    def forget(self, participant: str) -> None:
        """Remove links, identifiers and label of a participant who has withdrawn; the label is not reused."""
        with self._alone():
            self._redact(participant)
            for digest, person in list(self._of_digest.items()):
                if person.participant == participant:
                    del self._of_digest[digest]

    def invite(self, count: int) -> list[str]:
        """Create links for `count` new persons; return their secrets, which are not stored."""
        with self._alone():
            return [self._new(_secret(), {}) for _ in range(count)]

    def join(self, given: Mapping[str, str], secret: str | None = None) -> str:
        """Return the secret of a new person on the open link, or of the one whose browser sends a secret again.

        Platform identifiers do not give access to a session, because others may know or guess them.

        Parameters
        ----------
        given
            Parameters of the link; those of a platform are stored.
        secret
            Secret that the browser has generated for this session and keeps; default: a new one.

        Raises
        ------
        InputError
            If an identifier is invalid, or it cannot be stored.
        """
        platform = {name: given[name] for name in PLATFORM if name in given}
        for name, value in platform.items():
            if not VALUE.fullmatch(value):
                raise InputError(
                    f"{name} is not an identifier of at most 100 letters and digits: follow the link again."
                )
        with self._alone():
            if secret is not None and self._person(digest_of_token(secret)) is not None:
                return secret
            return self._new(secret or _secret(), platform)

    def sharing_identifiers(self) -> set[str]:
        """Return the labels of persons who share a platform identifier with another person."""
        of_name: dict[tuple[str, str], set[str]] = {}
        for participant, person in self.everybody().items():
            for name in OF_PERSON:
                if name in person.platform:
                    of_name.setdefault((name, person.platform[name]), set()).add(participant)
        return {participant for several in of_name.values() if len(several) > 1 for participant in several}

    def _new(self, token: str, platform: dict[str, str]) -> str:
        number = max(len(self._taken) + 1, self._labels + 1)
        while f"{number:0{DIGITS}}" in self._taken:
            number += 1
        person, digest = Person(f"{number:0{DIGITS}}", platform), digest_of_token(token)
        self._keep(person, digest)
        self._taken.add(person.participant)
        self._labels = max(self._labels, number)
        self._of_digest[digest] = person
        return token

    def close(self) -> None:
        """Close the storage."""


class People(Roster):
    """Participants, stored in one file that one server owns.

    Parameters
    ----------
    path
        Path of the file; created if missing, readable only by its owner.
    taken
        Labels that the data already contain.
    data
        Folder of the data set, which is locked against other servers, even with other links.

    Raises
    ------
    InputError
        If the file cannot be read or written, is damaged, or another server uses it or the data.
    """

    def __init__(self, path: Path, taken: frozenset[str] = frozenset(), data: Path | None = None):
        super().__init__(taken)
        self._path = path
        self._lock = None if data is None else _Owned(data)
        self._offsets: dict[str, int] = {}
        try:
            self._open(path)
        except BaseException:
            self._let_go()
            raise

    def _open(self, path: Path) -> None:
        if path.exists():
            read_bytes(path, "the links of a server")  # raises for anything but a regular file
        self._file = _locked(path, str(path), "path")
        try:
            self._read(read_links(path))
        except BaseException:
            os.close(self._file)
            raise

    def _read(self, found: Links) -> None:
        for link in found.links:
            self._of_digest[link.sha256] = Person(link.participant, link.platform)
            self._offsets[link.sha256] = link.offset
            self._taken.add(link.participant)
        self._stopped |= found.stopped
        self._labels = found.labels
        if found.torn and sum(found.torn[-1]) == os.fstat(self._file).st_size:
            os.ftruncate(self._file, found.torn.pop()[0])
        if found.torn:
            forget_links(self._path, owned=True)

    def _keep(self, person: Person, digest: str) -> None:
        line = {"participant": person.participant, "sha256": digest, "platform": person.platform}
        self._offsets[digest] = self._append(line)

    def _keep_stopped(self, participant: str) -> None:
        self._append({"participant": participant, "stopped": True})

    def _append(self, line: Mapping[str, Any]) -> int:
        content = json.dumps(line).encode() + b"\n"
        append(self._file, self._path, content)
        return os.fstat(self._file).st_size - len(content)

    def _redact(self, participant: str) -> None:
        if self._path.exists():  # otherwise the file was removed by hand
            forget_links(self._path, participant)

    def _is_kept(self, digest: str) -> bool:
        if sys.platform == "win32":  # where the file is locked against other processes
            return True
        return os.pread(self._file, len(BEGINNING), self._offsets[digest]) == BEGINNING

    def close(self) -> None:
        """Close the file, so that another server can use it; remove it if it is empty."""
        if not os.fstat(self._file).st_size:
            with suppress(OSError):  # Windows does not remove open files
                self._path.unlink(missing_ok=True)
        os.close(self._file)
        self._let_go()

    def _let_go(self) -> None:
        if self._lock is not None:
            self._lock.close()


class _Owned:
    """One server's lock on a data folder, which need not exist yet: a hidden file beside it."""

    def __init__(self, data: Path):
        real = Path(os.path.realpath(data))
        self._path = real.with_name(f".{real.name}-server")
        self._file = _locked(self._path, f"the data folder {data}", "folder")

    def close(self) -> None:
        """Release the lock."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
        os.close(self._file)


def _locked(path: Path, what: str, place: str) -> int:
    """Open a file for appending, created if missing, and lock it; raise `InputError` if another server uses it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0), 0o600)
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror}): give another {place}.") from error
    if not try_lock(file, path):
        os.close(file)
        raise InputError(f"another server uses {what}: stop that server, or give this study another {place}.")
    return file


def _secret() -> str:
    """Return a secret of 144 random bits."""
    return secrets.token_urlsafe(18)


def digest_of_token(token: str) -> str:
    """Return the digest of a link's secret, which is stored instead of the secret."""
    return hashlib.sha256(token.encode()).hexdigest()
