"""Local planes: weighted least squares about a node, with or without a jump, and the surfaces on either side of jumps.

Sums and fits are compiled. Windows grow over whatever lies on one surface; where depth jumps, the planes of nodes on
either side are continued to the jump.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.numerics import at_nodes, repeat_blocks
from focalgradient.parallel import share_rows

__all__ = [
    "HELD_APART",
    "SMOOTH",
    "STEEP",
    "Growth",
    "Zone",
    "continue_surfaces",
    "departure_from_planes",
    "grow_planes",
    "jump_pairs",
    "nearest_surfaces",
    "surface_planes",
]

REORDERED = {"contract", "reassoc", "nsz", "arcp"}
"""Compiler options for sums: terms may be added in another order, several at a time. Infinity and NaN are kept."""


@dataclass(frozen=True, slots=True)
class Growth:
    """Adaptive window schedule of plane fits, and the distance at which values are left out."""

    windows: tuple[float, ...]  # in units of the window asked for
    separate: float  # squared distance, over the variance, beyond which two values do not lie on one surface

    @property
    def first(self) -> Growth:
        """Return the first windows only."""
        return replace(self, windows=self.windows[:2])


SMOOTH = Growth((0.5, 0.75, 1.125, 1.7), 49.0)
"""Window schedule for smooth surfaces: windows grow by half, from half the requested one; values 7 standard deviations
apart belong to different surfaces. Chosen by hand."""

HELD_APART = Growth((0.5, 0.75, 1.125, 1.7, 2.5), 16.0)
"""Window schedule for surfaces close to each other: values 4 standard deviations apart belong to different surfaces, so
that fewer are attributed to the wrong one where they meet; planes extend as far in narrower windows. Chosen on
`MADE_WITH` of `benchmarks/depth_at_outlines.py`."""

STEEP = 2.0
"""Prior standard deviation of depth's slope within a window, in levels per block. Chosen by hand."""

UNKNOWN = 1e-9
"""Information on a jump, relative to that on the level, below which it is rounding: all nodes then lie on one side."""

WEAK_SLOPE_SD = 1e3
"""Prior standard deviation of a plane's slope, in levels per node, which leaves it open, for a line of nodes to be
enough."""

NOTHING = (0.0,) * 13
"""Sums over no value: of the weights by 1, y, x, y^2, y x and x^2; of the value by 1, y and x; of the side by 1, y, x
and value."""


@njit(inline="always")
def add(sums, weight, y, x, weighted, side=0.0):  # type: ignore[no-untyped-def]
    """Return `sums` with a value of `weight` at (y, x), `weighted` by it, on the `side` -1/2 or 1/2 of a jump."""
    one, y1, x1, yy, yx, xx, v, vy, vx, s, sy, sx, sv = sums
    wy, wx, ws = weight * y, weight * x, weight * side
    plane = (one + weight, y1 + wy, x1 + wx, yy + wy * y, yx + wy * x, xx + wx * x)
    values = (v + weighted, vy + weighted * y, vx + weighted * x)
    return plane + values + (s + ws, sy + ws * y, sx + ws * x, sv + weighted * side)


@njit(nogil=True, cache=True)
def inverse(sums, steep):  # type: ignore[no-untyped-def]
    """Return the 6 elements of the inverse of the normal matrix of a plane; its slopes have the prior sd `steep`."""
    one, y1, x1, yy, yx, xx = sums[0] + 1e-9, sums[1], sums[2], sums[3] + steep**-2, sums[4], sums[5] + steep**-2
    c0, c1, c2 = yy * xx - yx * yx, x1 * yx - y1 * xx, y1 * yx - x1 * yy
    det = one * c0 + y1 * c1 + x1 * c2
    return (
        c0 / det,
        c1 / det,
        c2 / det,
        (one * xx - x1 * x1) / det,
        (x1 * y1 - one * yx) / det,
        (one * yy - y1 * y1) / det,
    )


@njit(nogil=True, cache=True)
def dot(one, other):  # type: ignore[no-untyped-def]
    """Return the product of two vectors of 3."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


@njit(nogil=True, cache=True)
def times(matrix, vector):  # type: ignore[no-untyped-def]
    """Return the product of a symmetric matrix, as `inverse` returns it, and a vector."""
    a, b, c, d, e, f = matrix
    return dot((a, b, c), vector), dot((b, d, e), vector), dot((c, e, f), vector)


@njit(nogil=True, cache=True)
def fit_plane(sums, steep):  # type: ignore[no-untyped-def]
    """Return value, slope down and slope right at the node of the plane through values, and the squares it explains."""
    plane = times(inverse(sums, steep), sums[6:9])
    return plane, dot(plane, sums[6:9])


@njit(nogil=True, cache=True)
def fit_jump(sums, steep):  # type: ignore[no-untyped-def]
    """Return the value half-way up a jump of a plane, and the jump; 0 if values lie on one side of it alone."""
    matrix, side = inverse(sums, steep), sums[9:12]
    plane, by_jump = times(matrix, sums[6:9]), times(matrix, side)
    known = sums[0] / 4 - dot(by_jump, side)
    if known <= UNKNOWN * sums[0]:
        return 0.0, 0.0
    jump = (sums[12] - dot(plane, side)) / known
    return plane[0] - by_jump[0] * jump, jump


def grow_planes(
    weight: FloatArray,
    weighted: FloatArray,
    level: FloatArray,
    sd: FloatArray,
    windows: list[float],
    steep: float,
    separate: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the planes fitted about each block, in windows that grow over whatever lies on one surface.

    Adaptive weights (propagation and separation, after Polzehl and Spokoiny): from one window to the next, a
    neighbour counts by how well its own value agrees with the plane so far, so that depth is gathered along a
    surface and not across its edge.

    Parameters
    ----------
    weight, weighted
        Weight of each block, and its value times that weight; h x w.
    level
        Value to start from, h x w.
    sd
        Standard deviation of the noise in which `weight` is an inverse variance, h x w.
    windows
        Gaussian windows (sd, in blocks), from the narrowest up.
    steep
        Prior standard deviation of a plane's slope, per block.
    separate
        Squared distance, over the variance, beyond which a neighbour does not count.

    Returns
    -------
    value, sd
        h x w each.
    """
    # value, slope down, slope right, variance for noise of variance 1, still growing
    state = np.stack([level, 0 * level, 0 * level, np.full_like(level, np.inf), np.ones_like(level)])
    for window in windows:
        grown, variance = state.copy(), state[3] * sd**2
        grown[4] = 0

        def work(first: int, last: int) -> None:
            _grow_planes(weight, weighted, variance, state, window, steep, separate, first, last, grown)  # noqa: B023

        share_rows(len(level), work)
        state = grown
    return state[0], sd * np.sqrt(state[3])


@njit(nogil=True, cache=True, fastmath=REORDERED)
def _grow_planes(  # type: ignore[no-untyped-def]
    weight, weighted, variances, state, window, steep, separate, first, last, grown
):
    rows, columns = weight.shape
    reach = int(np.ceil(2.2 * window))
    fall = np.exp(-(np.arange(reach + 1) ** 2) / (2 * window * window))
    for row in range(first, last):
        for column in range(columns):
            if state[4, row, column] == 0:
                continue
            value, down, right = state[0, row, column], state[1, row, column], state[2, row, column]
            variance = variances[row, column]
            sums = squares = NOTHING
            for i in range(max(0, row - reach), min(rows, row + reach + 1)):
                y = i - row
                for j in range(max(0, column - reach), min(columns, column + reach + 1)):
                    x = j - column
                    # At the start every variance is infinite, and every neighbour counts.
                    apart = state[0, i, j] - (value + down * y + right * x)
                    s = min(1.0, apart * apart / (separate * (variance + variances[i, j])))
                    w = fall[abs(y)] * fall[abs(x)] * (1 - s) * (1 - s)
                    a = w * weight[i, j]
                    sums = add(sums, a, y, x, w * (weighted[i, j] - weight[i, j] * value))
                    squares = add(squares, w * a, y, x, 0.0)
            matrix = inverse(sums, steep)  # without evidence the plane is flat
            step = times(matrix, sums[6:9])
            if np.isfinite(variance) and step[0] ** 2 > 9 * variance:
                continue  # the wider window contradicts the narrower one: growth ends here
            spread = dot(matrix[:3], times(squares[:6], matrix[:3]))
            grown[0, row, column], grown[1, row, column], grown[2, row, column] = value + step[0], step[1], step[2]
            grown[3, row, column], grown[4, row, column] = max(spread, 1e-12), 1


PLANE_REACH = 4
"""Radius in grid points of the first window in which a plane is fitted: two `PLANE_SD`."""

PLANE_SD = 2.0
"""Standard deviation in grid points of the first window in which a plane is fitted. Chosen on `MADE_WITH` of
`benchmarks/depth_at_outlines.py`."""

APART = 2
"""Spacing in grid points of the fits in wider windows, which largely overlap; it saves a fifth of the time with
boundaries."""

PLANE_SLOPE_SD = 1.0
"""Prior standard deviation of a plane's slope, in levels per grid point. Chosen on `MADE_WITH`."""

LEAST_SD = 0.2
"""Standard deviation in levels added to that of every grid point; more precise points have equal weights. Chosen by
hand."""

CURVATURE_LEAST_SD = 0.7
"""`LEAST_SD` in the measurement of curvature. Chosen on `MADE_WITH`."""

JUMP_SDS = 6.0
"""Minimum depth difference at a discontinuity, in standard deviations: about 300 000 places and directions are tested
per megapixel. Chosen on `MADE_WITH` and `CONTROLS`."""

WIDEST_PLANE_SD = 8.0
"""Standard deviation in grid points of the widest window in which a plane is fitted; windows double while the plane
fits. Chosen on `MADE_WITH`."""

CURVATURE_WINDOW = 1.5
"""Standard deviation of the window in which the departure of depth from a plane is measured, relative to the reach of
blur and window. Chosen on `MADE_WITH`."""

STRAIGHT = 2
"""Radius in grid points within which the largest departure from a plane is used, as the middle of a blurred
discontinuity is straight. Chosen on `MADE_WITH`."""

CURVED_RATIO = 2.0
"""Ratio of the variance about a plane to that explained by noise above which a surface is not plane; painted planes
have less."""

PLANE_SPAN = round(PLANE_REACH * WIDEST_PLANE_SD / PLANE_SD)
"""Maximum extent of a plane in grid points: `PLANE_REACH` in the widest window."""

FITS = 1.0
"""Maximum mean squared distance of grid points from a plane, relative to their variance, for the plane to fit: the
expectation under noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Zone:
    """The near and the far surface near jumps of depth, in levels; H x W each."""

    is_inside: Mask  # in reach of a jump
    near: FloatArray
    near_sd: FloatArray
    far: FloatArray
    far_sd: FloatArray


def surface_planes(level: FloatArray, sd: FloatArray, is_reliable: Mask, gap: float) -> FloatArray:
    """Return the planes through reliable nodes (h x w) and those about them on one surface.

    Nodes that lie off the plane through the nearest ones by half a `gap` and 3 sd are on another surface. A plane is
    fitted in ever wider windows while it fits. Returns 4 x h x w, 0 where a node is not reliable: value,
    slope down, slope right (by node), and the nodes over which it is continued for its variance to double.
    """
    found = np.zeros((4, *level.shape))
    # A node's weight, and the window's: worked out once, as every node is in some hundred windows.
    information = np.where(is_reliable, 1 / (sd**2 + LEAST_SD**2), 0.0)
    widths = PLANE_SD * 2 ** np.arange(round(np.log2(WIDEST_PLANE_SD / PLANE_SD)) + 1)
    side = np.arange(int(PLANE_REACH * WIDEST_PLANE_SD / PLANE_SD) + 1.0)
    window = np.exp(-(side[:, None] ** 2 + side**2) / (2 * widths[:, None, None] ** 2))
    share_rows(len(level), lambda first, last: _planes(level, sd, information, window, gap / 2, first, last, found))
    return found


@njit(nogil=True, cache=True, fastmath=REORDERED)
def _planes(level, sd, information, window, off, first, last, found):  # type: ignore[no-untyped-def]
    for i in range(first, last):
        for j in range(level.shape[1]):
            if information[i, j] == 0:
                continue
            plane, _, _ = _plane(level, sd, information, window[0], 1.5, 1, i, j, (level[i, j], 0.0, 0.0), off)
            plane, _, _ = _plane(level, sd, information, window[0], PLANE_REACH, 1, i, j, plane, off)
            width = PLANE_SD
            for wider in window[1:]:
                reach = PLANE_REACH * 2 * width / PLANE_SD
                new, squares, total = _plane(level, sd, information, wider, reach, APART, i, j, plane, off)
                if squares > FITS * total or (new[0] - level[i, j]) ** 2 > FITS * (sd[i, j] ** 2 + LEAST_SD**2):
                    break
                plane, width = new, 2 * width
            found[0, i, j], found[1, i, j], found[2, i, j], found[3, i, j] = plane[0], plane[1], plane[2], width / 2


@njit(nogil=True, cache=True, fastmath=REORDERED)
def _plane(level, sd, information, window, reach, apart, i, j, plane, off):  # type: ignore[no-untyped-def]
    """Fit a plane to the nodes about one that lie near `plane`; also the residual sum of squares, and the weight."""
    rows, columns = level.shape
    value, down, right = plane
    far = int(reach)
    total = squares = 0.0
    sums = NOTHING
    for k in range(i - min(i, far) // apart * apart, min(rows, i + far + 1), apart):
        y = float(k - i)
        wide = int(np.sqrt(reach * reach - y * y))
        for m in range(j - min(j, wide) // apart * apart, min(columns, j + wide + 1), apart):
            x = float(m - j)
            on = abs(level[k, m] - value - down * y - right * x) <= off + 3 * sd[k, m]
            share = window[abs(k - i), abs(m - j)] if on and information[k, m] > 0 else 0.0
            weight, rise = share * information[k, m], level[k, m] - level[i, j]
            total += share
            squares += weight * rise * rise
            sums = add(sums, weight, y, x, weight * rise)
    fitted, explained = fit_plane(sums, PLANE_SLOPE_SD)
    return (level[i, j] + fitted[0], fitted[1], fitted[2]), squares - explained, total


def departure_from_planes(
    level: FloatArray, sd: FloatArray, is_informative: Mask, reach: FloatArray, gap: float
) -> FloatArray:
    """Variance of depth about its plane as far as blur and window reach, over what noise explains; h x w, 0 on planes.

    A small jump, over which near and far blur into each other, looks like a steep stretch of one surface, and windows
    give what lies between: the views cannot distinguish the two, so that depth that is not plane is uncertain.

    Parameters
    ----------
    level, sd, is_informative
        h x w: depth at nodes in levels, its standard deviation, and whether it counts.
    reach
        h x w: how far blur and window reach, in nodes.
    gap
        Levels from which a difference is a jump: nodes beyond it are on another surface.
    """
    variance = np.zeros(level.shape)
    width = CURVATURE_WINDOW * reach
    share_rows(len(level), lambda first, last: _curvature(level, sd, is_informative, width, gap, first, last, variance))
    return np.asarray(ndimage.maximum_filter(variance, 2 * STRAIGHT + 1))


@njit(nogil=True, cache=True, fastmath=REORDERED)
def _curvature(level, sd, is_informative, width, gap, first, last, variance):  # type: ignore[no-untyped-def]
    rows, columns = level.shape
    for i in range(first, last):
        for j in range(columns):
            if not is_informative[i, j]:
                continue
            reach, narrow = int(2 * width[i, j]), -1 / (2 * width[i, j] ** 2)
            squares = noise = 0.0
            sums = NOTHING
            apart = APART if reach >= 2 * APART else 1
            for k in range(i - min(i, reach) // apart * apart, min(rows, i + reach + 1), apart):
                y = float(k - i)
                wide = int(np.sqrt(reach * reach - y * y))
                for m in range(j - min(j, wide) // apart * apart, min(columns, j + wide + 1), apart):
                    x, off = float(m - j), level[k, m] - level[i, j]
                    if not is_informative[k, m] or abs(off) > gap + 3 * np.sqrt(sd[k, m] ** 2 + sd[i, j] ** 2):
                        continue
                    weight = np.exp((y * y + x * x) * narrow) / (sd[k, m] ** 2 + CURVATURE_LEAST_SD**2)
                    squares += weight * off * off
                    noise += weight * sd[k, m] ** 2
                    sums = add(sums, weight, y, x, weight * off)
            left = squares - fit_plane(sums, WEAK_SLOPE_SD)[1]
            if left > CURVED_RATIO * noise:
                variance[i, j] = (left - noise) / sums[0]


def jump_pairs(planes: FloatArray, sd: FloatArray, is_reliable: Mask, gap: float) -> NDArray[np.intp]:
    """Nodes at which depth jumps, each with the reliable nodes of the near and the far surface; -1 at all others.

    Returns h x w x 4: row and column of the node that the near surface is continued from, and of the far surface's; -1
    where depth does not jump: where the nearest reliable nodes of neighbours differ by less than `gap`, or as their
    planes slope.
    """
    found = np.full((*is_reliable.shape, 4), -1)
    if not is_reliable.any():
        return found
    nearest = ndimage.distance_transform_edt(~is_reliable, return_distances=False, return_indices=True)
    place = np.indices(is_reliable.shape)
    for axis in (0, 1):
        for shift, border in ((-1, -1), (1, 0)):
            other = np.roll(nearest, shift, axis=axis + 1)
            mine, yours = tuple(nearest), tuple(other)
            one, two = (_value(planes, nodes, place) for nodes in (mine, yours))
            plain = planes[0][mine] - planes[0][yours]
            least = np.maximum(gap, JUMP_SDS * np.hypot(sd[mine], sd[yours]))
            # Both by the nodes' own levels and by their planes here: a slope is not a jump.
            jump = (np.minimum(np.abs(one - two), np.abs(plain)) > least) & ((one > two) == (plain > 0))
            jump[(slice(None),) * axis + (border,)] = False
            both = np.concatenate(
                [np.where(one > two, nearest, other), np.where(one > two, other, nearest)]  # nearer is a higher level
            )
            new = jump & (found[..., 0] < 0)
            found[new] = both[:, new].T
    return found


def nearest_surfaces(
    pairs: NDArray[np.intp], planes: FloatArray, sd: FloatArray, step: int, shape: tuple[int, int], reach: int
) -> Zone:
    """Return the two surfaces of the nearest jump at every pixel (H x W), as far as `reach` pixels from it."""
    jumps = repeat_blocks(pairs[..., 0] >= 0, step, shape)
    distance, index = ndimage.distance_transform_edt(~jumps, return_indices=True)
    pair = pairs[index[0] // step, index[1] // step]
    place = _places(shape, step)
    near, far = (pair[..., 0], pair[..., 1]), (pair[..., 2], pair[..., 3])
    return Zone(
        np.asarray(distance <= reach),
        _value(planes, near, place),
        _sd(planes, sd, near, place),
        _value(planes, far, place),
        _sd(planes, sd, far, place),
    )


def continue_surfaces(
    zone: Zone,
    is_near: Mask,
    planes: FloatArray,
    node_level: FloatArray,
    node_sd: FloatArray,
    is_reliable: Mask,
    step: int,
    gap: float,
) -> tuple[FloatArray, FloatArray]:
    """Level of the surface on each pixel's side, and its sd: continued from the nearest reliable node of that surface.

    `is_near` (H x W) is the side of each pixel. The surface is that of the zone to within `gap`.
    """
    shape = is_near.shape
    level, sd = np.where(is_near, zone.near, zone.far), np.where(is_near, zone.near_sd, zone.far_sd)
    same = is_reliable & (np.abs(node_level - at_nodes(level, step)) < gap)
    place = _places(shape, step)
    for side in (True, False):
        some = same & (at_nodes(is_near, step) == side)
        if not some.any():
            continue
        index = ndimage.distance_transform_edt(~some, return_distances=False, return_indices=True)
        own = tuple(repeat_blocks(part, step, shape) for part in index)
        value = _value(planes, own, place)
        use = (is_near == side) & (np.abs(value - level) < gap)
        level[use], sd[use] = value[use], _sd(planes, node_sd, own, place)[use]
    return level, sd


Place = tuple[NDArray[np.intp], ...]


def _places(shape: tuple[int, ...], step: int) -> FloatArray:
    """Return the row and column of each pixel in the grid of nodes: 2 x H x W."""
    return (np.indices(shape) + 0.5) / step - 0.5


def _value(planes: FloatArray, node: Place, place: FloatArray | NDArray[np.intp]) -> FloatArray:
    """Level, at `place`, of the plane about a `node`; within the levels searched on the far side."""
    down, right = place[0] - node[0], place[1] - node[1]
    return np.maximum(planes[0][node] + planes[1][node] * down + planes[2][node] * right, 0)


def _sd(planes: FloatArray, sd: FloatArray, node: Place, place: FloatArray) -> FloatArray:
    span = np.maximum(planes[3][node], 1)
    return sd[node] * np.sqrt(1 + ((place[0] - node[0]) ** 2 + (place[1] - node[1]) ** 2) / span**2)
