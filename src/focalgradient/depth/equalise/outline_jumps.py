"""Depth discontinuities too small for any pixel's views to contradict each other, found from depth alone.

Where blur has nearly the same size on both sides, it mixes the surfaces, and the estimated depth changes steeply over a
stretch no longer than the reach of window and blur. A plane with a jump is fitted to the nodes beyond that stretch
(`docs/report/method.md`). Windows average both surfaces, weighted by the information in their textures, so that depth
at the boundary is known; each surface is continued to the boundary.

Constants without a figure were chosen on spheres of the seeds 5 (two apertures and two foci), 6 and 8 (two apertures,
focused before and behind everything), and on the scenes `MADE_WITH` and `CONTROLS` of
`benchmarks/depth_at_outlines.py`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from scipy import ndimage

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.outline_places import blurs_at, moved_to_edges
from focalgradient.depth.filters import Image
from focalgradient.depth.numerics import NEIGHBOURS
from focalgradient.depth.planes import APART, JUMP_SDS, LEAST_SD, NOTHING, REORDERED, WEAK_SLOPE_SD, add, fit_jump
from focalgradient.parallel import share_rows

__all__ = ["ALL_WINDOWS", "SCATTER_WINDOWS", "between_surfaces", "find_small_jumps", "variance_beside_jumps"]

DIRECTIONS = 8
"""Number of directions, 22.5 degrees apart, in which depth discontinuities are searched. Chosen by hand."""

SIDE_LENGTH, SIDE_WIDTH = 2.2, 0.8
"""Length and half-width of the strip on either side in which depth is evaluated, relative to the reach of window and
blur. Chosen on `MADE_WITH` and `CONTROLS`."""

BETWEEN = 0.2
"""Minimum difference between the depth of a grid point and the mean of either side, relative to their difference, for
the point to lie between them. Chosen on `MADE_WITH` and `CONTROLS`."""

MOSTLY = 0.7
"""Minimum proportion of the depth difference that must be due to the discontinuity and not to the plane's slope. With
0.5 the spheres have the same depth, and 79 % of a photograph (`analysis/motorcycle.py`) is valid with a median error of
0.70 %; with 0.7, 80 % and 0.68 %."""

SMALL_MIN_JUMP = 0.2
"""Minimum difference of blur radius, in pixels of the widest view, at a small discontinuity. Chosen on `MADE_WITH` and
`CONTROLS`."""

SIDE_SLOPE_SD = 0.4
"""Prior standard deviation of the slope of the surfaces on either side of a jump, in levels per node. Chosen on
`MADE_WITH` and `CONTROLS`."""

MIN_COVERAGE = 1.0
"""Minimum number of grid points on either side, relative to the squared reach of window and blur: half of all points.
"""

SMALL_MIN_BLUR = 3.5
"""Minimum blur radius in pixels at which small discontinuities are searched; below it, clutter and curved surfaces are
mistaken for them. With 4 pixels 81.5 % of a photograph (`analysis/motorcycle.py`) is valid, with a median error of .65
%; with this 80.8 % and .66 %; near boundaries of spheres seen with two foci, 8.9 and 7.7 % of valid depth is in error
by more than 10 %."""

IN_FOCUS = 1.0
"""Blur radius in pixels below which small discontinuities are searched, too: a surface in focus contains little
information on depth, and windows next to a blurred surface take the depth of that surface. Near boundaries of spheres
before a wall in focus, 14 and 9 % of valid depth is in error by more than 10 % without this, 9 and 6 % with it (seeds 6
and 8); 15 and 8 %, 10 and 5 % for held-out seeds (13 and 14)."""

RISE_REACH, RISE_SD = 1.5, 0.5
"""Distance from an untreated discontinuity within which depth may be affected by it, relative to the reach of window
and blur; and standard deviation added there, relative to the discontinuity. In two wavebands of an eye that views a
step or spheres (`benchmarks/eye_at_outlines.py`, seed 0), 7, 11 and 12 % of valid depth was beyond 5 standard
deviations without this, 0, 0.3 and 3 % with it."""

SURFACE_SMOOTHING = 1.5
"""Standard deviation in grid points of the Gaussian that smooths the two surfaces along a boundary. Chosen on
`MADE_WITH`."""


SCATTER_SHARE = 0.5
"""Proportion of the local variance of depth about its plane that is added to the variance of depth. Chosen by hand."""

SCATTER_WINDOWS, ALL_WINDOWS = 2.0, 4.0
"""Distance in windows over which a jump scatters depth, and invalidates it, where boundaries are found: 95 % of a
window's weight; and where none is looked for: all of it. Planes that grow farther leave out what lies on another
surface."""


def variance_beside_jumps(equalised: Equalised, nodes: Nodes, windows: float, reach: float = 0.0) -> FloatArray:
    """Return the variance that a jump adds to depth beside it, where blur mixes what lies on either side (h x w).

    It is half the variance of depth about its local plane, in levels squared. The window, wider by `reach` pixels, ends
    at `windows` standard deviations; nodes of infinite sd do not count.
    """
    trust = 1 / (1 + nodes.sd**2)  # full where depth is known to a level or so

    def local(values: FloatArray) -> FloatArray:
        margin = min(round(windows * sd) + 1, *(n - 1 for n in values.shape))
        wide = np.pad(values, margin, mode="reflect")
        return ndimage.gaussian_filter(wide, sd, truncate=windows)[margin:-margin, margin:-margin]

    sd = (equalised.window + reach) / equalised.step
    total = np.maximum(local(trust), 1e-9)
    mean = local(trust * nodes.level) / total
    spread = local(trust * nodes.level**2) / total - mean**2
    down, right = np.gradient(mean)
    return SCATTER_SHARE * np.maximum(spread - sd**2 * (down**2 + right**2), 0)


def find_small_jumps(
    equalised: Equalised, nodes: Nodes, is_reliable: Mask, images: Sequence[Image]
) -> tuple[Mask, Mask, FloatArray, FloatArray, FloatArray] | None:
    """Return the surfaces on either side of small jumps among reliable nodes; None where there are none.

    H x W each: whether a pixel is in reach of a jump; whether it lies on the near side; its distance from the nearest
    outline, in pixels; the level of the surface on its side; and the levels from the far surface to the near one.

    Parameters
    ----------
    equalised, nodes
        The views, compared at every level; and depth as windows give it.
    is_reliable
        h x w: nodes whose depth counts.
    images
        The views themselves, H x W each.
    """
    shape, reach = images[0].shape, equalised.reach(nodes)
    far, near, between = _surfaces(
        nodes.level, nodes.sd, is_reliable, reach, SMALL_MIN_JUMP * equalised.levels_per_pixel
    )
    blur = reach * equalised.step - equalised.window
    found = (near > far) & ((blur >= SMALL_MIN_BLUR) | (blur < IN_FOCUS))
    if not found.any():
        return None
    apart, index = ndimage.distance_transform_edt(~found, return_indices=True)
    is_inside = equalised.to_blocks(apart <= reach[tuple(index)], shape)
    share = ndimage.gaussian_filter(found.astype(float), SURFACE_SMOOTHING)
    there = share > 1e-6  # beyond, the nearest such node
    nearest = ndimage.distance_transform_edt(~there, return_distances=False, return_indices=True)
    smooth = [
        ndimage.gaussian_filter(values, SURFACE_SMOOTHING) / np.maximum(share, 1e-6) for values in (far, near, between)
    ]
    surfaces = *(values[tuple(nearest)] for values in smooth), nodes.level
    low, high, middle, level = (equalised.to_pixels(values, nodes.sd, shape) for values in surfaces)
    is_near = level > middle
    border = np.zeros(shape, np.bool_)
    for first, second in NEIGHBOURS:
        changes = (is_near[first] != is_near[second]) & is_inside[first] & is_inside[second]
        border[first] |= changes
        border[second] |= changes
    if not border.any():
        return None
    distance, nearest = ndimage.distance_transform_edt(~border, return_indices=True)
    distance += 0.5
    blurs = blurs_at(np.maximum(level, high), equalised.radii)
    moved = moved_to_edges(np.where(is_near, distance, -distance), border, images, blurs)[tuple(nearest)]
    inward = np.where(is_near, distance, -distance) - moved
    is_near, distance = inward > 0, np.abs(inward)
    is_inside &= distance <= equalised.step * equalised.to_pixels(reach, nodes.sd, shape)
    own = np.where(is_near, np.maximum(level, high), np.minimum(level, low))
    return is_inside, is_near, distance, own, high - low


def between_surfaces(equalised: Equalised, nodes: Nodes, is_reliable: Mask) -> tuple[Mask, FloatArray]:
    """Nodes at which depth alone shows a jump, and the variance of depth about the two surfaces in levels squared.

    h x w each. At these nodes windows give a depth between the surfaces, and farther from the jump it may still be part
    of the rise. Arguments are those of `find_small_jumps`.
    """
    reach = equalised.reach(nodes)
    far, near, _ = _surfaces(nodes.level, nodes.sd, is_reliable, reach, SMALL_MIN_JUMP * equalised.levels_per_pixel)
    found = near > far
    if not found.any():
        return found, np.zeros(found.shape)
    apart, index = ndimage.distance_transform_edt(~found, return_indices=True)
    nearest = tuple(index)
    return found, np.where(apart <= RISE_REACH * reach[nearest], (RISE_SD * (near - far)[nearest]) ** 2, 0.0)


def _surfaces(
    level: FloatArray, sd: FloatArray, is_reliable: Mask, reach: FloatArray, least: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Levels of the far and the near surface at each node (h x w) in a small jump, and that at the outline; else 0.

    `reach` (h x w) is how far window and blur reach, in nodes; `least` the levels from which a difference is a jump.

    A jump between columns 12 and 13 that windows have smoothed; a plane; and a crease.

    >>> column = np.arange(26.0) + np.zeros((20, 1))
    >>> even = np.full(column.shape, 0.3), np.ones(column.shape, bool), np.full(column.shape, 3.0)
    >>> far, near, _ = _surfaces(6 * np.clip((column - 9.5) / 6, 0, 1), *even, 2.0)
    >>> (near > far)[10].nonzero()[0].tolist(), far[10, 12].round(1).item(), near[10, 12].round(1).item()
    ([12, 13], 0.3, 5.6)
    >>> [bool(_surfaces(depth, *even, 2.0)[1].any()) for depth in (column, np.maximum(column, 12.5))]
    [False, False]
    """
    found = np.zeros((3, *level.shape))
    information = np.where(is_reliable, 1 / (sd**2 + LEAST_SD**2), 0.0)
    share_rows(len(level), lambda first, last: _find(level, information, reach, least, first, last, found))
    return found[0], found[1], found[2]


@njit(nogil=True, cache=True, fastmath=REORDERED)
def _find(level, information, reach, least, first, last, found):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for j in range(level.shape[1]):
            if information[i, j] == 0:
                continue
            most = 0.0
            for direction in range(DIRECTIONS):
                down, right = np.sin(np.pi * direction / DIRECTIONS), np.cos(np.pi * direction / DIRECTIONS)
                if _rises_little(level, information, reach[i, j], i, j, down, right, least / 2):
                    continue
                count, other, sums = _sides(level, information, reach[i, j], i, j, down, right)
                apart = APART if reach[i, j] >= 2 * APART else 1
                if min(count, other) < max(5, MIN_COVERAGE * (reach[i, j] / apart) ** 2):
                    continue
                before, after = sums[0] / 2 - sums[9], sums[0] / 2 + sums[9]  # weight of either side
                low, high = (sums[6] / 2 - sums[12]) / before, (sums[6] / 2 + sums[12]) / after
                one, two, rise = before / count, after / other, high - low  # mean weights
                sure = abs(rise) / np.sqrt((1 / one + 1 / two) / 2)
                if sure < JUMP_SDS or min(-low / rise, high / rise) < BETWEEN:
                    continue
                _, jump = fit_jump(sums, WEAK_SLOPE_SD)
                if sure * jump / rise <= most:
                    continue
                most = sure * jump / rise  # of the direction in which most of the rise is a jump
                if jump / rise > MOSTLY and abs(jump) >= least:
                    middle, jump = fit_jump(sums, SIDE_SLOPE_SD)
                    found[0, i, j] = level[i, j] + middle - abs(jump) / 2
                    found[1, i, j] = level[i, j] + middle + abs(jump) / 2
                    # Windows give the mean of both sides, weighted by their information.
                    found[2, i, j] = level[i, j] + middle + jump * (two - one) / (two + one) / 2


@njit(nogil=True, cache=True)
def _rises_little(level, information, reach, i, j, down, right, least):  # type: ignore[no-untyped-def]
    """Return whether one known node on either side of a node shows hardly a difference of depth."""
    rows, columns = level.shape
    far = (1 + SIDE_LENGTH) / 2 * reach
    k, m = round(i + far * down), round(j + far * right)
    p, q = round(i - far * down), round(j - far * right)
    if not (0 <= k < rows and 0 <= m < columns and 0 <= p < rows and 0 <= q < columns):
        return False
    return information[k, m] > 0 and information[p, q] > 0 and abs(level[k, m] - level[p, q]) < least


@njit(nogil=True, cache=True, fastmath=REORDERED)
def _sides(level, information, reach, i, j, down, right):  # type: ignore[no-untyped-def]
    """Return the numbers of nodes on either side of a jump across a direction, and the sums of `planes` over them."""
    rows, columns = level.shape
    far = SIDE_LENGTH * reach
    sums = NOTHING
    before = after = 0
    apart = APART if reach >= 2 * APART else 1
    for k in range(i - min(i, int(far)) // apart * apart, min(rows, i + int(far) + 1), apart):
        left, end = _strip(columns, reach, far, k - i, j, down, right, apart)
        for m in range(left, end, apart):
            along, across = (k - i) * down + (m - j) * right, (m - j) * down - (k - i) * right
            if information[k, m] == 0 or not reach <= abs(along) <= far or abs(across) > SIDE_WIDTH * reach:
                continue
            before += along <= 0
            after += along > 0
            weight, side = information[k, m], 0.5 if along > 0 else -0.5
            sums = add(sums, weight, along, across, weight * (level[k, m] - level[i, j]), side)
    return before, after, sums


@njit(nogil=True, cache=True)
def _strip(columns, reach, far, row, j, down, right, apart):  # type: ignore[no-untyped-def]
    """Return the first column, and the end, of a row that lies within the strip across `row` rows below a node."""
    left, end = max(0, j - int(far)), min(columns, j + int(far) + 1)
    if down > 1e-6:  # what lies across is a strip, and little of the square
        middle, half = j + row * right / down, SIDE_WIDTH * reach / down + 1
        left, end = max(left, int(middle - half)), min(end, int(middle + half) + 2)
    return left + (j - left) % apart, end
