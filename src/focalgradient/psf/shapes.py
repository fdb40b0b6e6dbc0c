"""Shapes of blur, one class each: disc, Gaussian, Gaussian-edged disc, annulus and polygon; and the pixel's blur."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.psf.shape import Psf, parameter

__all__ = [
    "DISC_K",
    "K_HELP",
    "PIXEL_VARIANCE",
    "Annulus",
    "Blend",
    "Disc",
    "Gaussian",
    "Polygon",
    "blend_transfer",
    "disc_edge",
    "disc_transfer",
    "gaussian_transfer",
    "pixel_transfer",
]

RIM_SAMPLES = 24
"""Samples per pixel, in each direction, along a disc's rim: the second moment is then accurate to 0.001."""

DISC_K = 0.5
"""sigma / radius of the Gaussian with the second moment (per axis) of a uniform disc."""


def disc_transfer(frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
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


def disc_edge(u: ArrayLike) -> FloatArray:
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

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
        """Return `disc_transfer`."""
        return disc_transfer(frequency, radius)

    def edge_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return `disc_edge` at `position` / `radius`."""
        return disc_edge(np.asarray(position, float) / radius)

    def line_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the length of the disc's chord at `position`, divided by the disc's area."""
        u = np.clip(np.asarray(position, float) / radius, -1, 1)
        return np.asarray(2 * np.sqrt(1 - u**2) / np.pi / radius)

    def picture(self, radius: float) -> FloatArray:
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
        picture: FloatArray = np.where(i <= j, light, light.T)[side[:, None], side]
        return picture / picture.sum()

    def points(self, square: FloatArray) -> FloatArray:
        """Return points of the unit disc by an equal-area map of the square (Shirley and Chiu 1997)."""
        a, b = 2 * square[..., 0], 2 * square[..., 1]
        wide = np.abs(a) > np.abs(b)
        radius, across = np.where(wide, a, b), np.where(wide, b, a)
        angle = np.pi / 4 * across / radius
        angle = np.where(wide, angle, np.pi / 2 - angle)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)


K_HELP = "sigma / disc radius"

EXTENT_SD = 6.0
"""Number of standard deviations beyond which an edge response is taken as 1 (error 1e-9)."""


def gaussian_transfer(frequency: ArrayLike, radius: ArrayLike, k: float = DISC_K) -> FloatArray:
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

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
        """Return `gaussian_transfer` with `k`."""
        return gaussian_transfer(frequency, radius, self.k)

    def edge_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the normal distribution function of `position` / sigma."""
        from scipy.special import ndtr

        return np.asarray(ndtr(np.asarray(position, float) / (self.k * radius)), float)

    def line_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the normal density with standard deviation sigma."""
        sigma = self.k * radius
        return np.exp(-((np.asarray(position, float) / sigma) ** 2) / 2) / (math.sqrt(2 * math.pi) * sigma)


CHORDS, CHORDS_PER_SIGMA = 512, 5
"""Minimum number of chords over which the Gaussian edge is integrated, and their number times k below k = 0.01:
accurate to 1e-6."""

DISC_BELOW = 1e-3
"""Value of k below which the edge response is a disc's: the difference is at most 1e-5."""


def blend_transfer(frequency: ArrayLike, radius: ArrayLike, k: float) -> FloatArray:
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

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
        """Return `blend_transfer` with `k`."""
        return blend_transfer(frequency, radius, self.k)

    def edge_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the mean of normal distribution functions centred on the disc's chords (Gauss-Chebyshev)."""
        if self.k < DISC_BELOW:
            return Disc().edge_response(position, radius)
        return self._over_chords(position, radius, line=False)

    def line_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the mean of normal densities centred on the disc's chords (Gauss-Chebyshev)."""
        if self.k < DISC_BELOW:
            return Disc().line_response(position, radius)
        return self._over_chords(position, radius, line=True)

    def _over_chords(self, position: ArrayLike, radius: float, line: bool) -> FloatArray:
        from scipy.special import ndtr

        u, rest = np.asarray(position, float) / radius, _rest(self.k)
        total = np.zeros(u.shape)
        chords = max(CHORDS, math.ceil(CHORDS_PER_SIGMA / self.k))
        turns = np.pi * np.arange(1, chords + 1) / (chords + 1)
        for chord, weight in zip(rest * np.cos(turns), 2 / (chords + 1) * np.sin(turns) ** 2, strict=True):
            z = (u - chord) / self.k
            total += weight * (np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi) / self.k / radius if line else ndtr(z))
        return total


@dataclass(frozen=True)
class Annulus(Psf):
    """Annulus: a disc with a central obstruction, as of a mirror lens."""

    name = "annulus"

    edge_reach = 1.0
    obstruction: float = parameter(0.35, "diameter of the obstruction / diameter of the aperture", least=0.0, most=0.95)
    """Obstruction ratio; mirror lenses for photography have 0.35 to 0.5."""

    @property
    def sd_per_radius(self) -> float:
        """Standard deviation per blur radius of a uniform annulus, whose variance is (1 + obstruction^2) / 4."""
        return DISC_K * math.sqrt(1 + self.obstruction**2)

    def transfer(self, frequency: ArrayLike, radius: ArrayLike) -> FloatArray:
        """Return the area-weighted difference between the transfers of the full disc and of the obstruction."""
        hole = self.obstruction
        inner, outer = (disc_transfer(frequency, scale * np.asarray(radius, float)) for scale in (hole, 1.0))
        return (outer - hole**2 * inner) / (1 - hole**2)

    def edge_response(self, position: ArrayLike, radius: float) -> FloatArray:
        """Return the area-weighted difference between the edge responses of the full disc and of the obstruction."""
        u, hole = np.asarray(position, float) / radius, self.obstruction
        inner = disc_edge(u / hole) if hole else 0.0
        return np.asarray((disc_edge(u) - hole**2 * inner) / (1 - hole**2), float)


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

    def corners(self) -> FloatArray:
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
        transfer = np.where(small, 1 - squared * self.sd_per_radius**2 / 2, 1j * total / safe / np.pi)
        return transfer.real if self.symmetric else transfer


PIXEL_VARIANCE = 1 / 12
"""Variance of the square pixel aperture along an axis (px^2)."""


def pixel_transfer(frequency_y: ArrayLike, frequency_x: ArrayLike) -> FloatArray:
    """Return the transfer of a square pixel aperture; frequencies in cycles per pixel; broadcasts.

    The sinc function that the paper's appendix multiplies by the transfer of the blur.

    >>> round(float(pixel_transfer(0.0, 0.5)), 4)
    0.6366
    """
    return np.sinc(np.asarray(frequency_y, dtype=float)) * np.sinc(np.asarray(frequency_x, dtype=float))
