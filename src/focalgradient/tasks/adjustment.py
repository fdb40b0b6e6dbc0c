"""Adjustment trials described as data: pictures controlled by a knob, in the window and in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from focalgradient.errors import InputError

__all__ = ["Adjustment", "Refocused"]


@dataclass(frozen=True, slots=True)
class Refocused:
    """A picture of a focus series, shown at a fixed or adjustable focus.

    Parameters
    ----------
    series
        A `focalgradient.live.FocusSeries`.
    pos
        Centre of the picture, in pixels from the screen's centre, x right and y up.
    focus
        Vergence in focus, in dioptres; None: the value of the knob.
    """

    series: Any
    pos: tuple[float, float] = (0.0, 0.0)
    focus: float | None = None


@dataclass(frozen=True, slots=True)
class Adjustment:
    """Pictures, knob range and question of an adjustment trial.

    Parameters
    ----------
    views
        The two pictures, side by side.
    least, most
        Range of the knob, in dioptres.
    question
        Instruction shown to the participant.
    ratios
        True if the knob is logarithmic (equal turns are equal ratios of the value); else it is linear.

    Raises
    ------
    InputError
        If `least` is not below `most`, or not above 0 on a logarithmic knob.

    Examples
    --------
    >>> Adjustment((Refocused(None),), 0.0, 2.0, "Are both equally blurred?").most
    2.0
    """

    views: Sequence[Refocused]
    least: float
    most: float
    question: str
    ratios: bool = False

    def __post_init__(self) -> None:
        if not (self.least < self.most and (self.least > 0 or not self.ratios)):
            above = ", above 0" if self.ratios else ""
            raise InputError(f"the knob goes from {self.least:g} to {self.most:g}, but must rise{above}.")
