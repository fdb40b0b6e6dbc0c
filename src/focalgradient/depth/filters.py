"""Whole images filtered so that only what blur cannot explain is left, at every candidate depth at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.depth import numerics

__all__ = ["RADIAL", "Residuals", "Spectra", "fine_noise", "residual_filters"]

FloatArray = NDArray[np.float64]
Image = NDArray[np.float32]

RADIAL = 512
"""Samples of radial frequency, 0 to 1/sqrt(2) cycles per pixel, at which filters are worked out."""

FINE = 8
"""Parts of a radial sample to which filters are interpolated."""

BAND = 4_000_000
"""Products of basis images that are held at a time."""

MOST = 128
"""Filtered images that are held at most: 1 GB of them at 1920 x 1080 pixels."""

TOLERANCE = 1e-4
"""Energy, in units of the noise variance, by which a low-rank family may err."""


def residual_filters(transfers: FloatArray) -> list[FloatArray]:
    """Orthonormal filters onto the complement of the views' transfers, one set for each view after the first.

    Parameters
    ----------
    transfers
        n x L x F: transfer of view i at candidate l and frequency f, over the standard deviation of its noise.

    Returns
    -------
    list of ndarray
        n - 1 arrays n x L x F. The j-th compares view j + 1 with the best estimate from the views before it, so
        that for two views it is (H2, -H1) / sqrt(H1^2 + H2^2).

    Examples
    --------
    >>> residual_filters(np.array([[[0.8]], [[0.6]]]))[0].ravel().round(3).tolist()
    [0.6, -0.8]
    """
    tiny = 1e-6 * np.abs(transfers).max()  # where every transfer vanishes, noise is compared with noise
    filters = []
    # The best estimate so far is combination . views, of transfer `reached`. Its sign follows the first view's, for
    # the filters to change smoothly with V.
    combination, reached = np.ones_like(transfers[:1]), transfers[0]
    for j in range(1, len(transfers)):
        norm = np.sqrt(reached**2 + transfers[j] ** 2 + tiny**2)
        rows = np.zeros_like(transfers)
        rows[:j] = combination * (transfers[j] / norm)
        rows[j] = -reached / norm
        filters.append(rows)
        combination, reached = transfers[: j + 1] / norm, norm
    return filters


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
        around = ((reach, rows - height - reach), (reach, columns - width - reach))
        frequency = np.hypot(fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None])
        return cls(
            [fft.rfft2(np.pad(image - image.mean(), around, mode="symmetric"), workers=-1) for image in images],
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
            total += np.interp(samples, np.arange(RADIAL), row).astype(np.float32)[self.position] * spectrum
        inside = tuple(slice(self.reach, self.reach + n) for n in self.shape)
        image: Image = fft.irfft2(total, self.size, overwrite_x=True)[inside]
        return image

    def stack(self, filters: FloatArray) -> Image:
        """One filtered image for each of `filters` (r x n x F): r x H x W."""
        images = np.empty((len(filters), *self.shape), np.float32)

        def some(first: int, last: int) -> None:
            for number in range(first, last):
                images[number] = self.filtered(filters[number])

        numerics.share_rows(len(filters), some)
        return images


@dataclass(frozen=True, slots=True)
class Residuals:
    """What one comparison of views leaves unexplained, at every candidate level, as a few images.

    The residual at level l is ``sum_k coefficients[l, k] * images[k]``. `coefficients` is None where the images are
    the residuals themselves, one a level. ``noise[l]`` is the residual's variance from noise of variance 1.
    """

    images: Image  # r x H x W
    coefficients: FloatArray | None  # L x r
    noise: FloatArray  # L
    noise_slope: FloatArray  # L: what noise alone adds to the variance of the score, per level^2
    gains: FloatArray  # n x L x F: the filters' power gains, which shape each view's noise
    measure: FloatArray  # F: share of all frequencies at each radial sample

    @classmethod
    def of(cls, spectra: Spectra, filters: FloatArray) -> Residuals:
        """Filter whole images by `filters` (n x L x F)."""
        measure, power = spectra.measure_and_power()
        views, levels, _ = filters.shape
        weight = np.sqrt(measure * power) + 1e-6 * np.sqrt(power.max())  # the energy that a filter meets
        rows = (filters * weight[:, None]).transpose(1, 0, 2).reshape(levels, -1)
        left, _, _ = np.linalg.svd(rows[:, ::4], full_matrices=False)  # every fourth frequency is enough to tell
        basis = left.T @ rows
        left_over = np.cumsum((left**2 * (basis**2).sum(axis=1))[:, ::-1], axis=1)[:, ::-1].max(axis=0)
        rank = min(MOST, max(1, int(np.searchsorted(-left_over, -TOLERANCE))))
        # A product of images costs about a fiftieth of filtering one.
        if levels <= MOST and rank + rank**2 / 100 > levels:
            images = spectra.stack(filters.transpose(1, 0, 2))
            coefficients = None
        else:
            coefficients = left[:, :rank]
            parts = basis[:rank].reshape(rank, views, -1) / weight
            images = spectra.stack(parts)
            filters = np.einsum("lr,rnf->nlf", coefficients, parts)  # what was kept of them
        gain = (filters**2).sum(axis=0)
        slope = (np.gradient(filters, axis=1) ** 2).sum(axis=0)
        return cls(images, coefficients, gain @ measure, (gain * slope) @ measure, filters**2, measure)

    def energy(self, weight: Image, step: int) -> Image:
        """Squared residuals at every level, summed over blocks of `step` pixels: L x h x w."""
        if self.coefficients is None:
            return numerics.block_squares(self.images, weight, step).astype(np.float32)
        first, second = np.tril_indices(self.coefficients.shape[1])
        quadratic = self.coefficients[:, first] * self.coefficients[:, second] * np.where(first == second, 1.0, 2.0)
        height, width = weight.shape
        # By bands of rows, for the products to stay small.
        band = max(1, BAND // (len(first) * -(-width // step)))
        bands = [
            quadratic
            @ numerics.block_products(self.images[:, y : y + band * step], weight[y : y + band * step], step).reshape(
                len(first), -1
            )
            for y in range(0, height, band * step)
        ]
        energy = np.concatenate([part.astype(np.float32) for part in bands], axis=1)
        return energy.reshape(len(quadratic), -(-height // step), -(-width // step))

    def at(self, level: Image) -> tuple[Image, Image]:
        """The residual image where each pixel lies at its own (fractional) `level`, and its derivative by level."""
        if self.coefficients is None:
            return numerics.pick(self.images, level)
        return numerics.mix(self.images, self.coefficients.astype(np.float32), level)


def fine_noise(image: Image) -> float:
    """Standard deviation of noise that would explain the finest detail (beyond 0.45 cycles per pixel) of `image`."""
    share, power = Spectra.of([image], 0).measure_and_power()
    fine = np.flatnonzero(share)  # a small image has no frequency at some samples
    return float(np.sqrt(np.median(power[0, fine[fine >= int(0.45 * np.sqrt(2) * RADIAL)]])))
