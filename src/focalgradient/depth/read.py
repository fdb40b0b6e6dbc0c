"""Candidate levels of depth, those of them that are summed, and the minimum of a cost over them at each place.

Levels are evenly spaced in blur. Only coarse detail remains in a strongly blurred view, and it changes little from one
level to the next: the cost of most levels follows from that of their neighbours.

Views differ as the squares of their blur do. Where all of them are focused on one distance, a little blur there changes
nothing in proportion to depth: a straight line through residuals, which is how planes of depth are fitted, would have
no slope, and what noise makes of depth there is never nearer to the focus than the focus, so that it does not average
out. In proportion to the square of blur everything is straight, and noise acts alike to either side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import integrate, ndimage
from scipy.interpolate import make_interp_spline

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.filters import Image
from focalgradient.depth.numerics import at_levels
from focalgradient.depth.validity import SECONDARY_MINIMUM
from focalgradient.parallel import share_rows

__all__ = ["EvenCoordinate", "parabola_minimum", "read_minima", "summed_levels"]


def parabola_minimum(cost: NDArray[np.floating]) -> tuple[FloatArray, FloatArray, FloatArray]:
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
    energy: NDArray[np.floating], expected: FloatArray, noise_slope: FloatArray, noise: float, size: FloatArray
) -> tuple[FloatArray, Mask]:
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
        2 x nodes: unambiguous (no secondary minimum fits about as well) and inside (the best fit lies within the
        levels, not beyond their ends).
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


SMALL_BLUR = 1.0
"""Blur radius in pixels below which the coordinate of depth is the square of blur (our choice): above it, disc and
noise no longer make a parabola, and planes of depth remain planes."""

CHANGING = 0.2
"""Minimum rate of change, relative to that of large blur, of residuals that are fitted: with 0.4 the fourth power of
blur, which a straight line omits, biased depth by 2 standard deviations at the focus (walls at 3 m, noise 0.3 %)."""

MIN_RATE = 1e-3
"""Minimum rate of change of the coordinate, relative to that of large blur, which makes it invertible. Chosen by hand.
"""

PLACES_PER_LEVEL = 16
"""Number of samples of the coordinate per level; linear interpolation between them. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class EvenCoordinate:
    """Coordinate of depth, tabulated between the candidate levels; its unit is a level where blur is large."""

    place: FloatArray  # N: level
    value: FloatArray  # N
    rate: FloatArray  # N: its change by level, 1 where blur is large

    @classmethod
    def of(cls, radius: FloatArray, even: bool = True) -> EvenCoordinate:
        """Make the coordinate of views whose blur has a `radius` in pixels at each candidate level (n x L).

        The level itself where blur is not `even`, so that views differ by its first power: the halves of a dual pixel.

        Two apertures at one focus: with the larger blur from 0 to 2 pixels, depth counts by its square up to 1 pixel.

        >>> coordinate = EvenCoordinate.of(np.linspace(0, 2, 21) * [[0.0], [1.0]])
        >>> coordinate.at(np.array([0.0, 5, 10, 20])).round(2).tolist()
        [0.0, 1.25, 5.0, 15.0]
        """
        place = np.linspace(0, radius.shape[1] - 1, PLACES_PER_LEVEL * (radius.shape[1] - 1) + 1)
        if not even:
            return cls(place, place, np.ones_like(place))
        radius = np.stack([np.interp(place, np.arange(radius.shape[1]), one) for one in radius])
        squares, blur = (np.gradient(values, place, axis=1) for values in (radius**2, radius))
        change = np.abs(squares[:, None] - squares[None]).max(axis=(0, 1))
        usual = max(min(2 * SMALL_BLUR * np.abs(blur).max(), change.max()), 1e-12)
        rate = np.clip(change / usual, MIN_RATE, 1.0)
        return cls(place, integrate.cumulative_trapezoid(rate, place, initial=0), rate)

    def at(self, level: NDArray[np.floating]) -> FloatArray:
        """Return the coordinate of each `level`."""
        return np.interp(level, self.place, self.value)

    def at_pixels(self, level: Image) -> Image:
        """Return `at` of each pixel (H x W), in single precision."""
        return at_levels(self.value, level, 1 / PLACES_PER_LEVEL)

    def rate_at(self, level: NDArray[np.floating]) -> FloatArray:
        """Return the rate of change of the coordinate by level."""
        return np.interp(level, self.place, self.rate)

    def rate_at_pixels(self, level: Image) -> Image:
        """Return `rate_at` of each pixel (H x W), in single precision."""
        return at_levels(self.rate, level, 1 / PLACES_PER_LEVEL)

    def levels(self, value: FloatArray, sd: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the level of each `value`, and its standard deviation: half the wider side of two."""
        value = np.clip(value, self.value[0], self.value[-1])
        below, level, above = (np.interp(value + n * sd, self.value, self.place) for n in (-2, 0, 2))
        return level, np.maximum(np.maximum(above - level, level - below) / 2, np.where(np.isfinite(sd), 1e-6, sd))

    def changing(self, level: FloatArray) -> FloatArray:
        """Move each `level` to the nearest at which residuals change enough to be linearised."""
        enough = self.rate >= CHANGING
        if enough.all():
            return level
        nearest = ndimage.distance_transform_edt(~enough, return_distances=False, return_indices=True)[0]
        return np.interp(level, self.place, self.place[nearest])


MAX_BEND = 0.2
"""Maximum departure of the residuals from a straight line between neighbouring summed candidates: root mean square over
the noise. Of a slant seen with two apertures, two and three foci, and of leaves, bars and a step, with noise of 1 %,
interpolation moves depth before refinement by 0.003 to 0.03 standard deviations (median; 99th percentile: 0.02 to 0.1)
with 0.3, by 0.01 to 0.24 with 0.6, where not all levels at the ends are summed."""

DENSE_ENDS = 8
"""Number of levels at either end of the range that are all summed: a spline errs most at its ends, and a focus that all
views share, where the cost goes by the fourth power of blur, lies at one. Chosen by hand."""

DEGREE = 3
"""Degree of the spline. With 5, interpolation errs more where noise is 0.05 %."""

NEGLIGIBLE = 1e-8
"""Weight below which a candidate does not count for another: less than the rounding of single precision."""


def summed_levels(bend: FloatArray) -> tuple[NDArray[np.intp], Image]:
    """Choose M of L levels to sum residuals at, by how far they depart from the mean of their neighbours' (L).

    Also returns the weights, L x M, with which the others follow from these.

    >>> summed_levels(np.repeat([0.4, 0.02], 14))[0].tolist()[8:]
    [8, 9, 10, 11, 12, 13, 14, 17, 19, 20, 21, 22, 23, 24, 25, 26, 27]
    """
    last = len(bend) - 1
    chosen = [0]
    while (first := chosen[-1]) < last:
        end = first + 1
        while first >= DENSE_ENDS and end < last - DENSE_ENDS and _is_straight(bend[first : end + 2]):
            end += 1
        chosen.append(end)
    levels = np.array(chosen)
    if len(levels) > last:
        return levels, np.eye(last + 1, dtype=np.float32)
    weights = make_interp_spline(levels, np.eye(len(levels)), DEGREE)(np.arange(last + 1))
    # Splines reach over all candidates, ever less: numbers as small as 1e-38 would be slow.
    return levels, np.where(np.abs(weights) < NEGLIGIBLE, 0, weights).astype(np.float32)


def _is_straight(bend: FloatArray) -> bool:
    """Return whether residuals that bend so from level to level are summed at the first and the last of these only."""
    return bool(bend.max() * (len(bend) - 1) ** 2 <= MAX_BEND)
