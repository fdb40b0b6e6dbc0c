"""What happened in a session besides its answers is on the disk, and is told by table, validation and report."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest
from recorded import record_ratings

from focalgradient.dataset import Apparatus, Rated, Session, read_dataset, read_journal, validate
from focalgradient.dataset.journal import whole_lines
from focalgradient.design import DepthRatingDesign, Design, Pinhole
from focalgradient.report import make_report

APPARATUS = Apparatus("seconds of the test", refresh_hz=60.0)
PINHOLE = Pinhole(scenes=["a"], repetitions=1)


def rated(number: int) -> Rated:
    return Rated(onset=30.0 * number, rating=1.2, response_time=2.0)


def notes(root: Path) -> str:
    found = validate(root)
    assert found.problems == ()
    return "\n".join(found.notes)


def cut_off(session: Session) -> None:
    """End as a kill does: without a table."""
    session._journal.close()


def test_an_exposure_before_a_kill_is_counted_when_its_trial_is_answered(tmp_path: Path) -> None:
    session = Session.begin(tmp_path, PINHOLE, "01", apparatus=APPARATUS)
    first, second, *_ = session.trials
    session.expose(first)
    session.record(first, rated(0))
    session.expose(second)
    cut_off(session)
    for _ in range(2):
        session = Session.resume(tmp_path, "pinhole", "01", apparatus=APPARATUS)
        session.expose(second)
        cut_off(session)
    with Session.resume(tmp_path, "pinhole", "01", apparatus=APPARATUS) as session:
        assert "main trial 2 was shown, but not answered" in "\n".join(validate(tmp_path).notes)
        session.expose(second)
        session.record(second, rated(1))
        for number, trial in enumerate(session.remaining(), start=2):
            session.expose(trial)
            session.record(trial, rated(number))
    table = read_dataset(tmp_path).pinhole
    assert table["interruptions"].tolist()[1] == 3
    assert table["interruptions"].drop(index=table.index[1]).isna().all()
    assert "1 trial was shown more than once (column interruptions); none is excluded." in notes(tmp_path)


def test_a_count_that_contradicts_the_exposures_is_found(tmp_path: Path) -> None:
    with Session.begin(tmp_path, PINHOLE, "01", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.trials):
            session.expose(trial)
            session.expose(trial)
            session.record(trial, rated(number))
    log = read_journal(session.files.journal)
    events = [dict(event) for event in log.events]
    last = next(event for event in reversed(events) if event["event"] == "trial")
    last["extra"] = {**last["extra"], "interruptions": {**last["extra"]["interruptions"], "value": 4}}
    session.files.journal.write_bytes(whole_lines(events))
    assert any(
        "interruptions is 4, but 1 by the design and the lines before: restore" in problem
        for problem in validate(tmp_path).problems
    )


RATING = DepthRatingDesign(scenes=["spheres-01", "spheres-02"], catch_trials=0, practice_trials=1)


def practised(root: Path, label: str, *rounds: bool, design: Design = RATING) -> None:
    with Session.begin(root, design, label, apparatus=APPARATUS) as session:
        for trial in session.trials:
            if trial.phase == "main" and trial.trial == 1:
                for number, passed in enumerate(rounds, start=1):
                    session.note("practice", round=number, right=int(passed), of=1, passed=passed)
            session.record(trial, Rated(onset=9.0 * len(session.recorded), rating=1.2, response_time=1.0))


def failed(root: Path) -> list[str]:
    rows = csv.DictReader(io.StringIO((root / "participants.tsv").read_text()), delimiter="\t")
    return [row["practice_failed"] for row in rows]


def test_practices_failed_in_two_tasks_are_both_named(tmp_path: Path) -> None:
    practised(tmp_path, "01", False)
    practised(tmp_path, "01", False, design=PINHOLE)
    assert failed(tmp_path) == ["depthrating pinhole"]


@pytest.mark.slow
def test_a_failed_practice_is_named_by_participants_validation_and_report(tmp_path: Path) -> None:
    practised(tmp_path, "01", False, True)
    practised(tmp_path, "02", False, False, False)
    assert failed(tmp_path) == ["n/a", "depthrating"]
    assert "practice_failed" in json.loads((tmp_path / "participants.json").read_text())
    told = notes(tmp_path)
    assert "practice was not passed: 0 of 1 trials right in round 3, the last." in told
    assert told.count("practice was not passed") == 1
    assert b"practice was not passed" in make_report(tmp_path).files["report.md"]


@pytest.mark.slow
def test_who_asked_for_removal_is_left_out_whatever_the_rules(tmp_path: Path) -> None:
    record_ratings(tmp_path, 5, kind="human")
    before = read_dataset(tmp_path)
    with (tmp_path / "sourcedata/sub-03/beh/sub-03_task-depthrating_beh.jsonl").open("ab") as journal:
        journal.write(b'{"event": "note", "kind": "keep", "kept": false}\n')
    found = read_dataset(tmp_path)
    assert (before.withdrawn, found.withdrawn) == ((), ("sub-03",))
    assert {*before.depth_rating["participant_id"]} - {*found.depth_rating["participant_id"]} == {"sub-03"}
    made = make_report(tmp_path)
    assert "Left out whatever the rules: 1 participant who asked for removal of the answers." in made.notices
    assert "Left out whatever the rules: 1 participant" in made.files["report.md"].decode()
