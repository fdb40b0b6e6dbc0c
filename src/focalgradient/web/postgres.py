"""Storage of journals in a PostgreSQL database shared by several servers: one row per line of a local journal.

A server that acts on a participant locks the participant's row. Lines that other servers have added are first copied to
the server's own folder; lines that it adds are committed before they are acknowledged. No other module imports psycopg
(extra `store`).
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
from focalgradient.dataset import journals as list_journals
from focalgradient.dataset.bids import add_participant
from focalgradient.dataset.journal import create_whole, scan_journal, writing
from focalgradient.dataset.links import number_of
from focalgradient.dataset.withdrawal import digest_of_record, has_withdrawn, record_of, remove_participant
from focalgradient.design import Design
from focalgradient.errors import InputError
from focalgradient.web.people import Person, Roster, digest_of_token
from focalgradient.web.store import UNKNOWN, Place, Refused

__all__ = ["Postgres", "SharedPeople", "collect_store", "withdraw_from_store"]

TABLES = """
create table if not exists study (one boolean primary key default true check (one), design jsonb not null,
    task text not null, manifest text);
create table if not exists people (sha256 text primary key, participant text not null, platform jsonb not null,
    stopped boolean not null default false);
create table if not exists sessions (participant text primary key, tab text,
    alive timestamptz not null default '-infinity', bytes bigint not null default 0);
create table if not exists journals (participant text not null, line integer not null, content text not null,
    primary key (participant, line));
alter table study add column if not exists labels integer not null default 0;
create table if not exists withdrawn (record text primary key);
"""
"""Tables of one study; another study needs another database or another schema.

`labels` is the highest label number at the last withdrawal; lower numbers are not reused. `withdrawn` contains the
digests of removed records, so that existing data sets lose them too.
"""

MOST_CONNECTIONS = 8
"""Maximum number of connections per server: PostgreSQL allows 100 in total, and a response needs one for a few ms."""

PATIENCE_S = 10
"""Time limit in s for connecting to the database."""

BEGINNING = 4917
"""Number of the advisory lock under which tables are created, so that only one server creates them."""


class Database:
    """Pool of connections to a database.

    Parameters
    ----------
    address
        Address, such as ``postgresql://user:password@host/database``.
    """

    def __init__(self, address: str):
        self.address = address
        self._slots = threading.BoundedSemaphore(MOST_CONNECTIONS)
        self._idle: queue.LifoQueue[psycopg.Connection] = queue.LifoQueue()

    @contextmanager
    def transaction(self) -> Iterator[psycopg.Connection]:
        """Run a transaction: all of its changes, or none.

        Raises
        ------
        psycopg.Error
            If the database cannot be reached, or the connection is lost.
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
        """Close the connections."""
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
            f"the store cannot be used ({why}): give an address such as postgresql://user@host/name."
        ) from error


@contextmanager
def _study(address: str) -> Iterator[Database]:
    """Open a database that must contain a study, and close it afterwards."""
    with _opening(address) as database:
        with database.transaction() as connection:
            if connection.execute("select to_regclass('people')").fetchone() == (None,):
                raise InputError("the store contains no study: give the store of 'focalgradient serve'.")
        yield database
        database.close()


@contextmanager
def _answering() -> Iterator[None]:
    """Answer 503 if the database fails, so that the page retries later."""
    try:
        yield
    except psycopg.Error as error:
        raise Refused(503, "The store does not respond.") from error


class Postgres:
    """Store that several servers share.

    Parameters
    ----------
    address
        Address, such as ``postgresql://user:password@host/database``.
    folder
        Folder of this server only, new or empty.
    design
        Design of the study; must equal that in the database, if there is one.
    manifest
        Manifest of the pictures, if the design shows any.

    Raises
    ------
    InputError
        If the database cannot be used, or contains another study.
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
                    "the store contains a study with another design or other pictures: give this study a database of "
                    "its own."
                )

    @contextmanager
    def held(self, place: Place) -> Iterator[None]:
        """See `Store`."""
        with place.guard, _answering(), self.database.transaction() as connection:
            who = [place.participant]
            connection.execute("insert into sessions (participant) values (%s) on conflict do nothing", who)
            row = connection.execute(
                "select tab, extract(epoch from now() - greatest(alive, now() - interval '1 year')), bytes, "
                "(select bool_or(stopped) from people where people.participant = sessions.participant) "
                "from sessions where participant = %s for update",
                who,
            ).fetchone()
            if row is None or row[3] is None:  # withdrawn meanwhile
                raise Refused(404, UNKNOWN)
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
                    place.stored = -1  # lines written by this server are not in the store: fetch them again
                raise
            size = place.stored + len(added)
            place.stored = -1  # until the transaction has ended
        place.stored = size

    @staticmethod
    def _fetch(connection: psycopg.Connection, place: Place) -> None:
        """Replace the journal in the server's folder by that in the store."""
        place.close()
        lines = connection.execute(
            "select content from journals where participant = %s order by line", [place.participant]
        ).fetchall()
        content = "".join(f"{line}\n" for (line,) in lines).encode()
        if content:
            with writing(place.journal):
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

    @contextmanager
    def data(self) -> Iterator[Path]:
        """See `Store`."""
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
    r"""Split a journal into lines at line feeds only: JSON texts may contain other line separators.

    >>> len(_lines('{"browser": "a\u2028b"}\n'.encode()))
    1
    """
    *lines, rest = content.decode().split("\n")
    return [*lines, rest] if rest else lines


def collect_store(address: str, root: Path) -> dict[str, int]:
    """Import the sessions of a store into a data set; existing data are kept.

    Parameters
    ----------
    address
        Address, such as ``postgresql://user:password@host/database``.
    root
        Folder of the data set: new, empty, or made from the same store.

    Returns
    -------
    dict
        Number of journal lines that were new to the data set, by label.

    Raises
    ------
    InputError
        If the database cannot be used or contains no study, or a journal in the folder differs.
    """
    with _study(address) as database, database.transaction() as connection:
        return _exported(connection, root)


def withdraw_from_store(address: str, participant: str) -> bool:
    """Remove a participant from a store; return whether the participant existed.

    Parameters
    ----------
    address
        Address, such as ``postgresql://user:password@host/database``.
    participant
        Label, such as ``sub-007`` or ``007``.

    Raises
    ------
    InputError
        If the database cannot be used or contains no study.
    """
    label = participant.removeprefix("sub-")
    with _study(address) as database:
        people = SharedPeople(database)
        there = label in people.everybody()
        if there:
            people.forget(label)
    return there


def _exported(connection: psycopg.Connection, root: Path) -> dict[str, int]:
    task, content = connection.execute("select task, manifest from study").fetchone() or (None, None)
    lines = connection.execute("select participant, content from journals order by participant, line")
    journals: dict[str, list[str]] = {}
    for participant, line in lines:
        journals.setdefault(participant, []).append(line)
    begin_dataset(root, "human")
    gone = {record for (record,) in connection.execute("select record from withdrawn")}
    for files in [Files(root, task, path.name.split("_")[0].removeprefix("sub-")) for path in list_journals(root)]:
        record = record_of(scan_journal(files.journal).events) if files.journal.exists() else None
        if record is not None and digest_of_record(record) in gone:
            remove_participant(root, files.participant)
    added = {}
    for participant, new in journals.items():
        files = Files(root, task, participant)
        if has_withdrawn(root, record_of(map(json.loads, filter(None, new)))):
            continue
        old = _lines(_read(files.journal))
        if old[: len(new)] != new[: len(old)]:
            raise InputError(f"{files.journal} differs from the store: give another folder.")
        if added_lines := max(len(new) - len(old), 0):
            with writing(root):
                create_whole(files.journal, "".join(f"{line}\n" for line in new).encode(), replace=True)
        head = read_journal(files.journal).head
        if content is not None:
            with writing(root):
                files.keep_manifest(head["stimuli"], content.encode())
        add_participant(root, participant, {"kind": head["kind"], **head.get("about", {})})
        export(files.journal)
        added[participant] = added_lines
    return added


class SharedPeople(Roster):
    """Participants, stored in the database of a `Postgres` store."""

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
        rows = connection.execute("select sha256, participant, platform from people").fetchall()
        self._of_digest = {digest: Person(participant, platform) for digest, participant, platform in rows}
        self._taken |= {participant for _, participant, _ in rows}
        found = connection.execute("select labels from study").fetchone()
        self._labels = max([0 if found is None else found[0], *map(number_of, self._taken)])

    def _keep(self, person: Person, digest: str) -> None:
        self._connection.execute(
            "insert into people (participant, sha256, platform) values (%s, %s, %s)",
            [person.participant, digest, json.dumps(person.platform)],
        )

    def _keep_stopped(self, participant: str) -> None:
        self._connection.execute("update people set stopped = true where participant = %s", [participant])

    def _redact(self, participant: str) -> None:
        execute, who = self._connection.execute, [participant]
        execute("select 1 from sessions where participant = %s for update", who)  # wait for a response being recorded
        lines = execute("select content from journals where participant = %s order by line", who).fetchall()
        if record := record_of(json.loads(line) for (line,) in lines if line):
            execute("insert into withdrawn values (%s) on conflict do nothing", [digest_of_record(record)])
        for table in ("people", "sessions", "journals"):
            execute(f"delete from {table} where participant = %s", who)
        execute("update study set labels = %s", [self._labels])

    def _is_kept(self, digest: str) -> bool:
        return digest in self._of_digest  # reloaded by `_alone` and `everybody`

    def of(self, token: str) -> Person | None:
        """Return the person to whom a secret belongs; None if there is none."""
        with _answering(), self._database.transaction() as connection:  # another server may have added or removed it
            row = connection.execute(
                "select participant, platform from people where sha256 = %s", [digest_of_token(token)]
            ).fetchone()
        return None if row is None else Person(*row)

    def everybody(self) -> dict[str, Person]:
        """Return all persons by label."""
        with self._guard, _answering(), self._database.transaction() as connection:
            self._load(connection)
            return super().everybody()

    def close(self) -> None:
        """Close the database."""
        self._database.close()
