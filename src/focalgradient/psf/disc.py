"""Uniform blur disc of geometric optics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.shape import Psf

__all__ = ["DISC_K", "Disc", "disc_edge", "disc_transfer"]

RIM_SAMPLES = 24
"""Samples per pixel, in each direction, along a disc's rim: the second moment is then accurate to 0.001."""

DISC_K = 0.5
"""sigma / radius of the Gaussian with the second moment (per axis) of a uniform disc."""


def disc_transfer(frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
    """Return the transfer of a uniform disc, 2 J1(x) / x with x = 2 pi `radius` `frequency`; broadcasts.

    Negative (contrast reversal) beyond the first zero at 0.61 cycles per radius.

    >>> disc_transfer([0.0, 0.61], 1.0).round(3).tolist()
    [1.0, -0.0]
    """
    # Imported here to keep `import focalgradient` light.
    from scipy.special import j1

    x = 2 * np.pi * np.asarray(radius, dtype=float) * np.asarray(frequency, dtype=float)
    small = np.abs(x) < 1e-4
    safe = np.where(small, 1.0, x)
    return np.where(small, 1 - x**2 / 8, 2 * j1(safe) / safe)


def disc_edge(u: ArrayLike) -> NDArray[np.float64]:
    """Return the edge response of a disc of radius 1: the fraction of its area left of `u`.

    >>> disc_edge([-1.0, 0.0, 0.5]).round(4).tolist()
    [0.0, 0.5, 0.8045]
    """
    u = np.clip(np.asarray(u, float), -1, 1)
    return 0.5 + (u * np.sqrt(1 - u**2) + np.arcsin(u)) / np.pi


@dataclass(frozen=True)
class Disc(Psf):
    """Uniform disc: a circular aperture, by geometric optics."""

    name = "disc"
    sd_per_radius = DISC_K
    edge_reach = 1.0

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
        """Return `disc_transfer`."""
        return disc_transfer(frequency, radius)

    def edge_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return `disc_edge` at `position` / `radius`."""
        return disc_edge(np.asarray(position, float) / radius)

    def line_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the length of the disc's chord at `position`, divided by the disc's area."""
        u = np.clip(np.asarray(position, float) / radius, -1, 1)
        return np.asarray(2 * np.sqrt(1 - u**2) / np.pi / radius)

    def picture(self, radius: float) -> NDArray[np.float64]:
        """Return the disc weighted by the pyramid of linear interpolation at each pixel, sampled along its rim."""
        reach, inner = math.ceil(radius) + 1, self.narrowed(radius)
        i, j = np.indices((reach + 1, reach + 1))
        away = np.hypot(i, j)
        light = (away < inner).astype(float)
        rim = (np.abs(away - inner) < math.sqrt(2)) & (i <= j)  # eightfold symmetry
        at = (np.arange(2 * RIM_SAMPLES) + 0.5) / RIM_SAMPLES - 1
        weight = (1 - np.abs(at)) / RIM_SAMPLES
        inside = np.hypot(i[rim][:, None, None] + at[:, None], j[rim][:, None, None] + at) <= inner
        light[rim] = inside @ weight @ weight
        side = np.abs(np.arange(-reach, reach + 1))
        picture: NDArray[np.float64] = np.where(i <= j, light, light.T)[side[:, None], side]
        return picture / picture.sum()

    def points(self, square: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points of the unit disc by an equal-area map of the square (Shirley and Chiu 1997)."""
        a, b = 2 * square[..., 0], 2 * square[..., 1]
        wide = np.abs(a) > np.abs(b)
        radius, across = np.where(wide, a, b), np.where(wide, b, a)
        angle = np.pi / 4 * across / radius
        angle = np.where(wide, angle, np.pi / 2 - angle)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)
