"""Who observes: the few numbers that make an observer, and observers by name."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError

if TYPE_CHECKING:
    from focalgradient.observers.questions import Question

Answered = TypeVar("Answered")

__all__ = ["CATEGORIES", "OBSERVERS", "Observer", "Sign", "observer_named"]

Sign = Literal["prior", "trust", "layout"]
"""How depth by blur meets the layout: what goes with it counts; all, if most goes with it; or in the layout's order."""

CATEGORIES = 7
"""Of an ordinal scale of ratings."""

WEBERS = 0.2
"""Standard deviation over people of the logarithm of the Weber fraction: that of a uniform one between log 0.28 and
log 0.56 (Mather & Smith 2002, the range of their thresholds)."""

LAYOUTS = 0.35
"""The same of the layout's uncertainty, and of the relief that people see in one picture: about a factor of 2 between
observers (the kind of difference: Koenderink, van Doorn, Kappers & Todd 2001; the number is our choice)."""

PRIORS = 0.4
"""Standard deviation over people of the prior. No published figure was found: our choice."""

DISCOUNTS = 0.15
"""Standard deviation of the half-normal share that people leave undiscounted. No published figure was found: ours."""

EXPONENTS = 0.25
"""Standard deviation over people of the logarithm of the exponent from perception to rating; our choice."""

DURATIONS, DURATION_SPREADS, PREFERENCES = 0.54, 0.17, 0.26
"""Standard deviations over people of the logarithms of the mean duration of percepts and of its spread, and of the
log odds by which a person prefers one reading: fitted with `dominance`, see there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """An observer. docs/observers.md says where each number comes from.

    Parameters
    ----------
    prior
        What more blur means: from 1, farther, to -1, nearer; 0 where blur means nothing. Between them it is the
        difference of the two probabilities.
    defocus
        Probability that blur is of defocus, and not of the texture itself; our choice.
    sign
        How depth by blur meets the layout.
    discounting
        Share of the blur contradicting the layout's order that is discounted, 0 to 1.
    guesses
        Whether all is answered without looking.
    lapses
        Share of trials that are.
    pupil
        Diameter in metres of the pupil that blur is put down to.
    weber
        Weber fraction of blur: by what share it must exceed that of the fixated object, and its depth errs.
    intrinsic
        Blur in minutes of arc that is added behind the optics of the eye.
    layout_spread
        Standard deviation of the logarithm of the amplitude of relief that the layout leaves open.
    layout_gain
        Amplitude by the layout over the scene's own.
    layout_noise
        Error of the layout's depth at single places, as a share of the spread over all.
    layout_error
        Standard deviation in dioptres of depth at places that a layout leaves open, a flat one too; our choice.
    flatness
        How surely the display is seen to be flat: standard deviation in dioptres.
    stereo
        Just noticeable difference of disparity in minutes of arc, right in 75 % of two alternatives: 20 seconds, as
        most people pass (Coutant & Westheimer 1993).
    interocular
        Metres between the eyes.
    rigidity
        Log odds against a reading for each unit of its departure from rigid.
    dominance
        Mean seconds that a percept lasts where both readings have equal odds.
    duration_spread
        Standard deviation of the logarithm of these times, given the percept before.
    serial
        Correlation of a percept's log duration with that of the percept before it. The three were fitted to 22 people
        who watched an ambiguous Necker lattice (A. Pastukhov, Correlated switching rate in kinetic-depth effect
        displays, CC-BY 4.0; percepts of at least 0.3 s, the ends of blocks censored) by
        `focalgradient.statistics.fit_dominance`, blocks taken as alike: geometric mean of medians 3.82 s (standard
        error of its logarithm .12), so a mean of 5.2 s; spread .77 (.04), serial correlation .24 (.03).
    preference
        Log odds of the rigid reading beyond what the picture gives.
    scale
        Exponent from the ratio that is perceived to the rating.
    scatter
        Standard deviation of the logarithm of repeated ratings.
    categories
        How many steps the scale of ratings has; 0 where ratings are ratios.
    """

    prior: float = 0.8
    defocus: float = 0.9
    sign: Sign = "prior"
    discounting: float = 1.0
    guesses: bool = False
    lapses: float = 0.01
    pupil: float = 0.004
    weber: float = 0.4
    intrinsic: float = 0.5
    layout_spread: float = 0.8
    layout_gain: float = 1.0
    layout_noise: float = 0.2
    layout_error: float = 0.1
    flatness: float = 0.17
    stereo: float = 0.33
    interocular: float = 0.063
    rigidity: float = 6.0
    dominance: float = 5.2
    duration_spread: float = 0.77
    serial: float = 0.24
    preference: float = 0.0
    scale: float = 1.0
    scatter: float = 0.15
    categories: int = 0

    def look(self, light: NDArray[np.float64], display: Display, question: Question[Answered]) -> Answered:
        """Answer a question about a picture, from its pixels and the display alone.

        Parameters
        ----------
        light
            Linear luminance in shares of white, H x W; at least 64 pixels along each side.
        display
            That shows it: its pixels per degree.
        question
            `DepthOrder`, `FigureGround`, `BlurDiscrimination`, `DistanceOfFixated`, `DepthExtent`, `DepthRating` or
            `Slant`.

        Raises
        ------
        InputError
            If the picture is too small, or a region is not a mask of its shape or too small.

        Examples
        --------
        A blurred border beside a blurred texture: the blurred side is in front, against the prior.

        >>> from focalgradient.observers import DepthOrder
        >>> from focalgradient.stimuli import texture_border
        >>> ppd = Display().pixels_per_degree
        >>> look = {"right_blur_arcmin": 4, "pixels_per_degree": ppd, "width_deg": 8, "height_deg": 8}
        >>> for blur in (0, 4):
        ...     drawn = texture_border(border_blur_arcmin=blur, border="straight", **look)
        ...     order = DepthOrder(drawn.masks["left"], drawn.masks["right"])
        ...     print(Observer().look(drawn.picture, Display(), order).likeliest)
        first
        second
        """
        return question.answer(light, display, self)

    def person(self, random: np.random.Generator) -> Observer:
        """One of the people whom this observer stands for; a control without a prior, or with the other, stays one."""
        scale, pace, weber, spread, gain, prior, discounting, lasting, preference = random.standard_normal(9)
        return replace(
            self,
            scale=self.scale * math.exp(EXPONENTS * scale),
            dominance=self.dominance * math.exp(DURATIONS * pace),
            duration_spread=self.duration_spread * math.exp(DURATION_SPREADS * lasting),
            preference=self.preference + PREFERENCES * preference,
            weber=self.weber * math.exp(WEBERS * weber),
            layout_spread=self.layout_spread * math.exp(LAYOUTS * spread),
            layout_gain=self.layout_gain * math.exp(LAYOUTS * gain),
            prior=min(max(self.prior + PRIORS * prior, -1.0), 1.0) if self.prior else 0.0,
            discounting=max(self.discounting - DISCOUNTS * abs(discounting), 0.0),
        )


OBSERVERS: dict[str, Observer] = {
    "default": Observer(),
    "blur-blind": Observer(prior=0.0, defocus=0.0),
    "opposite": Observer(prior=-0.8),
    "guessing": Observer(guesses=True),
    "lapsing": Observer(lapses=0.15),
    "ordinal": Observer(categories=CATEGORIES),
}
"""The observer that is the hypothesis, controls that it must be distinguished from, and one who rates by categories."""

FORMER_NAMES = {"blind": "blur-blind"}


def observer_named(name: str) -> Observer:
    """The observer of that name.

    Raises
    ------
    InputError
        If there is none.

    Examples
    --------
    >>> observer_named("blur-blind").prior
    0.0
    """
    name = FORMER_NAMES.get(name, name)
    if name not in OBSERVERS:
        raise InputError(f"observer is {name!r}, but must be one of {', '.join(OBSERVERS)}.")
    return OBSERVERS[name]
