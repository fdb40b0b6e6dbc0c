"""From looks to percepts: depth from blur by a prior, cues combined by their reliability, contradictions discounted.

All depths are in dioptres by which a place is farther than the fixated object. Of two cues, the layout of the scene
tells order well and amount badly; blur tells amount by the size of the pupil that it is put down to, and which way by a
prior alone. Nothing here knows with which aperture a picture was made, or which of its objects is the nearest.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from focalgradient.observers.look import Look
from focalgradient.observers.observer import Observer

__all__ = [
    "READ_PER_RADIUS",
    "agreement",
    "blur_depth",
    "blur_weight",
    "certainty",
    "perceived_depth",
    "relief",
    "seen_blur_depth",
]

FloatArray = NDArray[np.float64]

READ_PER_RADIUS = 0.55
"""Standard deviation that is read from the blur of a disc / the disc's radius."""


def agreement(one: FloatArray, other: FloatArray) -> float:
    """Share of pairs of places that two cues order alike, less the share that they order oppositely (Kendall's tau-a).

    >>> agreement(np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.0, 5.0]))  # one of three pairs is left open
    0.6666666666666666
    """
    above, over = one[:, None] > one, other[:, None] > other
    alike, opposite = np.count_nonzero(above & over), np.count_nonzero(above & over.T)
    return 2 * float(alike - opposite) / (len(one) * (len(one) - 1))


def blur_depth(look: Look, observer: Observer) -> FloatArray:
    """Depth by blur alone: the fixated object is in focus, and what is more blurred is farther, or as the prior has it.

    A disc of radius r on the retina is a defocus of 2 r / pupil.
    """
    blur, fixated = (np.hypot(read, observer.intrinsic) for read in (look.blur, look.fixated_blur))
    return observer.prior * _dioptres(np.sqrt(np.maximum(blur**2 - fixated**2, 0.0)), observer)


def seen_blur_depth(look: Look, observer: Observer, random: np.random.Generator) -> FloatArray:
    """The same at a glance at a picture: errs at each place, and is none where blur is not seen to be more.

    Surfaces differ in how fine they are, so that only what is clearly more blurred than the fixated object counts.
    """
    blur, fixated = (np.hypot(read, observer.intrinsic) for read in (look.blur, look.fixated_blur))
    depth = np.where(blur > (1 + observer.weber) * fixated, blur_depth(look, observer), 0.0)
    return depth * np.exp(observer.weber * random.standard_normal(depth.size))


def blur_weight(blur: FloatArray, layout: FloatArray, observer: Observer) -> float:
    """Reliability of depth by `blur`: 1 / variance, discounted as far as the `layout` contradicts its order."""
    trust = max(0.0, agreement(blur, layout)) if observer.discounts else 1.0
    return trust * certainty(blur, observer) ** 2 / max(float(blur.var()), 1e-12)


def certainty(blur: FloatArray, observer: Observer) -> float:
    """How many standard deviations the spread of depth by `blur` is from none."""
    spread = float(blur.std())
    return spread / math.hypot(observer.weber * spread, float(_dioptres(observer.intrinsic, observer)))


def perceived_depth(look: Look, observer: Observer, random: np.random.Generator) -> FloatArray:
    """Depth at each place: the layout's, that by blur, and the display's flatness, each by its reliability."""
    spread = max(float(look.depth.std()), 1e-6)
    layout = look.depth + observer.layout_noise * spread * random.standard_normal(look.depth.size)
    blur = seen_blur_depth(look, observer, random)
    of_layout, of_blur = (observer.layout_spread * spread) ** -2, blur_weight(blur, layout, observer)
    return (of_layout * layout + of_blur * blur) / (of_layout + of_blur + observer.flatness**-2)


def relief(look: Look, observer: Observer, random: np.random.Generator) -> float:
    """How deep a picture looks: the spread of perceived depth over its places, in dioptres."""
    return float(perceived_depth(look, observer, random).std())


def _dioptres(blur: float | FloatArray, observer: Observer) -> FloatArray:
    """Defocus that makes so much blur (arcmin)."""
    return np.radians(np.asarray(blur) / 60) / READ_PER_RADIUS / (observer.pupil / 2)
