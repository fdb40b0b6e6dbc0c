"""Journals in a PostgreSQL database, behind several servers: the lines that a local folder has, one a row.

A server that acts on a participant locks the participant's row. Lines that other servers have added are first brought
into the server's own folder; those that it adds are committed before anything is acknowledged. This is the only module
that imports psycopg (extra `store`).
"""

from __future__ import annotations

import json
import queue
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psycopg

from focalgradient.dataset import Files, Manifest, begin_dataset, export, read_journal
from focalgradient.dataset.bids import add_participant, withdrawn
from focalgradient.dataset.journal import create_whole, make_folder, writing
from focalgradient.design import Design
from focalgradient.errors import InputError
from focalgradient.web.people import Person, Roster, digest_of_token
from focalgradient.web.store import Place, Refused

__all__ = ["Postgres", "SharedPeople", "collect_store"]

TABLES = """
create table if not exists study (one boolean primary key default true check (one), design jsonb not null,
    task text not null, manifest text);
create table if not exists people (sha256 text primary key, participant text not null, platform jsonb not null,
    stopped boolean not null default false);
create table if not exists sessions (participant text primary key, tab text,
    alive timestamptz not null default '-infinity', bytes bigint not null default 0);
create table if not exists journals (participant text not null, line integer not null, content text not null,
    primary key (participant, line));
"""
"""Of one study; another one needs another database, or another schema."""

MOST_CONNECTIONS = 8
"""Of one server: PostgreSQL allows 100 of all, and an answer needs one for a few milliseconds."""

PATIENCE_S = 10
"""Seconds that the database may take to let a server in."""

BEGINNING = 4917
"""Number of the lock under which tables are made: one server makes them."""


class Database:
    """Connections to a database, used one after the other.

    Parameters
    ----------
    address
        As ``postgresql://user:password@host/database``.
    """

    def __init__(self, address: str):
        self.address = address
        self._slots = threading.BoundedSemaphore(MOST_CONNECTIONS)
        self._idle: queue.LifoQueue[psycopg.Connection] = queue.LifoQueue()

    @contextmanager
    def transaction(self) -> Iterator[psycopg.Connection]:
        """Do something as a whole, or not at all.

        Raises
        ------
        psycopg.Error
            If the database cannot be reached, or ends meanwhile.
        """
        with self._slots:
            try:
                connection = self._idle.get_nowait()
            except queue.Empty:
                connection = psycopg.connect(self.address, connect_timeout=PATIENCE_S, autocommit=True)
            try:
                with connection.transaction():
                    yield connection
            finally:
                if not connection.closed:
                    self._idle.put(connection)

    def close(self) -> None:
        """Let go of the database."""
        with suppress(queue.Empty):
            while True:
                self._idle.get_nowait().close()


@contextmanager
def _opening(address: str) -> Iterator[Database]:
    database = Database(address)
    try:
        yield database
    except BaseException as error:
        database.close()
        if not isinstance(error, psycopg.Error):
            raise
        why = " ".join(str(error).split())[:300]
        raise InputError(
            f"the store cannot be used ({why}): give an address as postgresql://user@host/name."
        ) from error


@contextmanager
def _answering() -> Iterator[None]:
    """Let the page ask again later, where the database does not answer."""
    try:
        yield
    except psycopg.Error as error:
        raise Refused(503, "The store does not answer.") from error


class Postgres:
    """A store that several servers share.

    Parameters
    ----------
    address
        As ``postgresql://user:password@host/database``.
    folder
        Of this server alone, new or empty.
    design
        Of the study; that which the database has already, where it has one.
    manifest
        Of the pictures, where the design has some.

    Raises
    ------
    InputError
        If the database cannot be used, or holds another study.
    """

    shared = True

    def __init__(self, address: str, folder: Path, design: Design, manifest: Manifest | None):
        begin_dataset(folder, "human")
        content = json.dumps(design.model_dump(mode="json"))
        text = None if manifest is None else manifest.content.decode()
        with _opening(address) as self.database, self.database.transaction() as connection:
            connection.execute("select pg_advisory_xact_lock(%s)", [BEGINNING])
            connection.execute(TABLES)
            connection.execute(
                "insert into study (design, task, manifest) values (%s, %s, %s) on conflict do nothing",
                [content, design.task, text],
            )
            there = connection.execute("select design = %s::jsonb, manifest from study", [content]).fetchone()
            if there != (True, text):
                raise InputError(
                    "the store holds another study, with another design or other pictures: give it a database of its "
                    "own."
                )

    @contextmanager
    def held(self, place: Place) -> Iterator[None]:
        """As `Store` has it."""
        with place.guard, _answering(), self.database.transaction() as connection:
            who = [place.participant]
            connection.execute("insert into sessions (participant) values (%s) on conflict do nothing", who)
            row = connection.execute(
                "select tab, extract(epoch from now() - greatest(alive, now() - interval '1 year')), bytes, "
                "(select bool_or(stopped) from people where people.participant = sessions.participant) "
                "from sessions where participant = %s for update",
                who,
            ).fetchone()
            assert row is not None
            place.tab, place.alive = row[0], time.monotonic() - float(row[1])
            place.stopped = bool(row[3])
            before = (place.tab, place.alive)
            if place.stored != row[2]:
                self._fetch(connection, place)
            try:
                yield
                added = _read(place.journal)[place.stored :]
                self._add(connection, place, added, tab_changed=(place.tab, place.alive) != before)
            except BaseException:
                if len(_read(place.journal)) != place.stored:
                    place.stored = -1  # what this server has written is not in the store: it is fetched anew
                raise
            size = place.stored + len(added)
            place.stored = -1  # until the transaction has ended
        place.stored = size

    @staticmethod
    def _fetch(connection: psycopg.Connection, place: Place) -> None:
        """Make a journal in the server's folder what the store has."""
        place.close()
        lines = connection.execute(
            "select content from journals where participant = %s order by line", [place.participant]
        ).fetchall()
        content = "".join(f"{line}\n" for (line,) in lines).encode()
        if content:
            with writing(place.journal):
                make_folder(place.journal.parent)
                create_whole(place.journal, content, replace=True)
        else:
            place.journal.unlink(missing_ok=True)
        place.stored = len(content)

    @staticmethod
    def _add(connection: psycopg.Connection, place: Place, added: bytes, *, tab_changed: bool) -> None:
        if added:
            connection.cursor().executemany(
                "insert into journals select %s, coalesce(max(line), 0) + 1, %s from journals where participant = %s",
                [(place.participant, line, place.participant) for line in _lines(added)],
            )
        if added or tab_changed:
            silent = min(time.monotonic() - place.alive, 3e7)
            connection.execute(
                "update sessions set tab = %s, alive = now() - %s * interval '1 second', bytes = bytes + %s "
                "where participant = %s",
                [place.tab, silent, len(added), place.participant],
            )

    def remove(self, place: Place) -> None:
        """As `Store` has it."""
        with _answering(), self.database.transaction() as connection:
            connection.execute("delete from journals where participant = %s", [place.participant])
            connection.execute("delete from sessions where participant = %s", [place.participant])
        place.journal.unlink(missing_ok=True)
        place.stored = 0

    @contextmanager
    def data(self) -> Iterator[Path]:
        """As `Store` has it."""
        with tempfile.TemporaryDirectory() as folder, _answering():
            with self.database.transaction() as connection:
                _exported(connection, Path(folder))
            yield Path(folder)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return b""


def _lines(content: bytes) -> list[str]:
    r"""The lines of a journal, which end in a line feed alone: other line separators may stand in a text of JSON.

    >>> len(_lines('{"browser": "a\u2028b"}\n'.encode()))
    1
    """
    *lines, rest = content.decode().split("\n")
    return [*lines, rest] if rest else lines


def collect_store(address: str, root: Path) -> dict[str, int]:
    """Bring the sessions of a store into a data set; what is there already stays.

    Parameters
    ----------
    address
        As ``postgresql://user:password@host/database``.
    root
        Folder of the data set: new, empty, or one that was made of the same store.

    Returns
    -------
    dict
        By label, how many lines of the journal are new to the data set.

    Raises
    ------
    InputError
        If the database cannot be used or holds no study, or a journal in the folder is another one.
    """
    with _opening(address) as database:
        with database.transaction() as connection:
            if connection.execute("select to_regclass('journals')").fetchone() == (None,):
                raise InputError("the store holds no study: give the store of 'focalgradient serve'.")
            added = _exported(connection, root)
        database.close()
    return added


def _exported(connection: psycopg.Connection, root: Path) -> dict[str, int]:
    task, content = connection.execute("select task, manifest from study").fetchone() or (None, None)
    lines = connection.execute("select participant, content from journals order by participant, line")
    journals: dict[str, list[str]] = {}
    for participant, line in lines:
        journals.setdefault(participant, []).append(line)
    begin_dataset(root, "human")
    gone = {entry.get("participant") for entry in withdrawn(root)}
    added = {}
    for participant, new in journals.items():
        files = Files(root, task, participant)
        if f"sub-{participant}" in gone:
            continue
        old = _lines(_read(files.journal))
        if old[: len(new)] != new[: len(old)]:
            raise InputError(f"{files.journal} holds something else than the store: give a folder of its own.")
        if added_lines := max(len(new) - len(old), 0):
            with writing(root):
                make_folder(files.journal.parent)
                create_whole(files.journal, "".join(f"{line}\n" for line in new).encode(), replace=True)
        head = read_journal(files.journal).head
        if content is not None and not (place := files.manifest(head["stimuli"])).exists():
            with writing(root):
                make_folder(place.parent)
                create_whole(place, content.encode())
        add_participant(root, participant, {"kind": head["kind"]})
        export(files.journal)
        added[participant] = added_lines
    return added


class SharedPeople(Roster):
    """Everybody who may take part, in the database of a `Postgres`."""

    def __init__(self, database: Database):
        super().__init__()
        self._database = database
        self._connection: Any = None

    @contextmanager
    def _alone(self) -> Iterator[None]:
        with self._guard, _answering(), self._database.transaction() as connection:
            connection.execute("lock table people in share row exclusive mode")
            self._load(connection)
            self._connection = connection
            yield

    def _load(self, connection: psycopg.Connection) -> None:
        for digest, participant, platform in connection.execute("select sha256, participant, platform from people"):
            self._of_digest[digest] = Person(participant, platform)
            self._taken.add(participant)

    def _keep(self, participant: str, digest: str, platform: dict[str, str]) -> None:
        self._connection.execute(
            "insert into people (participant, sha256, platform) values (%s, %s, %s)",
            [participant, digest, json.dumps(platform)],
        )

    def _keep_stopped(self, participant: str) -> None:
        self._connection.execute("update people set stopped = true where participant = %s", [participant])

    def of(self, token: str) -> Person | None:
        """Give the person that a link's secret is of; None where there is none."""
        person = super().of(token)
        if person is None:  # another server may have made the link
            digest = digest_of_token(token)
            with _answering(), self._database.transaction() as connection:
                row = connection.execute(
                    "select participant, platform from people where sha256 = %s", [digest]
                ).fetchone()
            if row is not None:
                person = self._of_digest[digest] = Person(*row)
        return person

    def everybody(self) -> dict[str, Person]:
        """Everybody, by label."""
        with _answering(), self._database.transaction() as connection:
            self._load(connection)
        return super().everybody()

    def close(self) -> None:
        """Let go of the database."""
        self._database.close()
