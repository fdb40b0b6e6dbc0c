"""The server without a browser: answers kept once, sessions that go on, and what is refused."""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import participant
import pytest
from fuzz_server import run
from participant import DEPTH, NECKER, PASSWORD, Hurried, Participant, client_of, film_frames, study
from PIL import Image
from starlette.testclient import TestClient

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.web import Consent, Study
from focalgradient.web import store as stores
from focalgradient.web import study as studies

pytestmark = pytest.mark.usefixtures("store")


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with client_of(study(tmp_path)) as made:
        yield made


def journal(folder: Path) -> Path:
    """Of the first participant of a study."""
    return next((folder / "data").rglob("sub-001*.jsonl"))


@pytest.mark.parametrize("design", [NECKER, DEPTH], ids=["necker", "depthrating"])
def test_a_session_from_link_to_completion_is_a_valid_data_set(tmp_path: Path, design: str) -> None:
    """It shows the trials and pictures of the laboratory."""
    made = study(tmp_path, design, completion="https://example.org/done?cc=1")
    planned = made.design.trials("001")
    with client_of(made) as client:
        someone = Participant(client)
        assert someone.ask("state").json()["status"] == "new"
        assert someone.begin().status_code == 200
        assert someone.ask("finish").status_code == 409  # no completion before all is on the disk
        assert "closing" not in someone.ask("begin", **participant.SITTING).json()  # no debriefing before the end
        assert [(one["phase"], one["trial"]) for one in someone.trials] == [(one.phase, one.trial) for one in planned]
        for number, trial in enumerate(planned):
            if design == DEPTH and trial.phase == "main" and "example" not in trial.scene:
                file = made.lists.pictures.picture(trial.scene, trial.aperture, trial.fixation, {}).png
                url = someone.entry(number)["intervals"][-1]["url"]
                shown, kept = (Image.open(one) for one in (BytesIO(someone.picture(url)), tmp_path / "set" / file))
                assert np.array_equal(np.asarray(shown), np.asarray(kept))
            assert someone.answer(number).json() == {"recorded": True, "done": number + 1}
        assert someone.ask("state").json()["status"] == "complete"
        assert someone.ask("finish").json()["completion"] == "https://example.org/done?cc=1"
    found = validate(tmp_path / "data", tmp_path / "set" if design == DEPTH else None)
    assert found.problems == ()
    assert found.sessions == 1
    (events,) = (pd.read_csv(path, sep="\t") for path in (tmp_path / "data").rglob("*_events.tsv"))
    judged = events[events["trial_type"] == ("picture" if design == DEPTH else "cube")]
    recorded = read_journal(next((tmp_path / "data").rglob("*_beh.jsonl"))).of("trial")
    onset = [event["onset"] for event in recorded]  # of the second sitting, in a table on the clock of the first
    assert np.diff(judged["onset"]) == pytest.approx(np.diff(onset))
    rows = zip(judged["phase"], judged["trial"], strict=True)
    assert [*rows] == [(trial.phase, trial.trial) for trial in planned]
    if design == NECKER:
        table, trial = read_dataset(tmp_path / "data").necker, planned[-1]
        frames = film_frames(made.lists.contents("001", trial)[0])
        digest = hashlib.sha256(b"".join(one.tobytes() for one in frames)).hexdigest()
        assert {*table["shown_sha256"][table["trial"] == trial.trial]} == {digest}
    condition = "fixation" if design == DEPTH else "shape"
    assert judged[condition].tolist() == [getattr(trial, condition) for trial in planned]


def test_onsets_are_those_of_the_judged_picture_after_its_reference(tmp_path: Path) -> None:
    made = study(tmp_path, DEPTH + 'reference = "same-scene"\nreference_s = 0.3\n')
    events = ("mark", "picture", "mark", "picture", "question")
    shown = [{"event": event, "stamps": [100.0 * place, 100.0 * place + 16.7]} for place, event in enumerate(events)]
    with client_of(made) as client:
        someone = Participant(client)
        someone.begin()
        for number, trial in enumerate(someone.trials):
            message = someone.message(trial, number)
            if len(someone.entry(number)["intervals"]) == 2:
                message["answer"]["frames"] = {"shown": shown}
            assert someone.ask("answer", **message).status_code == 200
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    table = read_dataset(tmp_path / "data").depth_rating
    assert (table["onset"] - table["mark_onset"]).tolist() == pytest.approx([0.1] * len(table))
    assert (table["question_onset"] - table["onset"]).tolist() == pytest.approx([0.1] * len(table))
    practice = len(someone.trials) - len(table)
    place = [10.0 * (practice + number) + 1.2 for number in range(len(table))]
    assert table["onset"].tolist() == pytest.approx(place), "1 s, and 0.2 s after the reference"


def test_an_answer_that_comes_again_is_recorded_once(client: TestClient, tmp_path: Path) -> None:
    someone = Participant(client)
    someone.begin()
    assert someone.answer(0).json() == {"recorded": True, "done": 1}
    assert someone.answer(0).json() == {"recorded": True, "again": True, "done": 1}
    assert someone.answer(2).status_code == 409  # out of order
    assert someone.answer(0, phase="main", trial=999).status_code == 400
    assert len(read_journal(journal(tmp_path)).of("trial")) == 1


@pytest.mark.parametrize("store", ["folder"], indirect=True)  # a database commits what was added at once
def test_the_disk_is_waited_for_once_an_answer(
    client: TestClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    someone = Participant(client)
    someone.begin()
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda file: synced.append(os.fstat(file).st_size))
    for number, trial in enumerate(someone.trials):
        someone.show(trial)
        someone.trial_token(trial)
        before = len(synced)
        assert someone.answer(number).json()["recorded"]
        assert len(synced) == before + 1
        assert synced[-1] == journal(tmp_path).stat().st_size
    notes = read_journal(journal(tmp_path)).of("note")
    kinds = Counter(note["kind"] for note in notes)
    assert (kinds["sitting"], kinds["exposure"], kinds["frames"]) == (1, len(someone.trials), len(someone.trials))


def kill(made: Study) -> None:
    """Open the locks of a server whose end is never run."""
    for place in made._places.values():
        place.session._journal.close()
    made.people.close()


def test_another_server_goes_on_where_the_first_was_killed(tmp_path: Path) -> None:
    made = study(tmp_path)
    first = TestClient(client_of(made).app)  # its end is never run, as after a kill
    someone = Participant(first)
    someone.begin()
    someone.answer(0)
    unsent = someone.message(someone.trials[1], 1)
    kill(made)
    made = study(tmp_path)
    with client_of(made) as second:
        same = Participant(second, someone.token)
        assert same.ask("answer", **someone.message(someone.trials[0], 0)).json()["again"]
        # Of the same sitting, whose clock it counts by: the page may have sent it before the kill.
        assert same.ask("answer", **unsent).json() == {"recorded": True, "done": 2}
        assert same.ask("state").json()["status"] == "begun"
        same.begin()
        assert len(same.trials) == len(someone.trials) - 2
        log = read_journal(next(made.data.rglob("sub-*.jsonl")))
        events = [event["event"] for event in log.events if event["event"] != "note"]
        assert events[:3] == ["begun", "trial", "trial"]


def test_a_server_killed_after_the_last_answer_leaves_the_table_to_the_next(tmp_path: Path) -> None:
    made = study(tmp_path)
    someone = Participant(TestClient(client_of(made).app))  # its end is never run, as after a kill
    someone.begin()
    for number in range(len(someone.trials)):
        someone.answer(number)
    kill(made)
    with client_of(study(tmp_path)) as second:
        same = Participant(second, someone.token)
        assert same.ask("finish").status_code == 200
        assert same.ask("finish").status_code == 200
    if not participant.DATABASE:
        assert validate(tmp_path / "data").problems == ()


@pytest.mark.parametrize("store", ["folder"], indirect=True)  # a database has whole lines only
def test_a_line_cut_short_is_told_when_another_server_goes_on(tmp_path: Path) -> None:
    made = study(tmp_path)
    first = TestClient(client_of(made).app)
    someone = Participant(first)
    someone.begin()
    someone.answer(0)
    made.close()
    path = journal(tmp_path)
    path.write_bytes(path.read_bytes() + b'{"event": "tri')
    with client_of(study(tmp_path)) as second:
        same = Participant(second, someone.token)
        assert same.ask("answer", **someone.message(someone.trials[1], 1)).json() == {"recorded": True, "done": 2}
        log = read_journal(path)
        assert len(log.broken) == 1
        assert len(log.of("resumed")) == 1


def test_two_tabs_of_one_participant(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    one = Participant(client)
    other = Participant(client, one.token, "tab-2")
    one.begin()
    assert other.ask("state").json()["status"] == "busy"
    assert other.begin().status_code == 409
    assert other.ask("here").json()["busy"]
    assert one.answer(0).status_code == 200
    one.ask("leave")
    assert other.begin().status_code == 200
    assert one.answer(1).status_code == 409
    monkeypatch.setattr(stores, "SILENT_S", 0.0)  # a tab that crashed
    assert one.begin().status_code == 200


def test_main_trials_need_passed_practice_also_after_a_reload(client: TestClient, tmp_path: Path) -> None:
    someone = Participant(client)
    someone.begin()
    practised = [trial for trial in someone.trials if trial["phase"] == "practice"]
    for number, trial in enumerate(practised):
        shown = someone.ask("next", phase="practice", trial=trial["trial"]).json()["trials"]
        assert {one["phase"] for one in shown} == {"practice"}, "and no main trial in advance"
        assert someone.answer(number).status_code == 200
    main = {"phase": "main", "trial": 1}
    answers = [*someone.practised.values()]
    failed = someone.ask("judge", round=1, answers=answers).json()
    assert failed["again"]
    assert "practice_token" not in failed
    for token in ("", "0" * 32):
        refused = someone.ask("next", **main, practice_token=token)
        assert refused.status_code == 403
        assert "Practice" in refused.json()["error"]
    assert someone.ask("answer", **someone.message(main, 2), trial_token="none").status_code == 403
    assert someone.ask("judge", round=3, answers=answers).status_code == 400, "a round is left out"
    reloaded = someone.begin().json()
    assert reloaded["practice_round"] == 2
    assert reloaded["again"]["event"] == "feedback"
    assert [trial["phase"] for trial in reloaded["trials"]][: len(practised) + 1] == ["practice"] * len(practised) + [
        "main"
    ]
    assert someone.ask("next", **main).status_code == 403, "a reload does not pass practice"
    shown = someone.ask("next", phase="practice", trial=1).json()["trials"]
    assert [one["phase"] for one in shown] == ["practice"] * len(practised)
    Hurried.ahead += 100.0
    for number in (2, 3):
        judged = someone.ask("judge", round=number, answers=answers).json()
    token = judged["practice_token"]
    assert someone.ask("next", **main, practice_token=token).status_code == 200
    resumed = someone.begin().json()
    assert [trial["phase"] for trial in resumed["trials"][:1]] == ["main"]
    assert "practice_round" not in resumed
    assert someone.ask("next", **main).status_code == 200, "all rounds are over"
    notes = [note for note in read_journal(journal(tmp_path)).of("note") if note["kind"] == "practice"]
    assert [(one["round"], one["passed"]) for one in notes] == [(1, False), (2, False), (3, False)]


def test_repeated_practice_is_kept_as_in_the_laboratory(client: TestClient, tmp_path: Path) -> None:
    someone = Participant(client)
    someone.begin()
    practised = [trial for trial in someone.trials if trial["phase"] == "practice"]
    for number in range(len(practised)):
        someone.answer(number)
    answers = [*someone.practised.values()]
    Hurried.ahead += 100.0
    someone.ask("judge", round=1, answers=answers)
    before = journal(tmp_path).read_bytes()
    wrong = [*answers, {**answers[0], "trial": 99}]
    assert someone.ask("judge", round=2, answers=wrong).status_code == 400
    assert journal(tmp_path).read_bytes() == before
    for _ in range(2):  # the network repeats it
        assert someone.ask("judge", round=2, answers=answers).json()["again"]
    notes = read_journal(journal(tmp_path)).of("note")
    found = [note for note in notes if note["kind"] == "practice"]
    assert [(one["round"], one["right"] < one["of"], one["passed"]) for one in found] == [
        (1, True, False),
        (2, True, False),
    ]
    repeated = [note for note in notes if note["kind"] == "practice again"]
    assert [note["trial"]["trial"] for note in repeated] == [one["trial"] for one in practised]
    (problem,) = validate(tmp_path / "data").problems
    assert "has no table" in problem  # which comes with the end of the session


def test_consent_is_to_the_text_in_force(tmp_path: Path) -> None:
    text = "Do you agree?"
    consent = Consent("consent.txt", "", hashlib.sha256(text.encode()).hexdigest(), (text,))
    with client_of(study(tmp_path, consent=consent)) as client:
        someone = Participant(client)
        assert someone.begin().status_code == 403
        assert someone.begin(consent="0" * 64).status_code == 403
        assert not (tmp_path / "data" / "sourcedata").exists()
        assert someone.begin(consent=consent.sha256).status_code == 200
    told = [event for event in read_journal(journal(tmp_path)).of("note") if event["kind"] == "sitting"]
    assert told[0]["consent"]["sha256"] == consent.sha256


@pytest.mark.parametrize("store", ["folder"], indirect=True)
def test_platform_identifiers_stay_out_of_the_data(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        platform = {"PROLIFIC_PID": "5f1e4c0d9b", "STUDY_ID": "s1", "other": "left out"}
        token = client.post("/api/join", json={"platform": platform}).json()["token"]
        someone = Participant(client, token)
        someone.begin()
        someone.answer(0)
        assert client.post("/api/join", json={"platform": {"id": "<script>"}}).status_code == 400
    links = (tmp_path / "links.jsonl").read_text()
    assert "5f1e4c0d9b" in links
    assert token not in links
    assert "left out" not in links
    assert (tmp_path / "links.jsonl").stat().st_mode & 0o777 == 0o600
    for path in (tmp_path / "data").rglob("*"):
        assert path.is_dir() or b"5f1e4c0d9b" not in path.read_bytes()


def test_nothing_else_is_read(tmp_path: Path) -> None:
    pictures = ("%2e%2e/design.toml", "..%2f..%2fetc%2fpasswd", "manifest.json", "%00.png")
    with client_of(study(tmp_path, DEPTH)) as client:
        for path in (*(f"pictures/{name}" for name in pictures), "static/%2e%2e/study.py", "static/..%2fstudy.py", "x"):
            assert client.get(f"/{path}").status_code == 404, path


def test_what_was_shown_before_the_session_began_is_refused(client: TestClient, tmp_path: Path) -> None:
    someone = Participant(client)
    someone.begin()
    someone.show(someone.trials[0])
    before = journal(tmp_path).read_bytes()
    message = someone.message(someone.trials[0], 0)
    message["answer"]["frames"]["shown"].insert(0, {"event": "mark", "stamps": [0.0, 16.7]})
    message["answer"]["frames"]["shown"][1]["stamps"] = [1100.0, 1116.7]  # and the cube 1 s after the beginning
    refused = someone.ask("answer", **message)
    assert refused.status_code == 400
    assert "0.1 s before the session began" in refused.json()["error"]
    assert journal(tmp_path).read_bytes() == before
    message["answer"]["frames"]["shown"][0]["stamps"] = [100.0, 116.7]
    assert someone.ask("answer", **message).status_code == 200


HOSTILE: list[str] = [
    *("NaN", "Infinity", "-Infinity", "1e999", "9" * 5000, "-0.0", "null", "true", '""', '"\\ud800"', '"\\u0000"'),
    *("[]", "{}", "[[1, 2, 3]]", '{"a": NaN}', "[" * 150 + "]" * 150, '{"a":' * 150 + "1" + "}" * 150),
]
"""Values in JSON that no page sends."""


def _replaced(value: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Copies of a message with a marker in place of each value."""
    if isinstance(value, dict):
        for key in value:
            yield from ((where, {**value, key: new}) for where, new in _replaced(value[key], f"{place}/{key}"))
    elif isinstance(value, list) and value:
        yield from ((where, [new, *value[1:]]) for where, new in _replaced(value[0], f"{place}/0"))
    yield place, "MARKER"


@pytest.mark.parametrize("store", ["folder"], indirect=True)
@pytest.mark.parametrize("design", [NECKER, DEPTH], ids=["necker", "depthrating"])
def test_no_value_in_any_message_is_a_fault_of_the_server(
    tmp_path: Path, design: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(studies, "BEGINS", 1e6)
    monkeypatch.setattr(studies, "MESSAGES", 1e6)
    with TestClient(client_of(study(tmp_path, design)).app, raise_server_exceptions=False) as client:
        someone = Participant(client)
        someone.begin()
        who = {"token": someone.token, "tab": "tab-1"}
        given = {**who, **someone.message(someone.trials[0], 0)}
        judged = {key: given[key] for key in ("phase", "trial", "answer")}
        messages = {"join": {"platform": {"id": "a"}}, "begin": {**who, **participant.SITTING}, "answer": given}
        messages |= {
            "next": {**who, "phase": "practice", "trial": 1},
            "judge": {**who, "round": 1, "answers": [judged]},
        }
        messages |= dict.fromkeys(("state", "here", "leave", "finish", "withdraw"), who)
        before = journal(tmp_path).read_bytes()
        for path in ("join", "state", "here", "answer", "judge", "next", "leave", "finish", "begin"):
            for place, changed in _replaced(messages[path]):
                for value in HOSTILE[:: 1 if path == "answer" else 4]:
                    body = json.dumps(changed).replace('"MARKER"', value)
                    status = client.post(f"/api/{path}", content=body.encode()).status_code
                    assert status < 500, (path, place, value)
        assert before in journal(tmp_path).read_bytes()
        for path in ("state", "begin", "here"):
            assert someone.ask(path, **(participant.SITTING if path == "begin" else {})).status_code == 200, path
        assert client.get("/experimenter/overview.json", auth=("experimenter", PASSWORD)).status_code == 200


def test_one_participant_costs_no_more_than_a_page_sends(client: TestClient, tmp_path: Path) -> None:
    someone = Participant(client)
    assert [someone.begin().status_code for _ in range(40)].count(200) <= 21
    assert someone.begin().headers["retry-after"]
    message = someone.message(someone.trials[0], 0)
    someone.show(someone.trials[0])
    before = journal(tmp_path).read_bytes()
    message["answer"]["frames"]["shown"][0]["stamps"] = [100.0 + 2 * n for n in range(1100)]  # of a cube shown for 2 s
    refused = someone.ask("answer", **message)
    assert refused.status_code == 400
    assert "1100 time stamps, but a trial of 2 s has at most 1010" in refused.json()["error"]
    message["answer"]["frames"]["shown"][0]["stamps"] = [100.0 + 2 * n for n in range(1001)]
    presses = [[0.01 * n, "f", n % 2 == 0] for n in range(200)]
    refused = someone.ask("answer", **message | {"answer": message["answer"] | {"presses": presses}})
    assert "presses has 200 entries" in refused.json()["error"]
    assert journal(tmp_path).read_bytes() == before
    assert someone.ask("answer", **message).status_code == 200
    large = b'{"token": [' + b"0," * 200_000 + b"0]}"
    assert client.post("/api/here", content=large).status_code == 413


def test_an_answer_needs_the_token_of_its_trial(tmp_path: Path) -> None:
    made = study(tmp_path)
    with client_of(made) as client:
        someone, other = Participant(client), Participant(client)
        someone.begin()
        other.begin()
        message = someone.message(someone.trials[0], 0)
        first = {key: message[key] for key in ("phase", "trial")}
        someone.show(someone.trials[0])
        before = journal(tmp_path).read_bytes()
        tokens = someone.ask("next", **first).json()["trial_tokens"]
        assert len(tokens) == len(set(tokens)) == 2, "those of practice"
        for wrong in ("none", tokens[1], other.ask("next", **first).json()["trial_tokens"][0]):
            refused = someone.ask("answer", **message, trial_token=wrong)
            assert refused.status_code == 403
            assert "was not shown" in refused.json()["error"]
        assert client.post("/api/answer", json={"token": someone.token, "tab": "tab-1", **message}).status_code == 400
        assert journal(tmp_path).read_bytes() == before
        assert someone.ask("answer", **message, trial_token=tokens[0]).json()["recorded"]
        assert someone.ask("next", **first).status_code == 409  # recorded
    with client_of(study(tmp_path)) as client:  # of a page that had its tokens before the server was started again
        same = Participant(client, someone.token)
        later = someone.message(someone.trials[1], 1)
        assert same.ask("answer", **later, trial_token=tokens[1]).json() == {"recorded": True, "done": 2}


def test_every_answer_has_its_headers(client: TestClient) -> None:
    for path in ("/", "/s/unknown", "/static/page.js", "/nothing"):
        headers = client.get(path).headers
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert "script-src 'self'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert "set-cookie" not in headers


def test_an_attacker_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "study").mkdir()
    statuses = run(200, 1, tmp_path / "study")
    assert statuses[400] > 50


@pytest.mark.parametrize("store", ["folder"], indirect=True)  # the database's lines stand
def test_messages_with_names_of_the_servers_files_reach_the_experimenter_only(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    made = study(tmp_path)
    someone = Participant(TestClient(client_of(made).app))
    someone.begin()
    someone.answer(0)
    made.close()
    path = journal(tmp_path)
    path.write_bytes(b"no journal\n" + path.read_bytes())
    with client_of(study(tmp_path)) as second:
        answer = Participant(second, someone.token).ask("state")
    assert answer.status_code == 400
    assert answer.json() == {"error": "The study cannot continue: tell the person who gave you the link."}
    assert str(path) in capfd.readouterr().err
