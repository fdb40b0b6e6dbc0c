"""Gaussian-edged disc: the blur of real lenses, between a disc and a Gaussian."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.disc import DISC_K, Disc, disc_transfer
from focalgradient.psf.gaussian import EXTENT_SD, K_HELP, gaussian_transfer
from focalgradient.psf.shape import Psf, parameter

__all__ = ["Blend", "blend_transfer"]

CHORDS, CHORDS_PER_SIGMA = 512, 5
"""Minimum number of chords over which the Gaussian edge is integrated, and their number times k below k = 0.01:
accurate to 1e-6."""

DISC_BELOW = 1e-3
"""Value of k below which the edge response is a disc's: the difference is at most 1e-5."""


def blend_transfer(frequency: ArrayLike, radius: ArrayLike, k: float) -> NDArray[np.float64]:
    """Return the transfer of a Gaussian-edged disc, a disc convolved with a Gaussian; broadcasts.

    The Gaussian has standard deviation `k` x `radius`, the disc radius `radius` sqrt(1 - (k / 0.5)^2), so that the
    second moment equals that of a uniform disc of `radius`. k = 0 is a disc, k >= 0.5 a Gaussian.

    >>> [round(float(blend_transfer(0.1, 4.0, k)), 3) for k in (0.0, 0.35, 0.5)]
    [0.393, 0.44, 0.454]
    """
    return disc_transfer(frequency, _rest(k) * np.asarray(radius, dtype=float)) * gaussian_transfer(
        frequency, radius, k
    )


def _rest(k: float) -> float:
    """Return the radius of the disc component, relative to the blur radius."""
    return float(np.sqrt(max(0.0, 1 - (k / DISC_K) ** 2)))


@dataclass(frozen=True)
class Blend(Psf):
    """Gaussian-edged disc: a disc convolved with a Gaussian of sigma = k x blur radius, of a disc's second moment."""

    name = "blend"

    k: float = parameter(0.35, K_HELP, least=0.0, exclusive=True)
    """sigma / blur radius. At the default 0.35 disc and Gaussian have equal second moments; from 0.5 it is a
    Gaussian."""

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation per blur radius: the disc's 0.5, or `k` if larger."""
        return max(DISC_K, self.k)

    @property
    def edge_reach(self) -> float:
        """Disc radius plus six standard deviations of the Gaussian, in blur radii."""
        return _rest(self.k) + EXTENT_SD * self.k

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
        """Return `blend_transfer` with `k`."""
        return blend_transfer(frequency, radius, self.k)

    def edge_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the mean of normal distribution functions centred on the disc's chords (Gauss-Chebyshev)."""
        if self.k < DISC_BELOW:
            return Disc().edge_response(position, radius)
        return self._over_chords(position, radius, line=False)

    def line_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the mean of normal densities centred on the disc's chords (Gauss-Chebyshev)."""
        if self.k < DISC_BELOW:
            return Disc().line_response(position, radius)
        return self._over_chords(position, radius, line=True)

    def _over_chords(self, position: ArrayLike, radius: float, line: bool) -> NDArray[np.float64]:
        from scipy.special import ndtr

        u, rest = np.asarray(position, float) / radius, _rest(self.k)
        total = np.zeros(u.shape)
        chords = max(CHORDS, math.ceil(CHORDS_PER_SIGMA / self.k))
        turns = np.pi * np.arange(1, chords + 1) / (chords + 1)
        for chord, weight in zip(rest * np.cos(turns), 2 / (chords + 1) * np.sin(turns) ** 2, strict=True):
            z = (u - chord) / self.k
            total += weight * (np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) / self.k / radius if line else ndtr(z))
        return total
