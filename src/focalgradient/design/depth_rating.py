"""Experiment 1: how three-dimensional a picture looks, by its aperture and by what is fixated."""

from __future__ import annotations

import re
from collections.abc import Hashable
from dataclasses import dataclass, replace
from itertools import product
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from focalgradient.design.draws import Draws
from focalgradient.design.plan import Names, Plan, Seconds, Trial, no_repeats
from focalgradient.errors import InputError

__all__ = ["DepthRatingDesign", "DepthTrial", "Fixation", "aperture_mm"]

Fixation = Literal["nearest", "farthest"]
"""Which object of the scene is fixated, and in focus."""

F_NUMBER = re.compile(r"f/(\d+(?:\.\d+)?)")


def aperture_mm(aperture: str, focal_length_mm: float) -> float:
    """Diameter of an aperture in millimetres: 0 for a pinhole, focal length / N for f/N.

    Raises
    ------
    InputError
        If it is neither "pinhole" nor an f-number.

    Examples
    --------
    >>> aperture_mm("f/5.6", 28), aperture_mm("pinhole", 28)
    (5.0, 0.0)
    """
    if aperture == "pinhole":
        return 0.0
    found = F_NUMBER.fullmatch(aperture)
    if not (found and float(found[1]) > 0):
        raise InputError(f"aperture is {aperture!r}, but must be 'pinhole' or an f-number like 'f/5.6'.")
    return focal_length_mm / float(found[1])


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthTrial(Trial):
    """A picture to be judged.

    Parameters
    ----------
    scene, aperture, fixation
        The picture, and the object that is fixated and in focus.
    aperture_mm
        Diameter of the aperture in millimetres, 0 for the pinhole.
    standard_before
        Whether the standard, the pinhole picture that counts as 1, is shown again before it.
    """

    scene: str
    aperture: str
    aperture_mm: float
    fixation: Fixation
    standard_before: bool = False

    @property
    def condition(self) -> tuple[Hashable, ...]:
        """The picture and what is fixated."""
        return (self.scene, self.aperture, self.fixation)


class DepthRatingDesign(Plan):
    """The design of experiment 1: apertures x fixations x scenes x repetitions.

    Examples
    --------
    >>> design = DepthRatingDesign()
    >>> trials = design.trials("01")
    >>> len(trials), [trial.phase for trial in trials].count("practice")
    (202, 6)
    """

    task: Literal["depthrating"] = "depthrating"
    apertures: Annotated[Names, Field(description="a list of 'pinhole' and f-numbers, like ['pinhole', 'f/22']")] = (
        "pinhole",
        "f/22",
        "f/11",
        "f/5.6",
    )
    focal_length_mm: Annotated[float, Field(gt=0, le=1000, description="a positive number of millimetres")] = 50.0
    fixations: Annotated[
        tuple[Fixation, ...], Field(strict=False, min_length=1, description="a list of 'nearest' and 'farthest'")
    ] = ("nearest", "farthest")
    fixation_order: Annotated[Literal["mixed", "blocked"], Field(description="'mixed' or 'blocked'")] = "mixed"
    scenes: Annotated[Names, Field(description="a list of names of scenes, like ['spheres-01']")] = tuple(
        f"spheres-{number:02}" for number in range(1, 13)
    )
    standard_scene: Annotated[str, Field(min_length=1, description="the name of a scene")] = "spheres-00"
    standard_every: Annotated[int, Field(ge=0, description="a whole number of trials, or 0 for once only")] = 16
    repetitions: Annotated[int, Field(ge=1, le=100, description="a whole number from 1 to 100")] = 2
    catch_trials: Annotated[int, Field(ge=0, description="a whole number of 0 or more")] = 4
    practice_trials: Annotated[int, Field(ge=0, le=100, description="a whole number from 0 to 100")] = 6
    break_every: Annotated[int, Field(ge=0, description="a whole number of trials, or 0 for no breaks")] = 49

    mark_s: Seconds = 1.0
    mark: Annotated[Literal["removed", "kept"], Field(description="'removed' or 'kept'")] = "removed"
    picture_s: Seconds = 3.0
    standard_s: Seconds = 5.0
    answer: Annotated[Literal["slider", "typed"], Field(description="'slider' or 'typed'")] = "slider"
    least_rating: Annotated[float, Field(gt=0, lt=1, description="a number between 0 and 1, like 0.25")] = 0.25
    most_rating: Annotated[float, Field(gt=1, le=1000, description="a number above 1, like 4.0")] = 4.0
    confidence: Annotated[bool, Field(description="true or false")] = False

    shortened: ClassVar = {"repetitions": 1, "scenes": 1, "catch_trials": 1, "practice_trials": 1, "picture_s": 1.0}

    @model_validator(mode="after")
    def _check(self) -> DepthRatingDesign:
        for key in ("apertures", "fixations", "scenes"):
            no_repeats(key, getattr(self, key))
        for aperture in self.apertures:
            aperture_mm(aperture, self.focal_length_mm)
        self.check_counts(len(self.apertures) * len(self.fixations) * len(self.scenes))
        self.trials("01")  # some orders are impossible: say so before the participant has come
        return self

    def trials(self, participant: str, session: str | None = None) -> tuple[DepthTrial, ...]:
        """Make the list of one participant: practice first, then all else.

        Raises
        ------
        InputError
            If a label is not alphanumeric.
        """
        seen = [
            self._trial(scene, aperture, fixation)
            for scene, aperture, fixation in product(self.scenes, self.apertures, self.fixations)
        ]
        blocks = [seen] * self.repetitions
        if self.fixation_order == "blocked":
            first = self.draws(participant, session, "first fixation").shuffled(self.fixations)
            parts = [[trial for trial in seen if trial.fixation == fixation] for fixation in first]
            blocks = parts * self.repetitions
        listed = self.listed(
            participant,
            session,
            blocks=blocks,
            factors=lambda trial: trial.condition if self.fixation_order == "mixed" else trial.condition[:2],
            catches=self._catches,
            practice=self._practice,
        )
        return tuple(
            replace(trial, standard_before=True)
            if trial.phase == "main" and (trial.trial == 1 or self._again(trial.trial))
            else trial
            for trial in listed
        )

    def _again(self, number: int) -> bool:
        return bool(self.standard_every and (number - 1) % self.standard_every == 0)

    def _trial(self, scene: str, aperture: str, fixation: Fixation) -> DepthTrial:
        diameter = aperture_mm(aperture, self.focal_length_mm)
        return DepthTrial(scene=scene, aperture=aperture, aperture_mm=diameter, fixation=fixation)

    def _catches(self, draws: Draws) -> list[DepthTrial]:
        """Trials that show the standard itself, whose answer is 1."""
        ways = [self.fixations[number % len(self.fixations)] for number in range(self.catch_trials)]
        return [
            replace(self._trial(self.standard_scene, "pinhole", fixation), catch=True)
            for fixation in draws.shuffled(ways)
        ]

    def _practice(self, draws: Draws) -> list[DepthTrial]:
        """Every aperture and fixation as evenly as the number allows, in the scene of the standard."""
        pairs: list[tuple[str, Fixation]] = []
        while len(pairs) < self.practice_trials:
            pairs += draws.shuffled(product(self.apertures, self.fixations))
        return [self._trial(self.standard_scene, *pair) for pair in pairs[: self.practice_trials]]
