"""Whole images filtered so that only what blur cannot explain is left, at every candidate depth at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth import numerics
from focalgradient.depth.filters import ROUND, FloatArray, Frequencies, Image, Spectra

__all__ = ["Residuals", "residual_filters"]

BAND = 4_000_000
"""Pixels of residual images that are held at a time."""

MOST = 128
"""Filtered images that are held at most: 1 GB of them at 1920 x 1080 pixels."""

TOLERANCE = 1e-4
"""Energy, in units of the noise variance, by which a low-rank family may err."""


def residual_filters(transfers: NDArray[Any]) -> list[NDArray[Any]]:
    """Orthonormal filters onto the complement of the views' transfers, one set for each view after the first.

    Parameters
    ----------
    transfers
        n x L x F: transfer of view i at candidate l and frequency f, over the standard deviation of its noise; complex
        where blur is not round.

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
        norm = np.sqrt(np.abs(reached) ** 2 + np.abs(transfers[j]) ** 2 + tiny**2)
        rows = np.zeros_like(transfers)
        rows[:j] = combination * (transfers[j] / norm)
        rows[j] = -reached / norm
        filters.append(rows)
        combination, reached = transfers[: j + 1].conj() / norm, norm
    return filters


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
    gains: FloatArray  # n x L x radial samples: the filters' power gains, which shape each view's noise
    measure: FloatArray  # share of all frequencies at each radial sample

    @classmethod
    def of(cls, spectra: Spectra, filters: NDArray[Any], frequencies: Frequencies = ROUND) -> Residuals:
        """Filter whole images by `filters` (n x L x F), given at the `frequencies`."""
        measure, power = spectra.measure_and_power_at(frequencies)
        views, levels, _ = filters.shape
        weight = np.sqrt(measure * power) + 1e-6 * np.sqrt(power.max())  # the energy that a filter meets
        whole = (filters * weight[:, None]).transpose(1, 0, 2)
        # Combinations of images are real: the two parts of a complex filter go by one coefficient.
        rows = np.concatenate([part.reshape(levels, -1) for part in _parts(whole)], axis=1)
        left = _directions(rows, frequencies)
        basis = left.T @ rows
        left_over = np.cumsum((left**2 * (basis**2).sum(axis=1))[:, ::-1], axis=1)[:, ::-1].max(axis=0)
        rank = min(MOST, max(1, int(np.searchsorted(-left_over, -TOLERANCE))))
        # A product of images costs about a fiftieth of filtering one.
        if levels <= MOST and rank + rank**2 / 100 > levels:
            images = spectra.stack(filters.transpose(1, 0, 2), frequencies)
            coefficients = None
        else:
            coefficients = left[:, :rank]
            parts = _joined(basis[:rank].reshape(rank, -1, views, len(measure))) / weight
            images = spectra.stack(parts, frequencies)
            filters = _combined(coefficients, parts)  # what was kept of them
        return cls(
            images,
            coefficients,
            *_of_noise(filters, np.gradient(filters, axis=1), measure, frequencies),
            spectra.measure_and_power()[0],
        )

    def with_noise(self, passed: NDArray[Any], slopes: NDArray[Any], frequencies: Frequencies) -> Residuals:
        """The same where noise of more sources is let through: `passed` and, by level, `slopes` (sources x L x F)."""
        noise, noise_slope, gains = _of_noise(passed, slopes, self.measure_at(frequencies), frequencies)
        return replace(self, noise=noise, noise_slope=noise_slope, gains=gains)

    def measure_at(self, frequencies: Frequencies) -> FloatArray:
        """Share of all frequencies at each of `frequencies`."""
        return self.measure if frequencies.down is None else frequencies.areas / frequencies.areas.sum()

    def energy(self, weight: Image, step: int) -> Image:
        """Squared residuals at every level, summed over blocks of `step` pixels with `weight` (H x W): L x h x w."""
        return self._summed(self.images, weight, step)

    def energy_of_blocks(self, blocks: NDArray[np.bool_], weight: Image, step: int) -> Image:
        """As `energy`, for the n blocks that are true in `blocks` (h x w) only: L x n."""
        height, width = weight.shape
        rows, columns = (index[:, None] * step + np.arange(step) for index in np.nonzero(blocks))
        within = (rows < height)[:, :, None] & (columns < width)[:, None, :]  # the last blocks may be partial
        at = np.minimum(rows, height - 1)[:, :, None], np.minimum(columns, width - 1)[:, None, :]

        def in_a_row(image: Image) -> Image:
            return np.ascontiguousarray(np.moveaxis(image, -3, -2)).reshape(*image.shape[:-3], step, -1)

        return self._summed(in_a_row(self.images[:, *at]), in_a_row(weight[at] * within), step)[:, 0]

    def _summed(self, images: Image, weight: Image, step: int) -> Image:
        """Squared residuals made of `images` (r x H x W), summed over blocks."""
        if self.coefficients is None:
            return numerics.block_squares(images, weight, step).astype(np.float32)
        coefficients = self.coefficients.astype(np.float32)
        height, width = weight.shape
        band = step * max(1, BAND // (len(coefficients) * width * step))  # by bands of rows, for memory
        sums = []
        for y in range(0, height, band):
            part = images[:, y : y + band]
            residuals = (coefficients @ part.reshape(len(part), -1)).reshape(-1, *part.shape[1:])
            sums.append(numerics.block_squares(residuals, weight[y : y + band], step).astype(np.float32))
        return np.concatenate(sums, axis=1)

    def at(self, level: Image) -> tuple[Image, Image]:
        """The residual image where each pixel lies at its own (fractional) `level`, and its derivative by level."""
        if self.coefficients is None:
            return numerics.select_levels(self.images, level)
        return numerics.combine_levels(self.images, self.coefficients.astype(np.float32), level)


def _directions(rows: FloatArray, frequencies: Frequencies) -> FloatArray:
    """Orthonormal combinations of levels (L x L), those with most energy in `rows` first."""
    if frequencies.down is not None:  # long rows: by their products
        return np.asarray(np.linalg.eigh(rows @ rows.T)[1][:, ::-1])
    left, _, _ = np.linalg.svd(rows[:, ::4], full_matrices=False)  # every fourth frequency is enough
    return np.asarray(left)


def _combined(coefficients: FloatArray, parts: NDArray[Any]) -> NDArray[Any]:
    """Combinations (L x r) of filters (r x n x F): n x L x F."""
    if not np.iscomplexobj(parts):
        return np.asarray(np.einsum("lr,rnf->nlf", coefficients, parts))
    real, imaginary = (np.tensordot(coefficients, part, 1) for part in (parts.real, parts.imag))
    return np.asarray((real + 1j * imaginary).transpose(1, 0, 2))


def _parts(values: NDArray[Any]) -> list[FloatArray]:
    """Real and imaginary part, or real numbers alone."""
    return [values.real, values.imag] if np.iscomplexobj(values) else [values]


def _joined(parts: FloatArray) -> NDArray[Any]:
    """What `_parts` took apart, along the second axis."""
    return parts[:, 0] + 1j * parts[:, 1] if parts.shape[1] == 2 else parts[:, 0]


def _of_noise(
    passed: NDArray[Any], slopes: NDArray[Any], measure: FloatArray, frequencies: Frequencies
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Variance that noise leaves at each level, what it adds to the score's, and radial gains (see `Residuals`)."""
    gains = np.abs(passed) ** 2
    gain, slope = gains.sum(axis=0), (np.abs(slopes) ** 2).sum(axis=0)
    return gain @ measure, (gain * slope) @ measure, frequencies.to_radial(gains)
