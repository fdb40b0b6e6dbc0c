"""Lines that are appended whole or not at all, whatever room the disk has."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from killing import DESIGNS, answer_of
from small_disk import limit_disk

from focalgradient import InputError
from focalgradient.dataset import Apparatus, Journal, Session, read_dataset, read_journal, validate
from focalgradient.dataset.append import append
from focalgradient.dataset.bids import add_participant, begin_dataset
from focalgradient.design import Pinhole


def add_line(path: Path, line: bytes) -> None:
    file = os.open(path, os.O_RDWR | os.O_APPEND)
    try:
        append(file, path, line)
    finally:
        os.close(file)


@pytest.mark.parametrize("truncates", [True, False], ids=["cut back", "left cut short"])
def test_a_full_disk_at_each_byte_leaves_whole_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, truncates: bool
) -> None:
    line, path = b'{"a": 1}\n', tmp_path / "lines"
    for room in range(len(line)):
        path.write_bytes(line)
        with monkeypatch.context() as disk:
            limit_disk(disk, room, truncates=truncates)
            with pytest.raises(InputError, match="No space left on device"):
                add_line(path, line)
        assert path.read_bytes() == line + (b"" if truncates else line[:room])
        add_line(path, b'{"b": 2}\n')
        lines = path.read_bytes().split(b"\n")
        assert (lines[0], lines[-2:]) == (b'{"a": 1}', [b'{"b": 2}', b""])


def test_a_write_in_small_parts_is_gone_on_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write, path = os.write, tmp_path / "lines"
    path.touch()
    monkeypatch.setattr(os, "write", lambda file, content: write(file, bytes(content)[:3]))
    add_line(path, b"twenty bytes of a line\n")
    assert path.read_bytes() == b"twenty bytes of a line\n"


def test_a_journal_on_a_full_disk_keeps_what_it_had_at_each_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = Session.begin(tmp_path, Pinhole(scenes=["a"]), "01", apparatus=Apparatus("seconds"))
    session._journal.close()
    path, note = session.files.journal, {"event": "note", "kind": "break"}
    begun = path.read_bytes()
    with Journal.take(path) as journal:
        journal.resume(read_journal(path), note)
    length = path.stat().st_size - len(begun)
    for room in range(length):
        path.write_bytes(begun)
        with monkeypatch.context() as disk, Journal.take(path) as journal:
            limit_disk(disk, room)
            with pytest.raises(InputError, match="No space left on device"):
                journal.resume(read_journal(path), note)
        assert path.read_bytes() == begun
    with Journal.take(path) as journal:
        journal.resume(read_journal(path), note)
    assert read_journal(path).changed == ()
    assert len(read_journal(path).of("note")) == 1


@pytest.mark.slow
def test_an_answer_of_an_own_task_that_a_full_disk_refuses_is_asked_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    design, apparatus = DESIGNS["own"], Apparatus("seconds")
    answers = [answer_of(design, onset=20.0 * at, rating=at % 9 + 0.5, response_time=0.5) for at in range(18)]
    Session.begin(tmp_path, design, "01", apparatus=apparatus)._journal.close()
    for room in (0, 1, 20, 100, 200):  # bytes: less than a line
        session = Session.resume(tmp_path, design.task, "01", apparatus=apparatus)
        session.record(session.remaining()[0], answers[18 - len(session.remaining())])
        with monkeypatch.context() as disk:
            limit_disk(disk, room)
            with pytest.raises(InputError, match="No space left on device"):
                session.record(session.remaining()[0], answers[18 - len(session.remaining())])
        session._journal.close()
    with Session.resume(tmp_path, design.task, "01", apparatus=apparatus) as session:
        for trial in session.remaining():
            session.record(trial, answers[18 - len(session.remaining())])
    assert validate(tmp_path).problems == ()
    table = read_dataset(tmp_path).tables[design.task]
    assert table["rating"].tolist() == table["noted"].tolist() == [answer.rating for answer in answers]


def test_what_was_interrupted_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    path = tmp_path / "lines"
    path.write_bytes(b"one\n")
    with monkeypatch.context() as interrupted:
        interrupted.setattr(os, "fsync", interrupt)
        with pytest.raises(KeyboardInterrupt):
            add_line(path, b"two\n")
    assert path.read_bytes() == b"one\n"


def test_the_table_of_participants_has_whole_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = tmp_path / "data"
    begin_dataset(root, "human")
    before = (root / "participants.tsv").read_bytes()
    add_participant(root, "01", {"kind": "human"})
    row = len((root / "participants.tsv").read_bytes()) - len(before)
    for room in range(row):
        (root / "participants.tsv").write_bytes(before)
        with monkeypatch.context() as disk:
            limit_disk(disk, room)
            with pytest.raises(InputError, match="No space left on device"):
                add_participant(root, "01", {"kind": "human"})
        assert (root / "participants.tsv").read_bytes() == before
