"""The programs that a laboratory copies do the same as the commands: the same steps, pixels and answers."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from headless import PROGRAMS, make_set

from focalgradient.dataset import Press
from focalgradient.design import DepthRatingDesign, DepthTrial, check_design
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import breaks
from focalgradient.design.words import load_words
from focalgradient.display import Display
from focalgradient.lab import EXPERIMENTS, Given, Sitting, described
from focalgradient.lab.gaze import Taken
from focalgradient.scales import Ways
from focalgradient.stimuli import read_set

COMMANDS = {
    "depth_rating": "depth-rating",
    "necker_rotation": "necker",
    "pinhole_demonstration": "pinhole",
    "blur_threshold": "blur-threshold",
}


def copied(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(f"copy_of_{name}", PROGRAMS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Drawn:
    """A stimulus of the screen that stands in for PsychoPy's."""

    def __init__(self, log: list[Any], *about: Any, size: tuple[int, int] = (0, 0)):
        self._log, self._about, self.size = log, about, size

    def draw(self) -> None:
        self._log.append(("draw", *self._about))


class Screen:
    """Records each drawn item and its time, on a clock that the frames move."""

    frame_s = 1 / 60

    def __init__(self, words: Any):
        self.log: list[Any] = []
        self.words, self.display, self.size, self.time = words, Display((1024, 768)), (1024, 768), 0.0
        self.keys = SimpleNamespace(events=list, clear=lambda: None)

    def picture(self, pixels: np.ndarray, *, recorded: bool = True) -> Drawn:
        found = np.asarray(pixels)
        return Drawn(self.log, "picture", found.tobytes(), recorded, size=found.shape[1::-1])

    def text(self, text: str, **how: Any) -> Drawn:
        return Drawn(self.log, "text", text, *sorted(how.items()))

    def whole(self, light: float) -> Drawn:
        return Drawn(self.log, "whole", light)

    def fixation(self, x: float, y: float) -> Drawn:
        return Drawn(self.log, "mark", x, y)

    def play(self, draw: Callable[[float], object], seconds: float, event: str, **how: Any) -> float:
        presses = how.pop("presses", None)
        onset = self.time
        self.log.append(("play", seconds, event, *sorted(how.items())))
        for since in (0.0, seconds / 2):
            draw(since)
        if presses is not None:
            presses += [Press(onset + 0.2, "f", True), Press(onset + 0.9, "f", False), Press(onset + 0.5, "x", True)]
        self.time += seconds
        return onset

    def empty(self, seconds: float, event: str, meanwhile: Callable[[], object] = lambda: None) -> float:
        onset = self.time
        self.log.append(("empty", seconds, event))
        meanwhile()
        self.time += seconds
        return onset

    def wait(self, draw: Callable[[], object], keys: Any, event: str) -> None:
        self.log.append(("wait", *keys, event))
        draw()

    def blank(self) -> float:
        self.log.append("blank")
        return self.time

    def frame(self) -> float:
        self.time += self.frame_s
        return self.time

    def warm(self, *parts: Any) -> None:
        self.log.append(("warm", len(parts)))

    def on_event(self, event: str, time: float) -> None:
        self.log.append(("event", event, time))

    def stop_if_asked(self, found: Any) -> None:
        assert not [*found]


def sat_through(trial: Callable[..., Any], before: Callable[..., Any], design: Any, stimuli: Any) -> tuple[Any, ...]:
    """All trials of a session without a window: what was shown, and the answers."""
    screen = Screen(load_words("en"))
    sitting = Sitting(screen, design, "01", stimuli)  # type: ignore[arg-type]
    before(sitting)
    recorded: list[Any] = []
    listed = breaks(design, screen.words, pages_of(design, screen.words, "01"), design.trials("01"))
    for turn, _, _ in listed:
        one, sitting.recorded = turn.trial, tuple(recorded)
        sitting.lead, sitting.after = turn.lead, turn.after
        answer = trial(sitting, one)
        fields = {name: getattr(one, name) for name in ("phase", "catch")}
        learnt = {name: getattr(answer, name) for name in ("level", "correct") if hasattr(answer, name)}
        recorded.append(fields | learnt)
        screen.log.append(answer)
    return tuple(screen.log)


def design_of(task: str, **settings: Any) -> Any:
    return check_design("a test's", {"task": task, **settings})


FEW = {"scenes": ["spheres-01", "spheres-02"], "apertures": ["pinhole", "f/11"], "repetitions": 1, "longest_run": 4}
DESIGNS = {
    "ratio to a standard": ("depth_rating", design_of("depthrating", **FEW, catch_trials=2, mask="noise")),
    "choice of two": ("depth_rating", design_of("depthrating", **FEW, catch_trials=0, scale="choice", mark="kept")),
    "beside the pinhole": ("depth_rating", design_of("depthrating", **FEW, reference="same-scene")),
    "cube": (
        "necker_rotation",
        design_of(
            "necker", repetitions=1, trial_s=1.0, practice_s=1.0, practice_trials=2, strengths_mm=[4.0], size_deg=3.0
        ),
    ),
    "pinhole": ("pinhole_demonstration", design_of("pinhole", forms=["real", "picture"], field_deg=3.0)),
    "blur": ("blur_threshold", design_of("blurthreshold", repetitions=2, catch_trials=1, level_steps=9)),
    "depth by blur": (
        "blur_threshold",
        design_of("blurthreshold", repetitions=1, catch_trials=0, level_steps=9, judged="depth", most_level=4.0),
    ),
}


@pytest.mark.parametrize("name", DESIGNS)
def test_each_copy_shows_the_same_pixels_for_the_same_time_and_answers_the_same(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program, design = DESIGNS[name]
    make_set(tmp_path / "set", ["spheres-00", "spheres-01", "spheres-02"], size=(160, 140))
    copy, command = copied(program), EXPERIMENTS[COMMANDS[program]]
    chance = np.random.default_rng

    def logged(screen: Screen, texts: Any, event: str, **how: Any) -> None:
        screen.log.append(("pages", *texts, event, *sorted(how.items())))

    def asked(screen: Screen, control: Any, *rest: Any) -> Given:
        screen.log.append(("ask", repr(control), *rest))
        return Given(1.0, 0.8, None if isinstance(control, Ways) else 2.0)

    rooms: list[Any] = [copy, described]
    for room in rooms:
        for called, stands_in in (("pages", logged), ("ask", asked), ("ask_which", asked), ("tone", lambda: True)):
            if hasattr(room, called):
                monkeypatch.setattr(room, called, stands_in)
    monkeypatch.setattr(np.random, "default_rng", lambda seed=1: chance(seed))  # of masks
    stimuli = read_set(tmp_path / "set")
    before = getattr(copy, "before", command.before)
    by_copy = sat_through(copy.trial, before, design, stimuli)
    by_command = sat_through(command.trial, command.before, design, stimuli)
    assert len(by_copy) > 5 * len(design.trials("01"))
    differ = [pair for pair in zip(by_copy, by_command, strict=True) if pair[0] != pair[1]]
    assert differ == []


@pytest.mark.parametrize(("away", "left"), [(1.5, False), (2.5, True), (None, True)])
def test_a_copy_of_depth_rating_answers_where_the_gaze_was(
    monkeypatch: pytest.MonkeyPatch, away: float | None, left: bool
) -> None:
    copy = copied("depth_rating")
    monkeypatch.setattr(copy, "show_picture", lambda sitting, trial: (1.0, "a.png"))
    monkeypatch.setattr(copy, "ask_depth", lambda sitting, trial: Given(1.2, 0.8, 2.0))
    sitting = SimpleNamespace(design=DepthRatingDesign(gaze="mouse"), taken=Taken([], away))
    trial = DepthTrial(scene="spheres-01", aperture="f/11", aperture_mm=4.5, fixation="nearest")
    answer = copy.trial(sitting, trial)
    assert (answer.gaze_away, answer.gaze_left) == (away, left)
    assert copy.trial(SimpleNamespace(design=DepthRatingDesign(), taken=None), trial).gaze_left is None
