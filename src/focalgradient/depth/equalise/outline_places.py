"""Where outlines lie: between what the near surface explains and what the far one does, moved to the views' edges.

Two surfaces rarely meet without an edge. Residuals give an outline's place to a few pixels: the prior. The likelihood
is exponential in the contrast across the outline, averaged along it, so that texture does not add up. The outline moves
to the posterior's mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.filters import Image, smoothed
from focalgradient.depth.numerics import NEIGHBOURS
from focalgradient.depth.planes import Zone, jump_pairs, nearest_surfaces, surface_planes
from focalgradient.depth.validity import BLUR_ERROR

__all__ = ["CLEAR_REACHES", "Located", "blurs_at", "few_large", "locate", "moved_to_edges", "squared_residual"]

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


def moved_to_edges(inward: FloatArray, border: Mask, images: Sequence[Image], blur: FloatArray) -> FloatArray:
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
    step = shift - inward[at][:, None]  # from the pixel; counted from the border
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


ONSET = 0.9
"""Proportion of the reach of blur and filters (`_reach`) within which residuals exceed noise. Chosen on `MADE_WITH`."""

LARGE_RESIDUAL = 4.0
"""Squared residual, relative to its expectation, above which it is large: probability 4.6 % under noise alone
(chi-square with one degree of freedom)."""

COUNT_SD, MAX_LARGE = 1.5, 0.22
"""Standard deviation in pixels of the window in which large residuals are counted; and proportion above which a surface
does not explain the views, about five times that of noise. Chosen on `MADE_WITH`."""

DECISIVE, DECISION_SD = 0.3, 3.0
"""Mean difference of the surfaces' squared residuals that decides between them, and standard deviation in pixels of its
window. Chosen on `MADE_WITH`."""

MIN_PATCH = 20
"""Area in pixels up to which a patch explained by one surface is attributed to chance: about the area of the window of
`COUNT_SD` (14). Chosen on `MADE_WITH`."""

OUTLINE_SMOOTHING = 1.5
"""Standard deviation in pixels of the Gaussian that smooths a boundary. Chosen on `MADE_WITH`."""

CLEAR_REACHES = 1.25
"""Distance from a boundary, in reaches of blur and filters (`_reach`), beyond which pixels are unoccluded and used in
the second estimate. Chosen on `MADE_WITH`."""

OUTLINE_SD = 2.0
"""Standard deviation in pixels of a boundary's position after it is moved to an image edge. Chosen on `MADE_WITH`."""

UNDECIDED = 0.4
"""Standard deviation of a boundary's position, relative to the excess width of the undecided band between the surfaces
beyond that explained by blur (the band is narrower where both surfaces explain the views). Chosen on `MADE_WITH`."""


@dataclass(frozen=True, slots=True, eq=False)
class Located:
    """Where outlines lie."""

    zone: Zone
    planes: FloatArray
    is_near: Mask  # H x W: whether a pixel lies on the near side
    distance: FloatArray  # pixels from the nearest outline
    place_sd: FloatArray  # standard deviation in pixels of the nearest outline's place
    reach: FloatArray  # how far residuals reach from the outline on each pixel's side
    is_explained: Mask  # H x W: by the surface on the pixel's side

    @property
    def is_unoccluded(self) -> Mask:
        """Return the pixels that outlines do not reach (H x W)."""
        return ~self.zone.is_inside | (self.distance > CLEAR_REACHES * self.reach)


def locate(
    equalised: Equalised,
    nodes: Nodes,
    jump_sd: FloatArray,
    is_reliable: Mask,
    is_settled: Mask,
    images: Sequence[Image],
) -> Located | None:
    """Return outlines between the surfaces that are continued from reliable nodes (h x w); None where there are none.

    No outline runs through pixels that are settled (H x W): windows give their depth.
    """
    gap, radii = equalised.jump_gap(), equalised.radii
    planes = surface_planes(nodes.level, nodes.sd, is_reliable, gap)
    pairs = jump_pairs(planes, jump_sd, is_reliable, gap)
    if not (pairs >= 0).any():
        return None
    reach = equalised.zone_reach()
    zone = nearest_surfaces(pairs, planes, nodes.sd, equalised.step, is_settled.shape, reach)
    near, far = (
        squared_residual(equalised, level, sd) for level, sd in ((zone.near, zone.near_sd), (zone.far, zone.far_sd))
    )
    is_explained_by_near, is_explained_by_far = few_large(near), few_large(far)
    # Where both surfaces explain the views, the better one does, if it is clearly better.
    better = smoothed(np.clip(far - near, -LARGE_RESIDUAL, LARGE_RESIDUAL), DECISION_SD)
    is_only_near = _without_specks(is_explained_by_near & (better > DECISIVE) & zone.is_inside)
    is_only_far = _without_specks(is_explained_by_far & (better < -DECISIVE) & zone.is_inside)
    if not (is_only_near.any() and is_only_far.any()):
        return None
    del near, far, better  # each as large as the tile
    reach_near, reach_far = _reach(*(blurs_at(level, radii) for level in (zone.near, zone.far)))
    to_near, to_far = (ndimage.distance_transform_edt(~part) for part in (is_only_near, is_only_far))
    inward = smoothed(((to_far - ONSET * reach_far) - (to_near - ONSET * reach_near)) / 2, OUTLINE_SMOOTHING)
    is_near = _at_edges(inward > 0, zone, is_settled, images, blurs_at(zone.near, radii))
    distance, nearest = _distance(is_near, zone, is_settled)
    undecided = to_near + to_far - ONSET * (reach_near + reach_far)
    return Located(
        zone,
        planes,
        is_near,
        distance,
        np.hypot(OUTLINE_SD, UNDECIDED * undecided)[nearest],
        np.where(is_near, reach_near, reach_far),
        np.where(is_near, is_explained_by_near, is_explained_by_far),
    )


def _at_edges(is_near: Mask, zone: Zone, is_settled: Mask, images: Sequence[Image], blur: FloatArray) -> Mask:
    """Return the `near` side (H x W) with its outlines moved to where the views have edges."""
    distance, nearest = _distance(is_near, zone, is_settled)
    inward = np.where(is_near, distance, -distance) if np.isfinite(distance).all() else np.where(is_near, 1e3, -1e3)
    moved = moved_to_edges(inward, distance < 1, images, blur)[nearest]
    return np.where(distance < EDGE_SEARCH + 1, inward > moved, is_near)


def _distance(is_near: Mask, zone: Zone, is_settled: Mask) -> tuple[FloatArray, tuple[NDArray[np.intp], ...]]:
    """Pixels from the nearest outline, a border of the `near` side (H x W) between the surfaces of one jump; its place.

    No outline runs through pixels that are settled (H x W).
    Where three surfaces meet, the middle one is on the far side of one outline and on the near side of another.
    """
    own, other = np.where(is_near, zone.near, zone.far), np.where(is_near, zone.far, zone.near)
    beside = np.zeros(is_near.shape, np.bool_)
    for first, second in NEIGHBOURS:
        border = (is_near[first] != is_near[second]) & zone.is_inside[first] & zone.is_inside[second]
        border &= ~(is_settled[first] & is_settled[second])
        for one, two in ((first, second), (second, first)):
            border &= np.abs(own[two] - other[one]) < np.abs(own[two] - own[one])
        beside[first] |= border
        beside[second] |= border
    if not beside.any():
        return np.full(is_near.shape, np.inf), tuple(np.indices(is_near.shape))
    distance, nearest = ndimage.distance_transform_edt(~beside, return_indices=True)
    return distance + 0.5, tuple(nearest)


def _reach(near: FloatArray, far: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the reach (pixels) of residuals on the near and far side of an outline; blur radii are n x H x W.

    A view meets the outline within the near surface's blur; the filter that compares it widens that by the other
    view's blur, at the depth that it is compared at.
    """
    pairs = [(i, j) for i in range(len(near)) for j in range(len(near)) if i != j]
    return (np.max([near[i] + near[j] for i, j in pairs], axis=0), np.max([near[i] + far[j] for i, j in pairs], axis=0))


def squared_residual(equalised: Equalised, level: FloatArray, sd: FloatArray) -> FloatArray:
    """Squared residual at `level` (H x W, known to `sd`), over its expectation by noise, `sd` and the error of blur."""
    level = np.clip(level, 0, equalised.levels - 1)
    left, slope = np.zeros(level.shape, np.float32), np.zeros(level.shape, np.float32)
    for residual in equalised.residuals:
        value, derivative = residual.at(level.astype(np.float32))
        left += value**2
        slope += derivative**2
    expected = np.interp(level, np.arange(equalised.levels), equalised.noise)
    error = BLUR_ERROR * equalised.levels_per_pixel * equalised.blur(level)
    return left / (expected + slope * (sd**2 + error**2))


def few_large(residual: FloatArray) -> Mask:
    """Test whether few of the squared residuals about a pixel are large: the depth explains them."""
    large = (residual > LARGE_RESIDUAL).astype(np.float32)
    return np.asarray(smoothed(large, COUNT_SD) < MAX_LARGE)


def _without_specks(part: Mask) -> Mask:
    label, count = ndimage.label(part)
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    return np.asarray((size > MIN_PATCH)[label])
