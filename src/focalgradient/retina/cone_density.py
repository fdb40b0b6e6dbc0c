"""Cone density by retinal location: means of eight human retinas (Curcio, Sloan, Kalina & Hendrickson 1990).

"Human photoreceptor topography", J. Comp. Neurol. 292, 497. The means along four meridians come from a public
transcription (the repository rjonnal/cone_density), which rounds densities to three digits and eccentricities to
0.1 mm: the four between 0 and 0.3 mm are assumed to be 0.05, 0.10, 0.15 and 0.20 mm. Millimetres become visual angles,
and areas square degrees, by Watson (2014, J. Vis. 14(7):15, equations A6 and A7, after Drasdo & Fowler 1974).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.eye.periphery import Meridian, checked_eccentricity

__all__ = ["cone_density", "cone_nyquist_cpd"]


PLACES = (*(0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 2.0, 3.0, 4.0), *range(5, 18))
"""Eccentricities in millimetres of retina."""

PEAK = 196.87
"""Peak density in thousand cones per mm^2: 14,804.6 per square degree (Curcio et al.; Watson 2014)."""

THOUSANDS: dict[str, tuple[float, ...]] = {
    "temporal": (
        *(PEAK, 154, 115, 93, 73, 53, 42, 36, 31, 26, 23, 22, 21, 12.4, 8.7, 7.86),  # at 4 mm, the disc: interpolated
        *(7.1, 6.6, 6.3, 6.2, 5.9, 5.5, 5.4, 5.1, 5.0, 4.9, 4.8, 4.8, 4.8),
    ),
    "nasal": (
        *(PEAK, 161, 121, 98, 79, 58, 45, 38, 34, 29, 24, 22, 21, 11.6, 9.0, 6.9),
        *(5.7, 5.1, 4.8, 4.4, 4.2, 3.9, 3.7, 3.6, 3.4, 3.4, 3.4, 3.2, 3.1),
    ),
    "inferior": (
        *(PEAK, 141, 106, 84, 66, 47, 36, 28, 24, 21, 19, 17, 16, 10.1, 7.6, 6.0),
        *(5.3, 4.9, 4.7, 4.5, 4.3, 4.3, 4.2, 4.0, 4.0, 3.9, 3.9, 3.8, 3.9),
    ),
    "superior": (
        *(PEAK, 147, 108, 86, 69, 51, 40, 33, 28, 24, 21, 19, 17, 10.4, 7.6, 6.2),
        *(5.5, 5.1, 4.8, 4.5, 4.3, 4.1, 3.9, 3.8, 3.7, 3.7, 3.8, 3.8, 3.9),
    ),
}
"""Thousand cones in a square millimetre at each place, by the side of the visual field: the temporal field falls on the
nasal retina, the superior one on the inferior retina. The blind spot is filled."""


def cone_density(eccentricity_deg: ArrayLike, meridian: Meridian = "temporal") -> FloatArray:
    """Return the density of cones of all three classes, per square degree of the visual field.

    Parameters
    ----------
    eccentricity_deg
        Degrees from the fovea, 0 to 60; any shape.
    meridian
        Meridian of the visual field.

    Raises
    ------
    InputError
        If an eccentricity is out of range or the meridian unknown.

    Examples
    --------
    >>> cone_density([0, 1, 10]).round(-1).tolist()
    [14800.0, 4250.0, 720.0]
    """
    far = checked_eccentricity(eccentricity_deg, meridian)
    places, logarithm = _measured(meridian)
    return np.exp(np.interp(far, places, logarithm))


def cone_nyquist_cpd(eccentricity_deg: ArrayLike, meridian: Meridian = "temporal") -> FloatArray:
    """Return the Nyquist frequency (cycles per degree) of a hexagonal mosaic with that cone density.

    Outside the fovea ganglion cells resolve less: see `resolved_cpd`.

    >>> cone_nyquist_cpd([0, 10]).round(1).tolist()
    [65.4, 14.4]
    """
    return np.asarray(np.sqrt(cone_density(eccentricity_deg, meridian) / (2 * math.sqrt(3))))


@lru_cache(maxsize=4)
def _measured(meridian: str) -> tuple[FloatArray, FloatArray]:
    """Return eccentricities in degrees, and the logarithm of the density there (cones per square degree)."""
    mm = np.asarray(PLACES, dtype=float)
    deg = 3.556 * mm + 0.05993 * mm**2 - 0.007358 * mm**3 + 0.0003027 * mm**4
    area = 0.0752 + 5.846e-5 * deg - 1.064e-5 * deg**2 + 4.116e-8 * deg**3  # mm^2 in a square degree
    return deg, np.log(1e3 * np.asarray(THOUSANDS[meridian]) * area)
