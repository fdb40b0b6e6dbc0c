"""Experiment 2: whether a rotating Necker cube looks rigid or nonrigid, by its focal gradient."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from focalgradient.design.draws import Draws
from focalgradient.design.plan import (
    Breaks,
    Count,
    Names,
    OrNone,
    Plan,
    Repetitions,
    Rounds,
    Share,
    Trial,
    UpTo100,
    no_repeats,
)

__all__ = ["Direction", "Gradient", "NeckerDesign", "NeckerTrial", "Shape"]

Gradient = Literal["none", "rigid", "nonrigid"]
"""Interpretation of the cube with which the blur is consistent."""

Direction = Literal["right", "left"]
"""Direction in which the near side of the rigid cube moves."""

Shape = Literal["ambiguous", "rigid", "nonrigid"]
"""Rotating object: the ambiguous wireframe cube, or an unambiguous example."""

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Shown = Annotated[float, Field(ge=1, le=600, description="a number of seconds from 1 to 600")]


@dataclass(frozen=True, slots=True, kw_only=True)
class NeckerTrial(Trial):
    """Trial with a rotating cube.

    Parameters
    ----------
    shape
        "ambiguous" for the wireframe cube; unambiguously "rigid" or "nonrigid" in practice and catch trials.
    gradient, strength
        Interpretation with which the blur is consistent, and its aperture in mm; 0 without a gradient.
    direction
        Direction in which the near side moves.
    trial_s
        Duration of the trial, in s.
    """

    gradient: Gradient
    strength: float
    direction: Direction
    shape: Shape = "ambiguous"
    trial_s: float

    @property
    def condition(self) -> tuple[Hashable, ...]:
        """Object, blur gradient and direction of rotation."""
        return (self.shape, self.gradient, self.strength, self.direction)

    @property
    def is_ambiguous(self) -> bool:
        """True for the wireframe cube, which has no correct percept."""
        return self.shape == "ambiguous"


class NeckerDesign(Plan):
    """Design of experiment 2: (none, and other gradients x strengths) x directions x repetitions.

    Examples
    --------
    >>> design = NeckerDesign()
    >>> sum(trial.trial_s for trial in design.trials("01") if trial.phase == "main") / 60  # minutes
    14.0
    >>> design.keys_of("01"), design.keys_of("03")
    ({'rigid': 'f', 'nonrigid': 'j'}, {'rigid': 'j', 'nonrigid': 'f'})
    """

    task: Literal["necker"] = "necker"
    gradients: Annotated[tuple[Gradient, ...], Field(min_length=1)] = ("none", "rigid", "nonrigid")
    strengths_mm: Annotated[
        tuple[Positive, ...],
        Field(min_length=1, description="a list of positive numbers of millimetres, like [2.0, 4.0]"),
    ] = (2.0, 4.0)
    directions: Annotated[tuple[Direction, ...], Field(min_length=1)] = ("right", "left")
    repetitions: Repetitions = 2
    trial_s: Shown = 40.0
    catch_trials: Count = 1
    practice_trials: UpTo100 = 2
    practice_right: Share = 1.0
    practice_rounds: Rounds = 3
    practice_required: bool = False
    practice_s: Shown = 15.0
    break_every: Breaks = 7
    least_break_s: OrNone = 10.0
    keys: Annotated[Names, Field(description="a list of two keys, like ['f', 'j']")] = ("f", "j")

    size_deg: Annotated[float, Field(gt=0, le=60, description="a number of degrees above 0 and up to 60")] = 8.0
    perspective: Annotated[float, Field(gt=0, lt=2, description="a number above 0, like 0.4")] = 0.4
    distance_m: Annotated[float, Field(gt=0, le=100, description="a positive number of metres, like 0.5")] = 0.5
    tilt_deg: Annotated[float, Field(gt=-90, lt=90, description="a number of degrees between -90 and 90")] = 20.0
    turns_per_s: Annotated[float, Field(gt=0, le=2, description="a number above 0 and up to 2, like 0.125")] = 0.125
    line_width_deg: Annotated[float, Field(gt=0, le=2, description="a number of degrees above 0 and up to 2")] = 0.05

    blank_s: ClassVar[float] = 0.0
    shortened: ClassVar = {
        "repetitions": 1,
        "strengths_mm": 1,
        "directions": 1,
        "catch_trials": 1,
        "trial_s": 5.0,
        "practice_s": 5.0,
        "least_break_s": 1.0,
        "practice_rounds": 1,
    }

    @model_validator(mode="after")
    def _check(self) -> NeckerDesign:
        for key in ("gradients", "strengths_mm", "directions"):
            no_repeats(key, getattr(self, key))
        if len(self.keys) != 2:
            raise ValueError(f"keys names {len(self.keys)}, but must name two: one for rigid, one for nonrigid.")
        if self.keys[0].lower() == self.keys[1].lower():
            raise ValueError(f"keys assigns {self.keys[0]!r} to both percepts: name two different keys.")
        if "escape" in self.keys:
            raise ValueError("keys names 'escape', which ends the experiment: name another key.")
        self.check_counts(len(self._gradings()) * len(self.directions))
        self.trials("01")  # some orders are impossible: raise before the participant arrives
        return self

    def keys_of(self, participant: str) -> dict[str, str]:
        """Return the keys that a participant holds for "rigid" and for "nonrigid".

        Raises
        ------
        InputError
            If the label is not alphanumeric.
        """
        rigid, nonrigid = reversed(self.keys) if self.place(participant).swapped else self.keys
        return {"rigid": rigid, "nonrigid": nonrigid}

    def least_s(self, trial: NeckerTrial) -> float:
        """Return the time in s for which a cube is shown."""
        return trial.trial_s

    def trials(self, participant: str, session: str | None = None) -> tuple[NeckerTrial, ...]:
        """Return the trial list of one participant, practice first.

        Raises
        ------
        InputError
            If a label is not alphanumeric.
        """
        seen = [
            NeckerTrial(gradient=gradient, strength=strength, direction=direction, trial_s=self.trial_s)
            for (gradient, strength), direction in product(self._gradings(), self.directions)
        ]
        blocks = [seen] * self.repetitions
        return self.listed(
            participant,
            session,
            blocks=blocks,
            factors=lambda trial: (trial.gradient, trial.direction),
            catches=self._catches,
            practice=self._practice,
        )

    def _gradings(self) -> list[tuple[Gradient, float]]:
        """Return each gradient with each strength; without a gradient the strength is 0."""
        return [
            (gradient, strength)
            for gradient in self.gradients
            for strength in ((0.0,) if gradient == "none" else self.strengths_mm)
        ]

    def _example(self, shape: Shape, direction: Direction, trial_s: float) -> NeckerTrial:
        return NeckerTrial(gradient="none", strength=0.0, direction=direction, shape=shape, trial_s=trial_s)

    def _catches(self, draws: Draws) -> list[NeckerTrial]:
        """Return catch trials with nonrigid objects."""
        ways = [self.directions[number % len(self.directions)] for number in range(self.catch_trials)]
        return [replace(self._example("nonrigid", way, self.trial_s), catch=True) for way in draws.shuffled(ways)]

    def _practice(self, draws: Draws) -> list[NeckerTrial]:
        """Return practice trials with rigid and nonrigid objects in turn."""
        shapes: tuple[Shape, Shape] = ("rigid", "nonrigid")
        ways = draws.shuffled(self.directions)
        return [
            self._example(shapes[number % 2], ways[number // 2 % len(ways)], self.practice_s)
            for number in range(self.practice_trials)
        ]
