"""Which candidate levels are summed, and a coordinate of depth with which views change evenly.

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
from numpy.typing import NDArray
from scipy import integrate, ndimage
from scipy.interpolate import make_interp_spline

from focalgradient.depth.filters import FloatArray, Image
from focalgradient.depth.numerics import at_levels

__all__ = ["Candidates", "EvenCoordinate"]

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


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """The M of L candidate levels at which residuals are summed, and how the others follow from them."""

    levels: NDArray[np.intp]  # M, rising
    weights: Image  # L x M

    @classmethod
    def of(cls, bend: FloatArray) -> Candidates:
        """Choose candidates by how far the residuals at each level (L) depart from the mean of their neighbours'.

        >>> Candidates.of(np.repeat([0.4, 0.02], 14)).levels.tolist()[8:]
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
            return cls.every(last + 1)
        weights = make_interp_spline(levels, np.eye(len(levels)), DEGREE)(np.arange(last + 1))
        # Splines reach over all candidates, ever less: numbers as small as 1e-38 would be slow.
        return cls(levels, np.where(np.abs(weights) < NEGLIGIBLE, 0, weights).astype(np.float32))

    @classmethod
    def every(cls, levels: int) -> Candidates:
        """Return all candidates, none of them interpolated.

        >>> Candidates.every(3).levels.tolist()
        [0, 1, 2]
        """
        return cls(np.arange(levels), np.eye(levels, dtype=np.float32))


def _is_straight(bend: FloatArray) -> bool:
    """Return whether residuals that bend so from level to level are summed at the first and the last of these only."""
    return bool(bend.max() * (len(bend) - 1) ** 2 <= MAX_BEND)
