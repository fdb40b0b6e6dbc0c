"""Files that platforms give of an exported study, right ones and an attacker's, and what becomes of them."""

from __future__ import annotations

import copy
import csv
import io
import json
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fuzz_server
import pytest
from click.testing import CliRunner
from participant import DEPTH, NECKER, client_of, make_set, study

from focalgradient.cli import main
from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import load_design
from focalgradient.errors import InputError
from focalgradient.web import Lists, collect
from focalgradient.web.lists import digest_of

Line = dict[str, Any]
SITTING: Line = {
    "consent": None,
    "screen_px": [1920, 1080],
    "screen_m": [0.53, 0.3],
    "viewing_distance_m": 0.6,
    "pixel_ratio": 1.0,
    "refresh_hz": 60.0,
    "browser": "none",
    "now_ms": 100.0,
}


def run(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def session(folder: Path, label: str = "002", name: str = "s-1", hour: int = 9, design: str = NECKER) -> list[Line]:
    """What the page notes of a whole session."""
    (folder / "design.toml").write_text(design)
    pictures = folder / "set" if "depthrating" in design else None
    if pictures is not None and not pictures.exists():
        make_set(pictures, ["spheres-00", "spheres-01", "spheres-02"], size=(320, 241))
    lists = Lists(load_design(folder / "design.toml"), pictures)
    trials = lists.design.trials(label)
    shared = {"focalgradient": 1, "session": name, "time": f"2026-03-02T{hour:02}:00:00.250Z"}
    begun: Line = {
        "kind": "begun",
        "participant": label,
        "design": lists.design.model_dump(mode="json"),
        "stimuli": lists.manifest and lists.manifest.sha256,
        "list": digest_of(trials),
        "study": "0" * 64,
        "platform": "jatos",
        "sitting": SITTING,
    }
    lines = [begun]
    for number, trial in enumerate(lists.shown(label, trials)):
        frames = {"shown": [{"event": "picture", "stamps": [0.0, 16.7, 33.3]}]}
        answer: Line = {"onset": 10.0 * number, "dropped_frames": 0, "frames": frames}
        if trial["scale"]["kind"] == "held":
            seconds = trial["intervals"][0]["seconds"]
            answer |= {"presses": [[0.5, "f", True], [1.5, "f", False]], "trial_duration": seconds}
        else:
            answer |= {"rating": 1.0 + 0.1 * (number % 5), "response_time": 1.0, "start": 0.5}
        key = {"phase": trial["phase"], "trial": trial["trial"], "attempt": f"attempt-{number}"}
        lines.append({"kind": "answer", "given": {**key, "answer": answer}})
    return [{**shared, "line": number, **line} for number, line in enumerate(lines)]


def text(lines: list[Line]) -> str:
    return "".join(json.dumps(line) + "\n" for line in lines)


def table(lines: list[Line]) -> str:
    content = io.StringIO(newline="")
    csv.writer(content).writerows([["record"], *([json.dumps(line)] for line in lines)])
    return content.getvalue()


def archive(members: dict[str, str | bytes]) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as made:
        for name, one in members.items():
            made.writestr(name, one)
    return content.getvalue()


WAYS: dict[str, Callable[[list[Line]], bytes]] = {
    "JATOS's text": lambda lines: text(lines).encode(),
    "JATOS's text, joined": lambda lines: text(lines).replace("\n", "").encode(),
    "JATOS's archive": lambda lines: archive(
        {
            "metadata.json": '{"apiVersion": "1.0.0", "data": []}',
            "study_result_1/comp_result_1/data.txt": text(lines[:4]),
            "study_result_2/comp_result_2/data.txt": text(lines[4:]),
            "study_result_2/comp_result_3/files/face.jpg": b"\xff\xd8\xff",
        }
    ),
    "CSV": lambda lines: table(lines).encode(),
    "CSV of a spreadsheet": lambda lines: b"\xef\xbb\xbf" + table(lines).encode(),
    "an archive of CSV": lambda lines: archive({"b.csv": table(lines[3:]), "a.csv": table(lines[:3])}),
    "a list of JSON": lambda lines: json.dumps(lines, indent=1).encode(),
    "rows of JSON": lambda lines: json.dumps([{"record": json.dumps(line)} for line in lines]).encode(),
    "twice the same": lambda lines: text(lines + lines[2:5]).encode(),
    "in any order": lambda lines: text(lines[::-1]).encode(),
}


@pytest.mark.parametrize("way", WAYS)
def test_files_as_platforms_give_them_become_a_valid_data_set(tmp_path: Path, way: str) -> None:
    lines = session(tmp_path)
    (tmp_path / "results").write_bytes(WAYS[way](lines))
    code, said = run("collect", tmp_path / "results", "--data", tmp_path / "data")
    assert code == 0, said
    trials = load_design(tmp_path / "design.toml").trials("002")
    assert f"sub-002: {len(trials)} of {len(trials)} trials, {len(trials)} new" in said
    assert validate(tmp_path / "data").problems == ()


def test_the_list_is_the_laboratorys_for_the_same_seed_and_label(tmp_path: Path) -> None:
    session(tmp_path, design=DEPTH)
    pictures = ("--stimuli", tmp_path / "set")
    design = load_design(tmp_path / "design.toml")
    code, said = run("serve", tmp_path / "design.toml", *pictures, "--export", tmp_path / "out", "--participants", "3")
    assert code == 0, said
    with client_of(study(tmp_path, DEPTH)) as client:
        token = client.post("/api/join", json={"platform": {}}).json()["token"]
        begin = client.post("/api/begin", json={"token": token, "tab": "t", **SITTING}).json()
    for label in ("001", "002", "003"):
        made = json.loads((tmp_path / "out" / "lists" / f"{label}.json").read_text())
        trials = design.trials(label)
        assert [(one["phase"], one["trial"]) for one in made["trials"]] == [(one.phase, one.trial) for one in trials]
        assert made["sha256"] == digest_of(trials)
        assert made["reveals"] in said
        assert "study.json the design with its seed" in made["reveals"]
        for entry, trial in zip(made["trials"], trials, strict=True):
            assert trial.scene.partition("-")[0] not in json.dumps(entry)
            assert all((tmp_path / "out" / interval["url"]).is_file() for interval in entry["intervals"])
        if label == "001":
            assert [{"phase": one["phase"], "trial": one["trial"]} for one in made["trials"]] == begin["trials"]
    assert len({repr(design.trials(label)) for label in ("001", "002", "003")}) == 3


def test_depth_ratings_are_those_that_were_given(tmp_path: Path) -> None:
    lines = session(tmp_path, design=DEPTH)
    (tmp_path / "results.txt").write_text(text(lines))
    words = ("collect", tmp_path / "results.txt", "--data", tmp_path / "data")
    code, said = run(*words)
    assert code == 2
    assert "give the folder of a set" in said
    assert not (tmp_path / "data").exists()
    assert run(*words, "--stimuli", tmp_path / "set")[0] == 0
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    given = [line["given"]["answer"]["rating"] for line in lines[1:] if line["given"]["phase"] == "main"]
    assert list(read_dataset(tmp_path / "data").tables["depthrating"]["rating"]) == pytest.approx(given)


def test_a_session_that_was_left_is_incomplete_and_goes_on_later(tmp_path: Path) -> None:
    lines = session(tmp_path)
    words = ("collect", tmp_path / "results.txt", "--data", tmp_path / "data")
    (tmp_path / "results.txt").write_text(text(lines[:4]))
    code, said = run(*words)
    assert code == 0
    assert f"sub-002: 3 of {len(lines) - 1} trials (incomplete), 3 new" in said
    journal = next((tmp_path / "data" / "sourcedata").rglob("*.jsonl"))
    early = journal.read_bytes()
    assert "0 new" in run(*words)[1]
    assert journal.read_bytes() == early
    (tmp_path / "results.txt").write_text(text(lines))
    assert f"{len(lines) - 4} new" in run(*words)[1]
    assert journal.read_bytes().startswith(early)
    assert validate(tmp_path / "data").problems == ()
    (tmp_path / "results.txt").write_text(text(lines[:4]))  # the older file again
    assert "0 new" in run(*words)[1]
    assert len(read_journal(journal).of("trial")) == len(lines) - 1


def test_lines_after_a_gap_wait_for_it(tmp_path: Path) -> None:
    lines = session(tmp_path)
    words = ("--data", tmp_path / "data")
    (tmp_path / "one.csv").write_text(table(lines[:3]))
    (tmp_path / "two.csv").write_text(table(lines[3:4]))
    (tmp_path / "three.csv").write_text(table(lines[4:]))
    code, said = run("collect", tmp_path / "one.csv", tmp_path / "three.csv", *words)
    assert code == 1
    assert f"its line 3 is missing, and {len(lines) - 4} after it were not used" in said
    code, said = run("collect", tmp_path / "three.csv", *words)
    assert code == 1
    assert "its first line is missing" in said
    assert run("collect", *(tmp_path / f"{name}.csv" for name in ("three", "one", "two")), *words)[0] == 0
    assert validate(tmp_path / "data").problems == ()


def test_of_two_sessions_with_one_list_the_longer_is_kept(tmp_path: Path) -> None:
    first, second = session(tmp_path, name="s-1", hour=8)[:3], session(tmp_path, name="s-2", hour=9)
    (tmp_path / "results.txt").write_text(text(first + second))
    code, said = run("collect", tmp_path / "results.txt", "--data", tmp_path / "data")
    assert code == 1
    assert "Left out: session s-1: list 002 was used by session s-2" in said
    (tmp_path / "results.txt").write_text(text(first))
    assert run("collect", tmp_path / "results.txt", "--data", tmp_path / "data")[0] == 1
    assert validate(tmp_path / "data").problems == ()


def test_who_has_withdrawn_stays_out(tmp_path: Path) -> None:
    (tmp_path / "results.txt").write_text(text(session(tmp_path) + session(tmp_path, "003", "s-2")))
    words = ("collect", tmp_path / "results.txt", "--data", tmp_path / "data")
    assert run(*words)[0] == 0
    assert run("withdraw", tmp_path / "data", "sub-002", "--yes")[0] == 0
    code, said = run(*words)
    assert code == 1
    assert "session s-1: its participant has withdrawn" in said
    assert not list((tmp_path / "data").rglob("sub-002*"))


def changed(number: int, part: str | None = None, **content: Any) -> Callable[[list[Line]], bytes]:
    """Change a line, or a part of it."""

    def change(lines: list[Line]) -> bytes:
        line = lines[number]
        lines[number] = {**line, **content} if part is None else {**line, part: {**line[part], **content}}
        return text(lines).encode()

    return change


WRONG: dict[str, Callable[[list[Line]], bytes]] = {
    "empty": lambda lines: b"",
    "words": lambda lines: b"rt,response\n204,1\n",
    "nested design": lambda lines: text(lines[:1]).replace('"begun"', "[" * 50_000).encode(),
    "followed by words": lambda lines: text(lines).encode() + b"hello",
    "an archive with a damaged file": lambda lines: archive({"a.txt": text(lines)[:-9]}),
    "two contents of one line": lambda lines: text([*lines, {**lines[1], "time": "2026-03-02T11:00:00Z"}]).encode(),
    "a time without its zone": changed(0, time="2026-03-02T09:00:00"),
    "a path for a session": changed(3, session="../../x"),
    "another label": changed(0, participant="009"),
    "no design": changed(0, design={}),
    "another seed": changed(0, "design", seed=7),
    "a million trials": changed(0, "design", repetitions=1_000_000),
    "an answer for a beginning": lambda lines: text([{**lines[1], "line": 0}, *lines[1:]]).encode(),
    "a trial that is not the next": lambda lines: text([lines[0], {**lines[3], "line": 1}]).encode(),
    "an endless onset": lambda lines: text(lines).replace('"onset": 10.0', '"onset": 1e999').encode(),
    "more answers than trials": lambda lines: text([*lines, {**lines[-1], "line": len(lines)}]).encode(),
}


@pytest.mark.parametrize("way", WRONG)
def test_hostile_files_are_refused_in_one_sentence_and_nothing_is_written(tmp_path: Path, way: str) -> None:
    other = session(tmp_path, "003", "s-2")
    (tmp_path / "right.txt").write_text(text(other))
    (tmp_path / "results").write_bytes(WRONG[way](session(tmp_path)))
    before = sorted(tmp_path.rglob("*"))
    code, said = run("collect", tmp_path / "right.txt", tmp_path / "results", "--data", tmp_path / "data")
    assert code == 2, said
    assert said.startswith("Error: ")
    assert said.count("\n") == 1
    assert len(said) < 600
    assert "<script>" not in said
    assert sorted(tmp_path.rglob("*")) == before


def test_a_journal_that_was_changed_is_not_written_over(tmp_path: Path) -> None:
    lines = session(tmp_path)
    words = ("collect", tmp_path / "results.txt", "--data", tmp_path / "data")
    (tmp_path / "results.txt").write_text(text(lines[:4]))
    assert run(*words)[0] == 0
    journal = next((tmp_path / "data" / "sourcedata").rglob("*.jsonl"))
    before = journal.read_bytes()
    lines[1]["given"]["answer"]["onset"] = 1.25
    (tmp_path / "results.txt").write_text(text(lines))
    code, said = run(*words)
    assert code == 2
    assert "differs from these results" in said
    assert journal.read_bytes() == before


def test_damaged_results_are_refused_or_become_a_valid_data_set(tmp_path: Path) -> None:
    right = session(tmp_path)
    chance = random.Random(1)
    refused = 0
    for number in range(60):
        lines = copy.deepcopy(right)
        for _ in range(chance.randrange(1, 3)):
            place = chance.randrange(len(lines))
            lines[place] = fuzz_server.changed(lines[place], chance)
        content = list(WAYS.values())[number % 7](lines)
        if chance.random() < 0.2:
            place = chance.randrange(len(content))
            content = content[:place] + bytes([chance.randrange(256)]) + content[place + 1 :]
        (tmp_path / "results").write_bytes(content)
        data = tmp_path / f"data-{number}"
        try:
            collect([tmp_path / "results"], data)
        except InputError:
            assert not data.exists()
            refused += 1
            continue
        problems = validate(data).problems if data.exists() else ()
        assert [one for one in problems if "trials of the design are missing" not in one] == []  # what was not answered
    assert 20 < refused < 60
