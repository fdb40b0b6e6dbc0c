"""Slant from blur: perceived slant of a textured plane seen through a small and a large pupil.

The texture is homogeneous in the picture ("projected"), so that only blur indicates the slant, or on the plane
("painted"), so that perspective indicates it as well. Laboratory and browser.
Run it: focalgradient run slant_from_blur.py --participant 01 --monitor lab
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.display import Display
from focalgradient.scales import Scale
from focalgradient.stimuli import slanted_plane
from focalgradient.tasks import Task, register


@dataclass(frozen=True, slots=True, kw_only=True)
class SlantTrial(Trial):
    slant: float = field(metadata={"about": "Slant of the plane.", "units": "degree", "least": 0, "most": 85})
    pupil: float = field(metadata={"about": "Pupil through which it is seen.", "units": "mm", "least": 0})
    texture: Literal["painted", "projected"] = field(metadata={"about": "Even on the plane, or in the picture."})


@dataclass(frozen=True, slots=True, kw_only=True)
class SlantAnswer(Response):
    seen: float = field(metadata={"about": "Slant as it looked.", "units": "degree", "least": 0, "most": 85})


class SlantDesign(Counterbalanced):
    task: str = "slantfromblur"
    repetitions: int = 3
    practice_trials: int = 2
    blocked: tuple[str, ...] = ("texture",)
    slants: Annotated[tuple[float, ...], Field(strict=False, description="a list of degrees")] = (20.0, 40.0, 60.0)
    pupils_mm: Annotated[tuple[float, ...], Field(strict=False, description="a list of millimetres")] = (0.5, 6.0)
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 1.0

    def trials(self, participant, session=None):
        shown = [
            SlantTrial(slant=slant, pupil=pupil, texture=texture)
            for texture in ("painted", "projected")
            for slant in self.slants
            for pupil in self.pupils_mm
        ]
        return self.ordered(participant, session, shown)


@register
class SlantFromBlur(Task):
    """Judge the slant of a plane."""

    name = "slantfromblur"
    title = "Slant from blur and from perspective"
    design, trial, answer = SlantDesign, SlantTrial, SlantAnswer
    texts = {
        "en": {
            "instructions": "How slanted is it?\n0 degrees is a wall seen from the front, 85 a floor that leads away.",
            "question": "How slanted was it, in degrees?",
            "wall": "a wall",
            "floor": "a floor",
        },
        "de": {
            "instructions": "Wie schräg ist es?\n0 Grad ist eine Wand von vorn, 85 ein Boden, der in die Ferne führt.",
            "question": "Wie schräg war es, in Grad?",
            "wall": "eine Wand",
            "floor": "ein Boden",
        },
    }

    def shown(self, design, trial, pixels_per_degree, seed=0):
        made = slanted_plane(
            slant_deg=trial.slant,
            pupil_mm=trial.pupil,
            texture=trial.texture,
            pixels_per_degree=pixels_per_degree,
            seed=seed,
        )
        grey = Display().encode(made.picture)
        return grey, design.picture_s

    def control(self, words, trial):
        ends = (self.text(words, "wall"), self.text(words, "floor"))
        return Scale(self.text(words, "question"), "", 0, 85, ratios=False, ends=ends)

    def simulated(self, design, trial, observer, chance):
        weight = 0.8 * (trial.texture == "painted") + 0.15 * (trial.pupil > 2)
        seen = float(np.clip(observer.scale * weight * trial.slant + chance.normal(0, 4), 0, 85))
        return SlantAnswer(onset=0.0, response_time=1.5, seen=seen)
