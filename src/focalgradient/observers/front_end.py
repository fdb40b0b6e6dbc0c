"""Visual front end of all observers: from displayed light to blur at grid points, with its uncertainty.

The light is first blurred by the optics of the eye. The slope of the texture spectrum is estimated from the whole
picture, and its change by the optics is known to the observer, so that neither steep nor shallow spectra bias the
estimated blur.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from focalgradient.arrays import FloatArray
from focalgradient.depth.edges.measure import measure_edges
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.retinal_blur import (
    BAND,
    STEP,
    BlurEstimate,
    estimate_blur,
    eye_law,
    retinal_image,
    texture_slope,
)

__all__ = [
    "SPACING",
    "block_means",
    "blur_of",
    "check_fixation",
    "continued",
    "fixated_blur",
    "own_blur",
    "seen_by",
]


SPACING = 32
"""Distance between places, in pixels."""

FOVEA = 1.0
"""Standard deviation in degrees of the window around the fixated point for estimating the blur of the fixated object.
"""

DARK = 0.01
"""Scattered light of display and eye, as a fraction of the display's white."""


def seen_by(
    pictures: Sequence[FloatArray], display: Display, pupil: float, spacing: int = SPACING
) -> tuple[list[FloatArray], float]:
    """Return the retinal contrast (log light, H x W) of each picture, and the spectral slope of their common texture.

    Raises
    ------
    InputError
        If a picture is not a finite array, H x W, with at least two places along each side.
    """
    images = []
    for light in pictures:
        picture = np.asarray(light, float)
        if picture.ndim != 2 or min(picture.shape) < 2 * spacing or not np.isfinite(picture).all():
            raise InputError(
                f"light has shape {picture.shape}, but must be H x W finite luminances relative to white, "
                f"{2 * spacing} pixels or more along each side."
            )
        images.append(np.log(np.maximum(retinal_image(picture, display.pixels_per_degree, pupil), 0) + DARK))
    return images, texture_slope(images, spacing, display.pixels_per_degree, pupil)


def block_means(values: NDArray[Any], spacing: int = SPACING) -> FloatArray:
    """Average an image over the block of each place (rows x columns); incomplete blocks at the end are dropped.

    >>> block_means(np.arange(8.0).reshape(2, 4), 2).tolist()
    [[2.5, 4.5]]
    """
    rows, columns = (length // spacing for length in values.shape)
    blocks = values[: rows * spacing, : columns * spacing].reshape(rows, spacing, columns, spacing)
    return np.asarray(blocks.mean((1, 3)))


def check_fixation(fixation: tuple[float, float], shape: tuple[int, ...]) -> None:
    """Raise `InputError` unless a fixation (pixels, right and down) lies within a picture of that shape (H x W)."""
    if not (0 <= fixation[1] < shape[0] and 0 <= fixation[0] < shape[1]):
        raise InputError(f"fixation is {fixation}, but the picture has {shape[1]} x {shape[0]} pixels.")


def blur_of(seen: FloatArray, slope: float, display: Display, pupil: float, spacing: int = SPACING) -> BlurEstimate:
    """Estimate the blur (px) of texture and edges at places of a retinal image, without the blur of the eye."""
    ppd = display.pixels_per_degree
    return estimate_blur(seen, spacing, law=eye_law(slope, ppd, pupil), own=own_blur(ppd, pupil))


def fixated_blur(
    estimated: BlurEstimate, fixation: tuple[float, float], pixels_per_degree: float, spacing: int = SPACING
) -> float:
    """Return the blur (px) of the fixated object: precision-weighted mean of the logarithm over the fovea."""
    down, right = spacing * (np.indices(estimated.log_sd.shape) + 0.5)
    away = np.hypot(right - fixation[0], down - fixation[1]) / pixels_per_degree
    precision = np.maximum(np.maximum(estimated.log_sd, 1e-6) ** -2.0, 1e-9)
    weight = precision * np.exp(-0.5 * ((away - away.min()) / FOVEA) ** 2)
    return math.exp(float((weight * continued(estimated)).sum() / weight.sum()))


def continued(estimated: BlurEstimate) -> FloatArray:
    """Return log blur at all places; places without an estimate, as on a smooth wall, take that of the nearest one.

    >>> continued(BlurEstimate(np.array([[0.5, 0.0]]), np.array([[0.1, np.inf]]))).tolist()
    [[0.5, 0.5]]
    """
    is_unknown = np.isinf(estimated.log_sd)
    if is_unknown.all():
        return np.zeros(is_unknown.shape)
    nearest = distance_transform_edt(is_unknown, return_distances=False, return_indices=True)
    return np.asarray(estimated.log_blur[tuple(nearest)])


@lru_cache(maxsize=64)
def own_blur(pixels_per_degree: float, pupil: float) -> float:
    """Return the blur (px) of a sharp edge due to the optics of the eye, measured like that of any edge.

    >>> round(own_blur(60.0, 0.004), 1), round(own_blur(30.0, 0.004), 1)
    (1.3, 0.5)
    """
    step = np.where(np.arange(96) < 48, 0.3, 0.6) * np.ones((96, 1))
    edges = measure_edges(np.log(retinal_image(step, pixels_per_degree, pupil)), noise=STEP, length=BAND)
    return float(np.median(edges.radius[edges.valid]))
