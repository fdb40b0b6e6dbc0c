"""Minima of a cost over candidates, at each place."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.depth.validity import SECONDARY_MINIMUM
from focalgradient.parallel import share_rows

__all__ = ["parabola_minimum", "read_minima"]


def parabola_minimum(
    cost: NDArray[np.floating],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return place, value and curvature of the least of a cost, by the parabola through three even candidates.

    Along the first axis, L x ...; the place counts candidates from 0, and lies within one of the least inner one.

    >>> place, value, curvature = parabola_minimum(np.array([4.0, 1.25, 0.5, 1.75]))
    >>> round(float(place), 3), round(float(value), 3), float(curvature)
    (1.875, 0.484, 2.0)
    """
    best = np.clip(cost.argmin(axis=0), 1, len(cost) - 2)
    before, here, after = (np.take_along_axis(cost, (best + way)[None], 0)[0].astype(float) for way in (-1, 0, 1))
    bend = np.maximum(before - 2 * here + after, 1e-30)
    shift = np.clip((before - after) / (2 * bend), -1, 1)
    return best + shift, here + shift * ((after - before) + shift * bend) / 2, bend


def read_minima(
    energy: NDArray[np.floating],
    expected: NDArray[np.float64],
    noise_slope: NDArray[np.float64],
    noise: float,
    size: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Find each node's minimum of the cost, its width, the misfit and the texture there, and whether it is unambiguous.

    Parameters
    ----------
    energy
        Mean squared residual, nodes x L.
    expected
        What noise alone leaves of it, per level.
    noise_slope
        What noise of variance 1 adds to the variance of the score, per level^2, per level.
    noise
        Noise variance.
    size
        Effective number of pixels of each node's window.

    Returns
    -------
    values
        4 x nodes: the level (fractional); its standard deviation in levels; the energy over what noise explains; the
        power that is informative about depth, over that of the noise in the same band.
    flags
        2 x nodes: unambiguous, that is no secondary minimum fits about as well; inside, that is the best fit lies
        within the levels, not beyond their ends.
    """
    values, flags = np.empty((4, len(energy))), np.empty((2, len(energy)), np.bool_)
    share_rows(
        len(energy),
        lambda first, last: _read_minima(energy, expected, noise_slope, noise, size, first, last, *values, *flags),
    )
    return values, flags


@njit(nogil=True, cache=True)
def _crossing(cost, start, direction, bound, level):  # type: ignore[no-untyped-def]
    """Return the distance from `level` at which the cost first rises to `bound` in one direction; infinity if never."""
    i = start
    while 0 <= i + direction < cost.size:
        if cost[i + direction] > bound:
            inner = min(cost[i], bound)
            return abs(i + direction * (bound - inner) / (cost[i + direction] - inner) - level)
        i += direction
    return np.inf


@njit(nogil=True, cache=True)
def _read_minima(  # type: ignore[no-untyped-def]
    energy, expected, noise_slope, noise, size, first, last, level, sd, misfit, texture, unambiguous, inside
):
    levels = energy.shape[1]
    cost = np.empty(levels)
    for node in range(first, last):
        best = 0
        for i in range(levels):
            cost[i] = (energy[node, i] - expected[i]) * size[node] / noise
            if cost[i] < cost[best]:
                best = i
        place, least, curvature = _quartic_minimum(cost, best)
        level[node] = place
        misfit[node] = (least * noise / size[node] + expected[best]) / expected[best]

        # The cost's rise at one sd is 1 where signal dominates, more where noise meets noise or the model misfits.
        slope = noise_slope[best] * size[node]
        # Noise alone makes the cost wander over its levels, the more so the more of it they let through.
        wander = np.sqrt(2 * size[node] * expected.max() / noise) * max(1.0, misfit[node])
        texture[node] = curvature / slope if slope > 0 and cost.max() - cost[best] > 6 * wander else 0.0
        unit = max(1.0, misfit[node]) * (1 + slope / max(curvature, slope / 3 + 1e-30))
        sd[node] = _half_width(cost, best, place, least, curvature, 4 * unit)
        inside[node] = _is_inside(cost, best, curvature, slope, unit)
        bound = least + SECONDARY_MINIMUM * unit
        unambiguous[node] = _is_unambiguous(cost, best, bound, expected, noise, size[node])


@njit(nogil=True, cache=True)
def _quartic_minimum(cost, best):  # type: ignore[no-untyped-def]
    """Return level, cost and curvature at the minimum near level `best`.

    From a quartic through five levels: exact where blur vanishes and the cost has the form (r^2 - r0^2)^2.
    """
    levels = cost.size
    c = min(max(best, 2), levels - 3)
    m2, m1, z, p1, p2 = cost[c - 2], cost[c - 1], cost[c], cost[c + 1], cost[c + 2]
    a1 = (m2 - 8 * m1 + 8 * p1 - p2) / 12
    a2 = (-m2 + 16 * m1 - 30 * z + 16 * p1 - p2) / 24
    a3 = (-m2 + 2 * m1 - 2 * p1 + p2) / 12
    a4 = (m2 - 4 * m1 + 6 * z - 4 * p1 + p2) / 24
    # Its slope changes sign between the neighbours of the least level: bisect.
    left, right = max(best - 1.0, 0.0) - c, min(best + 1.0, levels - 1.0) - c
    for _ in range(14):
        middle = (left + right) / 2
        if a1 + middle * (2 * a2 + middle * (3 * a3 + middle * 4 * a4)) > 0:
            right = middle
        else:
            left = middle
    t = (left + right) / 2
    least = min(z + t * (a1 + t * (a2 + t * (a3 + t * a4))), cost[best])
    return c + t, least, a2 + t * (3 * a3 + t * 6 * a4)


@njit(nogil=True, cache=True)
def _half_width(cost, best, level, least, curvature, rise):  # type: ignore[no-untyped-def]
    """Return the standard deviation, in levels, of a minimum whose cost rises by `rise` at two levels."""
    narrow = np.sqrt(rise / curvature) if curvature > 0 else np.inf
    if narrow < 1.0:
        return narrow / 2
    # Half the width of what lies within two sd: right also where the cost is not a parabola.
    down = _crossing(cost, best, -1, least + rise, level)
    up = _crossing(cost, best, 1, least + rise, level)
    # Where the range ends first, that side is unknown and the other stands for both.
    return (max(down, up) if max(down, up) < np.inf else min(down, up, cost.size - 1.0)) / 2


@njit(nogil=True, cache=True)
def _is_inside(cost, best, curvature, slope, unit):  # type: ignore[no-untyped-def]
    """Return whether the cost, at an end of the range, would not still fall by three sd beyond it."""
    outward = 0.0
    if best == 0:
        outward = cost[1] - cost[0]
    elif best == cost.size - 1:
        outward = cost[cost.size - 2] - cost[cost.size - 1]
    fall = outward**2 / (4 * max(curvature, slope / 3 + 1e-30))
    return fall <= SECONDARY_MINIMUM * unit or outward <= 2 * curvature


@njit(nogil=True, cache=True)
def _is_unambiguous(cost, best, bound, expected, noise, size):  # type: ignore[no-untyped-def]
    """Return whether no second minimum fits about as well: one beyond a barrier that the two could not share."""
    for direction in (-1, 1):
        i = best
        over = False
        while 0 <= i + direction < cost.size:
            i += direction
            apart = abs(expected[i] - expected[best]) / noise
            if cost[i] > bound + 3 * np.sqrt(2 * size * apart):
                over = True
            elif over:
                return False
    return True
