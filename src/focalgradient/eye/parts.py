"""Division of a band of wavelengths into a few parts, each in its own focus, and the number of parts needed.

Parts are of equal width in focus (D), each in the mean focus of its light. The image then converges as a midpoint rule
does for a smooth integrand: 8 parts of a band of cones are as accurate as 25 parts of equal light (pupil of 4 mm, up to
30 cycles per degree, an error of the transfer of 0.01).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import checked
from focalgradient.eye.chromatic import chromatic_difference, chromatic_wavelength
from focalgradient.eye.light import Light
from focalgradient.quantities import Whole

__all__ = ["COUNTS", "ERROR", "FINEST", "fewest", "parts_of_band", "parts_of_focus"]

ERROR = 0.008
"""Maximum difference of few parts from `FINEST`: the error is then below 0.01 also where steps lie side by side."""

FINEST = 41
"""Number of parts used as the reference: more change a step at 7 mm and 2 D by less than 0.001 of white."""

COUNTS = (3, 5, 7, 9, 11, 13, 15, 17, 21, 25, 29, 33)
"""Numbers of parts that are tried."""

TAIL = 0.005
"""Share of a band's light beyond each end of the parts, assigned to the first and the last: with 0.02 no number of
parts reaches an error of 0.008."""


def parts_of_focus(focus: FloatArray, ends: tuple[float, float], count: int) -> NDArray[np.intp]:
    """Return the part, 0 to `count` - 1, of each `focus` (D): equal widths between `ends`, the outer ones open.

    >>> parts_of_focus(np.array([-3.0, -0.9, 0.0, 0.9]), (-1.0, 1.0), 4).tolist()
    [0, 0, 1, 3]
    """
    return np.clip(np.searchsorted(np.linspace(*ends, count + 1), focus) - 1, 0, count - 1)


def fewest(made: Callable[[int], FloatArray]) -> int:
    """Return the smallest count for which `made` agrees with that of `FINEST` to `ERROR`, or `FINEST`.

    >>> fewest(lambda count: np.array([1 / count**2]))
    11
    """
    wanted = made(FINEST)
    return next((count for count in COUNTS if np.abs(made(count) - wanted).max() < ERROR), FINEST)


@lru_cache(maxsize=64)
@checked
def parts_of_band(light: Light, count: Annotated[int, Whole(1)]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the wavelengths (nm) that stand for the `count` parts of a light, and their shares, with a sum of 1.

    >>> from focalgradient.eye.light import band_light
    >>> nm, share = parts_of_band(band_light("S", "D65"), 3)
    >>> [round(one) for one in nm], [round(one, 2) for one in share]
    ([419, 448, 482], [0.17, 0.59, 0.24])

    Raises
    ------
    InputError
        If the count is not a whole number of 1 or more.
    """
    focus, share = chromatic_difference(light.wavelength_nm), light.share
    order = np.argsort(focus)
    low, high = np.interp((TAIL, 1 - TAIL), np.cumsum(share[order]), focus[order]).tolist()
    part = parts_of_focus(focus, (low, high), count)
    total = np.bincount(part, share, count)
    some = total > 0
    middle = np.bincount(part, share * focus, count)[some] / total[some]
    return tuple(chromatic_wavelength(middle).tolist()), tuple(total[some].tolist())
