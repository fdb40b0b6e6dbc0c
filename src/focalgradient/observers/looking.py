"""Blur at places of a picture, and depth from blur alone, without layout."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.observers.front_end import blur_of, fixated_blur, seen_by
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import defocus

__all__ = ["Look", "blur_threshold", "look"]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Result of one fixation; arrays of rows x columns of places, NaN where blur cannot be estimated.

    Parameters
    ----------
    blur, blur_log_sd
        Standard deviation of the picture's blur (arcmin), without the blur of the eye, and SD of its logarithm.
    depth
        Mean depth from blur (D beyond the fixated place), whose sign is that of the prior with probability (1 + prior)
        / 2.
    texture_slope
        Slope of the texture's amplitude spectrum, 1/f^slope.
    """

    blur: FloatArray
    blur_log_sd: FloatArray
    depth: FloatArray
    texture_slope: float


def look(light: FloatArray, display: Display, fixation: tuple[float, float], observer: Observer) -> Look:
    """Estimate blur and depth at places of a picture, from its pixels and the display alone.

    Parameters
    ----------
    light
        Linear luminance relative to white, H x W; at least 64 pixels along each side.
    display
        Display that shows the picture, with its pixels per degree.
    fixation
        Fixated point in pixels from the upper left corner, right and down.
    observer
        Observer with pupil, intrinsic blur and prior.

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
    size = defocus(np.sqrt(np.maximum(blur**2 - fixated**2, 0.0)), observer)  # intrinsic blur cancels in the difference
    return Look(blur, np.where(known, estimated.log_sd, np.nan), observer.prior * size, slope)


def blur_threshold(pedestal: float, observer: Observer) -> float:
    """Return the just noticeable increment of blur (arcmin) for a pedestal (arcmin).

    At threshold, the two blurs, with intrinsic blur added in quadrature, differ by the Weber fraction. This produces
    the dipper: on a small pedestal an increment adds more variance than without a pedestal.

    Examples
    --------
    >>> from focalgradient.observers import OBSERVERS
    >>> [round(blur_threshold(blur, OBSERVERS["default"]), 2) for blur in (0, 0.25, 0.5, 1, 2, 4)]
    [0.49, 0.35, 0.35, 0.48, 0.84, 1.62]
    """
    seen = (1 + observer.weber) * math.hypot(pedestal, observer.intrinsic)
    return math.sqrt(seen**2 - observer.intrinsic**2) - pedestal
