"""Sharpness of a picture: its largest gradient relative to the largest that its blur allows.

One measure for all sets. Blur of standard deviation sd limits the gradient to the local range of radiance x peak /
sqrt(sd^2 + 1/12), including the pixel aperture, and never more than the range per pixel. `peak` is the maximum slope of
a unit edge blurred by the shape, times its standard deviation: 0.399 for a Gaussian, 0.318 for a disc. The local range
and blur are given by a drawn stimulus itself (`sharpness`), or derived from the pinhole picture and its depth
(`sharpest`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter, minimum_filter, uniform_filter

from focalgradient.arrays import FloatArray
from focalgradient.optics import Optics
from focalgradient.psf import Disc, Psf, PsfName, psf_of
from focalgradient.psf.profile import steepest_slope
from focalgradient.psf.shapes import PIXEL_VARIANCE

__all__ = ["PIXEL_VARIANCE", "sharpest", "sharpest_place", "sharpness"]

NORMAL_PEAK = 1 / math.sqrt(2 * math.pi)
"""Maximum gradient of a unit step blurred by a Gaussian, times its standard deviation."""

LINE_PEAK = math.exp(-0.5)
"""Maximum gradient of a Gaussian line of unit peak, times its standard deviation."""

NEIGHBOURHOOD_PX = 3
"""Radius in pixels of the neighbourhood whose smallest blur limits the gradient of a drawn stimulus."""

RADIUS_TOLERANCE_PX = 0.75
"""Tolerance of the blur radius in pixels, due to the pixel aperture and the single depth per pixel."""


def sharpness(
    picture: ArrayLike,
    blur_px: ArrayLike,
    psf: Psf | PsfName = "gaussian",
    *,
    span: float | None = None,
    lines: bool = False,
) -> float:
    """Return the largest gradient of a picture relative to the largest that its blur allows (see the module).

    Parameters
    ----------
    picture
        Linear luminance, H x W.
    blur_px
        Standard deviation of the blur at each pixel, H x W; the smallest value within three pixels applies.
    psf
        Blur shape, or its name.
    span
        Range of luminance without the blur; None: that of the picture.
    lines
        Whether the picture consists of Gaussian lines instead of edges: the limit is then 0.607 / sd.

    Returns
    -------
    float
        At most 1 if nothing is sharper than its blur allows; 0 for a uniform picture.

    Raises
    ------
    InputError
        If the shape is unknown.

    Examples
    --------
    >>> step = np.where(np.arange(32) < 16, 0.0, 1.0) * np.ones((32, 1))
    >>> sharpness(step, np.zeros((32, 32))), round(sharpness(step, np.full((32, 32), 4.0)))
    (1.0, 10)
    """
    return float(sharpest_place(picture, blur_px, psf, span=span, lines=lines)["sharpest"])


def sharpest_place(
    picture: ArrayLike, blur_px: ArrayLike, psf: Psf | PsfName, *, span: float | None = None, lines: bool = False
) -> dict[str, Any]:
    """Return `sharpness` and its position: ``sharpest``, and ``sharpest_px`` (column, row)."""
    light = np.asarray(picture, float)
    least = minimum_filter(np.asarray(blur_px, float), 2 * NEIGHBOURHOOD_PX + 1, mode="nearest")
    highest = max(float(np.ptp(light)), span or 0.0)
    return _worst(light, highest * _allowed(least, psf_of(psf), lines))


def sharpest(
    light: NDArray[np.floating],
    sharp: NDArray[np.floating],
    distance: NDArray[np.floating],
    optics: Sequence[Optics],
    pixel_angle: float,
    *,
    finer: int = 1,
    residual: NDArray[np.floating] | None = None,
    unseen: bool = False,
) -> dict[str, Any]:
    """Return the largest gradient of a picture relative to the largest that blur allows there, and its position.

    Parameters
    ----------
    light
        Luminance of the picture, H x W.
    sharp, distance
        Luminance of the pinhole picture, and distances in metres, at `finer` times the resolution.
    optics
        Optics of the picture: one for all light, or one per colour. Their blur is taken as a disc.
    pixel_angle
        Pixel angle of the pinhole picture in radians.
    finer
        Resolution of the pinhole picture relative to the picture.
    residual
        Half the difference between the two halves of the picture's samples, H x W (noise alone); None: no noise. A
        gradient of 6 standard deviations is tolerated, of the whole picture or the neighbourhood, whichever is larger.
    unseen
        Whether the picture shows surfaces that are hidden in the pinhole picture, as in a rendered scene. Regions where
        the blur of a nearer surface extends past its boundary are then excluded.

    Returns
    -------
    dict
        ``sharpest``: the ratio; ``sharpest_px``: column and row.

    >>> from focalgradient import Lens
    >>> step = np.where(np.arange(64) < 32, 0.2, 0.8) * np.ones((64, 1))
    >>> lens = Lens(0.05, 2.5, 1.0)  # blur radius of 5 px at 2 m
    >>> found = sharpest(step, step, np.full((64, 64), 2.0), [lens], 1e-3)  # not blurred
    >>> round(found["sharpest"], 1), found["sharpest_px"]
    (6.7, [31, 0])
    """
    vergence = 1 / np.asarray(distance, float)
    radii = [lens.aperture_diameter / 2 * np.abs(lens.focus_vergence - vergence) / pixel_angle for lens in optics]
    radius, widest = np.minimum.reduce(radii), np.maximum.reduce(radii)
    highest, lowest = np.full(sharp.shape, -np.inf), np.full(sharp.shape, np.inf)
    least = np.full(sharp.shape, np.inf)
    before = _occlusion_boundaries(vergence, max(lens.aperture_diameter for lens in optics) / 2 / pixel_angle / finer)
    passed = np.zeros(sharp.shape, bool)
    reach = 1.0
    within = -1.0
    while within < widest.max():
        level = (widest > within) & (widest <= reach)
        if level.any():
            side = 2 * (math.ceil(reach) + 1) + 1
            highest = np.maximum(highest, maximum_filter(np.where(level, sharp, -np.inf), side))
            lowest = np.minimum(lowest, minimum_filter(np.where(level, sharp, np.inf), side))
            least = np.minimum(least, minimum_filter(np.where(level, radius, np.inf), side))
            passed |= maximum_filter(level & before, side)
        within, reach = reach, 2 * reach
    rows, columns = light.shape
    blocks = [one.reshape(rows, finer, columns, finer) for one in (highest, lowest, least)]
    span = blocks[0].max(axis=(1, 3)) - blocks[1].min(axis=(1, 3))
    shape = Disc()
    sd = shape.sd(np.maximum(blocks[2].min(axis=(1, 3)) / finer - RADIUS_TOLERANCE_PX, 0))
    bound = span * _allowed(sd, shape)
    if unseen:
        bound[passed.reshape(rows, finer, columns, finer).any(axis=(1, 3))] = np.inf
    noise = np.zeros(light.shape) if residual is None else _noise(residual)
    return _worst(light, bound + 6 * noise + 1e-6 * float(np.abs(light).max()))


def _occlusion_boundaries(vergence: FloatArray, radius_per_dioptre: float) -> NDArray[np.bool_]:
    """Return where a surface occludes another whose blur differs by at least one pixel of the picture; H x W."""
    before = np.zeros(vergence.shape, bool)
    for axis in (0, 1):
        step = radius_per_dioptre * np.diff(vergence, axis=axis)
        first, last = ((slice(None),) * axis + (part,) for part in (slice(None, -1), slice(1, None)))
        before[first] |= step < -1
        before[last] |= step > 1
    return before


def _noise(residual: NDArray[np.floating]) -> FloatArray:
    """Return the local standard deviation of noise, H x W, at least that of the whole picture."""
    # Over 5 x 5 pixels, so that six standard deviations exceed the contribution of one stray sample.
    around = uniform_filter(residual**2.0, 5, mode="nearest")
    return np.sqrt(np.maximum(around, np.mean(residual**2.0)))


def _allowed(sd_px: FloatArray, psf: Psf, lines: bool = False) -> FloatArray:
    """Return the largest gradient that blur of this standard deviation allows, as a fraction of the range."""
    peak = steepest_slope(psf) * psf.sd_per_radius
    # Blur finer than a pixel acts like any shape of the same standard deviation.
    slope: Any = LINE_PEAK if lines else np.where(sd_px < 1, max(peak, NORMAL_PEAK), peak)
    return np.minimum(1.0, slope / np.sqrt(sd_px**2 + PIXEL_VARIANCE))


def _worst(light: NDArray[np.floating], allowed: FloatArray) -> dict[str, Any]:
    """Return the largest change between neighbouring pixels relative to the larger of their limits, and where it is."""
    worst, place = 0.0, (0, 0)
    for axis in (0, 1):
        change = np.abs(np.diff(light, axis=axis))
        bound = np.maximum(*(np.delete(allowed, end, axis) for end in (0, -1)))
        ratio = np.divide(change, bound, out=np.zeros(change.shape), where=change > 0)
        at = np.unravel_index(int(ratio.argmax()), ratio.shape)
        if ratio[at] > worst:
            worst, place = float(ratio[at]), (int(at[1]), int(at[0]))
    return {"sharpest": worst, "sharpest_px": list(place)}
