"""The threshold of blur in real windows: levels chosen trial by trial, a session that was cut off, and the report."""

from __future__ import annotations

import numpy as np
import pytest
from headless import PAGES, Headless, Running, design, headless, keep, make_set, psychopy_here, session

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import BlurThresholdDesign, BlurTrial, Procedure, load_design
from focalgradient.report import make_report
from focalgradient.stimuli import blurred_scene, read_set

SHORT = {"scenes": ["spheres-01"], "repetitions": 5, "catch_trials": 2, "practice_trials": 2, "break_every": 8}
SHORT |= dict.fromkeys(("least_break_s", "mark_s", "picture_s", "blank_s", "pause_s"), 0.1)
SHORT |= {"judged": "depth", "most_level": 20.0, "language": "de"}


def answer_all(running: Running, screen: Headless, trials: list[BlurTrial], stop: int) -> None:
    """Answer rightly, but in every third trial that counts; kill it at the question of trial `stop`."""
    count = 0
    for number, event in enumerate(running.events()):
        keep(screen, f"threshold-{number:03}-{event.strip('?')}")
        if event == "question":
            if count == stop:
                running.process.kill()
                break
            trial = trials[count]
            wrong = trial.phase == "main" and not trial.catch and trial.trial % 3 == 0
            screen.keys("Left" if (trial.interval == 1) != wrong else "Right")
            count += 1
        elif event in PAGES:
            screen.keys("space")


@psychopy_here
@pytest.mark.slow
def test_a_session_that_was_cut_off_goes_on_with_the_levels_that_its_answers_give(tmp_path):
    make_set(tmp_path / "set", ["spheres-01"])
    given = [*session(tmp_path, design("blurthreshold", **SHORT)), "--gaze", "mouse"]
    made = load_design(tmp_path / "design.toml")
    assert isinstance(made, BlurThresholdDesign)
    trials = list(made.trials("01"))
    with headless(tmp_path / "x") as screen:
        first = Running(screen, "blur-threshold", *given)
        answer_all(first, screen, trials, 7)
        first.end()
        recorded = read_journal(first.journal()).of("trial")
        assert 6 <= len(recorded) <= 7
        second = Running(screen, "blur-threshold", *given, "--resume")
        answer_all(second, screen, trials[len(recorded) :], -1)
        assert second.end() == 0, second.errors
    found = validate(tmp_path / "data", tmp_path / "set")
    assert found.problems == ()
    table = read_dataset(tmp_path / "data").blur_threshold
    assert len(table) == 12
    assert set(table["sitting"]) == {1, 2}
    assert (table["gaze_left"] == ~(table["gaze_away"] <= 2.0)).all()
    counted = table[~table["catch"]]
    assert counted["correct"].tolist() == [number % 3 != 0 for number in counted["trial"]]
    assert (table["level"][table["catch"]] == made.levels[-1]).all()
    # Another procedure, given the same answers from the first, chooses the same levels: the cut left no trace.
    procedure = Procedure(made)
    for level, right in zip(counted["level"], counted["correct"], strict=True):
        assert procedure.level() == pytest.approx(level)
        procedure.learn([*procedure.learnt, (level, right)])
    assert counted["level"].nunique() > 3
    report = make_report(tmp_path / "data")
    assert report.problems == ()
    assert b"threshold" in report.files["report.html"]


def test_pictures_are_blurred_by_so_many_dioptres_as_the_level_says(tmp_path):
    make_set(tmp_path / "set", ["spheres-01"], (96, 96), gamma=1.0)
    stimuli = read_set(tmp_path / "set")
    made = BlurThresholdDesign(scenes=["spheres-01"], pupil_mm=4.0)
    sharp = blurred_scene(stimuli, made, "spheres-01", 0.0)
    assert (sharp == stimuli.pixels(stimuli.picture("spheres-01", "pinhole", "nearest"))).all()
    # White noise under a disc of radius r pixels keeps 1 / (pi r^2) of its variance, less what pixels take.
    level = 4.0
    radius = 0.002 * level * np.degrees(1) * stimuli.display.pixels_per_degree
    inner = blurred_scene(stimuli, made, "spheres-01", level)[24:-24, 24:-24].astype(float)
    kept = inner.var(axis=(0, 1)).mean() / sharp.astype(float).var(axis=(0, 1)).mean()
    assert kept == pytest.approx(1 / (np.pi * radius**2), rel=0.15)


def test_depth_is_judged_by_the_depth_of_the_scene_about_what_is_fixated(tmp_path):
    make_set(tmp_path / "set", ["spheres-01"], (160, 121))
    far = np.ones((121, 160), np.float32)
    far[:, 80:] = 4.0
    np.save(tmp_path / "set" / "spheres-01" / "depth.npy", far)
    stimuli = read_set(tmp_path / "set")
    made = BlurThresholdDesign(scenes=["spheres-01"], judged="depth", most_level=20.0)
    sharp, seen = (blurred_scene(stimuli, made, "spheres-01", amount).astype(float) for amount in (0.0, 8.0))
    assert (seen[:, :60] == sharp[:, :60]).all()  # at the distance of the fixated object
    assert seen[20:-20, 100:].std() < 0.5 * sharp[20:-20, 100:].std()
