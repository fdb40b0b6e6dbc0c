"""The programs that a laboratory copies answer as the commands do."""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import pytest

from focalgradient.design import DepthRatingDesign, DepthTrial
from focalgradient.lab.gaze import Taken
from focalgradient.lab.questions import Given

FOLDER = Path(__file__).parents[2] / "experiments"


@pytest.mark.parametrize(("away", "left"), [(1.5, False), (2.5, True), (None, True)])
def test_a_copy_of_depth_rating_answers_where_the_gaze_was(
    monkeypatch: pytest.MonkeyPatch, away: float | None, left: bool
) -> None:
    spec = importlib.util.spec_from_file_location("copied", FOLDER / "depth_rating.py")
    assert spec is not None
    assert spec.loader is not None
    copied = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(copied)
    monkeypatch.setattr(copied, "show_picture", lambda sitting, trial: (1.0, "a.png"))
    monkeypatch.setattr(copied, "ask_depth", lambda sitting, trial: Given(1.2, 0.8, 2.0))
    monkeypatch.setattr(copied, "ask_confidence", lambda sitting: None)
    sitting = SimpleNamespace(design=DepthRatingDesign(gaze="mouse"), taken=Taken([], away))
    trial = DepthTrial(scene="spheres-01", aperture="f/11", aperture_mm=4.5, fixation="nearest")
    answer = copied.trial(sitting, trial)
    assert (answer.gaze_away, answer.gaze_left) == (away, left)
    assert copied.trial(SimpleNamespace(design=DepthRatingDesign(), taken=None), trial).gaze_left is None
