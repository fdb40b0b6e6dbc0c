"""Sampling limit of the retina by eccentricity: cones and midget ganglion cells.

Receptive fields of midget ganglion cells by the formula of Watson (2014, "A formula for human retinal ganglion cell
receptive field density as a function of visual field location", J. Vis. 14(7):15), which fits the counts of Curcio &
Allen (1990), corrected for the displacement of cells from their cones. In the fovea each cone feeds one on and one off
midget cell (Kolb & Dekorver 1991), so that one class samples as finely as cones do; farther out ganglion cells, not
cones, limit resolution.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import check_one_of
from focalgradient.quantities import Range, Values

__all__ = ["Meridian", "midget_density", "resolved_cpd"]

Meridian = Literal["temporal", "superior", "nasal", "inferior"]
"""Meridian of the visual field, named as by Watson: the temporal field falls on the nasal retina."""

TOWARDS: dict[Meridian, tuple[int, int]] = {
    "temporal": (1, 0),
    "nasal": (-1, 0),
    "superior": (0, -1),
    "inferior": (0, 1),
}
"""Direction of each meridian in a right eye's field, x to the right and y down."""

Measured = Annotated[float, Range("degrees (people were measured to 40)", 0, 40)]
"""Eccentricity in degrees to which people were measured (Jaeken & Artal 2012), and up to which the schematic eye is
used, a choice: its astigmatism reaches 3.9 D there and grows ever faster beyond, more than in most eyes."""

PEAK = 33163.2
"""Peak density of receptive fields of all ganglion cells per square degree: twice 14804.6 cones (Curcio et al. 1990)
over the share of midget cells (Watson 2014)."""

SHARE, SHARE_FALLS = 1 / 1.12, 41.03
"""Share of midget cells at the centre (Drasdo et al. 2007), and the eccentricity in degrees at which it has halved
(Watson's equation 7)."""

FALL: dict[str, tuple[float, float, float]] = {
    "temporal": (0.9851, 1.058, 22.14),
    "superior": (0.9935, 1.035, 16.35),
    "nasal": (0.9729, 1.084, 7.633),
    "inferior": (0.996, 0.9932, 12.13),
}
"""Parameters of each meridian: weight of the first component of the decline, and scales of both in degrees (Watson's
Table 1)."""

FARTHEST = 60.0
"""Maximum eccentricity in degrees: farther out the counts are few."""


def check_meridian(meridian: object) -> None:
    """Raise `InputError` unless `meridian` is a meridian of the visual field."""
    check_one_of("meridian", meridian, get_args(Meridian))


def checked_eccentricity(eccentricity_deg: ArrayLike, meridian: object) -> FloatArray:
    """Return eccentricities (degrees) as an array after validation of range and meridian."""
    check_meridian(meridian)
    side = "give degrees from the fovea, and the side of it by meridian"
    return Values("degrees", 0, FARTHEST, remedy=side).of("eccentricity_deg", eccentricity_deg)


def midget_density(eccentricity_deg: ArrayLike, meridian: Meridian = "temporal") -> FloatArray:
    """Return the density of midget receptive fields, on and off, per square degree (Watson's equation 8).

    Parameters
    ----------
    eccentricity_deg
        Degrees from the fovea, 0 to 60; any shape.
    meridian
        Meridian of the visual field.

    Returns
    -------
    ndarray
        Fields in a square degree.

    Raises
    ------
    InputError
        If an eccentricity is out of range or the meridian unknown.

    Examples
    --------
    >>> midget_density([0, 10]).round(0).tolist()
    [29610.0, 441.0]
    """
    far = checked_eccentricity(eccentricity_deg, meridian)
    weight, first, second = FALL[meridian]
    fall = weight * (1 + far / first) ** -2 + (1 - weight) * np.exp(-far / second)
    return np.asarray(PEAK * SHARE * fall / (1 + far / SHARE_FALLS))


def resolved_cpd(eccentricity_deg: ArrayLike, meridian: Meridian = "temporal") -> FloatArray:
    """Return the Nyquist frequency (cycles per degree) of midget cells of one class, on or off.

    The Nyquist frequency of a hexagonal mosaic of half the `midget_density` (Watson's equations 9 and 10). Give it to
    `Cones` as ``finest_cpd`` for views away from the fovea.

    Examples
    --------
    At the centre it is that of the cones; 10 degrees out an eighth of it is left.

    >>> resolved_cpd([0, 10]).round(1).tolist()
    [65.4, 8.0]
    """
    return np.asarray(np.sqrt(midget_density(eccentricity_deg, meridian) / 2 / (2 * math.sqrt(3))))
