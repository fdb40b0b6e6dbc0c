"""The table that turns focal disparity into depth: monotone, worked out from the optics, mended by measured images.

For texture of a known spectrum both views' energies in a band follow from their blur, and with them the ratio, its
scatter over a window, and what noise adds. The scatter needs no simulation: energies are sums of squares of a random
field, whose variance is the summed square of the field's covariance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.optics import Optics
from focalgradient.psf import DISC_K, PsfName, pixel_transfer, transfer

__all__ = ["BANDS", "DisparityTable"]

FloatArray = NDArray[np.float64]

BANDS = (1, 2, 4, 8)
"""Scales, in pixels, at which second differences are taken: each responds to frequencies half the last one's."""

SLOPE = 1.0
"""Texture is taken to have an amplitude spectrum 1/frequency^SLOPE, until the bands' energies tell otherwise."""

STEEPER = 0.75
"""Steeper slope by which the effect of the slope is worked out: smooth texture is steeper more often than flatter."""

FINEST = 0.5
"""Cycles per pixel, in any direction, beyond which an image is taken to hold no texture."""

NOISE_ENERGY = 20.0
"""Energy of the second difference of noise of variance 1: 4^2 + 4 x 1^2. Means over pixels have so much less."""

NOISE_ALONE = 1.69
"""Sum over the band's own grid of that noise's squared correlation: (1 + 4 x (8^2 + 2^2 + 1) / 20^2)."""

CLEAR_OF_LEAST = 0.05
"""Distance in the logarithm of disparity from its least within which a band is taken to tell nothing more."""

GRID = 128
"""Frequencies in each direction at which spectra are worked out."""

LEVELS = 96
"""Levels of defocus in a table, closer together near focus where disparity changes as its square."""

LARGEST = 24.0
"""Blur radius in pixels up to which tables reach at most."""


@dataclass(frozen=True, slots=True, eq=False)
class DisparityTable:
    """Expected focal disparity against defocus, for two apertures at one focus.

    Parameters
    ----------
    bands
        Scale of each band's second difference, in pixels.
    focus
        Vergence of the plane of focus, in dioptres.
    defocus
        Size of the defocus, L levels rising from 0, in dioptres.
    curves
        Bands x 8 x L, as `focalgradient.depth.ratio_reading.read` takes them: the logarithm of the disparity, three
        parts of its variance, and how it and the sharper view's energy change with the texture's spectrum.
    ends
        For each band the last level up to which its disparity falls all the way: beyond, it tells nothing.

    Examples
    --------
    A point half a dioptre from focus has at f/5.6, in the finest band, about a fifth of the detail that it has at f/16.

    >>> from focalgradient import Lens
    >>> lenses = [Lens(focal_length=0.025, f_number=n, focus_distance=0.85) for n in (16, 5.6)]
    >>> table = DisparityTable.of(lenses, pixel_angle=3.1e-4)
    >>> table.disparity([1 / 0.85, 1 / 0.85 - 0.5]).round(2).tolist()
    [1.0, 0.22]
    """

    bands: tuple[int, ...]
    focus: float
    defocus: FloatArray
    curves: FloatArray
    ends: tuple[int, ...]

    @classmethod
    def of(
        cls,
        lenses: Sequence[Optics],
        pixel_angle: float,
        *,
        reach: float | None = None,
        psf: PsfName = "disc",
        k: float = DISC_K,
        bands: Sequence[int] = BANDS,
    ) -> DisparityTable:
        """The table of two lenses, for 1/f texture, a square pixel and the blur of the model.

        Parameters
        ----------
        lenses
            The one with the smaller aperture and the one with the larger, at one focus.
        pixel_angle
            Angle of one pixel, in radians.
        reach
            Largest defocus to tabulate, in dioptres; by default, and at most, that of a blur of 24 pixels.
        psf, k
            Blur model, as in `focalgradient.recover_depth`.
        bands
            Scales of the second difference: any of 1, 2, 4 and 8 pixels.

        Raises
        ------
        InputError
            If the lenses are not two apertures at one focus, or a band is unknown.
        """
        small, large = _apertures(lenses)
        if not bands or not set(bands) <= set(BANDS):
            raise InputError(f"bands is {tuple(bands)!r}, but must be one or more of {', '.join(map(str, BANDS))}.")
        limit = LARGEST / (large.aperture_diameter / 2 / pixel_angle)
        defocus = min(limit, reach or limit) * np.linspace(0, 1, LEVELS) ** 1.5
        pixels = [optics.aperture_diameter / 2 / pixel_angle for optics in (small, large)]
        down, right = np.fft.fftfreq(GRID)[:, None], np.fft.rfftfreq(GRID)
        frequency = np.hypot(down, right)
        radial = np.linspace(0, 0.75, 1025)  # blur is isotropic: worked out once along a radius
        blurs = [
            [np.interp(frequency, radial, transfer(radial, scale * step, psf, k)) for scale in pixels]
            for step in defocus
        ]
        frequency[0, 0] = np.inf  # mean brightness is no texture
        seen = pixel_transfer(down, right) ** 2 * (frequency <= FINEST)
        curves = np.empty((len(bands), 8, LEVELS))
        for band, curve in zip(bands, curves, strict=True):
            gain = band_gain(band, down, right)
            for level, (one, other) in enumerate(blurs):
                curve[:, level] = _expected(seen * gain, gain, frequency, one, other, band)
        return cls(tuple(bands), large.focus_vergence, defocus, curves, tuple(_end(curve[0]) for curve in curves))

    def disparity(self, vergence: FloatArray | Sequence[float], band: int = 1) -> FloatArray:
        """Expected focal disparity at `vergence` (D, any shape) in one of the table's bands; 1 in focus."""
        size = np.abs(self.focus - np.asarray(vergence, dtype=float))
        return np.exp(np.interp(size, self.defocus, self.curves[self.bands.index(band), 0]))

    def size_of_defocus(self, disparity: FloatArray | Sequence[float], band: int = 1) -> FloatArray:
        """Size of the defocus in dioptres, of either sign, that gives `disparity` in one of the table's bands.

        0 for a disparity of 1 or more; ``nan`` for less than the band can tell.
        """
        index = self.bands.index(band)
        end = self.ends[index] + 1
        with np.errstate(divide="ignore"):
            told = np.log(np.asarray(disparity, dtype=float))
        return np.interp(-told, -self.curves[index, 0, :end], self.defocus[:end], right=np.nan)

    def mended(self, vergence: Sequence[float], disparity: FloatArray) -> DisparityTable:
        """The table through disparities measured at known vergences (D), one row of `disparity` for each band.

        What was measured corrects the optics' curve by factors, interpolated in the defocus and held beyond the last;
        scatter and noise stay the optics'. Where measurements contradict a falling curve the band ends.

        >>> from focalgradient import Lens
        >>> lenses = [Lens(focal_length=0.025, f_number=n, focus_distance=0.85) for n in (16, 5.6)]
        >>> table = DisparityTable.of(lenses, pixel_angle=3.1e-4, bands=[1])
        >>> seen = 1.1 * table.disparity([0.9, 0.6])  # this lens is a little sharper than its f-number says
        >>> float(table.mended([0.9, 0.6], seen[None]).disparity(0.75) / table.disparity(0.75)).__round__(3)
        1.1
        """
        size = np.abs(self.focus - np.asarray(vergence, dtype=float))
        disparity = np.asarray(disparity, dtype=float)
        if disparity.shape != (len(self.bands), size.size) or size.size == 0:
            raise InputError(
                f"disparity has shape {disparity.shape}, but must hold one row for each of {len(self.bands)} bands and "
                f"one column for each of {size.size} vergences, one or more."
            )
        order = np.argsort(size)
        curves = self.curves.copy()
        for index, row in enumerate(disparity):
            known = np.isfinite(row[order]) & (row[order] > 0)
            if known.any():
                places = size[order][known]
                error = np.log(row[order][known]) - np.interp(places, self.defocus, self.curves[index, 0])
                # In focus both views are alike, whatever the lens.
                anchored = [0.0, *places], [0.0, *error]
                curves[index, 0] += np.interp(self.defocus, *(anchored if places[0] > 0 else (places, error)))
        curves[:, 7] = np.exp(2 * curves[:, 0])
        return replace(self, curves=curves, ends=tuple(_end(curve[0]) for curve in curves))

    def scales(self, window: float) -> FloatArray:
        """Bands x 4 numbers for `ratio_reading.read`, for energies gathered in a Gaussian of sd `window` pixels."""
        rows = []
        for band, end in zip(self.bands, self.ends, strict=True):
            # Pixels' worth of the window: Gaussian, and the squares that it gathers.
            area = 4 * math.pi * window**2 + max(4, band) ** 2
            rows.append((float(end), NOISE_ENERGY / band**2, band**2 / (2 * area), NOISE_ALONE))
        return np.array(rows)


def band_gain(band: int, down: NDArray[np.floating], right: NDArray[np.floating]) -> FloatArray:
    """Power gain, at frequencies in cycles per pixel, of the second difference of means over `band` x `band` pixels.

    >>> float(band_gain(1, np.array(0.5), np.array(0.5))), float(band_gain(1, np.array(0.0), np.array(0.0)))
    (64.0, 0.0)
    """
    mean = [np.sinc(band * f) / np.sinc(f) for f in (down, right)]
    second = 4 - 2 * np.cos(2 * np.pi * band * down) - 2 * np.cos(2 * np.pi * band * right)
    return (mean[0] * mean[1] * second) ** 2


def _expected(
    seen: FloatArray, gain: FloatArray, frequency: FloatArray, one: FloatArray, other: FloatArray, band: int
) -> list[float]:
    """A column of a table: log disparity, its variance's three parts, and its change with the texture's spectrum."""
    texture = seen * frequency ** (-2 * SLOPE)
    parts = [_covariance(texture * product) for product in (one**2, other**2, one * other)]
    noise = _covariance(gain)
    first, second = parts[0][0, 0], parts[1][0, 0]

    def joint(a: FloatArray, b: FloatArray) -> float:
        return float((a[::band, ::band] * b[::band, ::band]).sum())

    own = joint(parts[0], parts[0]) / first**2 + joint(parts[1], parts[1]) / second**2
    own -= 2 * joint(parts[2], parts[2]) / (first * second)
    with_noise = [2 * joint(part, noise) / (part[0, 0] * noise[0, 0]) for part in parts[:2]]
    tilted = []
    for tilt in (0.0, STEEPER):
        spectrum = _twice(texture * np.where(np.isinf(frequency), 1.0, frequency) ** (-2 * tilt))
        tilted.append(np.log([float((spectrum * one**2).sum()), float((spectrum * other**2).sum())]))
    by_slope = (tilted[1] - tilted[0]) / STEEPER
    change = [(by_slope[1] - by_slope[0]) / 2, math.log(first), by_slope[0]]
    return [math.log(second / first) / 2, max(own, 0.0), *with_noise, *change, second / first]


def _covariance(power: FloatArray) -> FloatArray:
    return np.fft.irfft2(power, (GRID, GRID))


def _twice(power: FloatArray) -> FloatArray:
    """Half a real image's spectrum is stored: all but its first and last columns stand for two."""
    weight = np.full(power.shape[1], 2.0)
    weight[[0, -1]] = 1.0
    return power * weight


def _end(curve: FloatArray) -> int:
    """The last level up to which a curve falls, and stays clear of the least it reaches later on.

    Where both views are far out of focus, blur has taken from either all it can, and their ratio stands still.
    """
    falling = int(np.argmax(np.append(np.diff(curve) >= 0, True)))
    return max(1, min(falling, int(np.argmax(curve <= curve.min() + CLEAR_OF_LEAST))))


def _apertures(lenses: Sequence[Optics]) -> tuple[Optics, Optics]:
    """The lens with the smaller aperture, and the one with the larger; refused unless they share one focus."""
    if len(lenses) != 2:
        raise InputError(f"{len(lenses)} lenses given, but a ratio takes two: a small aperture and a large one.")
    small, large = sorted(lenses, key=lambda optics: optics.aperture_diameter)
    if abs(small.focus_vergence - large.focus_vergence) > 1e-9 * max(1.0, abs(small.focus_vergence)):
        raise InputError(
            f"the views are focused at {small.focus_vergence:.4g} and {large.focus_vergence:.4g} D, but a ratio "
            "compares two apertures at one focus: use another method for views that differ in focus."
        )
    if small.aperture_diameter == large.aperture_diameter:
        raise InputError("both apertures are equal, so that their ratio tells nothing of depth: change one f-number.")
    return small, large
