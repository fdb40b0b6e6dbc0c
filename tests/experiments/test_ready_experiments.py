"""The ready experiments of `experiments/`: simulated, checked, reported; in a window with real keys; in Chromium."""

from __future__ import annotations

import csv
import os
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import succeed
from headless import PAGES, PROGRAMS, Headless, Running, design, headless, keep, psychopy_here

from focalgradient.dataset import read_dataset, validate
from focalgradient.design import answers_of, load_design
from focalgradient.design.pages import pages_of
from focalgradient.design.words import load_words
from focalgradient.observers import simulate
from focalgradient.report import make_report
from focalgradient.tasks import task_named
from focalgradient.tasks.registry import FILES

sys.path.insert(0, str(Path(__file__).parents[1] / "web"))
from browser import chromium
from chromium import Server, take_part
from damaging import forged

INK = 0.9  # of the screen's text, from -1 to 1

DESCRIBED = (
    *("blur_matching", "blur_discrimination"),
    *("border_blur", "slant_from_blur", "miniature_effect", "depth_order", "stereo_blur"),
)


def task_of(name: str):
    return task_named(str(PROGRAMS / f"{name}.py"))


@pytest.mark.slow
@pytest.mark.parametrize("name", DESCRIBED)
def test_each_is_a_full_citizen_in_both_languages(name: str, tmp_path: Path) -> None:
    task = task_of(name)
    lines = (PROGRAMS / f"{name}.py").read_text(encoding="utf-8").splitlines()
    assert 60 <= len(lines) <= 150
    assert task.described
    made = task.design()
    for language in ("en", "de"):
        words = load_words(language)
        assert all(task.text(words, entry) for entry in task.texts["en"])
        assert len(pages_of(made, words, "01").opening()) == 1
        if task.adjusts:
            assert task.adjustment(made, words, made.trials("01")[0], 20.0).question
        else:
            assert task.control(words, made.trials("01")[0]).form()["question"]
    simulate(made, tmp_path / "data", observers=3, seed=1)
    assert validate(tmp_path / "data").problems == ()
    (table,) = (one for one in read_dataset(tmp_path / "data", [task.name]).tables.values() if len(one))
    assert len(table) == 3 * sum(trial.phase == "main" for trial in made.trials("01"))


@pytest.mark.usefixtures("unrendered")
def test_a_staircase_has_its_trace_drawn_and_its_thresholds_compared(tmp_path: Path) -> None:
    task = task_of("blur_discrimination")
    assert task.adapted_fields == ("level",)
    simulate(task.design(pedestals_arcmin=[0.0, 4.0], repetitions=10), tmp_path / "data", observers=2, seed=2)
    files = make_report(tmp_path / "data").files
    assert "blurdiscrimination_level_trace.png" in files
    tests = [row["name"] for row in csv.DictReader(files["results.csv"].decode().splitlines())]
    assert {*tests} == {"geometric mean threshold", "log ratio of thresholds", "threshold"}
    means = files["blurdiscrimination_means.csv"].decode().splitlines()
    assert means[0].startswith("pedestal,answer,")  # the interval is the correct answer
    assert [row.split(",")[1] for row in means[1:]] == ["correct"] * 2


def test_a_level_that_its_staircase_did_not_set_is_seen(tmp_path: Path) -> None:
    simulate(task_of("blur_discrimination").design(repetitions=4), tmp_path / "data", observers=1, seed=2)
    assert validate(tmp_path / "data").problems == ()

    def raised(events: list[dict[str, Any]]) -> None:
        (last,) = [event for event in events if event["event"] == "trial"][-1:]
        last["level"] *= 1.5

    forged(raised, "blurdiscrimination")(tmp_path / "data")
    (problem,) = validate(tmp_path / "data").problems
    assert re.search(r"level is [\d.]+, but [\d.]+ by the design and the lines before: restore the journal", problem)
    forged(lambda events: events[0]["versions"].update(focalgradient="0.0.1"), "blurdiscrimination")(tmp_path / "data")
    assert validate(tmp_path / "data").problems == ()


@pytest.mark.slow
def test_their_reports_find_what_the_observers_were_given(tmp_path: Path) -> None:
    simulate(task_of("blur_discrimination").design(), tmp_path / "data", observers=8, seed=2)
    succeed("report", tmp_path / "data", "--out", tmp_path / "report")
    text = (tmp_path / "report" / "report.md").read_text(encoding="utf-8")
    thresholds = re.findall(r"Geometric mean threshold in pedestal (\d): ([\d.]+) arcmin", text)
    found = [float(dict(thresholds)[pedestal]) for pedestal in "014"]
    assert found[1] < found[0] < found[2]  # the dipper


SHORT: dict[str, dict[str, Any]] = {
    "blur_matching": {"contrasts": [0.8], "repetitions": 1, "practice_trials": 0, "size_deg": 2.0},
    "blur_discrimination": {"pedestals_arcmin": [1.0], "repetitions": 2},
}


def written(folder: Path, name: str, language: str) -> Path:
    task = task_of(name)
    path = folder / "design.toml"
    path.write_text(design(task.name, language=language, ask=[], **SHORT[name]))
    assert len(load_design(path).trials("01")) <= 8
    return path


def turn_knob(screen: Headless, trial: int) -> None:
    """By keys in the first trial, the wheel in the second, the slider in the third; text must be readable meanwhile."""
    light = np.asarray(screen.pixels()[[20, 60, 748], 100, 0] / 255)  # beside the question, its second line, the hint
    ink, ground = (((value + 0.055) / 1.055) ** 2.4 for value in ((1 + INK) / 2, light))
    assert ((ink + 0.05) / (ground + 0.05)).min() >= 7, "WCAG 2.1, level AAA"
    if trial == 1:
        screen.keys("Left", "Right", "Up")  # -1, 1 and 6 taps
    elif trial == 2:
        for notch in ("4", "4", "4", "5"):  # up and down
            screen.xdotool("click", notch, "sleep", "0.1")
    else:
        middle, half, height = 512, 0.3 * 768, 384 + 0.4 * 768
        places = [("mousemove", str(round(middle + at * half)), str(round(height))) for at in (-0.5, 0.5)]
        screen.xdotool(*places[0], "sleep", "0.1", "mousedown", "1", "sleep", "0.1")
        screen.xdotool(*places[1], "sleep", "0.3", "mouseup", "1", "sleep", "0.1")


@psychopy_here
@pytest.mark.slow
def test_blur_is_matched_in_a_window_by_keys_wheel_and_slider(tmp_path: Path) -> None:
    """Another of them, with a question, runs in `test_devices_of_tasks`."""
    given = ["--data", tmp_path / "data", "--uncalibrated", "--participant", "01", "--gaze", "mouse"]
    given += ["--design", written(tmp_path, "blur_matching", "de")]
    with headless(tmp_path / "x") as screen:
        running = Running(screen, "from-file", str(PROGRAMS / "blur_matching.py"), *given)
        events: list[str] = []
        for event in running.events():
            events.append(event)
            keep(screen, f"matching-{event.strip('?')}-{events.count(event)}")
            if event == "adjust":
                turn_knob(screen, events.count(event))
                keep(screen, f"matching-turned-{events.count(event)}")
                screen.keys("Return")
            elif event in PAGES:
                screen.keys("space")
        assert running.end() == 0, running.errors
    assert validate(tmp_path / "data").problems == ()
    (table,) = (one for one in read_dataset(tmp_path / "data").tables.values() if len(one))
    assert [*(tmp_path / "data").rglob("*_recording-eye1_physio.tsv.gz")]
    turned = [6 * 2.0 / 60, 2 * 2.0 / 60, 1.5 - table["start"].iloc[2]]  # defocus by tap or notch, of 60; at 3/4
    expected = (table["start"] + turned).clip(upper=2.0)
    assert (table["matched"] - expected).abs().tolist() == pytest.approx([0, 0, 0], abs=2e-3)


ALSO = """
[also.interest]
question = "How interesting was it?"
most = 4
steps = true
"""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "language"), [("blur_matching", "de"), ("blur_discrimination", "en")])
def test_each_runs_in_a_browser(name: str, language: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, name, language)
    path.write_text(path.read_text() + ALSO)
    monkeypatch.setenv(FILES, str(PROGRAMS / f"{name}.py"))
    server = Server(tmp_path, 0)
    server.start("--invite", 1)
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1024, "height": 768})
        page.goto(server.address)
        seen = take_part(page, name=name)
    assert server.end() == 0
    assert any(task_of(name).texts[language]["question"] in text for text in seen)
    assert validate(tmp_path / "data").problems == ()
    (table,) = (one for one in read_dataset(tmp_path / "data").tables.values() if len(one))
    assert {*table["interest"]} == {3}
    assert table["interest_start"].between(0, 4).all()
    if name == "blur_matching":  # each of two taps turns the knob by a sixtieth, but at its end
        turned = (table["matched"] - table["start"]).to_numpy()
        assert turned == pytest.approx(2 * 2.0 / 60, abs=1e-4)
    if name == "blur_discrimination":  # the level of each trial follows from the answers before it, as in a window
        assert table["shown_sha256"].notna().all()
        recorded = [{"phase": "main", "catch": False, **one} for one in table.to_dict("records")]
        stairs = sys.modules["blur_discrimination"].STAIRCASE
        for number, one in enumerate(recorded):
            assert one["level"] == pytest.approx(stairs.level(answers_of(recorded[:number])))
        assert len({one["level"] for one in recorded}) > 1
    assert os.environ[FILES]
