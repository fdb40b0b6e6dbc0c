"""Kruger, Mathews, Aggarwala and Sanchez (1993): an eye follows a target that moves as a sine, in several lights."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from focalgradient.eye import Accommodation, Stimulus, accommodate

__all__ = ["LIGHTS", "Followed", "follow"]

LIGHTS: Mapping[str, Stimulus] = {
    "white": Stimulus(illuminant="3000 K"),
    "monochromatic": Stimulus(light_nm=590.0, illuminant="3000 K"),
    "neutralised": Stimulus(chromatic_scale=0.0, illuminant="3000 K"),
    "reversed": Stimulus(chromatic_scale=-1.0, illuminant="3000 K"),
}
"""Their lights and aberrations."""

HERTZ, MEAN, AMPLITUDE = 0.2, 2.0, 0.5
"""Frequency (Hz), mean and amplitude (D) of their target, which moves from 1.5 to 2.5 D."""

SKIPPED = 1.0
"""Seconds at the start of a trial that are not analysed; our choice."""


@dataclass(frozen=True, slots=True)
class Followed:
    """How an eye followed the target.

    Parameters
    ----------
    response
        Accommodation over the target at its frequency: gain as modulus and phase as angle.
    focus, error
        Mean focus, and root mean square error of focus, in dioptres.
    """

    response: complex
    focus: float
    error: float


def _target(way: int, time: float) -> float:
    return MEAN + way * AMPLITUDE * math.sin(2 * math.pi * HERTZ * time)


def follow(eye: Accommodation, light: Stimulus, seconds: float, seed: int) -> Followed:
    """Let an eye follow the target for so many seconds, in two trials in which it moves the opposite ways.

    The response is that of half the difference of both trials, for fluctuations to cancel; mean and error are of both.

    >>> found = follow(Accommodation(pupil_diameter=0.004), LIGHTS["white"], 6.0, seed=0)
    >>> bool(0.5 < abs(found.response) < 1.2), bool(abs(found.focus - MEAN) < 0.5)
    (True, True)
    """
    there, back = (accommodate(partial(_target, way), seconds, eye, light, seed=seed) for way in (1, -1))
    halves = {name: (getattr(there, name) - getattr(back, name)) / 2 for name in ("target", "accommodation")}
    late = there.times >= SKIPPED
    focus = np.concatenate([there.accommodation[late], back.accommodation[late]])
    error = focus - np.concatenate([there.target[late], back.target[late]])
    response = replace(there, **halves).response(HERTZ, skip=SKIPPED)
    return Followed(response, float(focus.mean()), float(np.sqrt(np.mean(error**2))))
