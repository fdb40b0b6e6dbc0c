"""Spectra of whole images, and what every filter on them shares: radial frequencies, pass bands, natural power."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.depth.numerics import share_rows

__all__ = [
    "FINE_PASS",
    "RADIAL",
    "RADII",
    "Spectra",
    "disc_pass",
    "mirrored_spectra",
    "natural_levels",
    "natural_power",
]

FloatArray = NDArray[np.float64]
Image = NDArray[np.float32]

RADIAL = 512
"""Samples of radial frequency, 0 to 1/sqrt(2) cycles per pixel, at which filters are worked out."""

RADII: FloatArray = np.linspace(0, np.sqrt(0.5), RADIAL)
"""These frequencies, in cycles per pixel."""

FINEST = 0.47
"""Cycles per pixel up to which images are compared: finer detail is aliased by the pixels, and lost in resampling."""

FINE_PASS: FloatArray = np.exp(-((RADII / FINEST) ** 16) / 2)
"""Amplitude of the pass band that ends there."""

FINE = 8
"""Parts of a radial sample to which filters are interpolated."""

LOW = (0.01, 0.08)
"""Cycles per pixel between which the level of a scene's power is measured: no moderate blur takes anything there."""


def disc_pass(radius: FloatArray | float, *, limit: float, power: int) -> FloatArray:
    """Pass band (amplitude at RADII) of a disc of `radius` pixels that ends where 2 pi radius f is `limit`; broadcasts.

    The disc's transfer has its first zeros at 3.8 and 7.0. The larger `power`, the steeper the band's end.
    """
    band: FloatArray = np.exp(-((2 * np.pi * radius * RADII / limit) ** power) / 2)
    return band


def natural_levels(power: FloatArray, occupied: NDArray[np.bool_] | None = None) -> FloatArray:
    """Power at frequency 1 of each of n natural scenes, whose power falls as 1 / f^2, from `power` at RADII (n x F).

    The median over low frequencies; samples that are not `occupied` (F) hold no frequency of a small image.
    """
    low = (LOW[0] < RADII) & (LOW[1] > RADII)
    if occupied is not None:
        low &= occupied
    return np.median(power[:, low] * RADII[low] ** 2, axis=1)


def natural_power(level: float) -> FloatArray:
    """Power at RADII of a natural scene whose power at frequency 1 is `level`: level / f^2."""
    return level / np.maximum(RADII, RADII[1]) ** 2


def mirrored_spectra(images: Sequence[Image], reach: int, size: tuple[int, int]) -> list[NDArray[np.complex64]]:
    """Half spectra of `images` (H x W), mirrored all around to `size`, with `reach` pixels before the first."""
    height, width = images[0].shape
    around = ((reach, size[0] - height - reach), (reach, size[1] - width - reach))
    return [fft.rfft2(np.pad(image - image.mean(), around, mode="symmetric"), workers=-1) for image in images]


@dataclass(frozen=True, slots=True)
class Spectra:
    """Whole images as spectra, mirrored all around so that no filter wraps, with where each frequency lies."""

    values: list[NDArray[np.complex64]]
    shape: tuple[int, int]
    size: tuple[int, int]
    reach: int
    position: NDArray[np.int32]  # of each frequency along the radial samples, in FINE parts of one

    @classmethod
    def of(cls, images: Sequence[Image], reach: int) -> Spectra:
        """Spectra of `images`, each H x W, with at least `reach` pixels of mirrored surround."""
        height, width = images[0].shape
        reach = min(reach, height, width)
        rows, columns = (fft.next_fast_len(n + 2 * reach, real=True) for n in (height, width))
        frequency = np.hypot(fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None])
        return cls(
            mirrored_spectra(images, reach, (rows, columns)),
            (height, width),
            (rows, columns),
            reach,
            np.rint(frequency * (FINE * (RADIAL - 1) * np.sqrt(2))).astype(np.int32),
        )

    def measure_and_power(self) -> tuple[FloatArray, FloatArray]:
        """Share of all frequencies that falls to each radial sample (F), and each image's mean power there (n x F)."""
        index = (self.position.ravel() + FINE // 2) // FINE
        # A real image's spectrum is stored by half: all but the first column stand for two.
        twice = np.full(self.position.shape, 2.0)
        twice[:, 0] = 1.0
        counts = np.bincount(index, twice.ravel(), RADIAL)
        power = [
            np.bincount(index, (twice * (s.real**2 + s.imag**2)).ravel(), RADIAL) / np.maximum(counts, 1)
            for s in self.values
        ]
        return counts / counts.sum(), np.stack(power) / (self.size[0] * self.size[1])

    def filtered(self, filters: FloatArray) -> Image:
        """The sum of the images, each filtered by its row of `filters` (n x F): H x W."""
        samples = np.arange(FINE * (RADIAL - 1) + 1) / FINE
        total = np.zeros(self.position.shape, np.complex64)
        for row, spectrum in zip(filters, self.values, strict=True):
            if row.any():  # a comparison of early views leaves out those after
                gain = np.interp(samples, np.arange(RADIAL), row).astype(np.float32)
                total += gain.take(self.position) * spectrum
        inside = tuple(slice(self.reach, self.reach + n) for n in self.shape)
        image: Image = fft.irfft2(total, self.size, overwrite_x=True)[inside]
        return image

    def stack(self, filters: FloatArray) -> Image:
        """One filtered image for each of `filters` (r x n x F): r x H x W."""
        images = np.empty((len(filters), *self.shape), np.float32)

        def some(first: int, last: int) -> None:
            for number in range(first, last):
                images[number] = self.filtered(filters[number])

        share_rows(len(filters), some)
        return images
