"""Dual pixels: two views in one shot, each through one half of the pupil, more or less.

Under each microlens of a dual-pixel sensor lie two photodiodes, which see the left and the right of the pupil. Their
halves are not half discs: each is nearly the whole disc, weighted by 1 +- a u, where u runs from -1 to 1 across the
pupil (Canon RF 50 mm: a = 0.315 in the middle of the frame, less at the sides). The transfer of a point whose blur
disc has the radius r is then, with z = 2 pi r f,

    2 J1(z) / z  -+  i a (f_x / f) 2 J2(z) / z,

the first term of both alike. Points nearer than focus are displaced to the right in the left view, and points beyond it
to the left, as in a left eye: the sign of depth shows in one shot.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_number
from focalgradient.optics.lens import Lens

__all__ = ["ASYMMETRY", "DualPixel"]

ASYMMETRY = 0.315
"""Asymmetry of a half, as measured in the middle of the frame of a Canon R6 II with an RF 50 mm at f/4."""

_EVEN = (0.0,) * 5


@dataclass(frozen=True, slots=True)
class DualPixel:
    """One half of a dual pixel's pupil.

    Parameters
    ----------
    lens
        The lens; ``aperture_tolerance`` is that of aperture times asymmetry, which depth alone depends on.
    asymmetry
        Weight of the pupil's left side over that of its middle, less 1: positive for the left view, negative for the
        right, 0 for their mean; between -1 and 1.
    field
        How the asymmetry varies over the field: the share by which it is larger than in the middle, as coefficients of
        x, y, x^2, x y, y^2, counted from the middle of the frame in halves of its longer side, right and down.

    Examples
    --------
    >>> left, right = DualPixel.pair(Lens(0.05, 4, 1.0), 0.3)
    >>> left.asymmetry, right.asymmetry
    (0.3, -0.3)
    >>> z = complex(left.optical_transfer(0.0, 40.0, 2.0))  # a near point: displaced to the right
    >>> round(z.real, 3), round(z.imag, 3)
    (0.722, -0.095)
    """

    lens: Lens
    asymmetry: float = ASYMMETRY
    field: tuple[float, ...] = _EVEN

    isotropic = False

    def __post_init__(self) -> None:
        if not isinstance(self.lens, Lens):
            raise InputError(f"lens is a {type(self.lens).__name__}, but a dual pixel needs a Lens.")
        check_number("asymmetry", self.asymmetry, "shares of the middle's weight")
        if not -1 <= self.asymmetry <= 1:
            raise InputError(f"asymmetry is {self.asymmetry:g}, but must be between -1 and 1.")
        values = np.asarray(self.field, float)
        if values.shape != (5,) or not np.isfinite(values).all():
            raise InputError("field must be five numbers: coefficients of x, y, x^2, x y, y^2.")

    @classmethod
    def pair(
        cls, lens: Lens, asymmetry: float = ASYMMETRY, field: tuple[float, ...] = _EVEN
    ) -> tuple[DualPixel, DualPixel]:
        """Return the optics of the left view and of the right."""
        return cls(lens, abs(asymmetry), field), cls(lens, -abs(asymmetry), field)

    @property
    def mean(self) -> DualPixel:
        """The optics of the mean of left and right: the whole pupil."""
        return replace(self, asymmetry=0.0)

    @property
    def tells_side(self) -> bool:
        """Whether near and far points are displaced to different sides: in either half, but not in the mean."""
        return self.asymmetry != 0

    @property
    def uniform(self) -> bool:
        """Whether the asymmetry is the same all over the field."""
        return not any(self.field)

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the whole aperture in metres."""
        return self.lens.aperture_diameter

    @property
    def focus_vergence(self) -> float:
        """Vergence of the plane in exact focus, in dioptres."""
        return self.lens.focus_vergence

    @property
    def focal_length(self) -> float:
        """Focal length in metres."""
        return self.lens.focal_length

    @property
    def sensor_distance(self) -> float:
        """Distance from lens to sensor in metres."""
        return self.lens.sensor_distance

    @property
    def focus_tolerance(self) -> float:
        """Relative standard deviation of the focus vergence."""
        return self.lens.focus_tolerance

    @property
    def aperture_tolerance(self) -> float:
        """Relative standard deviation of aperture times asymmetry."""
        return self.lens.aperture_tolerance

    def over(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the factor of the asymmetry at every pixel of a frame of `shape`, H x W; 1 in the middle.

        >>> DualPixel(Lens(0.05, 4, 1.0), 0.3, (0, 0, -0.3, 0, 0)).over((2, 4)).round(3).tolist()[0]
        [0.831, 0.981, 0.981, 0.831]
        """
        y, x = ((2 * np.arange(n) + 1 - n) / max(shape) for n in shape)
        x, y = np.broadcast_arrays(x[None], y[:, None])
        return np.asarray(1 + np.tensordot(self.field, np.stack([x, y, x**2, x * y, y**2]), 1), float)

    def optical_transfer(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float
    ) -> NDArray[np.complex128]:
        """Transfer in the middle of the frame of a point at `vergence` (D), at frequencies in cycles per radian."""
        return self.through_focus(frequency_y, frequency_x, [vergence])[0]

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> NDArray[np.complex128]:
        """Return the same of points at each of the `vergences`: L x the frequencies' shape."""
        down, right = np.broadcast_arrays(np.asarray(frequency_y, float), np.asarray(frequency_x, float))
        radius = (np.atleast_1d(np.asarray(vergences, float)) - self.focus_vergence) * self.aperture_diameter / 2
        even, odd = half_transfer(down, right, radius.reshape(-1, *[1] * down.ndim))
        return np.asarray(even - 1j * self.asymmetry * odd, np.complex128)


def half_transfer(
    frequency_y: NDArray[np.floating], frequency_x: NDArray[np.floating], radius: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return 2 J1(z)/z and (f_x/f) 2 J2(z)/z of a disc of `radius`, negative beyond focus; broadcasts.

    Frequencies are in cycles per unit of the radius.
    """
    from scipy.special import j0, j1  # not needed to import the package

    radial = np.hypot(frequency_y, frequency_x)
    z = 2 * np.pi * np.asarray(radius, float) * radial
    small = np.abs(z) < 1e-6
    z = np.where(small, 1e-6, z)
    across = np.divide(frequency_x, radial, out=np.zeros(radial.shape), where=radial > 0)
    even = 2 * j1(z) / z
    # J2 = 2 J1/z - J0, which cancels where z is small: there 2 J2/z is z/4.
    odd = np.where(np.abs(z) < 0.01, z / 4, 2 * (even - j0(z)) / z)
    return np.where(small, 1.0, even), np.where(small, 0.0, odd) * across
