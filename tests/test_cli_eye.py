"""`focalgradient eye`: what a simulated eye sees, and the depth in it."""

import json
import sys
from functools import partial
from pathlib import Path

import command_line
import cv2
import pytest

from focalgradient import DepthMap

PLACE = sys.modules["focalgradient.cli.eye"]  # the package has a command of that name


@pytest.fixture(autouse=True)
def small(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(PLACE, "SHAPE", (96, 128))
    monkeypatch.setattr(PLACE, "SAMPLES", 16)
    monkeypatch.setattr(PLACE, "FRAMES", 4)


run = partial(command_line.run, "eye")
succeed = partial(command_line.succeed, "eye")


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("views", ["bands", "oscillation", pytest.param("both", marks=pytest.mark.slow)])
def test_a_slanted_wall(views):
    result = succeed("slant", "--out", "out", "--views", views, "--seed", "1")
    assert "Side of focus right" in result.stdout
    summary = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert summary["simulated"] is True
    assert len(summary["focus_D"]) == {"bands": 2, "oscillation": 2, "both": 4}[views]
    assert summary["found"]["median_error_D"] < 0.1
    assert DepthMap.load("out/depth.npz").valid.mean() == pytest.approx(summary["found"]["valid"])
    assert cv2.VideoCapture("out/oscillation.mp4").get(cv2.CAP_PROP_FRAME_COUNT) == 16
    assert all(cv2.imread(f"out/{name}.png") is not None for name in ("views", "focus"))


def test_an_eye_of_a_prescription_and_an_age():
    """At 60 years it does not accommodate to 1 D, and in the light of a bulb the bands lie apart as they do there."""
    result = run("plane", "--out", "out", "--age", "60", "--luminance", "100", "--illuminant", "A")
    assert result.exit_code in (0, 1), result.output
    summary = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert summary["settings"]["pupil_mm"] == pytest.approx(3.33, abs=0.01)
    assert summary["focus_D"][0] < 0.3
    assert summary["settings"]["illuminant"] == "A"
    (state,) = summary["settings"]["eyes"]
    assert not state["in_reach"]
    assert state["focus_D"] < 0.3


def test_quality_through_focus():
    result = succeed("--through-focus", "--out", "out", "--refraction", "-2,00 -0,75 x 30", "--pupil", "3")
    assert "cannot focus on 1 m, the default --accommodation: it" in result.stderr
    summary = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert summary["found"]["best_D"] == pytest.approx(2.31 + 0.08, abs=0.1)  # mean sphere; white focuses as 555 nm
    assert cv2.imread("out/through_focus.png") is not None
    lines = Path("out/through_focus.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "vergence_D,visual_strehl,mtf_4_cpd,mtf_8_cpd,mtf_16_cpd"
    assert len(lines) == 82


def test_separate_ranges_of_focus_are_stated_each():
    """The foci of -3.25 and -4.75 D at 12 mm, at the cornea, are each in a range; the mean of both is in neither."""
    result = succeed("--through-focus", "--out", "out", "--refraction=-3.25 -1.50 x 20", "--age", "35")
    found = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))["found"]
    (low, near), (far, high) = found["depth_of_focus_ranges_D"]
    foci = 3.25 / (1 + 0.012 * 3.25), 4.75 / (1 + 0.012 * 4.75)
    assert low < foci[0] < near < sum(foci) / 2 < far < foci[1] < high
    assert f"2 separate ranges: {low:.2f} to {near:.2f} D, {far:.2f} to {high:.2f} D" in result.output
    assert near - low + high - far == pytest.approx(found["depth_of_focus_D"], abs=0.01)


@pytest.mark.filterwarnings("ignore:a pupil of 0.5 mm")
def test_the_depth_of_focus_of_a_pinhole_is_a_lower_bound():
    result = succeed("--through-focus", "--out", "out", "--pupil", "0.5")
    assert "Depth of focus (80 % of it): at least 4.00 D" in result.output
    assert json.loads(Path("out/summary.json").read_text(encoding="utf-8"))["found"]["depth_of_focus_is_cut_off"]
