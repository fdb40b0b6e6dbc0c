"""Polygonal blur: the aperture of an iris with straight blades."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.shape import Psf, parameter

__all__ = ["Polygon"]

SERIES_PHASE = 1e-3
"""Phase (rad) at the blur radius below which the transfer is computed from its series (error below 1e-9)."""


@dataclass(frozen=True)
class Polygon(Psf):
    """Regular polygon: an iris with straight blades, with the area of the f-number's disc.

    The f-number gives the diameter of the circle with the aperture's area (ISO 517), so the corners lie outside the
    disc of the blur radius and the midpoints of the sides inside. With an odd number of blades, the shape is rotated by
    180 degrees on the nearer side of focus.
    """

    name = "polygon"
    isotropic = False

    blades: int = parameter(6, "number of blades", least=3, most=64)
    rotation: float = parameter(
        0.0,
        "direction of a corner, clockwise from the right",
        least=-360,
        most=360,
        unit="deg",
        per_unit=math.pi / 180,
    )
    """Direction of a corner in radians, from +x (right) towards +y (down)."""

    @property
    def symmetric(self) -> bool:
        """Whether the number of blades is even."""
        return self.blades % 2 == 0

    @property
    def circumradius(self) -> float:
        """Distance of the corners from the centre in blur radii; the area is pi."""
        return math.sqrt(2 * math.pi / (self.blades * math.sin(2 * math.pi / self.blades)))

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation per blur radius: the variance is R^2 (2 + cos(2 pi / n)) / 12 along every axis."""
        return self.circumradius * math.sqrt((2 + math.cos(2 * math.pi / self.blades)) / 12)

    def corners(self) -> NDArray[np.float64]:
        """Return the corners (y, x) in blur radii, shape n x 2.

        >>> Polygon(4).corners().round(3).tolist()
        [[0.0, 1.253], [1.253, 0.0], [0.0, -1.253], [-1.253, -0.0]]
        """
        turn = self.rotation + 2 * np.pi * np.arange(self.blades) / self.blades
        return self.circumradius * np.stack([np.sin(turn), np.cos(turn)], axis=1)

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, radius: ArrayLike) -> NDArray[Any]:
        """Return the Fourier transform of the polygon divided by its area, as a sum over its sides (Gauss's theorem).

        >>> Polygon(4).optical_transfer([0.0, 0.5], [0.5, 0.0], 1.0).round(3).tolist()
        [0.219, 0.219]
        >>> complex(Polygon(5).optical_transfer(0.0, 0.7, 1.0).round(3))
        (-0.088-0.033j)
        """
        radius = np.asarray(radius, float)
        y, x = np.broadcast_arrays(
            *(2 * np.pi * np.asarray(axis, float) * radius for axis in (frequency_y, frequency_x))
        )
        squared = x**2 + y**2
        small = squared < SERIES_PHASE**2
        safe = np.where(small, 1.0, squared)
        total = np.zeros(squared.shape, np.complex128)
        corners = self.corners()
        for (top, left), (bottom, right) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            down, over = bottom - top, right - left
            middle = x * (left + right) / 2 + y * (top + bottom) / 2
            half = (x * over + y * down) / 2
            total += (x * down - y * over) * np.sinc(half / np.pi) * np.exp(-1j * middle)
        found = np.where(small, 1 - squared * self.sd_per_radius**2 / 2, 1j * total / safe / np.pi)
        return found.real if self.symmetric else found
