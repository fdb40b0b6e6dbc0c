"""Residuals of whole images at every candidate depth, as combinations of a few filtered images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth import numerics
from focalgradient.depth.equalise.comparing import noise_passed
from focalgradient.depth.filters import ROUND, FloatArray, Frequencies, Image, Spectra

__all__ = ["BAND", "Residuals", "mixed_residuals"]

BAND = 4_000_000
"""Number of values computed at a time: 16 MB; limits memory."""

MAX_UNRESOLVED = 1e-6
"""Maximum energy, in units of the noise variance, that all combinations found from a fourth of the frequencies but the
last may leave over: 1e-11 to 5e-8 where they are enough, 7e-5 to 8e-3 where they are not.
"""

MAX_IMAGES = 128
"""Maximum number of filtered images in memory: 1 GB at 1920 x 1080 pixels."""

RANK_TOLERANCE = 1e-4
"""Maximum energy error of a low-rank family of filters, in units of the noise variance. With 3e-4, for a tenth less
time, depth of a slant moves by 0.006 standard deviations, but beside outlines more of it is in error by over 5
(`benchmarks/depth_at_outlines.py`, spheres: 0.9 to 1.1 % and 0.4 to 0.6 %), and one of two foci whose noises are as 1
to 7.5 seems to have a fifth of its own."""


@dataclass(frozen=True, slots=True)
class Residuals:
    """Residual of one comparison of views at every candidate level, as combinations of a few images.

    The residual at level l is ``sum_k coefficients[l, k] * images[k]``. `coefficients` is None where the images are
    the residuals themselves, one a level. ``noise[l]`` is the residual's variance from noise of variance 1.
    """

    images: Image  # r x H x W
    coefficients: FloatArray | None  # L x r
    noise: FloatArray  # L
    noise_slope: FloatArray  # L: what noise alone adds to the variance of the score, per level^2
    gains: FloatArray  # n x L x radial samples: the filters' power gains, which shape each view's noise
    measure: FloatArray  # share of all frequencies at each radial sample
    change: FloatArray  # L: what the noise's own change by level would add to the residual's variance
    noise_derivative: FloatArray  # L: variance of the residual's derivative by level from noise of variance 1
    bend: FloatArray  # L: mean square of how far the residual departs from the mean of its neighbours'

    @classmethod
    def of(
        cls,
        spectra: Spectra,
        filters: NDArray[Any],
        own: NDArray[Any] | None = None,
        frequencies: Frequencies = ROUND,
        tolerance: float = RANK_TOLERANCE,
        variance: FloatArray | None = None,
    ) -> Residuals:
        """Filter whole images by `filters` (n x L x F), given at the `frequencies`.

        `own` (m x n x L x F) is the amplitude of further sources of noise in the views, and `variance` that of each
        view's own noise (`noise_passed`); `tolerance` the energy by which the images may err.
        """
        measure, radial, power = spectra.measure_and_power_at(frequencies)
        views, levels, count = filters.shape
        weight = np.sqrt(measure * power) + 1e-6 * np.sqrt(power.max())  # the energy that a filter meets
        rows = np.empty((levels, views, count), filters.dtype)
        np.multiply(filters.transpose(1, 0, 2), weight, out=rows)
        # Combinations of images are real: the two parts of a complex filter go by one coefficient.
        rows = rows.view(rows.real.dtype).reshape(levels, -1)
        bend = np.pad(np.square(np.diff(rows, 2, axis=0)).sum(axis=1, dtype=float), 1, mode="edge")
        left, left_over = _directions(rows, frequencies, 2 if filters.dtype.kind == "c" else 1)
        rank = min(MAX_IMAGES, levels, max(1, int(np.searchsorted(-left_over, -tolerance))))
        # A product of images costs about a fiftieth of filtering one.
        if levels <= MAX_IMAGES and rank + rank**2 / 100 > levels:
            images = spectra.stack(filters.transpose(1, 0, 2), frequencies)
            coefficients = None
        else:
            coefficients = left[:, :rank]
            basis = np.matmul(coefficients.T.astype(rows.dtype), rows)
            parts = basis.view(filters.dtype).reshape(rank, views, count) / weight.astype(rows.dtype)
            images = spectra.stack(parts, frequencies)
            if own is None:  # of what was kept of them
                filters = _combined(coefficients, parts)
        sources = np.zeros((0, *filters.shape), filters.dtype) if own is None else own
        gains, noise, noise_slope, change, derivative = noise_passed(filters, sources, measure, variance)
        gains = frequencies.to_radial(gains)
        return cls(images, coefficients, noise, noise_slope, gains, radial, change, derivative, bend)

    def measure_at(self, frequencies: Frequencies) -> FloatArray:
        """Return the share of all frequencies at each of `frequencies`."""
        return self.measure if frequencies.down is None else frequencies.measure

    def energy(self, weight: Image, step: int, levels: NDArray[np.intp] | None = None) -> Image:
        """Return squared residuals, summed over blocks of `step` pixels with `weight`: L x h x w.

        Of all levels, or of the L that `levels` names.
        """
        return self._summed(self.images, weight, step, levels)

    def energy_of_blocks(
        self, blocks: NDArray[np.bool_], weight: Image, step: int, levels: NDArray[np.intp] | None = None
    ) -> Image:
        """Return `energy` only for the n blocks that are true in `blocks` (h x w): L x n."""
        rows, columns = np.nonzero(blocks)
        each = max(1, BAND // (len(self.images) * step**2))
        parts = [
            self._energy_at(rows[first : first + each], columns[first : first + each], weight, step, levels)
            for first in range(0, max(1, len(rows)), each)
        ]
        return np.concatenate(parts, axis=1)

    def _energy_at(
        self,
        row: NDArray[np.intp],
        column: NDArray[np.intp],
        weight: Image,
        step: int,
        levels: NDArray[np.intp] | None,
    ) -> Image:
        """Return `energy` for the n blocks at each `row` and `column` of the nodes: L x n."""
        height, width = weight.shape
        rows, columns = (index[:, None] * step + np.arange(step) for index in (row, column))
        within = (rows < height)[:, :, None] & (columns < width)[:, None, :]  # the last blocks may be partial
        at = np.minimum(rows, height - 1)[:, :, None], np.minimum(columns, width - 1)[:, None, :]

        def in_a_row(image: Image) -> Image:
            return np.ascontiguousarray(np.moveaxis(image, -3, -2)).reshape(*image.shape[:-3], step, -1)

        return self._summed(in_a_row(self.images[:, *at]), in_a_row(weight[at] * within), step, levels)[:, 0]

    def _summed(self, images: Image, weight: Image, step: int, levels: NDArray[np.intp] | None) -> Image:
        """Return the squared residuals made of `images` (r x H x W), summed over blocks."""
        if self.coefficients is None:
            return numerics.block_squares(images, weight, step, levels)
        coefficients = self.coefficients if levels is None else self.coefficients[levels]
        return numerics.block_squares_of_sums(images, coefficients.astype(np.float32), weight, step)

    def by_level(self) -> Image:
        """Return the residual image of every level: L x H x W."""
        if self.coefficients is None:
            return self.images
        flat = self.images.reshape(len(self.images), -1)
        return np.matmul(self.coefficients.astype(np.float32), flat).reshape(-1, *self.images.shape[1:])

    def at(self, level: Image) -> tuple[Image, Image]:
        """Return the residual with each pixel at its own (fractional) `level`, and its derivative by level."""
        if self.coefficients is None:
            return numerics.select_levels(self.images, level)
        return numerics.combine_levels(self.images, self.coefficients.astype(np.float32), level)


def mixed_residuals(parts: Sequence[Residuals], shares: NDArray[np.floating]) -> Residuals:
    """Return the residuals of blur that is at each pixel a mixture of those of the `parts`, by `shares` (C x H x W)."""
    weights = shares.astype(np.float32)
    mean = weights.mean(axis=(1, 2)).astype(float)
    known = [part.coefficients for part in parts if part.coefficients is not None]
    if len(known) == len(parts) and sum(part.images.shape[0] for part in parts) <= MAX_IMAGES:
        images = np.concatenate([weight * part.images for weight, part in zip(weights, parts, strict=True)])
        coefficients: FloatArray | None = np.concatenate(known, axis=1)
    else:  # an image a level
        images = sum(weight * part.by_level() for weight, part in zip(weights, parts, strict=True))
        coefficients = None
    averaged = {
        name: sum(share * getattr(part, name) for share, part in zip(mean, parts, strict=True))
        for name in ("noise", "noise_slope", "gains", "change", "noise_derivative")
    }
    return replace(parts[0], images=images, coefficients=coefficients, **averaged)


def _directions(rows: NDArray[Any], frequencies: Frequencies, parts: int) -> tuple[FloatArray, FloatArray]:
    """Return orthonormal combinations of levels (L x L) in order of falling energy in `rows`, and the energy left over.

    `rows` hold `parts` numbers for each frequency: 2 where they are the real and the imaginary part. The energy left
    over (L) is the largest of a level without the combinations from each one on.
    """

    def of(some: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
        energy, left = np.linalg.eigh(np.matmul(some, some.T))
        left = left[:, ::-1]
        radial = frequencies.down is None
        energy = (np.matmul(left.T, rows) ** 2).sum(axis=1) if radial else 4 * energy[::-1].clip(0)
        return left, np.cumsum((left**2 * energy)[:, ::-1], axis=1)[:, ::-1].max(axis=0)

    # Every fourth frequency is enough, with both its parts: blur of the two sides of focus may differ in one only.
    found = of(rows.reshape(len(rows), -1, parts)[:, ::4].reshape(len(rows), -1).astype(float))
    if frequencies.down is None and found[1][-1] > MAX_UNRESOLVED:
        # A small image has no frequency at some of the radial samples: combinations beyond the rank of a fourth of them
        # are arbitrary, and differ between processors.
        return of(rows.astype(float))
    return found


def _combined(coefficients: FloatArray, parts: NDArray[Any]) -> NDArray[Any]:
    """Return combinations (L x r) of filters (r x n x F): n x L x F."""
    rows = np.ascontiguousarray(parts).view(parts.real.dtype).reshape(len(parts), -1)
    combined = np.matmul(coefficients.astype(rows.dtype), rows)
    return np.ascontiguousarray(combined.view(parts.dtype).reshape(-1, *parts.shape[1:]).transpose(1, 0, 2))
