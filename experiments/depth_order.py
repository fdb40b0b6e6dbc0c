"""Depth order with and without depth of field: which of two cards is nearer.

Two textured cards stand side by side in front of a wall; one is in focus. With depth of field the other one is blurred
according to its distance; without it the picture is sharp and performance is at chance, as both cards have the same
size in the picture. The question, after Konrad et al. (2016), is whether depth of field improves the judgement.
Laboratory and browser.
Run it: focalgradient run depth_order.py --participant 01 --monitor lab
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from focalgradient import Lens
from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.display import Display
from focalgradient.render import blur_picture
from focalgradient.scales import Ways
from focalgradient.tasks import Task, register

FOCUS_M, WALL_M = 0.5, 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderTrial(Trial):
    near: Literal["left", "right"] = field(metadata={"about": "The nearer card, which is in focus."})
    far: float = field(metadata={"about": "Distance of the other card.", "units": "m", "above": FOCUS_M})
    depth_of_field: Literal["with", "without"] = field(metadata={"about": "Whether it is blurred by its distance."})


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderAnswer(Response):
    correct: bool = field(metadata={"about": "Whether the nearer card was chosen."})


class OrderDesign(Counterbalanced):
    task: str = "depthorder"
    repetitions: int = 6
    practice_trials: int = 2
    blocked: tuple[str, ...] = ("depth_of_field",)
    far_m: Annotated[tuple[float, ...], Field(strict=False, description="a list of metres")] = (0.6, 0.8, 1.2)
    pupil_mm: Annotated[float, Field(gt=0, le=20, description="a number of millimetres")] = 5.0
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 1.0

    def trials(self, participant, session=None):
        shown = [
            OrderTrial(near=side, far=far, depth_of_field=kind)
            for kind in ("with", "without")
            for side in ("left", "right")
            for far in self.far_m
        ]
        return self.ordered(participant, session, shown)


@register
class DepthOrder(Task):
    """Judge which of two cards is nearer."""

    name = "depthorder"
    title = "Order of depth with and without depth of field"
    design, trial, answer = OrderDesign, OrderTrial, OrderAnswer
    texts = {
        "en": {
            "instructions": "Which is nearer?\nTwo cards stand before a wall. Say which of them is nearer to you.",
            "question": "Which card was nearer?",
            "left": "left",
            "right": "right",
        },
        "de": {
            "instructions": "Was ist näher?\nZwei Karten stehen vor einer Wand. Sagen Sie, welche Ihnen näher ist.",
            "question": "Welche Karte war näher?",
            "left": "links",
            "right": "rechts",
        },
    }

    def shown(self, design, trial, pixels_per_degree, seed=0):
        side = 2 * round(3.5 * pixels_per_degree)  # 7 degrees
        grain = np.random.default_rng(seed).uniform(0.15, 0.85, (side // 4 + 1, side // 4 + 1))
        light = grain.repeat(4, 0).repeat(4, 1)[:side, :side]
        distance = np.full((side, side), WALL_M)
        for place, name in ((side // 8, "left"), (side * 9 // 16, "right")):
            own = FOCUS_M if name == trial.near else trial.far
            distance[side // 4 : side * 3 // 4, place : place + side * 5 // 16] = own
        light[distance == WALL_M] = 0.3 + 0.2 * light[distance == WALL_M]
        if trial.depth_of_field == "with":
            eye = Lens(focal_length=0.017, f_number=17 / design.pupil_mm, focus_distance=FOCUS_M)
            light = blur_picture(light, distance, eye, pixel_angle=np.radians(1 / pixels_per_degree))
        grey = Display().encode(light)
        return grey, design.picture_s

    def control(self, words, trial):
        return Ways(self.text(words, "question"), (self.text(words, "left"), self.text(words, "right")))

    def answered(self, design, trial, value, **times):
        return OrderAnswer(correct=("left", "right")[int(value) - 1] == trial.near, **times)

    def simulated(self, design, trial, observer, chance):
        blur_difference = (1 / FOCUS_M - 1 / trial.far) * (trial.depth_of_field == "with")
        right = bool(chance.random() < 0.5 + 0.48 * (1 - np.exp(-0.8 * blur_difference / observer.weber)))
        return OrderAnswer(onset=0.0, response_time=0.9, correct=right)
