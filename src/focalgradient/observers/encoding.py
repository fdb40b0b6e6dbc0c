"""Noise-free encoding of a picture: blur and layout for an eye that fixates one object."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.observers.front_end import block_means, blur_of, continued, fixated_blur, seen_by
from focalgradient.observers.retinal_blur import VAGUE
from focalgradient.render.rendered import LUMINANCE

__all__ = ["PUPIL", "SHARP", "EncodedStimulus", "encode", "encode_light"]

PUPIL = 0.004
"""Diameter of the pupil in metres, roughly that at the luminance of a display."""

ACROSS = 16
"""Maximum number of places across a picture."""

LEAST_SPACING = 16
"""Minimum distance between places in pixels; closer places leave too few receptive-field sizes to estimate blur."""

SHARP = 10
"""Percentile of the blur of all places that is taken as in focus, for any fixation."""

MIN_SKY = 0.25
"""Minimum fraction of sky for a place to count as sky. Clouds look soft at any focus, and the layout shows where they
are: their blur is replaced by that of the nearest place with a surface.
"""


@dataclass(frozen=True, slots=True, eq=False)
class EncodedStimulus:
    """Picture encoded by one eye that fixates one object; arrays have one entry per place.

    Parameters
    ----------
    blur
        Standard deviation of the picture's blur in arcmin, without the blur of the eye, including half a pixel of
        sampling blur.
    fixated_blur
        The same for the fixated object.
    depth
        Distance beyond the fixated object in dioptres. It is taken from the true depth, assuming that the layout of the
        picture shows it; 0 everywhere if only blur indicates depth.
    blur_log_sd
        Standard deviation of the log of `blur`.
    """

    blur: FloatArray
    fixated_blur: float
    depth: FloatArray
    blur_log_sd: FloatArray | float = 0.0


def encode(
    pixels: NDArray[np.uint8],
    display: Display,
    fixations: Sequence[tuple[float, float] | None],
    distance: NDArray[np.floating],
) -> list[EncodedStimulus]:
    """Encode a displayed picture, once for each fixation.

    Parameters
    ----------
    pixels
        8-bit values, H x W x 3.
    display
        Display that shows the picture.
    fixations
        Fixated points in pixels from the upper left corner, right and down; None: the sharpest point.
    distance
        True distance of the surface at each pixel in metres, H x W, which the layout is assumed to show.

    Examples
    --------
    A textured wall that recedes from 0.5 m at the left to 2 m at the right, with increasing blur.

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
    return encode_light(display.decode(pixels) @ np.array(LUMINANCE), display, fixations, distance)


def encode_light(
    light: FloatArray,
    display: Display,
    fixations: Sequence[tuple[float, float] | None],
    distance: NDArray[np.floating] | None,
    pupil: float = PUPIL,
    beside: Sequence[FloatArray] = (),
) -> list[EncodedStimulus]:
    """Encode linear luminance (H x W, relative to white) like `encode`; without distances the layout is flat.

    Pictures in `beside` have the same texture; its spectral slope is estimated from all of them.
    """
    spacing = max(LEAST_SPACING, 4 * round(np.shape(light)[-1] / ACROSS / 4))
    (seen, *_), slope = seen_by([light, *beside], display, pupil, spacing)
    estimated = blur_of(seen, slope, display, pupil, spacing)
    vergence = np.zeros(seen.shape) if distance is None else 1 / np.asarray(distance, float)
    layout, sky = (block_means(full, spacing) for full in (vergence, vergence == 0))
    if distance is not None and (sky <= MIN_SKY).any():
        estimated.log_sd[sky > MIN_SKY] = np.inf
    log_blur = continued(estimated).ravel()
    minute = display.arcmin(1.0)
    encoded = []
    for fixation in fixations:
        if fixation is None:
            fixated, at = math.exp(float(np.percentile(log_blur, SHARP))), 0.0
        else:
            fixated = fixated_blur(estimated, fixation, display.pixels_per_degree, spacing)
            at = float(vergence[math.floor(fixation[1]), math.floor(fixation[0])])
        encoded.append(
            EncodedStimulus(
                blur=minute * np.exp(log_blur),
                fixated_blur=minute * fixated,
                depth=at - layout.ravel(),
                blur_log_sd=np.minimum(estimated.log_sd, VAGUE).ravel(),
            )
        )
    return encoded
