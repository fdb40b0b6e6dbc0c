"""The local plane: weighted least squares of a plane through values about a node, with or without a jump, compiled."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.parallel import share_rows

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
    weight: NDArray[np.float64],
    weighted: NDArray[np.float64],
    level: NDArray[np.float64],
    sd: NDArray[np.float64],
    windows: list[float],
    steep: float,
    separate: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
