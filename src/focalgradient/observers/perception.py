"""From an encoded stimulus to a percept: how deep it looks, by the layout, by blur and by the display's flatness.

Depth at places (D) is A l + C r: the layout's relief l, which other cues give up to its amplitude (the bas-relief
ambiguity of pictures), and r, relief that the layout does not have; both of unit standard deviation and uncorrelated.
Depth by blur is split alike, b along l and c off it. A picture's blur is of defocus with the probability `defocus`, and
otherwise of the texture itself, when it tells nothing. Then the posteriors of A and of C have

    a prior          log A ~ N(log of the layout's own amplitude, layout_spread^2),  C ~ N(0, e^2 + (layout_noise A)^2),
    the display      0 ~ N(A, flatness^2) and 0 ~ N(C, flatness^2), as the eye's focus says that the display is flat,
    blur             b ~ N(p A, z^2 + (weber^2 + 1 - p^2) A^2), and c with C in the same way,

e being the depth that a layout leaves open (`layout_error`), p the prior for farther (the difference of the
probabilities of either side), and z the depth that intrinsic blur amounts to. The error of b is that of the amplitude
which is assumed, not of the b that was sensed: so more b can only speak for more A (a monotone likelihood ratio;
Milgrom 1981), and perceived depth never falls as b grows. Nothing here knows with which aperture a picture was made, or
which of its objects is the nearest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focalgradient.observers.encoding import EncodedStimulus
from focalgradient.observers.observer import Observer

__all__ = [
    "SD_PER_RADIUS",
    "Percept",
    "amplitude",
    "blur_amplitude",
    "blur_depth",
    "off_layout",
    "perceive",
    "perceived_depth",
    "relief",
    "response",
    "sensed_blur_depth",
]

FloatArray = NDArray[np.float64]

SD_PER_RADIUS = 0.55
"""Standard deviation that is estimated from the blur of a disc / the disc's radius: tests/observers measure it."""

AMPLITUDES = np.geomspace(0.005, 50.0, 300)
"""Amplitudes (D) over which the posterior is summed, at equal steps of the logarithm: beyond any picture's."""

LEAST_DEPTH = 0.005
"""Depth (D) that a picture is perceived to have at least; our choice."""


def blur_depth(stimulus: EncodedStimulus, observer: Observer) -> FloatArray:
    """Depth by blur alone, in dioptres beyond the fixated object: blurred is farther by a prior above 0.

    A disc of radius r on the retina is a defocus of 2 r / pupil.
    """
    blur, fixated = (np.hypot(sd, observer.intrinsic) for sd in (stimulus.blur, stimulus.fixated_blur))
    depth = _dioptres(np.sqrt(np.maximum(blur**2 - fixated**2, 0.0)), observer)
    return np.sign(observer.prior) * depth


def sensed_blur_depth(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> FloatArray:
    """The same within one fixation: with an error at each place, and 0 where blur is not discriminated from none.

    Textures differ in grain: only what exceeds the fixated object's blur by a Weber fraction counts.
    """
    blur, fixated = (np.hypot(sd, observer.intrinsic) for sd in (stimulus.blur, stimulus.fixated_blur))
    depth = np.where(blur > (1 + observer.weber) * fixated, blur_depth(stimulus, observer), 0.0)
    return depth * np.exp(_log_error(stimulus, observer) * random.standard_normal(depth.size))


def _log_error(stimulus: EncodedStimulus, observer: Observer) -> FloatArray:
    """Standard deviation of the logarithm of depth by blur at a place: Weber's and that of the estimate."""
    return np.hypot(observer.weber, stimulus.blur_log_sd)


def blur_amplitude(blur: FloatArray, layout: FloatArray, observer: Observer) -> float:
    """Amplitude of depth by `blur` that goes with the relief of the `layout`, in dioptres; negative if it is reversed.

    That is the least-squares factor of the layout's relief of unit standard deviation. Blur that contradicts the layout
    counts as no blur, as far as the observer discounts it.

    >>> layout = np.array([0.0, 1.0, 2.0])
    >>> round(blur_amplitude(layout / 2, layout, Observer()), 3)
    0.408
    >>> blur_amplitude(-layout, layout, Observer())
    0.0
    """
    relief = layout - layout.mean()
    along = float((blur * relief).mean()) / max(float(relief.std()), 1e-12)
    if observer.sign == "layout":
        return abs(along)
    if observer.sign == "trust":
        along = math.copysign(float(blur.std()), along)
    return along if along > 0 else (1 - observer.discounting) * along + 0.0


def response(amplitude: float | FloatArray, observer: Observer) -> FloatArray:
    """Amplitude of depth by blur on a scale where its error has unit standard deviation.

    Blur of an amplitude a is p a on average, p being the prior, with the variance z^2 + (weber^2 + 1 - p^2) a^2: by
    intrinsic blur, Weber's law and uncertainty about the side. The scale is p times the integral of da over its root:
    linear below the depth z of the intrinsic blur, logarithmic far above it, and nothing without a prior.

    >>> observer = Observer(weber=0.5, prior=1.0)
    >>> responses = response(np.array([100.0, 200.0]), observer)
    >>> round(float(responses[1] - responses[0]), 3)  # log 2 / weber
    1.386
    """
    floor = float(_dioptres(observer.intrinsic, observer))
    share = math.sqrt(observer.weber**2 + 1 - observer.prior**2)
    return abs(observer.prior) / share * np.arcsinh(share * np.asarray(amplitude, float) / floor)


def amplitude(layout: float, blur: float, observer: Observer) -> float:
    """Perceived amplitude: the geometric mean of the posterior, in dioptres.

    Parameters
    ----------
    layout, blur
        Amplitude of the layout's depth, and of depth by blur (`blur_amplitude`), in dioptres.
    observer
        Whose.

    Examples
    --------
    >>> observer = Observer()
    >>> [round(amplitude(0.6, blur, observer), 2) for blur in (0.0, 0.2, 0.6, 1.8)]
    [0.16, 0.19, 0.22, 0.25]
    """
    log = np.log(AMPLITUDES)
    without = ((log - math.log(layout)) / observer.layout_spread) ** 2 + (AMPLITUDES / observer.flatness) ** 2
    by_blur = without + (response(blur, observer) - response(AMPLITUDES, observer)) ** 2
    means = [float(weight @ log / weight.sum()) for weight in map(_weight, (by_blur, without))]
    return math.exp(observer.defocus * means[0] + (1 - observer.defocus) * means[1])


def off_layout(layout: float, blur: float, observer: Observer) -> float:
    """Perceived amplitude of the relief that a layout does not have: the mean of the posterior, in dioptres.

    Parameters
    ----------
    layout
        Amplitude of the layout's depth in dioptres; 0 for a flat one.
    blur
        Amplitude of depth by blur off the layout, in dioptres.
    observer
        Whose.

    Examples
    --------
    >>> [round(off_layout(0.0, blur, Observer()), 3) for blur in (0.0, 0.2, 0.5)]
    [0.0, 0.032, 0.058]
    """
    open_sd = max(math.hypot(observer.layout_error, observer.layout_noise * layout), 1e-9)
    signed = 5 * open_sd * np.linspace(-1, 1, 201)
    cost = (signed / open_sd) ** 2 + (signed / observer.flatness) ** 2
    weight = _weight(cost + (response(blur, observer) - response(signed, observer)) ** 2)
    return observer.defocus * float(weight @ signed / weight.sum())


def _weight(cost: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-(cost - cost.min()) / 2))


class Percept(NamedTuple):
    """What is perceived in one fixation.

    Parameters
    ----------
    depth
        At each place, in dioptres beyond the mean.
    along, off
        Standard deviations over places of its parts: the layout's relief, and that by blur alone.
    """

    depth: FloatArray
    along: float
    off: float


def perceive(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> Percept:
    """Perceive depth at each place: the layout's relief with the perceived amplitude, and what blur adds to it.

    Examples
    --------
    Two halves on a flat layout, the right one blurred by 4 arcmin and the left one by 1, which is fixated.

    >>> halves = EncodedStimulus(np.array([1.0, 1.0, 4.0, 4.0]), 1.0, np.zeros(4))
    >>> seen = perceive(halves, Observer(), np.random.default_rng(1))
    >>> bool(seen.depth[2:].min() > seen.depth[:2].max()), bool(0.02 < seen.off < 0.2), seen.along
    (True, True, 0.0)
    """
    spread = float(stimulus.depth.std())
    layout = stimulus.depth + observer.layout_noise * spread * random.standard_normal(stimulus.depth.size)
    sensed = sensed_blur_depth(stimulus, observer, random)
    relief = (layout - layout.mean()) / max(float(layout.std()), 1e-12)
    b = float((sensed * relief).mean())
    along = blur_amplitude(sensed, layout, observer)
    rest = sensed - sensed.mean() - b * relief
    # Less what errors at single places make of it, by the variance of a log-normal one.
    by_error = float((sensed**2 * -np.expm1(-(_log_error(stimulus, observer) ** 2))).mean())
    left = math.sqrt(max(float((rest**2).mean()) - by_error - (observer.layout_noise * b) ** 2, 0.0))
    own = observer.layout_gain * spread
    a = amplitude(own, along, observer) if own > 1e-9 else 0.0
    c = off_layout(own, (1 - observer.discounting) * left if b < 0 else left, observer)
    return Percept(a * relief + c * rest / max(float(rest.std()), 1e-12), a, c)


def perceived_depth(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> FloatArray:
    """Depth at each place, in dioptres beyond the mean."""
    return perceive(stimulus, observer, random).depth


def relief(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> float:
    """How deep a picture looks: the standard deviation of perceived depth over its places, in dioptres.

    At least `LEAST_DEPTH`, so that pictures without any depth have a ratio.
    """
    percept = perceive(stimulus, observer, random)
    return max(math.hypot(percept.along, percept.off), LEAST_DEPTH)


def _dioptres(blur: float | FloatArray, observer: Observer) -> FloatArray:
    """Defocus that makes so much blur (arcmin)."""
    return np.radians(np.asarray(blur) / 60) / SD_PER_RADIUS / (observer.pupil / 2)
