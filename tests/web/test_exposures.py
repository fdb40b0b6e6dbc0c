"""Exposures that a page reports: each is recorded once, before its trial is answered, and counted in the table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from participant import Participant, client_of, study
from test_collect import run, session

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.dataset.conduct import exposures
from focalgradient.design import load_design


def expose(someone: Participant, number: int, exposure: str, round: int = 1) -> Any:
    key = {name: someone.trials[number][name] for name in ("phase", "trial")}
    return someone.ask("expose", **key, round=round, exposure=exposure)


def log_of(folder: Path) -> Any:
    return read_journal(next((folder / "data").rglob("*.jsonl")))


def test_each_exposure_is_recorded_once_also_by_a_server_that_was_restarted(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        someone = Participant(client)
        someone.begin()
        for exposure in ("a", "a", "b"):
            assert expose(someone, 0, exposure).json() == {"recorded": True}
    with client_of(study(tmp_path)) as client:
        again = Participant(client, someone.token)
        again.trials = someone.trials
        assert expose(again, 0, "b").json() == {"recorded": True}
        again.begin()
        assert expose(again, 0, "c").json() == {"recorded": True}
        for number in range(len(again.trials)):
            assert number == 0 or expose(again, number, f"trial-{number}").status_code == 200
            assert again.answer(number).json()["recorded"]
        assert again.ask("finish").status_code == 200
    counts = exposures(log_of(tmp_path).events)
    assert sorted(counts.values()) == [1] * (len(someone.trials) - 1) + [3]
    trials = log_of(tmp_path).of("trial")
    noted = [event["extra"]["interruptions"]["value"] for event in trials if "interruptions" in event.get("extra", {})]
    assert noted == [2]
    found = validate(tmp_path / "data")
    assert found.problems == ()
    assert "1 trial was shown more than once (column interruptions); none is excluded." in "\n".join(found.notes)


def test_an_exposure_out_of_its_turn_is_refused(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        someone = Participant(client)
        key = {"phase": "main", "trial": 1, "round": 1, "exposure": "early"}
        assert someone.ask("expose", **key).status_code == 425
        someone.begin()
        assert expose(someone, 1, "second").status_code == 409
        assert someone.ask("expose", **{**key, "trial": 9999}).status_code == 409
        assert someone.ask("expose", **{**key, "round": 0}).status_code == 400
        assert not exposures(log_of(tmp_path).events)


def test_an_answer_whose_exposure_was_not_reported_is_refused(tmp_path: Path) -> None:
    with client_of(study(tmp_path)) as client:
        someone = Participant(client)
        someone.begin()
        message = someone.message(someone.trials[0], 0)
        tokens = someone.ask("next", phase=message["phase"], trial=message["trial"]).json()["trial_tokens"]
        who = {"token": someone.token, "tab": someone.tab}
        refused = client.post("/api/answer", json={**who, **message, "trial_token": tokens[0]})
        assert refused.status_code == 403
        assert "report its exposure before the response" in refused.json()["error"]
        assert not log_of(tmp_path).of("trial")
        assert someone.answer(0).json() == {"recorded": True, "done": 1}


def test_an_exported_study_counts_the_exposures_of_its_lines(tmp_path: Path) -> None:
    lines = []
    for line in session(tmp_path):
        if line["kind"] == "answer":
            key = {name: line["given"][name] for name in ("phase", "trial")}
            times = 2 if key == {"phase": "main", "trial": 2} else 1
            for time in range(times):
                shown = {**key, "round": 1, "exposure": f"{key['phase']}-{key['trial']}-{time}"}
                rest = {name: value for name, value in line.items() if name != "given"}
                lines.append({**rest, "kind": "shown", "shown": shown})
        lines.append(line)
    text = "".join(json.dumps({**line, "line": number}) + "\n" for number, line in enumerate(lines))
    (tmp_path / "results").write_text(text)
    code, said = run("collect", tmp_path / "results", "--data", tmp_path / "data")
    assert code == 0, said
    trials = load_design(tmp_path / "design.toml").trials("002")
    assert f"sub-002: {len(trials)} of {len(trials)} trials" in said
    table = read_dataset(tmp_path / "data").necker
    assert {*table["interruptions"][table["trial"] == 2]} == {1}
    assert table["interruptions"][table["trial"] != 2].isna().all()
    assert validate(tmp_path / "data").problems == ()
