"""The miniature effect: perceived distance, in metres, of a town that is blurred like a nearby model.

The blur follows the distances in the scene ("consistent"), or increases only upwards in the picture ("vertical"), or
sideways ("horizontal") (Held et al. 2010, ACM TOG 29(2):19). Laboratory and browser.
Run it: focalgradient run miniature_effect.py --participant 01 --monitor lab
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.display import Display
from focalgradient.scales import Scale
from focalgradient.stimuli import miniature
from focalgradient.tasks import Task, register

LEAST_M, MOST_M = 0.05, 500.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TownTrial(Trial):
    simulated: float = field(metadata={"about": "Distance whose blur is shown.", "units": "m", "above": 0})
    gradient: Literal["consistent", "vertical", "horizontal"] = field(metadata={"about": "What the blur follows."})


@dataclass(frozen=True, slots=True, kw_only=True)
class TownAnswer(Response):
    distance: float = field(metadata={"about": "How far it looked.", "units": "m", "least": LEAST_M, "most": MOST_M})


class TownDesign(Counterbalanced):
    task: str = "miniatureeffect"
    repetitions: int = 4
    practice_trials: int = 1
    runs: dict[str, int] = {"gradient": 2}
    distances_m: Annotated[tuple[float, ...], Field(strict=False, description="a list of metres")] = (0.15, 0.6, 60.0)
    width_deg: Annotated[float, Field(gt=1, le=60, description="a number of degrees")] = 14.0
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 3.0

    def trials(self, participant, session=None):
        kinds = ("consistent", "vertical", "horizontal")
        shown = [TownTrial(simulated=one, gradient=kind) for one in self.distances_m for kind in kinds]
        return self.ordered(participant, session, shown)


@register
class MiniatureEffect(Task):
    """Judge the distance of a town in metres."""

    name = "miniatureeffect"
    title = "The miniature effect"
    design, trial, answer = TownDesign, TownTrial, TownAnswer
    ratios = frozenset({"distance"})
    texts = {
        "en": {
            "instructions": "How far away is it?\nSay how far the buildings in the middle seem to be from the camera.",
            "question": "How far away was it, in metres?",
            "near": "in the hand",
            "far": "across a town",
        },
        "de": {
            "instructions": "Wie weit weg ist es?\nSagen Sie, wie weit die Gebäude in der Mitte entfernt scheinen.",
            "question": "Wie weit weg war es, in Metern?",
            "near": "in der Hand",
            "far": "quer durch die Stadt",
        },
    }

    def shown(self, design, trial, pixels_per_degree):
        made = miniature(
            simulated_distance_m=trial.simulated,
            gradient=trial.gradient,
            width_deg=design.width_deg,
            height_deg=design.width_deg / 1.4,
            pixels_per_degree=pixels_per_degree,
        )
        grey = Display().encode(made.picture)
        return grey, design.picture_s

    def control(self, words, trial):
        ends = (self.text(words, "near"), self.text(words, "far"))
        return Scale(self.text(words, "question"), "", LEAST_M, MOST_M, ratios=True, ends=ends)

    def simulated(self, design, trial, observer, chance):
        weight = {"consistent": 0.6, "vertical": 0.5, "horizontal": 0.1}[trial.gradient]
        seen = 60 * (trial.simulated / 60) ** (weight * observer.scale) * np.exp(chance.normal(0, 0.4))
        return TownAnswer(onset=0.0, response_time=3.0, distance=float(np.clip(seen, LEAST_M, MOST_M)))
