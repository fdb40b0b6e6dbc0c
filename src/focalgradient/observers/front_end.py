"""The front end of all observers: from light on a display to blur at places, with its uncertainty.

The eye's own optics blur the light first. The slope of the texture's spectrum is estimated from the whole picture, and
what the optics do to it is known to the observer: so neither a steep texture nor a sharp one is taken for a blurred
one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

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

FloatArray = NDArray[np.float64]

SPACING = 32
"""Pixels between places."""

FOVEA = 1.0
"""Degrees from the fixated point (standard deviation) within which the blur of the fixated object is estimated."""

DARK = 0.01
"""Light, in shares of the display's white, that the display and the eye scatter over everything."""


def seen_by(
    pictures: Sequence[FloatArray], display: Display, pupil: float, spacing: int = SPACING
) -> tuple[list[FloatArray], float]:
    """Contrast on the retina (logarithm of light) of each picture, H x W, and the slope of the texture of all of them.

    Raises
    ------
    InputError
        If a picture is not an array of finite light, H x W, of at least two places along each side.
    """
    images = []
    for light in pictures:
        picture = np.asarray(light, float)
        if picture.ndim != 2 or min(picture.shape) < 2 * spacing or not np.isfinite(picture).all():
            raise InputError(
                f"light is an array of shape {picture.shape}, but must be H x W finite luminances in shares of white, "
                f"{2 * spacing} pixels or more along each side."
            )
        images.append(np.log(np.maximum(retinal_image(picture, display.pixels_per_degree, pupil), 0) + DARK))
    return images, texture_slope(images, spacing, display.pixels_per_degree, pupil)


def block_means(values: NDArray[Any], spacing: int = SPACING) -> FloatArray:
    """Mean of an image over the block of each place, rows x columns; an incomplete block at the end is left out.

    >>> block_means(np.arange(8.0).reshape(2, 4), 2).tolist()
    [[2.5, 4.5]]
    """
    rows, columns = (length // spacing for length in values.shape)
    blocks = values[: rows * spacing, : columns * spacing].reshape(rows, spacing, columns, spacing)
    return np.asarray(blocks.mean((1, 3)))


def check_fixation(fixation: tuple[float, float], shape: tuple[int, ...]) -> None:
    """Raise `InputError` unless a fixation (pixels, right and down) lies in a picture of that shape (H x W)."""
    if not (0 <= fixation[1] < shape[0] and 0 <= fixation[0] < shape[1]):
        raise InputError(f"fixation is {fixation}, but the picture has {shape[1]} x {shape[0]} pixels.")


def blur_of(seen: FloatArray, slope: float, display: Display, pupil: float, spacing: int = SPACING) -> BlurEstimate:
    """Blur of the picture (px) at places of its retinal image, without that of the eye: of texture and edges."""
    ppd = display.pixels_per_degree
    return estimate_blur(seen, spacing, law=eye_law(slope, ppd, pupil), own=own_blur(ppd, pupil))


def fixated_blur(
    estimated: BlurEstimate, fixation: tuple[float, float], pixels_per_degree: float, spacing: int = SPACING
) -> float:
    """Blur (px) of what is fixated: the mean of the logarithm over the fovea, by precision."""
    down, right = spacing * (np.indices(estimated.log_sd.shape) + 0.5)
    away = np.hypot(right - fixation[0], down - fixation[1]) / pixels_per_degree
    precision = np.maximum(np.maximum(estimated.log_sd, 1e-6) ** -2.0, 1e-9)
    weight = precision * np.exp(-0.5 * ((away - away.min()) / FOVEA) ** 2)
    return math.exp(float((weight * continued(estimated)).sum() / weight.sum()))


def continued(estimated: BlurEstimate) -> FloatArray:
    """Logarithm of blur at all places; at places without an estimate, as on a smooth wall, that of the nearest one.

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
    """Blur (px) that a sharp edge has by the eye's own optics: measured as any edge is.

    >>> round(own_blur(60.0, 0.004), 1), round(own_blur(30.0, 0.004), 1)
    (1.3, 0.5)
    """
    step = np.where(np.arange(96) < 48, 0.3, 0.6) * np.ones((96, 1))
    edges = measure_edges(np.log(retinal_image(step, pixels_per_degree, pupil)), noise=STEP, length=BAND)
    return float(np.median(edges.radius[edges.valid]))
