"""Move outlines to where the sharpest view has an edge: two surfaces rarely meet without one.

Residuals give an outline's place to a few pixels: the prior. The likelihood is exponential in the contrast across the
outline, averaged along it, so that texture does not add up. The outline moves to the posterior's mean.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from focalgradient.depth.filters import FloatArray, Image, smoothed

__all__ = ["blurs_at", "moved_to_edges"]

EDGE_SEARCH = 10
"""Distance in pixels on either side of an occlusion boundary within which image edges are searched: about three
`PRIOR_SD`."""

PRIOR_SD = 3.0
"""Prior standard deviation of a boundary's position, in pixels; residuals locate it to a few pixels. Chosen on
`MADE_WITH`."""

CONTRAST_GAIN = 4.0
"""Increase in log likelihood for a contrast across the boundary that equals the typical contrast around it. Chosen on
`MADE_WITH`."""

GRADIENT_SD = 1.0
"""Standard deviation in pixels of the Gaussian whose gradient measures contrast. Chosen on `MADE_WITH`."""

COMMON_SD = 8.0
"""Standard deviation in pixels of the window of the typical contrast: the default window. Chosen on `MADE_WITH`."""

ALONG_SD = 6.0
"""Standard deviation in pixels of the window along an outline in which contrast is averaged. Chosen on `MADE_WITH`."""

NORMAL_SD = 4.0
"""Standard deviation in pixels of the window in which a boundary's direction is measured. Chosen on `MADE_WITH`."""


def blurs_at(level: FloatArray, radii: FloatArray) -> FloatArray:
    """Interpolate the `radii` of blur (n x L) at each pixel's `level` (H x W): n x H x W."""
    return np.stack([np.interp(level, np.arange(len(radius)), radius) for radius in radii])


def moved_to_edges(
    inward: FloatArray, border: NDArray[np.bool_], images: Sequence[Image], blur: FloatArray
) -> FloatArray:
    """Return how far each pixel of a border must move towards where `inward` rises to lie at an edge, in pixels; H x W.

    Elsewhere it is 0.

    Parameters
    ----------
    inward
        H x W: pixels to the border, positive on one side of it and negative on the other.
    border
        H x W: the pixels beside it.
    images
        The views, H x W each.
    blur
        Blur radius of the near surface in each view at each pixel: n x H x W.

    Examples
    --------
    A border at column 24.5, and an edge at 26.5.

    >>> column = np.arange(50.0) + np.zeros((40, 1))
    >>> moved = moved_to_edges(column - 24.5, np.abs(column - 24.5) < 1, [(column > 26.5) * 1.0], np.ones((1, 40, 50)))
    >>> round(float(moved[20, 25]), 1)
    2.0
    """
    moved = np.zeros(border.shape)
    at = np.nonzero(border)
    if not at[0].size:
        return moved
    place = np.stack(at, axis=1)
    reach = EDGE_SEARCH + 4 * NORMAL_SD
    # Of single precision, for memory: as large as a tile.
    down, right = np.gradient(smoothed(np.clip(inward, -reach, reach).astype(np.float32), NORMAL_SD))
    size = np.hypot(down, right) + np.float32(1e-9)
    down, right = down / size, right / size
    sharpest = blur.argmin(axis=0)
    contrast = np.zeros(border.shape, np.float32)
    for number, image in enumerate(images):
        if (sharpest == number).any():
            contrast = np.where(sharpest == number, _contrast(image, down, right), contrast)
    shift = np.arange(-EDGE_SEARCH, EDGE_SEARCH + 1)
    step = shift - inward[at][:, None]  # from the pixel, of what is counted from the border
    normal = np.stack([down[at], right[at]])
    found = ndimage.map_coordinates(contrast, np.stack(at)[:, :, None] + normal[:, :, None] * step, order=1)
    tree = cKDTree(place)
    weight = tree.sparse_distance_matrix(tree, 2 * ALONG_SD, output_type="coo_matrix").tocsr()
    weight.data = np.exp(-(weight.data**2) / (2 * ALONG_SD**2))
    posterior = (
        CONTRAST_GAIN * ((weight @ found + found) / (np.asarray(weight.sum(axis=1)) + 1)) - (shift / PRIOR_SD) ** 2 / 2
    )
    posterior = np.exp(posterior - posterior.max(axis=1, keepdims=True))
    moved[at] = posterior @ shift / posterior.sum(axis=1)
    return moved


def _contrast(image: Image, down: Image, right: Image) -> Image:
    """Slope of an image along the direction (`down`, `right`), over the root mean square slope about it; H x W."""
    slopes = np.gradient(smoothed(image.astype(np.float32), GRADIENT_SD))
    common = np.sqrt(smoothed(slopes[0] ** 2 + slopes[1] ** 2, COMMON_SD))
    least = np.float32(1e-9 * np.abs(image).max())
    return np.asarray(np.abs(slopes[0] * down + slopes[1] * right) / np.maximum(common, least))
