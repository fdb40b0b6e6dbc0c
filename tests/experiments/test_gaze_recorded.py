"""Gaze during depth rating, by ioHub's simulated tracker: samples, fixations, trials flagged."""

from __future__ import annotations

import gzip
import json
import time

import numpy as np
import pytest
from headless import PAGES, Running, design, headless, make_set, psychopy_here, session

from focalgradient.dataset import bids_problems, read_dataset, repair, validate
from focalgradient.design import load_design
from focalgradient.report import make_report

pytestmark = psychopy_here

DESIGN = design("depthrating", mark_s=1.0, picture_s=0.5, scale="steps", gaze_within_deg=1.5)
TARGETS = {"nearest": (40.0, 90.0), "farthest": (120.0, 30.0)}  # of the pictures of 160 x 121 pixels
AWAY = 2  # number of the trial that is looked at somewhere else


@pytest.mark.slow
def test_gaze_goes_to_the_data_set_and_trials_that_left_the_object_are_flagged(tmp_path):
    make_set(tmp_path / "set", ["spheres-00", "spheres-01"])
    given = session(tmp_path, DESIGN)
    trials = load_design(tmp_path / "design.toml").trials("01")
    with headless(tmp_path / "x") as screen:
        running = Running(screen, "depth-rating", *given, "--gaze", "tracker")
        done = 0

        def look(number: int) -> None:
            x, y = TARGETS[trials[number].fixation]
            shift = 120 if number + 1 == AWAY else 0
            middle = (screen.pixels().shape[1] / 2, screen.pixels().shape[0] / 2)
            screen.xdotool("mousemove", str(round(middle[0] + x - 80 + shift)), str(round(middle[1] + y - 60.5)))

        for event in running.events():
            if event == "question":
                done += 1
                if done < len(trials):
                    look(done)  # before its mark: a slow machine would move the pointer after the picture
                screen.keys("6", "Return")
            elif event in PAGES:
                time.sleep(0.1)
                look(min(done, len(trials) - 1))
                screen.keys("space")
        assert running.end() == 0, running.errors
    found = validate(tmp_path / "data", tmp_path / "set")
    assert found.problems == ()
    assert bids_problems(tmp_path / "data") == []
    table = read_dataset(tmp_path / "data").depth_rating
    left = [number + 1 == AWAY for number in range(len(trials))]
    assert table["gaze_left"].tolist() == left
    assert (table["gaze_away"][~table["gaze_left"]] < 0.5).all()
    assert table["gaze_away"].iloc[AWAY - 1] == pytest.approx(120 / 37.6, rel=0.1)

    stem = tmp_path / "data/sub-01/beh/sub-01_task-depthrating_recording-eye1"
    about = json.loads(stem.with_name(f"{stem.name}_physio.json").read_text())
    with gzip.open(stem.with_name(f"{stem.name}_physio.tsv.gz"), "rt") as file:
        rows = np.array([[float(cell.replace("n/a", "nan")) for cell in line.split("\t")] for line in file])
    assert about["PhysioType"] == "eyetrack"
    assert about["Columns"][:3] == ["timestamp", "x_coordinate", "y_coordinate"]
    assert rows.shape[1] == len(about["Columns"])
    assert (np.diff(rows[:, 0]) > 0).all()
    assert 5 < about["SamplingFrequency"] < 130  # 60 and 100 where nothing else keeps the machine busy
    assert set(rows[:, about["Columns"].index("trial")]) == {1, 2, 3, 4}
    events = json.loads(stem.with_name(f"{stem.name}_physioevents.json").read_text())
    assert events["OnsetSource"] == "timestamp"
    with gzip.open(stem.with_name(f"{stem.name}_physioevents.tsv.gz"), "rt") as file:
        assert sum("fixation" in line for line in file) >= len(trials)

    _damaged(tmp_path, stem)
    report = make_report(tmp_path / "data")
    assert b"gaze" in report.files["report.html"]


def _damaged(folder, stem):
    """A sample that was changed is found, and repaired from the journal."""
    path = stem.with_name(f"{stem.name}_physio.tsv.gz")
    path.write_bytes(gzip.compress(gzip.decompress(path.read_bytes()).replace(b"1", b"2", 1)))
    assert any(path.name in problem for problem in validate(folder / "data").problems)
    assert repair(folder / "data")
    assert validate(folder / "data").problems == ()
