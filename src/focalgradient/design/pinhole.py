"""Pinhole demonstration: monocular depth with and without a pinhole, and through a tube of the same field."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from focalgradient.design.depth_rating import aperture_mm
from focalgradient.design.plan import Asked, Plan, Repetitions, Scenes, Seconds, Trial, no_repeats
from focalgradient.scales import Ratio

__all__ = ["Form", "Pinhole", "PinholeTrial", "Viewing"]

Form = Literal["real", "picture"]
"""Stimulus: the real world, or pictures of it on the screen."""

Viewing = Literal["pinhole", "natural", "tube"]
"""Viewing condition: through a pinhole, freely, or through a tube with the pinhole's field of view."""

Without = Annotated[Literal[0], Field(description="0: the demonstration has none")]


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeTrial(Trial):
    """Trial with one look at a scene or picture.

    Parameters
    ----------
    form, viewing
        Stimulus, and viewing condition.
    scene
        Scene of a picture; "room" for the real world.
    """

    form: Form
    viewing: Viewing
    scene: str


class Pinhole(Plan):
    """Design of the demonstration: real world, then pictures (reversed for the other participant of a pair).

    Examples
    --------
    >>> [trial.viewing for trial in Pinhole(forms=["real"], repetitions=1).trials("01")]
    ['tube', 'pinhole', 'natural']
    """

    task: Literal["pinhole"] = "pinhole"
    ask: Asked = ("age", "sex", "handedness", "eye")
    forms: Annotated[tuple[Form, ...], Field(min_length=1)] = ("real", "picture")
    viewings: Annotated[tuple[Viewing, ...], Field(min_length=1)] = ("pinhole", "natural", "tube")
    scenes: Scenes = ("spheres-01", "spheres-02")
    natural_aperture: Annotated[str, Field(description="an f-number like 'f/5.6'")] = "f/5.6"
    field_deg: Annotated[float, Field(gt=0, le=90, description="a number of degrees above 0 and up to 90")] = 10.0
    repetitions: Repetitions = 2
    longest_run: Annotated[int, Field(ge=1)] = 1
    catch_trials: Without = 0
    practice_trials: Without = 0
    look_s: Seconds = 10.0
    picture_s: Seconds = 5.0
    least_rating: Annotated[float, Field(gt=0, lt=1, description="a number between 0 and 1, like 0.25")] = 0.25
    most_rating: Annotated[float, Field(gt=1, le=1000, description="a number above 1, like 4.0")] = 4.0

    blank_s: ClassVar[float] = 0.0
    closed: ClassVar = ("form", "viewing", "scene")
    shortened: ClassVar = {"repetitions": 1, "scenes": 1, "look_s": 2.0, "picture_s": 2.0}

    @model_validator(mode="after")
    def _check(self) -> Pinhole:
        for key in ("forms", "viewings", "scenes"):
            no_repeats(key, getattr(self, key))
        if aperture_mm(self.natural_aperture, 1.0) == 0:
            raise ValueError("natural_aperture is 'pinhole', but must be an f-number: give one.")
        self.check_counts(len(self.viewings) * (("real" in self.forms) + ("picture" in self.forms) * len(self.scenes)))
        self.trials("01")
        return self

    @property
    def response_scale(self) -> Ratio:
        """Scale of ratios to the view through the pinhole."""
        return Ratio(self.least_rating, self.most_rating)

    @property
    def shown_s(self) -> float:
        """Time in s from the onset of a picture to the question."""
        return self.picture_s

    def trials(self, participant: str, session: str | None = None) -> tuple[PinholeTrial, ...]:
        """Return the trial list of one participant.

        Raises
        ------
        InputError
            If a label is not alphanumeric.
        """
        places = {"real": ("room",), "picture": self.scenes}
        blocks = [
            [
                PinholeTrial(form=form, viewing=viewing, scene=scene)
                for viewing, scene in product(self.viewings, places[form])
            ]
            for form in self.forms
            for _ in range(self.repetitions)
        ]
        return self.listed(participant, session, blocks=blocks, factors=lambda trial: (trial.viewing,))
