"""From an encoded stimulus to a percept: how deep it looks, by the layout, by blur and by the display's flatness.

The layout of a picture gives its relief up to the amplitude (the bas-relief ambiguity of pictures). The amplitude A,
the standard deviation of depth over places in dioptres, is what is estimated: its posterior has

    a prior          log A ~ N(log of the layout's own amplitude, layout_spread^2),
    the display      0 ~ N(A, flatness^2), as the eye's focus says that the display is flat, and
    blur             b ~ N(p A, z^2 + (weber^2 + 1 - p^2) A^2),

b being the part of depth by blur that goes with the layout's relief, p the prior for farther (the difference of the
probabilities of either side), and z the depth that intrinsic blur amounts to. The error of b is that of the amplitude
which is assumed, not of the b that was sensed: so more b can only speak for more A (a monotone likelihood ratio;
Milgrom 1981), and perceived depth never falls as b grows. Nothing here knows with which aperture a picture was made, or
which of its objects is the nearest.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from focalgradient.observers.encoding import EncodedStimulus
from focalgradient.observers.observer import Observer

__all__ = [
    "SD_PER_RADIUS",
    "amplitude",
    "blur_amplitude",
    "blur_depth",
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
    return depth * np.exp(observer.weber * random.standard_normal(depth.size))


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
    [0.16, 0.19, 0.22, 0.26]
    """
    log = np.log(AMPLITUDES)
    cost = ((log - math.log(layout)) / observer.layout_spread) ** 2 + (AMPLITUDES / observer.flatness) ** 2
    cost += (response(blur, observer) - response(AMPLITUDES, observer)) ** 2
    posterior = np.exp(-(cost - cost.min()) / 2)
    return math.exp(float(posterior @ log / posterior.sum()))


def perceived_depth(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> FloatArray:
    """Depth at each place, in dioptres beyond the mean: the layout's relief with the perceived amplitude."""
    spread = max(float(stimulus.depth.std()), 1e-6)
    layout = stimulus.depth + observer.layout_noise * spread * random.standard_normal(stimulus.depth.size)
    blur = blur_amplitude(sensed_blur_depth(stimulus, observer, random), layout, observer)
    relief = layout - layout.mean()
    return amplitude(observer.layout_gain * spread, blur, observer) * relief / float(relief.std())


def relief(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> float:
    """How deep a picture looks: the standard deviation of perceived depth over its places, in dioptres."""
    return float(perceived_depth(stimulus, observer, random).std())


def _dioptres(blur: float | FloatArray, observer: Observer) -> FloatArray:
    """Defocus that makes so much blur (arcmin)."""
    return np.radians(np.asarray(blur) / 60) / SD_PER_RADIUS / (observer.pupil / 2)
