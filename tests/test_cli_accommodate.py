"""`focalgradient eye --accommodate`: an eye that focuses by what it sees, from the command line."""

import csv
import json
import re
from functools import partial
from pathlib import Path

import command_line
import cv2
import numpy as np
import pytest

from focalgradient.eye import Course, TargetMotion
from focalgradient.plotting.eye import accommodation_figure


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("focalgradient.eye.target_motion.DURATION_S", 3.0)


run = partial(command_line.run, "eye")
succeed = partial(command_line.succeed, "eye")


def test_a_course_from_a_table():
    Path("target.csv").write_text("time,dioptres\n0,1\n0.5,1\n0.5,3\n3,3\n", encoding="utf-8")
    result = succeed("--accommodate", "target.csv", "--out", "out", "--views", "both", "--seed", "2", "--json")
    summary = json.loads(result.stdout)
    assert summary["simulated"] is True
    assert summary["settings"]["target"] == "target.csv"
    assert summary["found"]["estimate_rms_error_D"] < 0.3
    rows = list(csv.DictReader(Path("out/course.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 30
    assert [float(rows[i]["target_D"]) for i in (0, 29)] == [1, 3]
    assert float(rows[29]["accommodation_D"]) > 2
    assert cv2.VideoCapture("out/retina.mp4").get(cv2.CAP_PROP_FRAME_COUNT) == 30
    assert cv2.imread("out/course.png") is not None
    frame = cv2.VideoCapture("out/retina.mp4").read()[1].astype(float)
    assert np.ptp(frame, axis=2).max() > 10  # it is in colour


@pytest.mark.parametrize("form", ["sine:2,0.5,0.25", "step:1,3,0.77"])
def test_the_target_is_drawn_as_it_moves_between_the_eyes_moments(form):
    target, times = TargetMotion.parse(form), np.arange(0, 2, 0.1)
    at = np.array([target.at(t) for t in times])
    line = accommodation_figure(Course(times, at, at, at, 0.1 + 0 * at), target.at, form).axes[0].lines[0]
    drawn = np.interp([0.25, 0.74, 0.80, 1.234], *line.get_data())
    assert line.get_drawstyle() == "default"
    assert drawn == pytest.approx([target.at(t) for t in (0.25, 0.74, 0.80, 1.234)], abs=1e-4)


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["spheres", "--accommodate", "step:1,3"], "SCENE 'spheres' and --accommodate are both given"),
        (["--accommodate", "sine:2,1,0"], "has 0 Hz, but must be above 0 and below 5 Hz"),
        (["--accommodate", "long.csv"], "must end by 120 s"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(args, said):
    Path("long.csv").write_text("0,1\n150,1\n", encoding="utf-8")
    result = run(*args, "--out", "out")
    assert result.exit_code == 2
    assert re.search(said, result.stderr)
    assert len(result.stderr.strip().splitlines()) == 1
    assert not Path("out").exists()
