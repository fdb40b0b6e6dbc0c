"""Look at a picture without its layout: blur estimated at places, and depth by blur alone.

The slope of the texture's spectrum is estimated from the whole picture first, and what the eye's own optics do to it is
known to the observer: so neither a steep texture nor a sharp one is taken for a blurred one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.edges.measure import measure_edges
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.encoding import DARK, FOVEA
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import SD_PER_RADIUS
from focalgradient.observers.retinal_blur import (
    BAND,
    STEP,
    BlurEstimate,
    estimate_blur,
    eye_law,
    retinal_image,
    texture_slope,
)

__all__ = ["Look", "blur_threshold", "look"]

FloatArray = NDArray[np.float64]

SPACING = 32
"""Pixels between places."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What is seen in one fixation; arrays of rows x columns of places, NaN where blur cannot be estimated.

    Parameters
    ----------
    blur, blur_log_sd
        Standard deviation of the blur of the picture (arcmin), without the eye's own, and the SD of its logarithm.
    depth, depth_sd
        Mean and standard deviation (D beyond the fixated place) of depth by blur: its sign is that of the prior with
        the probability (1 + prior) / 2, its size errs by the Weber fraction.
    texture_slope
        Of the amplitude of the picture's texture, 1/f^slope.
    """

    blur: FloatArray
    blur_log_sd: FloatArray
    depth: FloatArray
    depth_sd: FloatArray
    texture_slope: float


def look(light: FloatArray, display: Display, fixation: tuple[float, float], observer: Observer) -> Look:
    """Estimate blur and depth at places of a picture, from its pixels and the display alone.

    Parameters
    ----------
    light
        Linear luminance in shares of white, H x W; at least 64 pixels along each side.
    display
        That shows it: its pixels per degree.
    fixation
        Pixels from the upper left corner, right and down.
    observer
        Whose pupil, intrinsic blur, Weber fraction and prior apply.

    Examples
    --------
    >>> from focalgradient.observers import OBSERVERS
    >>> from focalgradient.stimuli import texture_border
    >>> display = Display()
    >>> ppd = display.pixels_per_degree
    >>> drawn = texture_border(
    ...     left_blur_arcmin=1, right_blur_arcmin=4, border="straight", pixels_per_degree=ppd, width_deg=8, height_deg=8
    ... )
    >>> seen = look(drawn.picture, display, (60.0, 144.0), OBSERVERS["default"])
    >>> left, right = np.nanmedian(seen.depth[:, :3]), np.nanmedian(seen.depth[:, -3:])
    >>> bool(right - left > 0.5)
    True
    """
    ppd = display.pixels_per_degree
    (seen,), slope = seen_by([light], display, observer)
    estimated = blur_of(seen, slope, display, observer)
    known = np.isfinite(estimated.log_sd)
    log_blur = np.where(known, estimated.log_blur, 0.0)
    minute = 60 / ppd
    fixated = minute * fixated_blur(estimated, fixation, ppd)
    blur = np.where(known, minute * np.exp(log_blur), np.nan)
    size = defocus(np.sqrt(np.maximum(blur**2 - fixated**2, 0.0)), observer)  # the intrinsic blur of both cancels
    share = math.sqrt(observer.weber**2 + 1 - observer.prior**2)
    return Look(blur, np.where(known, estimated.log_sd, np.nan), observer.prior * size, share * size, slope)


def seen_by(pictures: Sequence[FloatArray], display: Display, observer: Observer) -> tuple[list[FloatArray], float]:
    """Contrast on the retina (logarithm of light) of each picture, H x W, and the slope of the texture of all of them.

    Raises
    ------
    InputError
        If a picture is not an array of finite light, H x W, of at least 64 pixels along each side.
    """
    images = []
    for light in pictures:
        picture = np.asarray(light, float)
        if picture.ndim != 2 or min(picture.shape) < 2 * SPACING or not np.isfinite(picture).all():
            raise InputError(
                f"light is an array of shape {picture.shape}, but must be H x W finite luminances in shares of white, "
                f"{2 * SPACING} pixels or more along each side."
            )
        images.append(np.log(np.maximum(retinal_image(picture, display.pixels_per_degree, observer.pupil), 0) + DARK))
    return images, texture_slope(images, SPACING, display.pixels_per_degree, observer.pupil)


def blur_of(seen: FloatArray, slope: float, display: Display, observer: Observer) -> BlurEstimate:
    """Blur of the picture (px) at places of its retinal image, without that of the eye: of texture and edges."""
    ppd = display.pixels_per_degree
    return estimate_blur(seen, SPACING, law=eye_law(slope, ppd, observer.pupil), own=own_blur(ppd, observer.pupil))


def fixated_blur(estimated: BlurEstimate, fixation: tuple[float, float], pixels_per_degree: float) -> float:
    """Blur (px) of what is fixated: the mean of the logarithm over the fovea, by precision."""
    known = np.isfinite(estimated.log_sd)
    down, right = SPACING * (np.indices(known.shape) + 0.5)
    away = np.hypot(right - fixation[0], down - fixation[1]) / pixels_per_degree
    precision = np.where(known, np.maximum(estimated.log_sd, 1e-6) ** -2.0, 0.0)
    weight = precision * np.exp(-0.5 * (away / FOVEA) ** 2)
    log_blur = np.where(known, estimated.log_blur, 0.0)
    return math.exp(float((weight * log_blur).sum() / max(weight.sum(), 1e-300)))


@lru_cache(maxsize=64)
def own_blur(pixels_per_degree: float, pupil: float) -> float:
    """Blur (px) that a sharp edge has by the eye's own optics: measured as any edge is.

    >>> round(own_blur(60.0, 0.004), 1), round(own_blur(30.0, 0.004), 1)
    (1.3, 0.5)
    """
    step = np.where(np.arange(96) < 48, 0.3, 0.6) * np.ones((96, 1))
    edges = measure_edges(np.log(retinal_image(step, pixels_per_degree, pupil)), noise=STEP, length=BAND)
    return float(np.median(edges.radius[edges.valid]))


def defocus(blur: FloatArray, observer: Observer) -> FloatArray:
    """Dioptres of defocus by which the observer's own pupil would make a blur of that standard deviation (arcmin)."""
    return np.asarray(np.radians(np.asarray(blur) / 60) / SD_PER_RADIUS / (observer.pupil / 2))


def blur_threshold(pedestal: float, observer: Observer) -> float:
    """Just noticeable increment of blur (arcmin) upon a pedestal (arcmin).

    Both blurs are seen with the intrinsic blur added in quadrature, and differ by the Weber fraction at threshold. The
    dip is a consequence: upon a small pedestal an increment adds more to the variance than upon none.

    Examples
    --------
    >>> from focalgradient.observers import OBSERVERS
    >>> [round(blur_threshold(blur, OBSERVERS["default"]), 2) for blur in (0, 0.25, 0.5, 1, 2, 4)]
    [0.49, 0.35, 0.35, 0.48, 0.84, 1.62]
    """
    seen = (1 + observer.weber) * math.hypot(pedestal, observer.intrinsic)
    return math.sqrt(seen**2 - observer.intrinsic**2) - pedestal
