"""Parts of a trial that a task describes as data, and their readers for the window and the browser."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.scales import Control, Held, OwnControl

if TYPE_CHECKING:
    from focalgradient.tasks.base import Task

__all__ = [
    "BLANK_S",
    "LEAST_RIGHT",
    "Interval",
    "Look",
    "Pictured",
    "Step",
    "control_of",
    "files_of",
    "intervals_of",
    "judged",
    "judged_round",
    "pauses",
    "steps_of",
    "stimulus_of",
]

BLANK_S = 0.3
"""Duration in seconds of the blank screen before the question, in tasks whose trials are described as data (our
choice).
"""

LEAST_RIGHT = 0.5
"""Minimum share of a correct practice answer (our choice)."""

Interval = tuple[NDArray[np.uint8], float]
"""Picture (H x W x 3, 8 bits) and its duration in seconds."""

Pictured = tuple[str, str, str, Mapping[str, str]]
"""Picture of a set: scene, aperture, fixation, and levels of the design's factors."""


@dataclass(frozen=True, slots=True)
class Look:
    """Look at the real world, instead of a picture; a tone and a white screen end it.

    Parameters
    ----------
    page
        Text of the page before it, with its title as the first line.
    foot
        How to begin, below that page in the window.
    text
        Text on the screen meanwhile.
    """

    page: str
    foot: str
    text: str


@dataclass(frozen=True, slots=True)
class Step:
    """A picture of a trial, with the fixation mark before it.

    Parameters
    ----------
    picture
        8-bit values, H x W or H x W x 3; a `focalgradient.stimuli.Picture` of the set; a `Look`; or an iterator of
        8-bit values, the frames of a film, shown at one frame per refresh of the display, over and over.
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


def intervals_of(task: Task, design: Any, trial: Any, pixels_per_degree: float, **known: Any) -> list[Interval | Step]:
    """Return what `shown` gives for a trial, as a list also for a single interval; `known`: parameters it may have."""
    assert task.shown is not None
    shown = _passing(task.shown, design, trial, pixels_per_degree, **known)
    single = isinstance(shown, Step) or (isinstance(shown, tuple) and not isinstance(shown[0], tuple | Step))
    return [shown] if single else [*shown]


def steps_of(task: Task, design: Any, trial: Any, pixels_per_degree: float, **known: Any) -> list[Step]:
    """Return the steps of a trial; `known`: values of the parameters that `shown` may have."""
    shown = intervals_of(task, design, trial, pixels_per_degree, **known)
    return [one if isinstance(one, Step) else Step(*one) for one in shown]


def control_of(task: Task, design: Any, words: Any, trial: Any, participant: str) -> Control | Held | OwnControl:
    """Return the control on which a participant answers a trial."""
    assert task.control is not None
    control: Control | Held | OwnControl = _passing(task.control, words, trial, design=design, participant=participant)
    return control


def files_of(task: Task, design: Any, trial: Any, stimuli: Any) -> dict[str, str]:
    """Return the files of the set that a trial shows, by column: "picture", "reference"; empty without a set."""
    if stimuli is None or task.pictured is None:
        return {}
    shown = task.pictured(design, trial).items()
    return {column: stimuli.picture(*key).png for column, key in shown if stimuli.drawing(key[0]) is None}


def stimulus_of(task: Task, design: Any, trial: Any, stimuli: Any) -> dict[str, str]:
    """Return the keyword `stimulus` of `Task.answered`: the file of the trial's picture; empty without one."""
    file = files_of(task, design, trial, stimuli).get("picture")
    return {} if file is None else {"stimulus": file}


def judged(task: Task, design: Any, trial: Any, answer: Any, participant: str) -> tuple[bool | None, float | None]:
    """Return whether a practice answer is correct, and for which share of the trial, if keys were held."""
    if task.right is None:
        return None, None
    right = _passing(task.right, design, trial, answer, participant=participant)
    return (right, None) if right is None or isinstance(right, bool) else (right >= LEAST_RIGHT, right)


def judged_round(design: Any, right: Sequence[bool | None]) -> dict[str, Any]:
    """Return the result of a round of practice: how many of those that have a correct answer are "right", and "passed".

    >>> judged_round(None, [True, None, False])
    {'right': 1, 'of': 2, 'passed': True}
    """
    known = [one for one in right if one is not None]
    passed = sum(known) >= getattr(design, "practice_right", 0.0) * len(known)
    return {"right": sum(known), "of": len(known), "passed": passed}


def _passing(method: Callable[..., Any], *given: Any, **known: Any) -> Any:
    """Call a method with those of the known values for which it has a parameter."""
    names = inspect.signature(method).parameters
    return method(*given, **{name: value for name, value in known.items() if name in names})
