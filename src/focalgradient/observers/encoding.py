"""From a picture to its encoded stimulus: blur and layout for an eye that fixates one object, without any noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from focalgradient.display import Display
from focalgradient.observers.retinal_blur import BlurEstimate, estimate_blur, retinal_image
from focalgradient.render.rendered import LUMINANCE

__all__ = ["PUPIL", "EncodedStimulus", "encode"]

PUPIL = 0.004
"""Diameter in metres of the pupil with which the display is seen, about what its light makes it."""

ACROSS = 16
"""Places across a picture."""

FOVEA = 1.0
"""Degrees from the fixated point (standard deviation) within which the blur of the fixated object is estimated."""

DARK = 0.01
"""Light, in shares of the display's white, that the display and the eye scatter over everything."""


SKY = 0.25
"""Share of sky from which on a place is taken for sky. Clouds are soft in any focus, and the layout shows where they
are: blur there is that of the nearest place with a surface."""


@dataclass(frozen=True, slots=True, eq=False)
class EncodedStimulus:
    """A picture as encoded by one eye that fixates one object; arrays of one entry a place.

    Parameters
    ----------
    blur
        Standard deviation of the blur on the retina in minutes of arc, the eye's own included.
    fixated_blur
        The same of the fixated object.
    depth
        Dioptres by which a place is farther than the fixated object. That the layout of the picture gives it is an
        assumption: it is taken from the true depth.
    """

    blur: NDArray[np.float64]
    fixated_blur: float
    depth: NDArray[np.float64]


def encode(
    pixels: NDArray[np.uint8],
    display: Display,
    fixations: Sequence[tuple[float, float]],
    distance: NDArray[np.floating],
) -> list[EncodedStimulus]:
    """Encode a picture on a display, once for each fixation.

    Parameters
    ----------
    pixels
        8-bit values, H x W x 3.
    display
        That shows it.
    fixations
        The fixated points, each in pixels from the upper left corner, right and down.
    distance
        True distance of what each pixel shows, in metres, H x W: what the layout is assumed to give.

    Examples
    --------
    A wall of texture that recedes from 0.5 m at the left to 2 m at the right, drawn ever more blurred.

    >>> from scipy.ndimage import gaussian_filter
    >>> random = np.random.default_rng(0)
    >>> field = np.cumsum(np.cumsum(random.standard_normal((128, 128)), 0), 1)
    >>> field = 0.2 * np.clip((field - gaussian_filter(field, 8)) / 20, -2, 2)
    >>> field = np.where(np.arange(128) < 64, field, gaussian_filter(field, 3))
    >>> picture = np.repeat(np.rint(255 * (0.5 + field))[..., None], 3, 2).astype(np.uint8)
    >>> distance = np.broadcast_to(1 / np.linspace(2, 0.5, 128), (128, 128))
    >>> (encoded,) = encode(picture, Display(), [(20.0, 64.0)], distance)
    >>> near, far = encoded.blur[encoded.depth < 0.5], encoded.blur[encoded.depth > 1.0]
    >>> bool(np.median(far) > 1.5 * np.median(near))
    True
    """
    light = display.decode(pixels) @ np.array(LUMINANCE)
    seen = retinal_image(light, display.pixels_per_degree, PUPIL)
    spacing = 4 * max(2, round(seen.shape[1] / ACROSS / 4))
    estimated = estimate_blur(np.log(np.maximum(seen, 0) + DARK), spacing)
    rows, columns = estimated.log_blur.shape
    sky = np.isinf(np.asarray(distance)[: rows * spacing, : columns * spacing])
    sky = sky.reshape(rows, spacing, columns, spacing).mean((1, 3)) > SKY
    if not sky.all():
        estimated.log_sd[sky] = np.inf
    down, right = (spacing * (np.indices((rows, columns)) + 0.5)).reshape(2, -1)
    vergence = 1 / np.asarray(distance, float)
    layout = vergence[: rows * spacing, : columns * spacing]
    layout = layout.reshape(rows, spacing, columns, spacing).mean((1, 3)).ravel()
    log_blur, trust = _filled(estimated), np.maximum(estimated.log_sd.ravel() ** -2.0, 1e-9)
    minute = display.arcmin(1.0)
    encoded = []
    for x, y in fixations:
        away = np.hypot(right - x, down - y) / display.pixels_per_degree
        fovea = trust * np.exp(-0.5 * (away / FOVEA) ** 2)
        encoded.append(
            EncodedStimulus(
                blur=minute * np.exp(log_blur),
                fixated_blur=minute * math.exp(float(fovea @ log_blur / fovea.sum())),
                depth=float(vergence[math.floor(y), math.floor(x)]) - layout,
            )
        )
    return encoded


def _filled(estimated: BlurEstimate) -> NDArray[np.float64]:
    """Logarithms of blur in a row; without an estimate, as in a clear sky, that of the nearest place with one."""
    unknown = np.isinf(estimated.log_sd)
    if unknown.all():
        return np.zeros(unknown.size)
    nearest = distance_transform_edt(unknown, return_distances=False, return_indices=True)
    return np.asarray(estimated.log_blur[tuple(nearest)]).ravel()
