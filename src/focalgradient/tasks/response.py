"""Answer of a trial of a described task."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from focalgradient.errors import InputError, check_fields
from focalgradient.quantities import Range
from focalgradient.tasks.noted import Noted, OpenRecord, plain

__all__ = ["Response", "check_rating"]

ROUNDING = 1e-6
"""Rounding tolerance of a position on a scale."""


SECONDS = Range("seconds", 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Response(metaclass=OpenRecord):
    """Answer of a trial; a custom task subclasses it, and the added fields become columns.

    The metadata of a field may contain the sidecar entries "about", "units", "levels", "least" and "most". Keywords
    that name no field are stored in `extra`, and also become columns.

    Parameters
    ----------
    onset
        Time of stimulus onset, in seconds on the clock of the sitting.
    response_time
        Time from the question to the answer, in seconds.
    dropped_frames
        Number of late frames during the trial.
    extra
        Additional values by name, each a `Noted` or a plain value.

    Raises
    ------
    InputError
        If a value does not match the type of its field, or a time is negative or not finite.
    """

    onset: Annotated[float, SECONDS]
    response_time: Annotated[float, SECONDS]
    dropped_frames: int = 0
    extra: Mapping[str, Noted] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        for one in dataclasses.fields(self):
            object.__setattr__(self, one.name, plain(getattr(self, one.name)))
        check_fields(self)


def check_rating(design: Any, answer: Any) -> None:
    """Raise `InputError` for a rating, start or confidence outside its scale, or gaze that contradicts the design."""
    scale = design.response_scale
    least, most = scale.bounds
    if not scale.is_answer(answer.rating):
        wrong = scale.off if least <= answer.rating <= most else f"goes from {least:g} to {most:g}"
        raise InputError(f"rating is {answer.rating:g}, but the scale of the design {wrong}: give one of its answers.")
    if answer.start is not None and not least - ROUNDING <= answer.start <= most + ROUNDING:
        raise InputError(f"start is {answer.start:g}, but the scale of the design goes from {least:g} to {most:g}.")
    if answer.confidence is not None and not getattr(design, "confidence", False):
        raise InputError(f"confidence is {answer.confidence:g}, but the design does not ask for it: leave it out.")
    gaze = getattr(design, "gaze", "none")
    if (gaze != "none") is not (answer.gaze_left is not None):
        raise InputError(f"gaze_left is {answer.gaze_left}, but gaze is {gaze!r} in the design: correct it.")
    if gaze == "none" and answer.gaze_away is not None:
        raise InputError(f"gaze_away is {answer.gaze_away:g}, but gaze is {gaze!r} in the design: leave it out.")
    left = answer.gaze_away is None or answer.gaze_away > getattr(design, "gaze_within_deg", 0.0)
    if answer.gaze_left is not None and answer.gaze_left is not left:
        raise InputError(
            f"gaze_left is {answer.gaze_left}, but gaze_away is {answer.gaze_away} and the design allows "
            f"{design.gaze_within_deg:g} degrees."
        )
