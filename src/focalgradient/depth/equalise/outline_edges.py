"""Outlines moved to where the sharpest view has an edge: two surfaces rarely meet without one.

Residuals give an outline's place to a few pixels. At each of its pixels, contrast is measured along the normal,
in the view in which the near surface is sharpest; edges that go along with the outline add up, texture does not. The
prior of the outline's place is normal about where residuals put it, the likelihood is exponential in contrast, and the
outline is moved to the posterior's mean.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from focalgradient.depth.filters import FloatArray, Image

__all__ = ["blurs_at", "moved_to_edges"]

EDGE_SEARCH = 10
"""Distance in pixels to either side of an outline within which edges are looked for: about three `PRIOR_SD`."""

PRIOR_SD = 3.0
"""Prior standard deviation of an outline's place, in pixels: residuals give it to a few. Chosen on `MADE_WITH`."""

CONTRAST_GAIN = 4.0
"""Log likelihood gained by contrast across the outline that equals the common contrast about it. Chosen on
`MADE_WITH`."""

GRADIENT_SD = 1.0
"""Standard deviation in pixels of the Gaussian whose gradient is the contrast. Chosen on `MADE_WITH`."""

COMMON_SD = 8.0
"""Standard deviation in pixels of the window over which contrast is common: that of the default window. Chosen on
`MADE_WITH`."""

ALONG_SD = 6.0
"""Standard deviation in pixels of the window along an outline in which contrast is averaged. Chosen on `MADE_WITH`."""

NORMAL_SD = 4.0
"""Standard deviation in pixels of the window in which an outline's direction is taken. Chosen on `MADE_WITH`."""


def blurs_at(level: FloatArray, radii: FloatArray) -> FloatArray:
    """Each view's blur radius at each pixel's `level` (H x W): n x H x W, of its `radii` at every level (n x L)."""
    return np.stack([np.interp(level, np.arange(len(radius)), radius) for radius in radii])


def moved_to_edges(
    inward: FloatArray, border: NDArray[np.bool_], images: Sequence[Image], blur: FloatArray
) -> FloatArray:
    """How far each pixel of a border moves towards where `inward` rises, in pixels, to lie at an edge; H x W.

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
    down, right = np.gradient(ndimage.gaussian_filter(np.clip(inward, -reach, reach).astype(np.float32), NORMAL_SD))
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
    """Slope of an image across the direction (`down`, `right`), over what is common about it; H x W."""
    slopes = np.gradient(ndimage.gaussian_filter(image.astype(np.float32), GRADIENT_SD))
    common = np.sqrt(ndimage.gaussian_filter(slopes[0] ** 2 + slopes[1] ** 2, COMMON_SD))
    least = np.float32(1e-9 * np.abs(image).max())
    return np.asarray(np.abs(slopes[0] * down + slopes[1] * right) / np.maximum(common, least))
