"""Noise that rises with brightness, as that of photons does, and with contrast: its law, from what equalising leaves.

Where the views agree, what is left of them is noise, so that its power in dark and in bright places gives the law, and
so does that in flat places and in those with contrast: compression leaves errors where there is something to compress.
The residuals of each pixel are then divided by its own noise, and all that follows takes noise to be even.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import ndimage

from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.filters import FloatArray, Image
from focalgradient.depth.noise import NOISE_SIDE, NoiseLaw, noise_law
from focalgradient.depth.numerics import block_sum
from focalgradient.depth.registration import RegisteredViews

__all__ = ["brightness_of_noise", "even_out", "local_contrast", "uneven_noise"]

SMOOTH = 2.0
"""Standard deviation in pixels of the Gaussian that takes the noise off the views where noise goes by brightness."""

ABOUT = 3.0
"""Standard deviation in pixels of the Gaussian window in which an image's contrast is taken: blocks of JPEG are 8 wide,
and its errors stay within them."""

ROUNDS = 4
"""Times that the law is looked for, at most."""

SETTLED = 0.02
"""Change of its share below which it is found."""

CHANGE = 0.1
"""Change of what contrast adds, as a share of it, below which the law is found."""


def _brightness(views: RegisteredViews) -> Image:
    """Brightness of registered views, without their noise (H x W)."""
    mean: Image = np.mean(views.images, axis=0, dtype=np.float32)
    return np.asarray(ndimage.gaussian_filter(mean, SMOOTH), np.float32)


def brightness_of_noise(registered: RegisteredViews) -> float:
    """Mean brightness of the part in which noise is estimated."""
    part = registered.most_textured_crop(NOISE_SIDE)
    return float(np.mean([image[part.usable].mean() for image in part.images])) if part.usable.any() else 0.0


def local_contrast(views: RegisteredViews) -> Image:
    """Variance of registered views about each pixel, without white noise's part; their mean (H x W)."""
    total = np.zeros(views.shape, np.float32)
    for image in views.images:
        mean = ndimage.gaussian_filter(image, ABOUT)
        total += ndimage.gaussian_filter((image - mean) ** 2, ABOUT)
    return np.asarray(total / len(views.images), np.float32)


def uneven_noise(law: NoiseLaw, views: RegisteredViews) -> Image:
    """Noise of each pixel (H x W), over that which is estimated for the views."""
    return np.sqrt(law.variance(_brightness(views), local_contrast(views))).astype(np.float32)


def even_out(
    equalised: Equalised, read: Callable[[bool], Nodes], views: RegisteredViews, at: float | None, every: int = 1
) -> tuple[NoiseLaw | None, Nodes]:
    """Make noise even, in place, where it rises with brightness or contrast: the law, or None; and the nodes.

    Parameters
    ----------
    equalised, views
        What is compared, and the views themselves.
    read, every
        Estimates depth at nodes, `every` so many of them, from `equalised`; called with whether that has changed since.
    at
        Brightness at which noise is as assumed. None: noise is given, and alike in bright and in dark places.
    """
    nodes = read(False)
    step = equalised.step

    def at_nodes(image: Image) -> FloatArray:
        mean = block_sum(image, step) / block_sum(np.ones_like(image), step)
        return np.asarray(mean[::every, ::every], float)

    image, contrast = _brightness(views), local_contrast(views)
    bright, varied = at_nodes(image), at_nodes(contrast)
    known = at is None
    brightness = float(image.mean()) if at is None else at
    law, divided = None, np.ones_like(image)
    for _ in range(ROUNDS):
        # Where noise is less than assumed, depth is wrong and more is left of the views: the law mends both.
        variance = nodes.misfit * (1 if law is None else law.variance(bright, varied))
        some = nodes.support > 0.5
        textured = some & (nodes.texture >= 1)
        some = textured if textured.mean() > 0.02 else some
        found = noise_law(variance[some], bright[some], varied[some], brightness, level_known=known)
        if found is None or (law is not None and _alike(found, law)):
            break
        noise_sd = np.sqrt(found.variance(image, contrast)).astype(np.float32)
        equalised.divide(noise_sd / divided)
        law, divided = found, noise_sd
        nodes = read(True)
    return law, nodes


def _alike(one: NoiseLaw, other: NoiseLaw) -> bool:
    change = abs(one.by_contrast - other.by_contrast)
    return abs(one.share - other.share) < SETTLED and change <= CHANGE * other.by_contrast
