"""Task of published experiments: replicas of a paper's stimuli with its question, for people and observers."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator

from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.design.pages import PlainPages
from focalgradient.design.sequence import Page
from focalgradient.display import Display
from focalgradient.published.asked import ASKED, Asked
from focalgradient.scales import Control
from focalgradient.statistics.condition_test import planned_tests
from focalgradient.tasks import Task

__all__ = ["PublishedAnswer", "PublishedDesign", "PublishedTask", "PublishedTrial"]

DECISION_S = 2.0
"""Simulated response time in seconds (our choice)."""

TEXTS = tomllib.loads(Path(__file__).with_name("texts.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedTrial(Trial):
    """Condition of a trial.

    Parameters
    ----------
    experiment
        Key of the paper.
    condition_name
        Condition of the paper.
    place
        Interval that contains the picture of the condition; 1 with a single picture.
    """

    experiment: str = field(metadata={"about": "Key of the published experiment in the bibliography."})
    condition_name: str = field(metadata={"about": "Condition of the published experiment."})
    place: Literal[1, 2] = field(
        default=1, metadata={"about": "Interval of the more blurred picture; 1 where there is one picture."}
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedAnswer(Response):
    """Answer: 1 or 0 for a choice, metres for a distance."""

    answer: float = field(
        metadata={
            "about": "Order: 1 where the blurred side was chosen as the nearer one, else 0. Blur: 1 where the more "
            "blurred one was chosen, else 0. Distance: metres.",
            "least": 0,
        }
    )


class PublishedDesign(Counterbalanced):
    """Design of a published experiment whose stimuli can be shown on an ordinary display."""

    task: Literal["published"] = "published"
    experiment: Annotated[str, Field(description=f"one of {', '.join(ASKED)}")] = "mather1996"
    repetitions: Annotated[int, Field(ge=1, le=100, description="a whole number from 1 to 100")] = 5
    practice_trials: Annotated[int, Field(ge=0, le=100, description="a whole number from 0 to 100")] = 2
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 1.0

    @field_validator("experiment")
    @classmethod
    def _known(cls, given: str) -> str:
        if given not in ASKED:
            raise ValueError(f"experiment is {given!r}, but must be one of {', '.join(ASKED)}.")
        return given

    @property
    def asked(self) -> Asked:
        """Stimuli and question of the experiment."""
        return ASKED[self.experiment]

    def trials(self, participant: str, session: str | None = None) -> tuple[PublishedTrial, ...]:
        """Return the trials of a participant: each condition, in each interval, `repetitions` times."""
        asked = self.asked
        shown = [
            PublishedTrial(experiment=self.experiment, condition_name=condition, place=place)
            for condition in asked.conditions
            for place in asked.places
        ]
        return self.ordered(participant, session, shown)


class _AskedPages(PlainPages):
    """Pages with the instructions of the experiment's question."""

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        return self._read(f"{self.design.asked.name} instructions", "instructions")


class PublishedTask(Task[PublishedDesign, PublishedTrial, PublishedAnswer]):
    """Question of a published experiment about replicas of its stimuli."""

    name: ClassVar[str] = "published"
    title: ClassVar[str] = "A published experiment, with replicas of its stimuli"
    texts = TEXTS
    observer_s: ClassVar[float] = 30.0
    no_pictures: ClassVar[str] = "whose pictures are drawn by its design"

    pages = _AskedPages
    design, trial, answer = PublishedDesign, PublishedTrial, PublishedAnswer

    def shown(self, design: Any, trial: Any, pixels_per_degree: float, *, seed: int = 0, stimuli: Any = None) -> Any:
        """Return the replicas of a trial, one per interval, with a new texture in each trial."""
        drawn = design.asked.drawn(trial.condition_name, trial.place, pixels_per_degree, seed)
        return [(np.asarray(Display().encode(stimulus.picture)), design.picture_s) for stimulus in drawn]

    def control(self, words: Any, trial: Any, *, design: Any = None) -> Control:
        """Return the response control of the experiment's question."""
        asked: Asked = ASKED[trial.experiment]
        return asked.control(partial(self.text, words))

    def answered(self, design: Any, trial: Any, value: float, **times: Any) -> Any:
        """Convert the response on the control to the recorded answer."""
        return PublishedAnswer(answer=design.asked.value(trial.condition_name, trial.place, value), **times)

    def simulated(self, design: Any, trial: Any, observer: Any, chance: Any) -> Any:
        """Return the answer of a simulated observer who looks at such pictures."""
        asked: Asked = design.asked
        drawn = asked.drawn(trial.condition_name, trial.place, asked.pixels_per_degree, trial.trial)
        given = asked.simulate(observer, drawn, chance)
        return self.answered(design, trial, given, onset=0.0, response_time=DECISION_S)

    def planned(self, design: Any) -> tuple[Any, ...]:
        """Return the tests of the report: effects of the conditions, distances on their logarithm."""
        return planned_tests({"answer": design.asked.is_ratio}, self.factors(design))
