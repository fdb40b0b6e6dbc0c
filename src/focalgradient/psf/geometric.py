"""A shape of blur, an aperture and a focus as optics: geometric blur by the distance from focus."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.shape import Psf

__all__ = ["Geometric"]


@dataclass(frozen=True, slots=True)
class Geometric:
    """Optics whose blur has a shape, of the radius (aperture / 2) x the absolute defocus.

    Nearer than focus it is turned by half a turn.

    >>> from focalgradient.psf import Gaussian
    >>> through = Geometric(Gaussian(), 0.004, 1.0).through_focus(0.0, 200.0, [0.5, 1.0, 1.5])
    >>> through.round(3).tolist()
    [0.821, 1.0, 0.821]
    """

    psf: Psf
    aperture_diameter: float
    focus_vergence: float

    @property
    def name(self) -> str:
        """The shape in words."""
        return str(self.psf)

    @property
    def isotropic(self) -> bool:
        """Whether blur is rotationally symmetric."""
        return self.psf.isotropic

    @property
    def tells_side(self) -> bool:
        """Whether the shape is seen turned nearer than focus."""
        return not self.psf.symmetric

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Return the transfer of isotropic blur of points at `vergence` (D); broadcasts."""
        return self.psf.transfer(frequency, self._radius(vergence))

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> NDArray[np.float64] | NDArray[np.complex128]:
        """Return the OTF at each of the L `vergences` (D): L x the frequencies' shape (cycles per radian)."""
        levels = np.atleast_1d(np.asarray(vergences, float))
        if self.isotropic:
            radial = np.hypot(frequency_y, frequency_x)
            return self.transfer(radial, levels.reshape(-1, *(1,) * np.ndim(radial)))
        upright = [self.psf.optical_transfer(frequency_y, frequency_x, radius) for radius in self._radius(levels)]
        nearer = levels > self.focus_vergence
        return np.stack([np.conj(one) if turned else one for one, turned in zip(upright, nearer, strict=True)])

    def _radius(self, vergence: ArrayLike) -> NDArray[np.float64]:
        return np.asarray(np.abs(self.focus_vergence - np.asarray(vergence, float)) * self.aperture_diameter / 2)
