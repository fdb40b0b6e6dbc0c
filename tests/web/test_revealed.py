"""What is sent to a participant's browser does not tell the right answer, read as a whole session of messages."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from participant import DEPTH, NECKER, Participant, client_of, film_frames, study

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))
from headless import PROGRAMS

from focalgradient.dataset import read_dataset
from focalgradient.design import NeckerDesign
from focalgradient.display import Display
from focalgradient.stimuli.cube_frames import frame_count, frames_of
from focalgradient.stimuli.cube_frames import shown as as_shown
from focalgradient.tasks import task_named
from focalgradient.tasks.steps import LEAST_RIGHT
from focalgradient.web import Lists

TYPED = DEPTH + 'answer = "typed"\nconfidence = true\nmask = "noise"\n'
THRESHOLD = """
task = "blurthreshold"
scenes = ["spheres-01"]
repetitions = 2
catch_trials = 1
practice_trials = 2
level_steps = 9
mark_s = 0.05
picture_s = 0.05
blank_s = 0.05
pause_s = 0.05
ask = []
"""
CHOICE = DEPTH + 'scale = "choice"\ncatch_pictures = ["flatter", "deeper"]\nsmallest_screen = [600, 280]\n'
TELLING = {
    *("scene", "aperture", "fixation", "catch", "interval", "right", "condition", "level", "focus", "share", "rounds"),
    *("shape", "gradient", "strength", "direction", "cube", "correct", "answer"),
}
"""Keys that no message may have."""


def keys(value: Any) -> set[str]:
    """All keys of nested objects."""
    if isinstance(value, dict):
        return set(value).union(*map(keys, value.values()))
    return set().union(*map(keys, value)) if isinstance(value, list) else set()


def values(value: Any) -> set[str]:
    """All texts and names in nested objects."""
    if isinstance(value, dict):
        value = [*value.values()]
    return set().union(*map(values, value)) if isinstance(value, list) else {str(value)}


def texts_and_names(value: Any) -> str:
    """What is not a page's text: names, addresses and numbers."""
    if isinstance(value, dict):
        return " ".join(f"{key} {texts_and_names(one)}" for key, one in value.items() if key != "text")
    return " ".join(map(texts_and_names, value)) if isinstance(value, list) else str(value)


DESIGNS = {"slider": DEPTH, "choice": CHOICE, "typed": TYPED, "cube": NECKER, "threshold": THRESHOLD}


@pytest.mark.parametrize("design", DESIGNS.values(), ids=[*DESIGNS])
def test_no_message_and_no_size_of_a_session_tells_the_condition_or_the_right_answer(
    tmp_path: Path, design: str
) -> None:
    made = study(tmp_path, design)
    planned = made.design.trials("001")
    sent: list[Any] = []
    names: list[str] = []
    sizes: set[int] = set()
    with client_of(made) as client:
        someone = Participant(client)
        sent += [client.get("/api/opening").json(), someone.ask("state").json(), someone.begin().json()]
        if design == DEPTH:
            sizes.add(len(someone.picture("/pictures/standard")))
        for number, trial in enumerate(planned):
            shown = someone.ask("next", phase=trial.phase, trial=trial.trial).json()
            sent.append(shown)
            assert len(shown["trials"]) <= 4, "few trials in advance"
            urls = [part["url"] for part in shown["trials"][0]["intervals"]]
            names += urls
            sizes |= {len(someone.picture(url)) for url in urls}
            message = someone.message(someone.trials[number], number)
            if design in (CHOICE, THRESHOLD):
                message["answer"] = {**message["answer"], "rating": None, "chosen": 1, "start": None}
            if design == TYPED:
                message["answer"] |= {"start": None, "also": {"confidence": 0.5, "confidence_start": 0.25}}
            answered = someone.ask("answer", **message)
            assert answered.status_code == 200, answered.json()
            sent.append(answered.json())
    assert len(sizes) == 1, sizes
    assert not TELLING & keys(sent)
    told = texts_and_names(sent)
    for trial in planned:
        for word in (getattr(trial, "scene", "cube"), "example-", "reference", "f/", "pinhole", "nearest", "farthest"):
            assert word not in told, word
    if design == TYPED:
        table = read_dataset(tmp_path / "data").depth_rating
        assert ({*table["confidence"]}, {*table["confidence_start"]}) == ({0.5}, {0.25})
    debriefing = made.lists.closing("001")
    assert debriefing
    repeated = made.lists.again("001")
    assert not {page["text"] for page in [*debriefing, *([repeated] if repeated else [])]} & values(sent)
    assert names == [
        f"/pictures/{one.phase}/{one.trial}/{n}" for one in planned for n in range(len(names) // len(planned))
    ]


def test_focus_series_of_a_session_have_one_size() -> None:
    task = task_named(str(PROGRAMS / "blur_matching.py"))
    lists = Lists(task.design(ask=()))
    trials = lists.design.trials("001")
    assert len({len(lists.contents("001", trial)[0]) for trial in trials}) > 1
    files = [file for trial in trials for file in lists.files("001", trial)]
    assert len({*map(len, files)}) == 1
    assert json.loads(files[0]) == json.loads(lists.contents("001", trials[0])[0])


def test_a_cube_is_a_film_of_the_laboratorys_frames(tmp_path: Path) -> None:
    made = study(tmp_path, NECKER)
    display = Display()
    count = frame_count(made.design, 60.0)
    shown = {(one.shape, one.gradient): one for one in made.design.trials("001")}
    assert len(shown) == 5
    for trial in shown.values():
        (film,) = made.lists.contents("001", trial)
        light = frames_of(trial, made.design, count, display.pixel_pitch / display.distance)
        expected = [as_shown(one, display) for one in light]
        assert all(np.array_equal(one, other) for one, other in zip(film_frames(film), expected, strict=True))


def test_a_picture_needs_the_token_of_a_participant_who_has_reached_its_trial(tmp_path: Path) -> None:
    with client_of(study(tmp_path, DEPTH)) as client:
        someone, other = Participant(client), Participant(client)
        someone.begin()
        url = someone.entry(0)["intervals"][0]["url"]
        assert someone.picture(url).startswith(b"\x89PNG")
        last = someone.trials[-1]
        mine = {"Authorization": f"Bearer {someone.token}"}
        assert client.get(url).status_code == 404
        assert client.get(url, headers={"Authorization": f"Bearer {other.token}"}).status_code == 425
        assert client.get(url[:-1] + "9", headers=mine).status_code == 404
        assert client.get(f"/pictures/main/{last['trial']}/0", headers=mine).status_code == 404
        for number, trial in enumerate(someone.trials):
            if trial["phase"] == "main":
                break
            someone.answer(number)
        assert someone.picture(url).startswith(b"\x89PNG"), "practice may be repeated"


def test_the_server_judges_practice(tmp_path: Path) -> None:
    made = study(tmp_path, DEPTH)
    planned: Any = [trial for trial in made.design.trials("001") if trial.phase == "practice"]
    with client_of(made) as client:
        someone = Participant(client)
        someone.begin()
        for is_right in (True, False):
            answers = []
            for number, trial in enumerate(planned):
                side = made.design.right_side(trial) or {"above": 1.0}
                low = ("below" in side) is is_right
                message = someone.message(someone.trials[number], number)
                answer = message["answer"] | {"rating": 0.5 if low else 2.0}
                answers.append({"phase": "practice", "trial": trial.trial, "answer": answer})
            verdict = someone.ask("judge", round=1, answers=answers).json()
            assert bool(verdict.pop("practice_token", "")) is is_right
            assert ("text" in verdict.pop("page", {})) is not is_right, "with the verdict, not before"
            count = sum(made.design.right_side(trial) is not None for trial in planned)
            assert count
            assert verdict == {
                "right": count if is_right else 0,
                "of": count,
                "passed": is_right,
                "again": not is_right,
                "share": None,
            }
            few = someone.ask("judge", round=1, answers=answers[:-1]).json()
            assert not {"page", "practice_token"} & few.keys(), "the round is not complete"
        main = [{**answers[0], "phase": "main"}]
        assert someone.ask("judge", round=1, answers=main).status_code == 400


def test_a_task_states_by_what_a_page_without_a_server_judges_practice() -> None:
    design = NeckerDesign()
    lists, held = Lists(design), design.keys_of("001")
    expected: list[Any] = [{"key": held[shape], "share": LEAST_RIGHT} for shape in ("rigid", "nonrigid")] + [None]
    assert [lists.key("001", trial)["right"] for trial in design.trials("001")[:3]] == expected


def test_the_focus_to_be_matched_is_a_picture_and_no_number(tmp_path: Path) -> None:
    task = task_named(str(PROGRAMS / "blur_matching.py"))
    design: Any = task.design(ask=())
    lists = Lists(design)
    trial = design.trials("001")[0]
    (entry,) = lists.shown("001", [trial])
    assert not TELLING & keys(entry)
    assert str(trial.defocus) not in texts_and_names(entry["knob"]["views"])
    files = [json.loads(file) for file in lists.contents("001", trial)]
    assert sorted(len(one["vergences"]) > 1 for one in files) == [False, True]
    fixed = next(one for one in files if len(one["vergences"]) == 1)
    assert fixed["vergences"] == [0.0]
