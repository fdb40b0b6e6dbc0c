"""Parts of a trial that a task describes as data, for the window and the browser."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLANK_S", "Interval", "Step", "pauses"]

BLANK_S = 0.3
"""Duration in seconds of the blank screen before the question, in tasks whose trials are described as data (our
choice).
"""

Interval = tuple[NDArray[np.uint8], float]
"""Picture (H x W x 3, 8 bits) and its duration in seconds."""


@dataclass(frozen=True, slots=True)
class Step:
    """A picture of a trial, with the fixation mark before it.

    Parameters
    ----------
    picture
        8-bit values, H x W or H x W x 3; or a `focalgradient.stimuli.Picture` of the set.
    seconds
        Duration of the picture, in s.
    event
        Name of its event: "picture", or "reference" for the picture to compare it with.
    mark
        Position of the mark in pixels of the picture, from its upper left corner, x right and y down; None: no mark.
    mark_s
        Duration of the mark before the picture, in s.
    mark_kept
        Whether the mark stays on the picture.
    mask
        Picture that replaces it, without a gap; None: no mask.
    mask_s
        Duration of the mask, in s.
    judged
        False for a picture shown before the judged one, to whose onset the answer's does not refer.

    Examples
    --------
    >>> Step(np.zeros((2, 2), np.uint8), 0.5).event
    'picture'
    """

    picture: Any
    seconds: float
    event: str = "picture"
    mark: tuple[float, float] | None = None
    mark_s: float = 0.0
    mark_kept: bool = False
    mask: NDArray[np.uint8] | None = None
    mask_s: float = 0.0
    judged: bool = True


def pauses(design: Any) -> tuple[float, float]:
    """Return the durations in s of the pause before a trial and of the blank screen after each of its pictures.

    They are `pause_s` and `blank_s` of a design that states them, else 0 and `BLANK_S`.
    """
    return getattr(design, "pause_s", 0.0), getattr(design, "blank_s", BLANK_S)
