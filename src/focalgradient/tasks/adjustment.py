"""An adjustment described as data: pictures that follow a knob, for the window and the browser alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from focalgradient.errors import InputError

__all__ = ["Adjustment", "Refocused"]


@dataclass(frozen=True, slots=True)
class Refocused:
    """A picture at a focus.

    Parameters
    ----------
    series
        A `focalgradient.live.FocusSeries`.
    pos
        Of its middle, in pixels from the middle of the screen, x right and y up.
    focus
        In dioptres; None: the value of the knob.
    """

    series: Any
    pos: tuple[float, float] = (0.0, 0.0)
    focus: float | None = None


@dataclass(frozen=True, slots=True)
class Adjustment:
    """What a trial asks to be set.

    Parameters
    ----------
    views
        The two pictures, side by side.
    least, most
        Ends of the knob, in dioptres.
    question
        What is to be set.
    ratios
        Whether equal turns are equal ratios of the value; else equal differences.

    Raises
    ------
    InputError
        If the ends do not rise, or ratios are of what is not above 0.

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
