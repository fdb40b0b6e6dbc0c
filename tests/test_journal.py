"""Sessions that are cut off at any moment: what was finished is there, and the rest follows in the same order."""

import json
import os
import random
import subprocess
import sys

import pytest
from killing import DESIGNS, kill_often

from focalgradient.dataset import (
    Apparatus,
    Journal,
    Press,
    Rated,
    Session,
    Watched,
    export,
    read_dataset,
    read_journal,
    validate,
)
from focalgradient.dataset import journal as journals
from focalgradient.dataset.events import event_error
from focalgradient.design import NeckerDesign, Pinhole
from focalgradient.errors import InputError

APPARATUS = Apparatus("seconds from the start of the sitting", refresh_hz=60.0)
SHORT = Pinhole(scenes=["a"], repetitions=1)

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def answer(number: int) -> Rated:
    return Rated(onset=20.0 * number, rating=1 + number / 10, response_time=1.5)


def partly(root, trials=None, **more) -> Session:
    """A session that ends after some trials, without leave."""
    session = Session.begin(root, SHORT, "01", apparatus=APPARATUS, **more)
    for number, trial in enumerate(session.trials[:trials]):
        session.record(trial, answer(number))
    session._journal.close()
    return session


def resumed(root, session=None, **more) -> Session:
    return Session.resume(root, "pinhole", "01", session, apparatus=APPARATUS, **more)


@pytest.mark.slow
@posix
@pytest.mark.parametrize("length", ["short", "own"])  # the second is a task that is registered here
def test_kills_at_random_moments_lose_no_finished_trial_and_end_in_a_valid_data_set(length, tmp_path):
    killed = 0
    for place, spread in enumerate((0.06, 0.02, 0.007, 0.002)):  # a quick machine is through before a late kill
        count = kill_often(tmp_path / f"{place}", length, "01", random.Random(7), spread)
        killed += count["SIGKILL"] + count["SIGTERM"]
        _is_whole(tmp_path / f"{place}", length)
        if killed:
            break
    assert killed >= 1


def _is_whole(folder, length="short"):
    found = validate(folder)
    assert found.problems == ()
    assert found.trials == len(DESIGNS[length].trials("01"))


def test_wherever_the_last_line_is_cut_the_session_goes_on(tmp_path):
    session = partly(tmp_path / "data", 3)
    path = session.files.journal
    whole = path.read_bytes()
    start = whole[:-1].rindex(b"\n") + 1
    for cut in (*range(start, len(whole), 83), len(whole) - 2, len(whole) - 1, len(whole)):
        path.write_bytes(whole[:cut])
        log = read_journal(path)
        # Without its end of line a line is complete all the same.
        done = 2 if cut < len(whole) - 1 else 3
        assert len(log.of("trial")) == done
        assert log.broken == ((4,) if start < cut < len(whole) - 1 else ())
        with resumed(tmp_path / "data") as again:
            assert again.remaining() == session.trials[done:]
            for number, trial in enumerate(again.remaining()):
                again.record(trial, answer(number))
        assert path.read_bytes().startswith(whole[:cut])
        table = read_dataset(tmp_path / "data").pinhole
        assert table["trial"].tolist() == list(range(1, 7))
        assert table["sitting"].tolist() == [1] * done + [2] * (6 - done)
        found = validate(tmp_path / "data")
        assert found.problems == ()
        assert any("was interrupted" in note for note in found.notes) == bool(log.broken)
        session.files.table.unlink()
    path.write_bytes(whole + b"\0" * 300)  # blocks of zeros that a loss of power leaves
    assert len(resumed(tmp_path / "data").remaining()) == 3


@pytest.mark.parametrize(("kind", "durable"), [("human", True), ("human", False), ("simulated", True)])
def test_a_persons_answer_is_on_the_disk_before_record_returns_where_it_is_durable(
    kind, durable, tmp_path, monkeypatch
):
    synced = []
    monkeypatch.setattr(journals.os, "fsync", lambda file: synced.append(os.fstat(file).st_size))
    session = partly(tmp_path / "data", 0, kind=kind, durable=durable)
    for number, trial in enumerate(session.remaining()):
        session = resumed(tmp_path / "data", durable=durable)
        synced.clear()
        session.record(trial, answer(number))
        waited_for = synced[-1:] == [session.files.journal.stat().st_size]
        assert waited_for is (kind == "human" and durable)
        session._journal.close()


def test_damage_that_no_kill_explains_is_told(tmp_path):
    session = partly(tmp_path / "data", 3)
    path = session.files.journal
    whole = path.read_bytes()
    lines = whole.split(b"\n")
    path.write_bytes(b"\n".join([lines[0], lines[1][:50], *lines[2:]]))
    with pytest.raises(InputError, match="line 2 is damaged, which a crash of the program does not explain: restore"):
        read_journal(path)
    for beginning in ([], [lines[0][:50], lines[0]]):
        path.write_bytes(b"\n".join([*beginning, *lines[1:]]))
        with pytest.raises(InputError, match="does not start with the first line of a journal"):
            resumed(tmp_path / "data")
    path.write_bytes(b"\n".join([lines[0], lines[2], lines[1], *lines[3:]]))
    with pytest.raises(InputError, match="lines before line 2 are missing, or were changed or moved: restore"):
        resumed(tmp_path / "data")


def test_what_cannot_be_resumed_begun_again_or_written_over(tmp_path):
    with pytest.raises(InputError, match="there is no such session to resume; begin it"):
        resumed(tmp_path / "data")
    session = partly(tmp_path / "data")
    before = session.files.journal.read_bytes()
    assert not session.files.table.exists()
    with pytest.raises(InputError, match=r"is finished, all 6 trials: give a new session label"):
        resumed(tmp_path / "data")
    table = session.files.table.read_text()  # the kill came before the table
    with pytest.raises(InputError, match="session label is '1-b'"):
        resumed(tmp_path / "data", "1-b")
    with pytest.raises(
        InputError, match=r"already contains a session of sub-01.*resume it, or give a new session label"
    ):
        partly(tmp_path / "data")
    session.files.table.write_text(table.replace("1.1", "1.9"))
    with pytest.raises(InputError, match=r"differs from its journal .*: move it away"):
        export(session.files.journal)
    assert "1.9" in session.files.table.read_text()
    session.files.journal.rename(tmp_path / "kept")
    with pytest.raises(InputError, match="never overwritten"):
        partly(tmp_path / "data")
    assert (tmp_path / "kept").read_bytes() == before
    partly(tmp_path / "data", session="2")


def test_resuming_takes_the_design_that_the_session_began_with(tmp_path):
    session = partly(tmp_path / "data", 3)
    assert resumed(tmp_path / "data").design == SHORT
    head = json.loads(session.files.journal.read_text().splitlines()[0])
    assert head["design"]["seed"] == SHORT.seed
    assert {"focalgradient", "numpy", "python"} <= set(head["versions"])
    assert head["apparatus"]["refresh_hz"] == 60
    assert event_error(head, head) is None
    del head["keys"]
    assert (
        event_error(head, head)
        == "keys is missing, but must be a key for rigid and one for nonrigid, or null in a task without keys"
    )
    del head["design"]["seed"]
    assert "must be the settings of a known task, with their seed" in str(event_error(head, head))


def test_only_the_next_trial_with_its_kind_of_answer_is_recorded(tmp_path):
    session = partly(tmp_path / "data", 1)
    with resumed(tmp_path / "data") as again:
        for wrong in (session.trials[0], session.trials[2]):
            with pytest.raises(InputError, match=r"is not the next: record the trials in their order"):
                again.record(wrong, answer(0))
        with pytest.raises(InputError, match="the answer is Watched, but pinhole requires Rated"):
            again.record(session.trials[1], Watched(onset=0.0, presses=[], trial_duration=1.0))
        again.note("break", seconds=3.0)
    assert len(read_journal(session.files.journal).of("trial")) == 1
    assert read_journal(session.files.journal).of("note")[0]["seconds"] == 3.0


def test_what_begin_and_resume_would_refuse_can_be_checked_before_and_nothing_is_written(tmp_path):
    root = tmp_path / "data"
    assert Session.check(root, SHORT, "01") == SHORT
    assert not root.exists()
    with pytest.raises(InputError, match="there is no such session to resume"):
        Session.check(root, SHORT, "01", resume=True)
    with pytest.raises(InputError, match="participant label is 'a b'"):
        Session.check(root, SHORT, "a b")
    session = partly(root, 2)
    before = session.files.journal.read_bytes()
    with pytest.raises(InputError, match="never overwritten"):
        Session.check(root, SHORT, "01")
    assert Session.check(root, Pinhole(), "01", resume=True) == SHORT  # the design that it began with
    with pytest.raises(InputError, match="which a simulated observer cannot join"):
        Session.check(root, SHORT, "02", kind="simulated")
    assert session.files.journal.read_bytes() == before
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file, but must be the folder of a data set"):
        Session.check(tmp_path / "file", SHORT, "01")


FULL = """
import resource, sys
from pathlib import Path
from focalgradient.dataset import Apparatus, Rated, Session
from focalgradient.design import Pinhole
from focalgradient.errors import InputError

session = Session.begin(Path(sys.argv[1]), Pinhole(), "01", apparatus=Apparatus("seconds"))
resource.setrlimit(resource.RLIMIT_FSIZE, (session.files.journal.stat().st_size + 1000,) * 2)
for again in range(2):
    try:
        for number, trial in enumerate(session.remaining()):
            session.record(trial, Rated(onset=number, rating=1.0, response_time=1.0))
            print(trial.trial)
    except InputError as error:
        print(error)
"""


@posix
def test_a_full_disk_is_said_and_costs_no_finished_trial(tmp_path):
    said = subprocess.check_output([sys.executable, "-c", FULL, str(tmp_path / "data")], text=True).splitlines()
    finished = [int(line) for line in said if line.isdigit()]
    assert len(finished) >= 2
    assert len(said) == len(finished) + 2  # a second try adds nothing after the line cut short
    assert "jsonl cannot be written (File too large): make room on the disk" in said[-2]
    assert "can be resumed" in said[-2]
    session = Session.resume(tmp_path / "data", "pinhole", "01", apparatus=APPARATUS)
    assert session.remaining()[0].trial == finished[-1] + 1


def test_a_cube_is_resumed_with_the_same_keys(tmp_path):
    design = NeckerDesign().pilot()
    with Session.begin(tmp_path / "data", design, "03", apparatus=APPARATUS) as session:
        trial = session.remaining()[0]
        session.record(trial, Watched(onset=1.0, presses=[Press(0.5, "f", True)], trial_duration=5.0))
    with Session.resume(tmp_path / "data", "necker", "03", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.remaining()):
            answered = Watched(onset=10.0 * number, presses=[Press(0.5, "f", True)], trial_duration=5.0)
            session.record(trial, answered)
    table = read_dataset(tmp_path / "data").necker
    assert set(zip(table["onset"], table["duration"], table["percept"], strict=True)) == {
        (0.0, 0.5, "none"),
        (0.5, 4.5, "nonrigid"),  # participant 03 has the keys the other way round
    }
    assert validate(tmp_path / "data").problems == ()


def test_a_journal_whose_closing_is_cut_off_is_not_closed_twice(tmp_path, monkeypatch):
    journal = Journal.begin(tmp_path / "one.jsonl", {"event": "begun"})
    close = os.close

    def interrupted(file):
        close(file)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "close", interrupted)
        with pytest.raises(KeyboardInterrupt):
            journal.close()
    journal.close()  # of a file that is closed it would raise
