"""Discretised point spread functions, and the blurs for which they are tabulated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray, FloatImage

__all__ = ["LANES", "Kernels", "few_blurs", "kernels_of", "lens_radius"]

LANES = 8
"""Number of zeros appended to each line, so that loops use whole vector registers."""

LENS_ENERGY, MAX_LENS_RADIUS = 0.98, 2.0
"""Fraction of a point spread function's energy within the lens's radius (a choice), and the maximum of that radius in
disc radii."""

FINE_STEP_PX, MAX_FINE_COUNT = 1 / 32, 64
"""Spacing in pixels, and maximum number, of blurs where only a few distinct ones occur, as for frontal planes; nearest
neighbour: error at most half a step."""


@dataclass(frozen=True, slots=True, eq=False)
class Kernels:
    """Point spread functions for a sequence of blurs, sampled at the pixels and normalised to sum 1.

    Parameters
    ----------
    at
        Blur of each kernel in pixels, increasing.
    values
        All kernels concatenated: for each, its rows, each followed by `LANES` zeros.
    start, reach
        Start of each kernel in `values`; its half-width in pixels.
    extent
        Half-width in pixels of the non-zero part of each row, kernels x rows; -1 for an empty row.
    lens
        Radius within which the lens passes light, divided by the blur-disc radius: 1.4 for a Gaussian. One value for
        all focus distances, because pictures must vary continuously with focus.
    """

    at: NDArray[np.floating]
    values: FloatImage
    start: NDArray[np.int64]
    reach: NDArray[np.int64]
    extent: NDArray[np.int64]
    lens: float


def few_blurs(blurs: NDArray[np.floating]) -> FloatArray | None:
    """Return the distinct blurs (px), rounded to `FINE_STEP_PX`; None if there are more than `MAX_FINE_COUNT`."""
    steps: FloatArray = FINE_STEP_PX * np.unique(np.rint(blurs / FINE_STEP_PX))
    return steps if len(steps) <= MAX_FINE_COUNT else None


def kernels_of(at: NDArray[np.floating], pictures: Sequence[FloatArray], lens: float) -> Kernels:
    """Pack square, odd-sized point spread functions, one for each blur in `at`, into `Kernels`."""
    reach = np.array([len(picture) // 2 for picture in pictures])
    side = 2 * reach + 1
    ends = np.cumsum(side * (side + LANES))
    values = np.zeros(ends[-1] + LANES, np.float32)
    extent = np.full((len(at), side.max()), -1)
    for n, picture in enumerate(pictures):
        rows = values[ends[n] - side[n] * (side[n] + LANES) : ends[n]].reshape(side[n], side[n] + LANES)
        rows[:, : side[n]] = picture / picture.sum()
        extent[n, : side[n]] = np.where(picture != 0, np.abs(np.arange(side[n]) - reach[n]), -1).max(axis=1)
    return Kernels(at, values, np.concatenate([[0], ends[:-1]]), reach, extent, lens)


def lens_radius(picture: FloatArray, radius: float) -> float:
    """Return the radius (disc radii, 1 to `MAX_LENS_RADIUS`) that contains `LENS_ENERGY` of the energy of a PSF."""
    away = np.hypot(*(np.indices(picture.shape) - len(picture) // 2)).ravel()
    order = np.argsort(away, kind="stable")
    light = np.cumsum(np.abs(picture).ravel()[order])
    return min(max(float(np.interp(LENS_ENERGY * light[-1], light, away[order])) / radius, 1.0), MAX_LENS_RADIUS)
