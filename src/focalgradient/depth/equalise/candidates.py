"""Candidates at which residuals are summed: as close together as the residuals change, and interpolated in between.

Candidates are evenly spaced in blur. Only coarse detail remains in a strongly blurred view, and it changes little from
one candidate to the next: the cost of most candidates follows from that of their neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from focalgradient.depth.filters import FloatArray, Image

__all__ = ["Candidates"]

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
