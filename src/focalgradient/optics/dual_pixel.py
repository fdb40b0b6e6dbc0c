"""Dual-pixel optics: two views in one exposure, each weighted towards one half of the pupil.

Each microlens of a dual-pixel sensor covers two photodiodes, which see the left and the right part of the pupil. Their
pupils are not half discs: each is nearly the whole disc, weighted by 1 +- a u, where u runs from -1 to 1 across the
pupil (Canon RF 50 mm: a = 0.315 in the middle of the frame, less at the sides). The optical transfer function of a
point with blur radius r is then, with z = 2 pi r f,

    2 J1(z) / z  -+  i a (f_x / f) 2 J2(z) / z,

of which the first term is common to both. Points nearer than focus are displaced to the right in the left view, and
points beyond it to the left, as in a left eye: the sign of defocus shows in one exposure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields
from focalgradient.optics.lens import Lens
from focalgradient.quantities import Range

__all__ = ["ASYMMETRY", "DualPixel"]

ASYMMETRY = 0.315
"""Asymmetry measured in the middle of the frame of a Canon R6 II with an RF 50 mm at f/4."""

_UNIFORM_FIELD = (0.0,) * 5


@dataclass(frozen=True, slots=True)
class DualPixel:
    """Optics of one half of a dual-pixel sensor.

    Parameters
    ----------
    lens
        The lens; its ``aperture_tolerance`` is that of the product of aperture and asymmetry, on which depth depends.
    asymmetry
        Weight at the left rim of the pupil relative to its centre, minus 1: positive for the left view, negative for
        the right, 0 for their mean; from -1 to 1.
    field
        Relative increase of the asymmetry over the field, as coefficients of x, y, x^2, x y, y^2, where x (right) and y
        (down) are measured from the middle of the frame in units of half its longer side.

    Examples
    --------
    >>> left, right = DualPixel.pair(Lens(0.05, 4, 1.0), 0.3)
    >>> left.asymmetry, right.asymmetry
    (0.3, -0.3)
    >>> z = complex(left.optical_transfer(0.0, 40.0, 2.0))  # a near point is displaced to the right
    >>> round(z.real, 3), round(z.imag, 3)
    (0.722, -0.095)
    """

    lens: Lens
    asymmetry: Annotated[float, Range("fractions of the weight at the centre", -1, 1)] = ASYMMETRY
    field: tuple[float, ...] = _UNIFORM_FIELD

    isotropic = False

    def __post_init__(self) -> None:
        if not isinstance(self.lens, Lens):
            raise InputError(f"lens is a {type(self.lens).__name__}, but must be a Lens: give one.")
        check_fields(self)
        values = np.asarray(self.field, float)
        if values.shape != (5,) or not np.isfinite(values).all():
            raise InputError("field must be five finite numbers: give the coefficients of x, y, x^2, x y, y^2.")

    @classmethod
    def pair(
        cls, lens: Lens, asymmetry: float = ASYMMETRY, field: tuple[float, ...] = _UNIFORM_FIELD
    ) -> tuple[DualPixel, DualPixel]:
        """Return the optics of the left and of the right view."""
        return cls(lens, abs(asymmetry), field), cls(lens, -abs(asymmetry), field)

    @property
    def mean(self) -> DualPixel:
        """The optics of the mean of left and right view: the whole pupil."""
        return replace(self, asymmetry=0.0)

    @property
    def tells_side(self) -> bool:
        """Whether near and far points are displaced in opposite directions: true of either half, not of the mean."""
        return self.asymmetry != 0

    @property
    def uniform(self) -> bool:
        """Whether the asymmetry is constant over the field."""
        return not any(self.field)

    aperture_diameter = property(attrgetter("lens.aperture_diameter"), doc="Diameter of the whole aperture in metres.")
    focus_vergence = property(attrgetter("lens.focus_vergence"), doc="Vergence of the plane in focus, in dioptres.")
    focal_length = property(attrgetter("lens.focal_length"), doc="Focal length in metres.")
    sensor_distance = property(attrgetter("lens.sensor_distance"), doc="Distance from lens to sensor in metres.")
    focus_tolerance = property(attrgetter("lens.focus_tolerance"), doc="Relative SD of the focus vergence.")
    field_sd = property(attrgetter("lens.field_sd"), doc="That of the lens.")
    aperture_tolerance = property(attrgetter("lens.aperture_tolerance"), doc="Relative SD of aperture x asymmetry.")

    def over(self, shape: tuple[int, int]) -> FloatArray:
        """Return the relative asymmetry at each pixel of a frame of `shape`, H x W; 1 in the middle.

        >>> DualPixel(Lens(0.05, 4, 1.0), 0.3, (0, 0, -0.3, 0, 0)).over((2, 4)).round(3).tolist()[0]
        [0.831, 0.981, 0.981, 0.831]
        """
        y, x = ((2 * np.arange(n) + 1 - n) / max(shape) for n in shape)
        x, y = np.broadcast_arrays(x[None], y[:, None])
        return np.asarray(1 + np.tensordot(self.field, np.stack([x, y, x**2, x * y, y**2]), 1), float)

    def optical_transfer(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float
    ) -> NDArray[np.complex128]:
        """Return the OTF in the middle of the frame for a point at `vergence` (D); frequencies in cycles per radian."""
        return self.through_focus(frequency_y, frequency_x, [vergence])[0]

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> NDArray[np.complex128]:
        """Return the OTF of points at each of the `vergences` (D), shape L x the frequencies' shape."""
        down, right = np.broadcast_arrays(np.asarray(frequency_y, float), np.asarray(frequency_x, float))
        radius = (np.atleast_1d(np.asarray(vergences, float)) - self.focus_vergence) * self.aperture_diameter / 2
        even, odd = half_transfer(down, right, radius.reshape(-1, *[1] * down.ndim))
        return np.asarray(even - 1j * self.asymmetry * odd, np.complex128)


def half_transfer(
    frequency_y: NDArray[np.floating], frequency_x: NDArray[np.floating], radius: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return 2 J1(z)/z and (f_x/f) 2 J2(z)/z for a disc of `radius` (negative beyond focus); broadcasts.

    Frequencies are in cycles per unit of the radius.
    """
    from scipy.special import j0, j1  # deferred to keep `import focalgradient` light

    radial = np.hypot(frequency_y, frequency_x)
    z = 2 * np.pi * np.asarray(radius, float) * radial
    small = np.abs(z) < 1e-6
    z = np.where(small, 1e-6, z)
    across = np.divide(frequency_x, radial, out=np.zeros(radial.shape), where=radial > 0)
    even = 2 * j1(z) / z
    # J2 = 2 J1/z - J0 suffers from cancellation at small z, where 2 J2/z = z/4.
    odd = np.where(np.abs(z) < 0.01, z / 4, 2 * (even - j0(z)) / z)
    return np.where(small, 1.0, even), np.where(small, 0.0, odd) * across
