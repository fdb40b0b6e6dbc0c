"""Stereo with blur: perceived depth of a wavy surface seen with two eyes, with consistent, absent or reversed blur.

Each eye sees its view through red-cyan glasses, or a mirror stereoscope (--stereoscope FILE; laboratory only).
Disparity is the same in all conditions; blur follows the same depth, is absent, or follows the opposite depth, as if
near and far were exchanged.
Run it: focalgradient run stereo_blur.py --participant 01 --monitor lab
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from focalgradient import Lens
from focalgradient.binocular import stereo
from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.display import Display
from focalgradient.lab import ask, show_described
from focalgradient.scales import Scale
from focalgradient.tasks import Task, register

SCREEN_M = 0.57


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoTrial(Trial):
    depth: float = field(metadata={"about": "From trough to crest of the surface.", "units": "cm", "least": 0})
    blur: Literal["consistent", "none", "reversed"] = field(metadata={"about": "What the blur follows."})


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoAnswer(Response):
    seen: float = field(metadata={"about": "Depth as it looked.", "units": "cm", "least": 0, "most": 20})


class StereoDesign(Counterbalanced):
    task: str = "stereoblur"
    repetitions: int = 3
    practice_trials: int = 2
    runs: dict[str, int] = {"blur": 2}
    depths_cm: Annotated[tuple[float, ...], Field(strict=False, description="a list of centimetres")] = (2.0, 5.0, 8.0)
    pupil_mm: Annotated[float, Field(gt=0, le=20, description="a number of millimetres")] = 5.0
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 2.0

    def trials(self, participant, session=None):
        kinds = ("consistent", "none", "reversed")
        return self.ordered(
            participant, session, [StereoTrial(depth=one, blur=kind) for one in self.depths_cm for kind in kinds]
        )


@register
class StereoBlur(Task):
    """Judge the depth of a wavy surface with two eyes."""

    name = "stereoblur"
    title = "Depth from disparity with consistent, absent and reversed blur"
    design, trial, answer = StereoDesign, StereoTrial, StereoAnswer
    texts = {
        "en": {
            "instructions": "How deep is it?\nSay how deep the waves are. Glasses, if you have them: red on the left.",
            "question": "How deep were the waves, in centimetres?",
            "flat": "flat",
            "deep": "deep",
        },
        "de": {
            "instructions": "Wie tief ist es?\nSagen Sie, wie tief die Wellen sind. Mit Brille: rot links.",
            "question": "Wie tief waren die Wellen, in Zentimetern?",
            "flat": "flach",
            "deep": "tief",
        },
    }

    def views(self, design, trial, pixels_per_degree, seed):
        """Return the light of the views of the left and the right eye."""
        side = 2 * round(3 * pixels_per_degree)  # 6 degrees
        grain = np.random.default_rng(seed).uniform(0.1, 0.9, (side // 3 + 1, side // 3 + 1))
        light = grain.repeat(3, 0).repeat(3, 1)[:side, :side]
        wave = trial.depth / 200 * np.sin(4 * np.pi * np.arange(side) / side)[:, None] * np.ones((1, side))
        made = stereo(
            light,
            SCREEN_M + wave,
            Lens(focal_length=0.017, f_number=17 / design.pupil_mm, focus_distance=SCREEN_M),
            pixel_angle=float(np.radians(1 / pixels_per_degree)),
            vergence=1 / SCREEN_M,
            blur=trial.blur != "none",
            blur_distance=SCREEN_M - wave if trial.blur == "reversed" else None,
        )
        return np.asarray(made.left.light), np.asarray(made.right.light)

    def shown(self, design, trial, pixels_per_degree, seed=0):
        left, right = self.views(design, trial, pixels_per_degree, seed)
        return Display().encode(np.stack([left, right, right], -1)), design.picture_s

    def run(self, sitting, trial):
        screen = sitting.screen
        if screen.eyes is None:
            return show_described(self, sitting, trial)
        views = self.views(sitting.design, trial, screen.display.pixels_per_degree, sitting.noise_seed(trial))
        pair = screen.pair(*views)
        onset = screen.play(lambda since: pair.draw(), sitting.design.picture_s, "picture")
        screen.empty(0.3, "off")
        given = ask(screen, self.control(sitting.words, trial))
        return StereoAnswer(onset=sitting.since_start(onset), response_time=given.seconds, seen=given.value)

    def control(self, words, trial):
        ends = (self.text(words, "flat"), self.text(words, "deep"))
        return Scale(self.text(words, "question"), "", 0, 20, ratios=False, ends=ends)

    def simulated(self, design, trial, observer, chance):
        gain = {"consistent": 1.0, "none": 0.9, "reversed": 0.75}[trial.blur]
        seen = float(np.clip(gain**observer.scale * trial.depth * np.exp(chance.normal(0, 0.15)), 0, 20))
        return StereoAnswer(onset=0.0, response_time=1.8, seen=seen)
