"""Who observes: the few numbers that make an observer, and observers by name."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from focalgradient.errors import InputError

__all__ = ["OBSERVERS", "Observer", "Prior", "observer_named"]

Prior = Literal[-1, 0, 1]

SCALES = 0.25
"""Standard deviation, from person to person, of the logarithm of the exponent from perception to rating."""

RATES = 0.4
"""The same of how long percepts last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """An observer. docs/observers.md says where each number comes from.

    Parameters
    ----------
    prior
        What more blur means: 1 farther, -1 nearer; 0 where blur means nothing, as to who is blind to it.
    discounts
        Whether a cue is discounted where it contradicts the layout's order in depth.
    guesses
        Whether all is answered without looking.
    lapses
        Share of trials that are.
    pupil
        Diameter in metres of the pupil that blur is put down to.
    weber
        Share by which blur must exceed that of the fixated object to be seen, and by which what is seen errs.
    intrinsic
        Blur in minutes of arc that is added behind the optics of the eye.
    layout_spread
        Uncertainty of how deep the scene's layout makes it, as a share.
    layout_noise
        Error of the layout's depth at single places, as a share of the spread over all.
    flatness
        How surely the display is seen to be flat: standard deviation in dioptres.
    rigidity
        Log odds against a reading for each unit of its departure from rigid.
    dominance
        Mean seconds that a percept lasts where both readings have equal odds.
    regularity
        Shape of the gamma distribution of these times.
    scale
        Exponent from the ratio that is perceived to the rating.
    scatter
        Standard deviation of the logarithm of repeated ratings.
    """

    prior: Prior = 1
    discounts: bool = True
    guesses: bool = False
    lapses: float = 0.01
    pupil: float = 0.004
    weber: float = 0.4
    intrinsic: float = 0.5
    layout_spread: float = 0.8
    layout_noise: float = 0.2
    flatness: float = 0.17
    rigidity: float = 6.0
    dominance: float = 5.0
    regularity: float = 3.5
    scale: float = 1.0
    scatter: float = 0.15

    def person(self, random: np.random.Generator) -> Observer:
        """One of the people whom this observer stands for, with a scale and a pace of its own."""
        scale, pace = random.standard_normal(2)
        return replace(
            self, scale=self.scale * math.exp(SCALES * scale), dominance=self.dominance * math.exp(RATES * pace)
        )


OBSERVERS: dict[str, Observer] = {
    "default": Observer(),
    "blind": Observer(prior=0),
    "opposite": Observer(prior=-1),
    "guessing": Observer(guesses=True),
    "lapsing": Observer(lapses=0.15),
}
"""The observer that is the hypothesis, and controls that it must be told from."""


def observer_named(name: str) -> Observer:
    """The observer of that name.

    Raises
    ------
    InputError
        If there is none.

    Examples
    --------
    >>> observer_named("blind").prior
    0
    """
    if name not in OBSERVERS:
        raise InputError(f"observer is {name!r}, but must be one of {', '.join(OBSERVERS)}.")
    return OBSERVERS[name]
