"""Parameters of simulated observers, and observers by name."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import check_one_of

if TYPE_CHECKING:
    from focalgradient.observers.questions import Question

Answered = TypeVar("Answered")

__all__ = ["CATEGORIES", "OBSERVERS", "Observer", "Sign", "observer_named"]

Sign = Literal["prior", "trust", "layout"]
"""Use of depth from blur along the layout: "prior", its component along the layout, discounted if negative; "trust",
its full amplitude with the sign of that component; "layout", the absolute value of that component.
"""

CATEGORIES = 7
"""Number of steps of the ordinal rating scale."""

WEBER_LOG_SD = 0.2
"""SD over people of the log Weber fraction: that of a uniform distribution between log 0.28 and log 0.56, the range of
thresholds in Mather & Smith (2002).
"""

LAYOUT_LOG_SD = 0.35
"""SD over people of the logarithm of the layout's uncertainty, and of the perceived relief of a picture: a factor of
about 2 between observers (kind of difference: Koenderink, van Doorn, Kappers & Todd 2001; size: our choice).
"""

PRIOR_SD = 0.4
"""SD over people of the prior (our choice; no published value was found)."""

UNDISCOUNTED_SD = 0.15
"""SD of the half-normal fraction of contradicting blur that people do not discount (our choice; no published value)."""

EXPONENT_LOG_SD = 0.25
"""SD over people of the logarithm of the exponent from perception to rating (our choice)."""

DURATIONS, DURATION_SPREADS, PREFERENCES = 0.54, 0.17, 0.26
"""SDs over people of the logarithms of the mean duration and of the spread of percepts, and of the log odds of the
preferred reading: fitted together with `Observer.dominance`.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observer:
    """Parameters of a simulated observer; docs/report/observers.md states their sources.

    Parameters
    ----------
    prior
        Interpretation of more blur: from 1 (farther) to -1 (nearer), 0: uninformative. It is the difference between the
        probabilities of farther and nearer.
    defocus
        Probability that blur is due to defocus rather than to the texture itself (our choice).
    sign
        Combination of depth from blur with the layout.
    discounting
        Fraction (0 to 1) of the blur contradicting the layout's order that is discounted.
    guesses
        True if all answers are given without looking.
    lapses
        Lapse rate.
    pupil
        Diameter in metres of the pupil to which blur is attributed.
    weber
        Weber fraction of blur: minimum relative increase over the blur of the fixated object, and relative error of its
        depth.
    intrinsic
        Intrinsic blur in arcmin, added behind the optics of the eye.
    layout_spread
        SD of the logarithm of the relief amplitude, as left open by the layout.
    layout_gain
        Ratio of the layout's amplitude to the true one.
    layout_noise
        Error of the layout's depth at single places, as a fraction of the SD over all places.
    layout_error
        SD in dioptres of depth at places that a layout, including a flat one, leaves open (our choice).
    flatness
        SD in dioptres of the evidence that the display is flat.
    stereo
        Just noticeable difference of disparity in arcmin, 75 % correct with two alternatives: 20 seconds of arc, which
        most people pass (Coutant & Westheimer 1993).
    interocular
        Interocular distance in metres.
    rigidity
        Log odds against a reading per unit of its departure from rigidity.
    dominance
        Mean duration of a percept in seconds if both readings have equal odds.
    duration_spread
        SD of log duration, given the preceding percept.
    serial
        Serial correlation of log duration. The last three were fitted to 22 people who watched an ambiguous Necker
        lattice (A. Pastukhov, Correlated switching rate in kinetic-depth effect displays, CC-BY 4.0; percepts of at
        least 0.3 s, censored at the ends of blocks) by `focalgradient.statistics.fit_dominance`, without differences
        between blocks: geometric mean of medians 3.82 s (standard error of its logarithm .12), hence a mean of 5.2 s;
        spread .77 (.04), serial correlation .24 (.03).
    preference
        Log odds of the rigid reading in addition to the evidence in the picture.
    scale
        Exponent from perceived ratio to rating.
    scatter
        SD of the log of repeated ratings.
    categories
        Number of steps of the rating scale; 0 for ratings as ratios.
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

    def look(self, light: FloatArray, display: Display, question: Question[Answered]) -> Answered:
        """Answer a question about a picture, from its pixels and the display alone.

        Parameters
        ----------
        light
            Linear luminance relative to white, H x W; at least 64 pixels along each side.
        display
            Display that shows the picture, with its pixels per degree.
        question
            `DepthOrder`, `FigureGround`, `BlurDiscrimination`, `DistanceOfFixated`, `DepthExtent`, `DepthRating` or
            `Slant`.

        Raises
        ------
        InputError
            If the picture is too small, or a region is not a mask of its shape or is too small.

        Examples
        --------
        If border and left texture are both blurred, the left side occludes the right, against the prior.

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
        """Draw an individual from the population; control observers keep the sign of their prior, or its absence."""
        scale, pace, weber, spread, gain, prior, discounting, lasting, preference = random.standard_normal(9)
        return replace(
            self,
            scale=self.scale * math.exp(EXPONENT_LOG_SD * scale),
            dominance=self.dominance * math.exp(DURATIONS * pace),
            duration_spread=self.duration_spread * math.exp(DURATION_SPREADS * lasting),
            preference=self.preference + PREFERENCES * preference,
            weber=self.weber * math.exp(WEBER_LOG_SD * weber),
            layout_spread=self.layout_spread * math.exp(LAYOUT_LOG_SD * spread),
            layout_gain=self.layout_gain * math.exp(LAYOUT_LOG_SD * gain),
            prior=min(max(self.prior + PRIOR_SD * prior, -1.0), 1.0) if self.prior else 0.0,
            discounting=max(self.discounting - UNDISCOUNTED_SD * abs(discounting), 0.0),
        )


OBSERVERS: dict[str, Observer] = {
    "default": Observer(),
    "blur-blind": Observer(prior=0.0, defocus=0.0),
    "opposite": Observer(prior=-0.8),
    "guessing": Observer(guesses=True),
    "lapsing": Observer(lapses=0.15),
    "ordinal": Observer(categories=CATEGORIES),
}
"""Default observer (the hypothesis to be tested), control observers, and one with an ordinal rating scale."""


def observer_named(name: str) -> Observer:
    """Return the observer with a name.

    Raises
    ------
    InputError
        If the name is unknown.

    Examples
    --------
    >>> observer_named("blur-blind").prior
    0.0
    """
    check_one_of("observer", name, OBSERVERS)
    return OBSERVERS[name]
