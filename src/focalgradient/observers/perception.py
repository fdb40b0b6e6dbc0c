"""Perceived depth of an encoded stimulus, from layout, blur, and flatness of the display.

Depth at places (D) is A l + C r: the relief l of the layout, which other cues give up to its amplitude (the bas-relief
ambiguity of pictures), and a relief r absent from the layout; both have unit standard deviation and are uncorrelated.
Depth from blur is split likewise into b along l and c along r. The blur of a picture is due to defocus with probability
`defocus`, and otherwise to the texture itself, when it is uninformative. The posteriors of A and C combine

    a prior          log A ~ N(log of the layout's own amplitude, layout_spread^2),  C ~ N(0, e^2 + (layout_noise A)^2),
    the display      0 ~ N(A, flatness^2) and 0 ~ N(C, flatness^2), as accommodation indicates a flat display,
    blur             b ~ N(p A, z^2 + (weber^2 + 1 - p^2) A^2), and c with C in the same way,

where e is the depth that a layout leaves open (`layout_error`), p the prior for farther (difference between the
probabilities of the two signs), and z the depth equivalent of intrinsic blur. The error of b depends on the
hypothesised amplitude, not on the sensed b, so that more b always supports more A (monotone likelihood ratio; Milgrom
1981), and perceived depth never decreases with b. The model has no access to the aperture of a picture, nor to which of
its objects is the nearest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.observers.encoding import EncodedStimulus
from focalgradient.observers.observer import Observer

__all__ = [
    "SD_PER_RADIUS",
    "Percept",
    "amplitude",
    "blur_amplitude",
    "blur_depth",
    "defocus",
    "off_layout",
    "perceive",
    "perceived_depth",
    "relief",
    "response",
    "sensed_blur_depth",
]


SD_PER_RADIUS = 0.55
"""Ratio of the estimated SD of a disc-shaped blur to the radius of the disc, measured in tests/observers."""

AMPLITUDES = np.geomspace(0.005, 50.0, 300)
"""Amplitudes (D) over which the posterior is summed, logarithmically spaced, beyond the range of any picture."""

LEAST_DEPTH = 0.005
"""Minimum perceived depth of a picture (D; our choice)."""


def blur_depth(stimulus: EncodedStimulus, observer: Observer) -> FloatArray:
    """Return depth from blur alone, in dioptres beyond the fixated object; a positive prior makes blurred farther.

    A blur disc of radius r on the retina corresponds to a defocus of 2 r / pupil.
    """
    blur, fixated = (np.hypot(sd, observer.intrinsic) for sd in (stimulus.blur, stimulus.fixated_blur))
    depth = defocus(np.sqrt(np.maximum(blur**2 - fixated**2, 0.0)), observer)
    return np.sign(observer.prior) * depth


def sensed_blur_depth(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> FloatArray:
    """Return depth from blur in one fixation, with an error at each place, and 0 where blur is below threshold.

    As textures differ in grain, only blur that exceeds that of the fixated object by a Weber fraction counts.
    """
    blur, fixated = (np.hypot(sd, observer.intrinsic) for sd in (stimulus.blur, stimulus.fixated_blur))
    depth = np.where(blur > (1 + observer.weber) * fixated, blur_depth(stimulus, observer), 0.0)
    return depth * np.exp(_log_error(stimulus, observer) * random.standard_normal(depth.size))


def _log_error(stimulus: EncodedStimulus, observer: Observer) -> FloatArray:
    """Return the SD of log depth from blur at each place: Weber's law and the error of the estimate."""
    return np.hypot(observer.weber, stimulus.blur_log_sd)


def blur_amplitude(blur: FloatArray, layout: FloatArray, observer: Observer) -> float:
    """Return the amplitude (D) of depth from `blur` along the relief of the `layout`; negative if reversed.

    It is the least-squares coefficient on the layout's relief with unit standard deviation. Blur that contradicts the
    layout is discounted to the observer's degree.

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
    """Return the amplitude of depth from blur on a scale on which its error has unit standard deviation.

    For an amplitude a, depth from blur has mean p a, where p is the prior, and variance z^2 + (weber^2 + 1 - p^2) a^2,
    due to intrinsic blur, Weber's law and uncertainty about the sign. The scale is p times the integral of da over the
    root of this variance: linear below the depth z of intrinsic blur, logarithmic far above it, and 0 without a prior.

    >>> observer = Observer(weber=0.5, prior=1.0)
    >>> responses = response(np.array([100.0, 200.0]), observer)
    >>> round(float(responses[1] - responses[0]), 3)  # log 2 / weber
    1.386
    """
    floor = float(defocus(observer.intrinsic, observer))
    share = math.sqrt(observer.weber**2 + 1 - observer.prior**2)
    return abs(observer.prior) / share * np.arcsinh(share * np.asarray(amplitude, float) / floor)


def amplitude(layout: float, blur: float, observer: Observer) -> float:
    """Return the perceived amplitude: the geometric mean of the posterior, in dioptres.

    Parameters
    ----------
    layout, blur
        Amplitude of the layout's depth, and of depth from blur (`blur_amplitude`), in dioptres.
    observer
        Observer.

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
    """Return the perceived amplitude of relief absent from the layout: the posterior mean, in dioptres.

    Parameters
    ----------
    layout
        Amplitude of the layout's depth in dioptres; 0 for a flat one.
    blur
        Amplitude of depth from blur off the layout, in dioptres.
    observer
        Observer.

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
    """Percept of one fixation.

    Parameters
    ----------
    depth
        Depth at each place, in dioptres relative to the mean.
    along, off
        Standard deviations over places of its components: relief of the layout, and relief from blur alone.
    """

    depth: FloatArray
    along: float
    off: float


def perceive(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> Percept:
    """Perceive depth at each place: the layout's relief with its perceived amplitude, plus relief from blur.

    Examples
    --------
    Two halves on a flat layout; the right one is blurred by 4 arcmin, the left one by 1 arcmin and fixated.

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
    # subtract the contribution of errors at single places, with the variance of a log-normal distribution
    by_error = float((sensed**2 * -np.expm1(-(_log_error(stimulus, observer) ** 2))).mean())
    left = math.sqrt(max(float((rest**2).mean()) - by_error - (observer.layout_noise * b) ** 2, 0.0))
    layout_amplitude = observer.layout_gain * spread
    a = amplitude(layout_amplitude, along, observer) if layout_amplitude > 1e-9 else 0.0
    c = off_layout(layout_amplitude, (1 - observer.discounting) * left if b < 0 else left, observer)
    return Percept(a * relief + c * rest / max(float(rest.std()), 1e-12), a, c)


def perceived_depth(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> FloatArray:
    """Return depth at each place, in dioptres relative to the mean."""
    return perceive(stimulus, observer, random).depth


def relief(stimulus: EncodedStimulus, observer: Observer, random: np.random.Generator) -> float:
    """Return the perceived depth of a picture: standard deviation of depth over its places, in dioptres.

    It is at least `LEAST_DEPTH`, so that ratios are defined for pictures without depth.
    """
    percept = perceive(stimulus, observer, random)
    return max(math.hypot(percept.along, percept.off), LEAST_DEPTH)


def defocus(blur: float | FloatArray, observer: Observer) -> FloatArray:
    """Return the defocus (D) that causes blur of that standard deviation (arcmin) with the observer's pupil."""
    return np.radians(np.asarray(blur) / 60) / SD_PER_RADIUS / (observer.pupil / 2)
