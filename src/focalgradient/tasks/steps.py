"""Parts of a trial that a task describes as data, for the window and the browser."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Interval", "Step"]

Interval = tuple[NDArray[np.uint8], float]
"""Picture (H x W x 3, 8 bits) and its duration in seconds."""


@dataclass(frozen=True, slots=True)
class Step:
    """A picture of a trial, with the fixation mark before it.

    Parameters
    ----------
    picture
        8-bit values, H x W or H x W x 3.
    seconds
        Duration of the picture, in s.
    event
        Name of its event: "picture", or "reference" for the picture to compare it with.
    mark
        Position of the mark in pixels of the picture, from its upper left corner, x right and y down; None: no mark.
    mark_s
        Duration of the mark before the picture, in s.

    Examples
    --------
    >>> Step(np.zeros((2, 2), np.uint8), 0.5).event
    'picture'
    """

    picture: NDArray[np.uint8]
    seconds: float
    event: str = "picture"
    mark: tuple[float, float] | None = None
    mark_s: float = 0.0
