"""Look at a picture without its layout: blur estimated at places, and depth by blur alone."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.observers.front_end import blur_of, fixated_blur, seen_by
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import SD_PER_RADIUS

__all__ = ["Look", "blur_threshold", "look"]

FloatArray = NDArray[np.float64]


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
    (seen,), slope = seen_by([light], display, observer.pupil)
    estimated = blur_of(seen, slope, display, observer.pupil)
    known = np.isfinite(estimated.log_sd)
    log_blur = np.where(known, estimated.log_blur, 0.0)
    minute = 60 / ppd
    fixated = minute * fixated_blur(estimated, fixation, ppd)
    blur = np.where(known, minute * np.exp(log_blur), np.nan)
    size = defocus(np.sqrt(np.maximum(blur**2 - fixated**2, 0.0)), observer)  # the intrinsic blur of both cancels
    share = math.sqrt(observer.weber**2 + 1 - observer.prior**2)
    return Look(blur, np.where(known, estimated.log_sd, np.nan), observer.prior * size, share * size, slope)


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
