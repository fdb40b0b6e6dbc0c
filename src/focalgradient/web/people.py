"""Who may take part: secret links, and what a platform calls its people, both kept apart from the data.

The file has one line of JSON a person: the label in the data, the digest of the secret in the link, and identifiers of
a platform. Whoever has the data without this file cannot tell who is who; whoever has this file cannot take part.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from focalgradient.dataset.lock import try_lock
from focalgradient.errors import InputError
from focalgradient.files import flush, parse_json, read_bytes

__all__ = ["People", "Person"]

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


class People:
    """Everybody who may take part, kept in one file that one server owns.

    Parameters
    ----------
    path
        The file; made where it is missing, readable by its owner alone.
    taken
        Says whether a label is in the data already.

    Raises
    ------
    InputError
        If the file cannot be read or written, is damaged, or another server has it.
    """

    def __init__(self, path: Path, taken: frozenset[str] = frozenset()):
        self._path, self._taken, self._guard = path, set(taken), threading.Lock()
        self._of_digest: dict[str, Person] = {}
        if path.exists():
            read_bytes(path, "the links of a server")  # refuses what is no regular file
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o600)
        except OSError as error:
            raise InputError(f"{path} cannot be written ({error.strerror}): give --links a place that can.") from error
        try:
            if not try_lock(self._file, path):
                raise InputError(f"another server uses {path}: end it, or give --links another file.")
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
            case _:
                raise InputError(
                    f"{self._path}, line {number}, is no link: give --links a file of 'focalgradient serve'."
                )

    def of(self, token: str) -> Person | None:
        """Give the person that a link's secret is of; None where there is none."""
        return self._of_digest.get(_digest(token))

    def everybody(self) -> dict[str, Person]:
        """Everybody, by label."""
        return {person.participant: person for person in self._of_digest.values()}

    def invite(self, count: int) -> list[str]:
        """Make so many links for new people; gives their secrets, which are kept nowhere."""
        with self._guard:
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
        with self._guard:
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

    def _new(self, participant: str, platform: Mapping[str, str]) -> str:
        token = secrets.token_urlsafe(18)
        digest = _digest(token)
        line = {"participant": participant, "sha256": digest, "platform": dict(platform)}
        os.write(self._file, json.dumps(line).encode() + b"\n")
        flush(self._file)
        self._of_digest[digest] = Person(participant, platform)
        return token

    def close(self) -> None:
        """Let another server have the file."""
        os.close(self._file)


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()
