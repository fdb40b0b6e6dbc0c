"""Intraocular scatter: the CIE's general disability glare equation, and its effect on contrast.

A point of light at an angle theta gives, for each lux at the eye, a veil of L cd/m^2, the point spread in 1/sr:

    L / E = 10 / theta^3 + (5 / theta^2 + 0.1 p / theta) (1 + (age / 62.5)^4) + 0.0025 p,

theta in degrees from 0.1 to 100, p the pigmentation of the eye (CIE 146:2002, "CIE equations for disability glare";
Vos & van den Berg 1999, CIE 135/1). It is within 30 % of the CIE's total equation from 0.1 to 90 degrees, and agrees
with published straylight (`tests/eye/test_published_reference.py`, `tests/eye/test_eye_retina.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0

from focalgradient.arrays import FloatArray
from focalgradient.errors import check_fields, check_finite
from focalgradient.quantities import Range, Values

__all__ = ["Scatter"]


NEAREST, FARTHEST = 0.1, 90.0
"""Range of scattering angles in degrees: nearer, the equation does not hold, and the waves of the pupil give the
spread. Up to about a degree it includes the tail of an average eye's aberrations, which an eye with aberrations of its
own then counts twice."""

AGE_DOUBLED = 62.5
"""Age in years at which age-dependent scatter is twice that of the young (CIE 146:2002)."""

STEP_DEG = 0.002
"""Step of the integral over angles in degrees: an eighth of a period of 60 cycles per degree."""


@dataclass(frozen=True, slots=True)
class Scatter:
    """Intraocular scatter by age and pigmentation.

    Parameters
    ----------
    age
        Years.
    pigment
        0 for very dark eyes, 0.5 for brown, 1.0 for light eyes, 1.2 for very light ones.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    Of the light of a point, this share is scattered by more than 0.1 degree, at 20 and at 80 years.

    >>> [round(Scatter(age).share, 2) for age in (20, 80)]
    [0.27, 0.46]
    """

    age: Annotated[float, Range("years", 0, 100)] = 25.0
    pigment: Annotated[float, Range("units of the CIE's pigmentation factor", 0, 1.2)] = 0.5

    def __post_init__(self) -> None:
        check_fields(self)

    def veil(self, angle_deg: ArrayLike) -> FloatArray:
        """Return the veiling luminance (cd/m^2) per lux of a glare source at `angle_deg`, 0.1 to 100 (any shape): 1/sr.

        >>> Scatter(25, 0.5).veil([1.0, 10.0]).round(4).tolist()
        [15.1805, 0.0677]
        """
        theta = Values("degrees", NEAREST, 100).of("angle_deg", angle_deg)
        aged = 1 + (self.age / AGE_DOUBLED) ** 4
        return np.asarray(10 / theta**3 + (5 / theta**2 + 0.1 * self.pigment / theta) * aged + 0.0025 * self.pigment)

    @property
    def share(self) -> float:
        """Share of a point's light that is scattered by more than 0.1 degree."""
        return float(_table(self.age, self.pigment)[1][0])

    def transfer(self, frequency: ArrayLike) -> FloatArray:
        """Return the contrast left by scatter at `frequency` (cycles per radian): 1 at 0, 1 - `share` soon after.

        >>> Scatter(70).transfer(np.degrees([0.0, 0.1, 1.0, 10.0])).round(2).tolist()
        [1.0, 0.87, 0.72, 0.63]
        """
        cpd, scattered = _table(self.age, self.pigment)
        f = np.abs(np.radians(check_finite("frequency", frequency, "cycles per radian")))
        return np.asarray(1 - scattered[0] + np.interp(f, cpd, scattered))


@lru_cache(maxsize=32)
def _table(age: float, pigment: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (cycles per degree) and the Hankel transform of the scattered light: at 0 its share."""
    near = np.geomspace(NEAREST, 1.0, 400)
    theta = np.concatenate([near, np.arange(1.0 + STEP_DEG, FARTHEST, STEP_DEG)])
    light = Scatter(age, pigment).veil(theta) * 2 * np.pi * np.sin(np.radians(theta))
    cpd = np.concatenate([[0.0], np.geomspace(1e-3, 60.0, 60)])
    kernel = np.array([np.trapezoid(light * j0(2 * np.pi * f * theta), np.radians(theta)) for f in cpd])
    return cpd, kernel
