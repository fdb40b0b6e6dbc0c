"""Blur discrimination in two intervals: thresholds as a function of the pedestal, the dipper function of blur.

Each pedestal has its own staircase, all interleaved; the standard edge and the more blurred one are shown in random
order (Watson & Ahumada 2011, J. Vis. 11(5):10). In a browser the server selects the blur.
Run it: focalgradient run blur_discrimination.py --participant 01 --monitor lab
"""

import math
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

from pydantic import Field

from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Staircase, Trial, answers_of
from focalgradient.display import Display
from focalgradient.scales import Ways
from focalgradient.stimuli import blurred_edge
from focalgradient.tasks import Task, register

STAIRCASE = Staircase(2.0, 0.05, 8.0, steps=(0.2, 0.1, 0.05))  # arcmin of added blur; 70.7 % right


@dataclass(frozen=True, slots=True, kw_only=True)
class DipperTrial(Trial):
    pedestal: float = field(metadata={"about": "Blur of the standard edge.", "units": "arcmin", "least": 0})
    interval: Literal[1, 2] = field(metadata={"about": "Interval of the more blurred edge."})
    level: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DipperAnswer(Response):
    level: float = field(metadata={"about": "Blur that was added.", "units": "arcmin", "above": 0})
    correct: bool = field(metadata={"about": "Whether the more blurred edge was chosen."})


class DipperDesign(Counterbalanced):
    task: str = "blurdiscrimination"
    repetitions: int = 20
    break_every: int = 40
    pedestals_arcmin: Annotated[tuple[float, ...], Field(strict=False, description="a list of numbers")] = (
        0.0,
        1.0,
        4.0,
    )
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 0.3

    def trials(self, participant, session=None):
        shown = [DipperTrial(pedestal=one, interval=half) for one in self.pedestals_arcmin for half in (1, 2)]
        return self.ordered(participant, session, shown)


@register
class BlurDiscrimination(Task):
    """Choose the interval with the more blurred edge."""

    name = "blurdiscrimination"
    title = "Discrimination of blur, by interleaved staircases"
    design, trial, answer = DipperDesign, DipperTrial, DipperAnswer
    ratios = frozenset({"level"})
    texts = {
        "en": {
            "instructions": "Which is more blurred?\nTwo edges follow each other. Say which of them was more blurred.",
            "question": "Which was more blurred?",
            "first": "the first",
            "second": "the second",
        },
        "de": {
            "instructions": "Was ist unschärfer?\nZwei Kanten folgen aufeinander. Sagen Sie, welche unschärfer war.",
            "question": "Welche war unschärfer?",
            "first": "die erste",
            "second": "die zweite",
        },
    }

    def adapted(self, design, trial, recorded):
        return replace(trial, level=STAIRCASE.level(answers_of(recorded, pedestal=trial.pedestal)))

    def shown(self, design, trial, pixels_per_degree):
        edges = []
        for interval in (1, 2):
            added = trial.level if interval == trial.interval else 0.0
            made = blurred_edge(
                pedestal_arcmin=trial.pedestal, increment_arcmin=added, pixels_per_degree=pixels_per_degree
            )
            grey = Display().encode(made.picture)
            edges.append((grey, design.picture_s))
        return edges

    def control(self, words, trial):
        return Ways(self.text(words, "question"), (self.text(words, "first"), self.text(words, "second")))

    def answered(self, design, trial, value, **times):
        return DipperAnswer(level=trial.level, correct=int(value) == trial.interval, **times)

    def simulated(self, design, trial, observer, chance):
        noise = observer.weber * (
            0.75 + 0.45 * trial.pedestal
        )  # intrinsic blur adds to the pedestal, which produces the dipper
        own = 0.8
        seen = math.hypot(own, trial.pedestal + trial.level) - math.hypot(own, trial.pedestal)
        right = bool(chance.random() < 0.5 + 0.49 * (1 - math.exp(-((seen / noise) ** 2))))
        return DipperAnswer(onset=0.0, response_time=0.8, level=trial.level, correct=right)
