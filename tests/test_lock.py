"""One owner of a session: of two programs one succeeds, a killed owner holds nothing, and only the owner can read."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
from racing import APPARATUS, DESIGN, OWN, race

from focalgradient.dataset import Rated, Session, export, read_dataset, read_journal
from focalgradient.dataset import journal as journals
from focalgradient.errors import InputError

posix = pytest.mark.skipif(os.name != "posix", reason="modes and signals of POSIX")

ANSWER = Rated(onset=1.0, rating=1.0, response_time=1.0)


def begin(root: Path, participant: str = "01", **about: object) -> Session:
    return Session.begin(root, DESIGN, participant, apparatus=APPARATUS, about=about)


def resume(root: Path, participant: str = "01") -> Session:
    return Session.resume(root, "pinhole", participant, apparatus=APPARATUS)


@pytest.mark.parametrize(
    ("fresh", "design"),
    [(True, DESIGN), (False, DESIGN), pytest.param(False, OWN, marks=pytest.mark.slow, id="own task")],
)
def test_of_two_that_begin_or_resume_at_once_one_succeeds_and_the_other_gets_a_sentence(tmp_path, fresh, design):
    count = race(tmp_path, 8, fresh, design)
    assert sum(count.values()) == 16


def test_a_session_that_is_running_is_refused_to_a_second_program_and_goes_on(tmp_path):
    session = begin(tmp_path / "data")
    for way in (begin, resume):
        with pytest.raises(
            InputError, match=r"already contains a session of sub-01|is being recorded by another program"
        ):
            way(tmp_path / "data")
    with pytest.raises(InputError, match="is being recorded by another program: wait for it"):
        Session.check(tmp_path / "data", DESIGN, "01", resume=True)
    with pytest.raises(InputError, match="is being recorded by another program"):
        export(session.files.journal)
    assert len(read_journal(session.files.journal).events) == 1  # reading needs no lock
    with session:
        session.record(session.remaining()[0], ANSWER)
    with resume(tmp_path / "data") as again:
        assert len(again.remaining()) == 5


OWNER = """
import sys, time
from pathlib import Path
from racing import APPARATUS, DESIGN
from focalgradient.dataset import Session
session = Session.begin(Path(sys.argv[1]), DESIGN, "01", apparatus=APPARATUS)
print("begun", flush=True)
time.sleep(600)
"""


def test_the_lock_ends_with_a_killed_program(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, "-c", OWNER, str(tmp_path / "data")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as owner:
        assert owner.stdout.readline() == "begun\n"
        with pytest.raises(InputError, match="is being recorded by another program"):
            resume(tmp_path / "data")
        owner.kill()
    with resume(tmp_path / "data") as session:
        assert len(session.remaining()) == 6


@posix
def test_a_file_system_without_locks_is_refused_in_one_sentence(tmp_path, monkeypatch):
    def no_locks(file: int, how: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", no_locks)
    with pytest.raises(
        InputError, match=r"cannot be locked \(No locks available\): put the data set on a disk of this"
    ):
        begin(tmp_path / "data")


@posix
def test_without_hard_links_a_session_begins_and_is_never_overwritten(tmp_path, monkeypatch):
    def no_links(one: str, other: Path) -> None:
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(journals.os, "link", no_links)
    with begin(tmp_path / "data") as session:
        before = session.files.journal.read_bytes()
    with pytest.raises(FileExistsError):
        journals._place("hidden", session.files.journal, b"other")
    assert session.files.journal.read_bytes() == before


@posix
def test_data_are_for_their_owner_alone(tmp_path):
    with begin(tmp_path / "above" / "data", age=30) as session:
        session.record(session.remaining()[0], ANSWER)
    root = session.files.root
    modes = {path: path.stat().st_mode & 0o777 for path in (root, root.parent, *root.rglob("*"))}
    assert len(modes) > 10
    assert {mode for path, mode in modes.items() if path.is_dir()} == {0o700}
    assert {mode for path, mode in modes.items() if path.is_file()} == {0o600}


def test_one_participant_has_one_spelling(tmp_path):
    begin(tmp_path / "data", "01")
    with pytest.raises(InputError, match="has sub-01, which is the same number as sub-1: give 01, or another"):
        begin(tmp_path / "data", "1")
    assert not list((tmp_path / "data" / "sourcedata").glob("sub-1"))


def test_a_row_that_a_kill_left_out_is_added_when_the_session_is_resumed(tmp_path):
    with begin(tmp_path / "data", age=33, sex="=1+1", handedness="left\thand\n"):
        pass
    path = tmp_path / "data" / "participants.tsv"
    header, row = path.read_text().splitlines()
    assert row == "sub-01\thuman\t33\t'=1+1\tleft hand"
    path.write_text(header + "\n")
    with resume(tmp_path / "data") as session:
        for trial in session.remaining():
            session.record(trial, ANSWER)
    assert path.read_text().splitlines() == [header, row]
    assert len(read_dataset(tmp_path / "data").participants) == 1
