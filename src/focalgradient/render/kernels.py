"""Discretised point spread functions: discs, and the optics' own blur."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.parallel import cores
from focalgradient.psf import disc_transfer

__all__ = ["LANES", "Kernels", "disc_kernels", "kernels_of"]

LANES = 8
"""Number of zeros appended to each line, so that loops use whole vector registers."""

MIN_INTERPOLATED_RADIUS = 6.0
"""Disc radius in pixels from which linear interpolation reproduces the transfer to 0.005 up to 1/8 cycle per pixel."""

LENS_ENERGY, MAX_LENS_RADIUS = 0.98, 2.0
"""Fraction of a point spread function's energy within the lens's radius (a choice), and the maximum of that radius in
disc radii."""

MAX_FITTED_FREQUENCY, FREQUENCY_STEPS = 0.43, 14
"""Maximum frequency (cycles per pixel) up to which the transfer of smaller discs is fitted, and number of frequency
steps. In a photograph blurred by about a pixel, distance is estimated with a bias of -1.0 % for 0.36 and -0.5 % for
0.43; for 0.5 it varies more."""

UNIFORMITY_WEIGHT = 0.005
"""Weight of a disc's uniformity relative to its transfer in the fit. 0 would give a few bright pixels; with 0.005,
pixels within a disc of radius 4 px differ by 6 %, and the transfer is accurate to 0.0025 up to 1/8 cycle per pixel."""

RIM_SAMPLES = 24
"""Samples per pixel, in each direction, along a disc's rim: the second moment is then accurate to 0.001."""

FloatImage = NDArray[np.float32]


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


def kernels_of(at: NDArray[np.floating], pictures: Sequence[NDArray[np.float64]], lens: float) -> Kernels:
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


def lens_radius(picture: NDArray[np.float64], radius: float) -> float:
    """Return the radius (disc radii, 1 to `MAX_LENS_RADIUS`) that contains `LENS_ENERGY` of the energy of a PSF."""
    away = np.hypot(*(np.indices(picture.shape) - len(picture) // 2)).ravel()
    order = np.argsort(away, kind="stable")
    light = np.cumsum(np.abs(picture).ravel()[order])
    return min(max(float(np.interp(LENS_ENERGY * light[-1], light, away[order])) / radius, 1.0), MAX_LENS_RADIUS)


def disc_kernels(largest: float) -> Kernels:
    """Return kernels of uniform discs with radii from 0 to `largest` pixels, for a picture interpolated between pixels.

    Radii are 0.02 px apart, 1 % above 2 px; nearest neighbour: error at most half a step. No weight is negative.
    """
    count = 101 if largest <= 2 else 102 + math.ceil(math.log(largest / 2) / math.log(1.01))
    radii = np.concatenate([0.02 * np.arange(100), 2 * 1.01 ** np.arange(count - 100)])
    radii = radii[: 1 + int(np.searchsorted(radii, largest))]
    with ThreadPoolExecutor(cores()) as pool:
        return kernels_of(radii, list(pool.map(_disc, radii.tolist())), 1.0)


@cache
def _small(radius: float) -> NDArray[np.float64]:
    """Return a small disc: uniform, non-negative weights whose transfer fits the disc's by least squares.

    Exact interpolation at the fine detail that small discs leave would need negative weights, which produce dark
    rings around bright points.
    """
    from scipy.optimize import nnls  # deferred: slow to import

    reach = math.ceil(radius) + 1
    waves, frequency, octant, count = _waves(reach)
    even = _spread_out(radius, reach)[reach:, reach:]
    even = np.array([even[place] for place in octant])
    weight = 1 / np.maximum(frequency, frequency[1])  # amplitude spectrum of natural images
    weight[0] = 100 * weight.sum()  # unit gain at frequency 0
    weight[1:] /= np.linalg.norm(weight[1:])
    level = UNIFORMITY_WEIGHT * np.sqrt(count) / even.max()
    found, _ = nnls(
        np.concatenate([weight[:, None] * waves, np.diag(level)]),
        np.concatenate([weight * disc_transfer(frequency, radius), level * even]),
    )
    place = np.abs(np.arange(-reach, reach + 1))
    number = np.empty((reach + 1, reach + 1), int)
    for n, (i, j) in enumerate(octant):
        number[i, j] = number[j, i] = n
    return np.asarray(found[number[place[:, None], place]])


def _disc(radius: float) -> NDArray[np.float64]:
    """Return a disc as a square picture of odd size."""
    if radius < 0.01:
        return np.ones((1, 1))
    return _small(radius) if radius < MIN_INTERPOLATED_RADIUS else _spread_out(radius, math.ceil(radius))


@cache
def _waves(
    reach: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[tuple[int, int]], NDArray[np.float64]]:
    """Return the contribution of each pixel of one octant, in a picture with eightfold symmetry, to each frequency.

    The result holds sums of cosines, frequencies x pixels; the frequencies in cycles per pixel; the pixels' rows
    and columns from the centre; and the number of pixels that each represents.
    """
    across, down = np.meshgrid(*2 * [np.linspace(0, MAX_FITTED_FREQUENCY, FREQUENCY_STEPS + 1)])
    kept = (down <= across) & (np.hypot(down, across) <= MAX_FITTED_FREQUENCY)
    order = np.argsort(np.hypot(down, across)[kept])
    down, across = down[kept][order], across[kept][order]
    octant = [(i, j) for i in range(reach + 1) for j in range(i, reach + 1)]
    count = np.array([(1 + (i > 0)) * (1 + (j > 0)) * (1 + (i < j)) for i, j in octant], float)

    def wave(i: int, j: int) -> NDArray[np.float64]:
        return np.asarray(np.cos(2 * np.pi * down * i) * np.cos(2 * np.pi * across * j))

    waves = np.stack([n * (wave(i, j) + wave(j, i)) / 2 for n, (i, j) in zip(count, octant, strict=True)], axis=1)
    return waves, np.hypot(down, across), octant, count


def _spread_out(radius: float, reach: int) -> NDArray[np.float64]:
    """Return a disc by linear interpolation between pixels, reduced in size so that the second moment is exact."""
    picture = np.zeros((2 * reach + 1, 2 * reach + 1))
    # Linear interpolation adds a variance of 1/6 per axis; a disc has r^2 / 4.
    _fill_disc(math.sqrt(max(radius**2 - 2 / 3, 1 / 4)), picture)
    return picture / picture.sum()


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_disc(radius, picture):  # type: ignore[no-untyped-def]
    """Fill in a disc of radiance 1, weighted by the pyramid kernel of linear interpolation at each pixel."""
    reach = len(picture) // 2
    for i in range(reach + 1):
        for j in range(i, reach + 1):  # eightfold symmetry
            away, light = math.hypot(i, j), 0.0
            if away < radius - math.sqrt(2):
                light = 1.0
            elif away < radius + math.sqrt(2):
                for m in range(2 * RIM_SAMPLES):
                    y = (m + 0.5) / RIM_SAMPLES - 1
                    for n in range(2 * RIM_SAMPLES):
                        x = (n + 0.5) / RIM_SAMPLES - 1
                        if math.hypot(i + y, j + x) <= radius:
                            light += (1 - abs(y)) * (1 - abs(x)) / RIM_SAMPLES**2
            for y, x in ((i, j), (j, i)):
                picture[reach - y, reach - x] = picture[reach - y, reach + x] = light
                picture[reach + y, reach - x] = picture[reach + y, reach + x] = light
