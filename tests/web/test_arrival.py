"""Answers that no person can have given: refused one by one, and found in a session; outages lose nothing."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from participant import DEPTH, NECKER, SECONDS_EACH, Hurried, Participant, client_of, study

from focalgradient.dataset import validate
from focalgradient.report import make_report


def short(someone: Participant, number: int, **changed: Any) -> dict[str, Any]:
    """An answer whose own times are those of its design, to which almost nothing is added."""
    message = someone.message(someone.trials[number], number)
    return {**message, "answer": message["answer"] | changed}


@pytest.mark.slow
@pytest.mark.parametrize("design", [DEPTH.replace("picture_s = 0.3", "picture_s = 0.4"), NECKER])
def test_a_script_that_is_faster_than_its_trials_is_found(tmp_path: Path, design: str) -> None:
    served = study(tmp_path, design)
    with client_of(served) as client:
        someone = Participant(client)
        someone.begin()
        refused = 0
        for number in range(len(someone.trials)):
            given = short(someone, number, **({} if design == NECKER else {"response_time": 0.3}))
            answer = someone.ask("answer", **given)
            Hurried.ahead -= SECONDS_EACH  # the clock stands still
            if answer.status_code != 200:
                refused += 1
                Hurried.ahead += 3.0
                assert someone.ask("answer", **given).status_code == 200
                Hurried.ahead -= SECONDS_EACH + 3.0
        someone.ask("finish")
    found = [one for one in validate(tmp_path / "data").problems if "by the server's clock" in one]
    assert len(found) == 1
    # the clock stood still, so that the last answer is the earliest; all before it are counted with it
    count, of_last = re.search(r"the (\d+) answers up to main trial (\d+) came", found[0]).groups()  # type: ignore[union-attr]
    assert (int(count), int(of_last)) == (len(someone.trials), someone.trials[-1]["trial"])
    report = make_report(tmp_path / "data")
    assert any("by the server's clock" in problem for problem in report.problems)
    assert report.files["report.md"].decode().index("by the server's clock") < 3000  # at its top


def test_answers_that_waited_for_the_network_are_kept_and_no_problem(tmp_path: Path) -> None:
    with client_of(study(tmp_path, DEPTH)) as client:
        someone = Participant(client)
        someone.begin()
        count = len(someone.trials)
        Hurried.ahead += SECONDS_EACH * count  # all are given while the network is away, and come at once
        for number in range(count):
            assert someone.answer(number).status_code == 200
            Hurried.ahead -= SECONDS_EACH
        assert someone.ask("finish").status_code == 200
    found = validate(tmp_path / "data", tmp_path / "set")
    assert found.problems == ()
    assert any("in bursts" in note for note in found.notes)


def test_a_page_that_goes_on_after_a_restart_keeps_what_it_had(tmp_path: Path) -> None:
    """The server was away while trials were answered; the page begins again with its own clock, and sends them."""
    with client_of(study(tmp_path, NECKER)) as client:
        someone = Participant(client)
        someone.begin()
        assert someone.answer(0).status_code == 200
    trials = someone.trials
    Hurried.ahead += SECONDS_EACH * len(trials)
    with client_of(study(tmp_path, NECKER)) as client:
        again = Participant(client, someone.token)
        again.begin(waited_ms=1000.0 * SECONDS_EACH * (len(trials) + 1))
        for number in range(1, len(trials)):
            answer = again.ask("answer", **again.message(trials[number], number))
            assert answer.status_code == 200
            Hurried.ahead -= SECONDS_EACH
        again.ask("finish")
    assert validate(tmp_path / "data").problems == ()


@pytest.mark.parametrize(
    ("design", "changes"),
    [
        (
            NECKER,
            [
                *({"presses": [[0.5, "q", True]]}, {"presses": [[70.0, "f", True]]}),
                *({"trial_duration": 100_000.0}, {"trial_duration": 0.5}),
            ],
        ),
        (DEPTH, [{"response_time": 100_000.0}, {"response_time": -1.0}, {"start": 900.0}]),
        (DEPTH + 'scale = "bipolar"\ncatch_pictures = ["flatter", "deeper"]\n', [{"rating": 1.0, "start": -4.0}]),
    ],
)
def test_what_no_page_sends_is_refused_in_one_sentence(
    tmp_path: Path, design: str, changes: list[dict[str, Any]]
) -> None:
    with client_of(study(tmp_path, design)) as client:
        someone = Participant(client)
        someone.begin()
        for changed in changes:
            answer = someone.ask("answer", **short(someone, 0, **changed))
            assert answer.status_code == 400, changed
            assert answer.json()["error"].count(". ") == 0


def test_the_form_is_recorded_as_in_the_laboratory(tmp_path: Path) -> None:
    with client_of(study(tmp_path, NECKER)) as client:
        someone = Participant(client)
        assert someone.begin(about={"age": "34", "sex": "weiblich", "handedness": "right"}).status_code == 200
        other = Participant(client)
        assert other.begin(about={"light": "dim"}).status_code == 400  # not asked for
        assert other.begin(about={"age": "old"}).status_code == 400
        assert other.begin().status_code == 200
    rows = (tmp_path / "data" / "participants.tsv").read_text().splitlines()
    columns = rows[0].split("\t")
    row = dict(zip(columns, rows[1].split("\t"), strict=True))
    assert (row["age"], row["sex"], row["handedness"]) == ("34", "weiblich", "right")
