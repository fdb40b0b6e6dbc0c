"""Gaussian blur, the paper's model of a lens."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.disc import DISC_K
from focalgradient.psf.shape import Psf, parameter

__all__ = ["K_HELP", "Gaussian", "gaussian_transfer"]

K_HELP = "sigma / disc radius"

EXTENT_SD = 6.0
"""Number of standard deviations beyond which an edge response is taken as 1 (error 1e-9)."""


def gaussian_transfer(frequency: ArrayLike, radius: ArrayLike, k: float = DISC_K) -> NDArray[np.float64]:
    """Return the transfer of a Gaussian of sigma = `k` x `radius`, exp(-2 (pi sigma f)^2); broadcasts.

    >>> round(float(gaussian_transfer(0.1, 4.0, k=0.5)), 3)
    0.454
    """
    sigma = k * np.asarray(radius, dtype=float)
    return np.exp(-2 * (np.pi * sigma * np.asarray(frequency, dtype=float)) ** 2)


@dataclass(frozen=True)
class Gaussian(Psf):
    """Gaussian of sigma = k x blur radius; the paper uses k = 1, k = 0.5 has a disc's second moment."""

    name = "gaussian"
    absorbs_pixel = True
    scale_parameter = "k"
    ends_sharply = False

    k: float = parameter(DISC_K, K_HELP, least=0.0, exclusive=True)

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation per blur radius, `k`."""
        return self.k

    @property
    def edge_reach(self) -> float:
        """Six standard deviations, in blur radii."""
        return EXTENT_SD * self.k

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
        """Return `gaussian_transfer` with `k`."""
        return gaussian_transfer(frequency, radius, self.k)

    def edge_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the normal distribution function of `position` / sigma."""
        from scipy.special import ndtr

        return np.asarray(ndtr(np.asarray(position, float) / (self.k * radius)), float)

    def line_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the normal density with standard deviation sigma."""
        sigma = self.k * radius
        return np.exp(-((np.asarray(position, float) / sigma) ** 2) / 2) / (math.sqrt(2 * math.pi) * sigma)
