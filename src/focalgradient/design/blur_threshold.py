"""Adaptive 2IFC design: the smallest blur that is noticed, or that makes a picture look deeper."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from focalgradient.design.adaptive import Quest, answers_of
from focalgradient.design.draws import Draws
from focalgradient.design.plan import (
    Breaks,
    Count,
    OrNone,
    Plan,
    Repetitions,
    Rounds,
    Scenes,
    Seconds,
    Share,
    Trial,
    UpTo100,
    no_repeats,
)

__all__ = ["BlurThresholdDesign", "BlurTrial", "Judged", "LevelTrial"]

Judged = Literal["blur", "depth"]
"""Attribute in which the two intervals are compared."""

LEVEL_TOLERANCE = 1e-9
"""Relative rounding tolerance of recorded levels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BlurTrial(Trial):
    """Trial with two intervals to be compared.

    Parameters
    ----------
    scene
        Name of the scene shown in both intervals.
    interval
        Interval with the added level: 1 or 2.
    """

    scene: str
    interval: int

    @property
    def condition(self) -> tuple[Hashable, ...]:
        """Scene, and interval with the added level."""
        return (self.scene, self.interval)


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelTrial(BlurTrial):
    """Trial to be shown, with its level."""

    level: float


class BlurThresholdDesign(Plan):
    """Design of a blur threshold: scenes x intervals x repetitions, with one adaptive procedure for all trials.

    Examples
    --------
    >>> design = BlurThresholdDesign()
    >>> [trial.phase for trial in design.trials("01") if not trial.catch].count("main"), design.unit
    (60, 'D')
    """

    task: Literal["blurthreshold"] = "blurthreshold"
    judged: Judged = "blur"
    scenes: Scenes = ("spheres-01", "spheres-02")
    fixation: Annotated[str, Field(min_length=1, description="the name of a fixation, like 'nearest'")] = "nearest"
    repetitions: Repetitions = 15
    least_level: Annotated[float, Field(gt=0, le=100, description="a number above 0, like 0.02")] = 0.02
    most_level: Annotated[float, Field(gt=0, le=100, description="a number above 0, like 2.0")] = 2.0
    level_steps: Annotated[int, Field(ge=5, le=100)] = 41
    pedestal: Annotated[float, Field(ge=0, le=100, description="a number of 0 or more")] = 0.0
    pupil_mm: Annotated[float, Field(gt=0, le=100, description="a positive number of millimetres")] = 4.0
    catch_trials: Count = 6
    practice_trials: UpTo100 = 4
    practice_right: Share = 0.75
    practice_rounds: Rounds = 3
    practice_required: bool = False
    break_every: Breaks = 33
    least_break_s: OrNone = 10.0
    mark_s: Seconds = 0.5
    picture_s: Seconds = 0.5
    blank_s: OrNone = 0.5
    pause_s: OrNone = 0.3

    closed: ClassVar = ("scene",)
    shortened: ClassVar = {
        "repetitions": 2,
        "scenes": 1,
        "catch_trials": 1,
        "practice_trials": 2,
        "practice_rounds": 1,
        "least_break_s": 1.0,
    }

    @model_validator(mode="after")
    def _check(self) -> BlurThresholdDesign:
        no_repeats("scenes", self.scenes)
        if self.most_level < 2 * self.least_level:
            raise ValueError(
                f"most_level is {self.most_level:g}, but must be at least twice least_level, which is "
                f"{self.least_level:g}."
            )
        self.check_counts(2 * len(self.scenes))
        self.trials("01")
        return self

    @property
    def unit(self) -> str:
        """Unit of the levels: dioptres of defocus (D), or millimetres of aperture (mm)."""
        return "D" if self.judged == "blur" else "mm"

    @property
    def thresholds_of(self) -> str:
        """What the thresholds are of, in words."""
        return "blur" if self.judged == "blur" else "depth from blur"

    @property
    def levels(self) -> tuple[float, ...]:
        """Levels available to the procedure, in equal logarithmic steps.

        >>> BlurThresholdDesign(least_level=0.1, most_level=1.6, level_steps=5).levels
        (0.1, 0.2, 0.4, 0.8, 1.6)
        """
        ratio = math.log(self.most_level / self.least_level) / (self.level_steps - 1)
        return tuple(round(self.least_level * math.exp(ratio * step), 6) for step in range(self.level_steps))

    def is_level(self, level: float) -> bool:
        """Return whether a number is one of the levels."""
        return any(math.isclose(level, one, rel_tol=LEVEL_TOLERANCE) for one in self.levels)

    def adapted(self, trial: BlurTrial, recorded: Sequence[Mapping[str, Any]]) -> LevelTrial:
        """Return a trial at the level that the answers so far give: the largest in practice and catch trials."""
        level = self.levels[-1]
        if trial.phase == "main" and not trial.catch:
            level = Quest(self.levels).level(answers_of(recorded))
        return LevelTrial(**asdict(trial), level=level)

    @property
    def shown_s(self) -> float:
        """Time in s from the onset of the first picture to the question."""
        return 2 * (self.picture_s + self.blank_s)

    def trials(self, participant: str, session: str | None = None) -> tuple[BlurTrial, ...]:
        """Return the trial list of one participant, without the levels, which depend on the answers.

        Raises
        ------
        InputError
            If a label is not alphanumeric.
        """
        shown = [BlurTrial(scene=scene, interval=interval) for scene, interval in product(self.scenes, (1, 2))]
        return self.listed(
            participant,
            session,
            blocks=[shown * self.repetitions],
            factors=lambda trial: (trial.interval,),
            catches=lambda draws: [replace(one, catch=True) for one in self._easy(self.catch_trials, draws)],
            practice=lambda draws: self._easy(self.practice_trials, draws),
        )

    def _easy(self, count: int, draws: Draws) -> list[BlurTrial]:
        """Return trials to be shown at the largest level, balanced over the two intervals, and these over scenes."""
        return draws.shuffled(
            BlurTrial(scene=self.scenes[number // 2 % len(self.scenes)], interval=1 + number % 2)
            for number in range(count)
        )
