"""The Gaussian-edged disc: real lenses' blur, between a disc and a Gaussian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.psf.disc import DISC_K, disc_transfer
from focalgradient.psf.gaussian import K_HELP, SPREAD, gaussian_transfer
from focalgradient.psf.shape import Psf, parameter

__all__ = ["Blend", "blend_transfer"]

CHORDS = 512
"""Chords of the disc over which its Gaussian rim is integrated: 0.006 radii apart, right to 1e-6 for k of 0.01 on."""


def blend_transfer(frequency: ArrayLike, radius: ArrayLike, k: float) -> NDArray[np.float64]:
    """Transfer of a disc convolved with a Gaussian, as real lenses' blur is; broadcasts.

    The Gaussian's standard deviation is `k` x `radius`, the disc's own radius `radius` sqrt(1 - (k / 0.5)^2): the two
    together have the second moment of the whole disc. 0 is the disc, 0.5 and more the Gaussian.

    >>> [round(float(blend_transfer(0.1, 4.0, k)), 3) for k in (0.0, 0.35, 0.5)]
    [0.393, 0.44, 0.454]
    """
    return disc_transfer(frequency, _rest(k) * np.asarray(radius, dtype=float)) * gaussian_transfer(
        frequency, radius, k
    )


def _rest(k: float) -> float:
    """Radius of the disc's part, over the whole radius."""
    return float(np.sqrt(max(0.0, 1 - (k / DISC_K) ** 2)))


@dataclass(frozen=True)
class Blend(Psf):
    """Gaussian-edged disc: a disc convolved with a Gaussian of sigma = k x blur radius, of a disc's second moment."""

    name = "blend"

    k: float = parameter(0.35, K_HELP, least=0.0, exclusive=True)
    """By default half of the second moment is the disc's, half the Gaussian's. From 0.5 on all is the Gaussian's."""

    @property
    def sd_per_radius(self) -> float:
        """A disc's, or `k` where that is larger."""
        return max(DISC_K, self.k)

    @property
    def edge_reach(self) -> float:
        """The disc's radius, and six standard deviations of the Gaussian."""
        return _rest(self.k) + SPREAD * self.k

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
        """See `blend_transfer`."""
        return blend_transfer(frequency, radius, self.k)

    def edge_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the mean, over the disc's chords, of the normal distribution about each (Gauss-Chebyshev)."""
        return self._over_chords(position, radius, line=False)

    def line_response(self, position: ArrayLike, radius: float) -> NDArray[np.float64]:
        """Return the same of the normal density."""
        return self._over_chords(position, radius, line=True)

    def _over_chords(self, position: ArrayLike, radius: float, line: bool) -> NDArray[np.float64]:
        from scipy.special import ndtr

        u, rest = np.asarray(position, float) / radius, _rest(self.k)
        total = np.zeros(u.shape)
        turns = np.pi * np.arange(1, CHORDS + 1) / (CHORDS + 1)
        for chord, weight in zip(rest * np.cos(turns), 2 / (CHORDS + 1) * np.sin(turns) ** 2, strict=True):
            z = (u - chord) / self.k
            total += weight * (np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) / self.k / radius if line else ndtr(z))
        return total
