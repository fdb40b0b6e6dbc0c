"""Answer of a trial of a described task."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

from focalgradient.errors import InputError, check_fields
from focalgradient.tasks.noted import Noted, OpenRecord, plain

__all__ = ["Response"]


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

    onset: float
    response_time: float
    dropped_frames: int = 0
    extra: Mapping[str, Noted] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        for one in dataclasses.fields(self):
            object.__setattr__(self, one.name, plain(getattr(self, one.name)))
        check_fields(self)
        for name in ("onset", "response_time"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"{name} is {value!r}, but must be a finite number of 0 or more.")
