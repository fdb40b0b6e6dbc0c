"""Point spread functions sampled at the pixels: discs, and those that optics have of their own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import nnls

from focalgradient.parallel import cores
from focalgradient.psf import disc_transfer

__all__ = ["LANES", "Kernels", "disc_kernels", "kernels_of"]

LANES = 8
"""Numbers by which lines are lengthened, so that loops run in whole vector registers."""

LARGE = 6.0
"""Pixels of a disc's radius from which linear interpolation has its transfer to 0.005 up to 1/8 cycle a pixel."""

WITHIN, WIDEST = 0.98, 2.0
"""Share of a point spread function's light within the lens's radius, and the largest radius: a choice."""

FITTED_TO, STEPS = 0.43, 14
"""Cycles a pixel to which the transfer of smaller discs is fitted, and steps to there. Of a photograph blurred by about
a pixel, distance is recovered with a bias of -1.0 % at 0.36 and of -0.5 % at 0.43; at 0.5 it scatters more."""

EVEN = 0.005
"""Weight of a disc's evenness beside its transfer: 0 makes it a few bright pixels. At 0.005 those within a disc of 4
pixels differ by 6 %, and its transfer is right to 0.0025 up to 1/8 cycle a pixel."""

FINER = 24
"""Points to a pixel, in each direction, at which a disc's rim is sampled: its second moment is then right to 0.001."""

FloatImage = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Kernels:
    """Point spread functions for a row of blurs, sampled at the pixels, each of sum 1.

    Parameters
    ----------
    at
        The blur that each is for, rising.
    values
        All of them in one line: of each its rows, each row followed by `LANES` zeros.
    start, reach
        Where each begins in `values`; its pixels to each side of the middle.
    extent
        Pixels to each side that each row of each kernel fills, kernels x rows; -1 for an empty row.
    lens
        Radius to which the lens passes light, over that of its disc of blur: 1.4 for a Gaussian. One for all focus
        distances, as pictures must not jump with focus.
    """

    at: NDArray[np.floating]
    values: FloatImage
    start: NDArray[np.int64]
    reach: NDArray[np.int64]
    extent: NDArray[np.int64]
    lens: float


def kernels_of(at: NDArray[np.floating], pictures: Sequence[NDArray[np.float64]], lens: float) -> Kernels:
    """Put square, odd `pictures` of point spread functions, one for each blur in `at`, into `Kernels`."""
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
    """Radius of `WITHIN` of the light of a point spread function, over that of its disc: 1 to `WIDEST`."""
    away = np.hypot(*(np.indices(picture.shape) - len(picture) // 2)).ravel()
    order = np.argsort(away, kind="stable")
    light = np.cumsum(np.abs(picture).ravel()[order])
    return min(max(float(np.interp(WITHIN * light[-1], light, away[order])) / radius, 1.0), WIDEST)


def disc_kernels(largest: float) -> Kernels:
    """Kernels of uniform discs of radius 0 to `largest`, in pixels, of a picture interpolated between its pixels.

    Radii lie 0.02 px apart, from 2 px on 1 %: the nearest is wrong by half of that at most. No weight is negative.
    """
    count = 101 if largest <= 2 else 102 + math.ceil(math.log(largest / 2) / math.log(1.01))
    radii = np.concatenate([0.02 * np.arange(100), 2 * 1.01 ** np.arange(count - 100)])
    radii = radii[: 1 + int(np.searchsorted(radii, largest))]
    with ThreadPoolExecutor(cores()) as pool:
        return kernels_of(radii, list(pool.map(_disc, radii.tolist())), 1.0)


@cache
def _small(radius: float) -> NDArray[np.float64]:
    """A disc below `LARGE`: the even, positive weights that have its transfer, by least squares.

    Interpolation as level as the fine detail wants that small discs leave has negative weights, which put dark rings
    around bright points.
    """
    reach = math.ceil(radius) + 1
    waves, frequency, octant, count = _waves(reach)
    even = _spread_out(radius, reach)[reach:, reach:]
    even = np.array([even[place] for place in octant])
    weight = 1 / np.maximum(frequency, frequency[1])  # the amplitude of natural pictures
    weight[0] = 100 * weight.sum()  # the light is kept
    weight[1:] /= np.linalg.norm(weight[1:])
    level = EVEN * np.sqrt(count) / even.max()
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
    """A disc as a square, odd picture."""
    if radius < 0.01:
        return np.ones((1, 1))
    return _small(radius) if radius < LARGE else _spread_out(radius, math.ceil(radius))


@cache
def _waves(
    reach: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[tuple[int, int]], NDArray[np.float64]]:
    """What each octant of a picture that is alike in all eight has of each frequency.

    Sums of cosines, frequencies x places; the frequencies in cycles a pixel; the places' rows and columns from the
    middle; and the number of pixels that each stands for.
    """
    across, down = np.meshgrid(*2 * [np.linspace(0, FITTED_TO, STEPS + 1)])
    kept = (down <= across) & (np.hypot(down, across) <= FITTED_TO)
    order = np.argsort(np.hypot(down, across)[kept])
    down, across = down[kept][order], across[kept][order]
    octant = [(i, j) for i in range(reach + 1) for j in range(i, reach + 1)]
    count = np.array([(1 + (i > 0)) * (1 + (j > 0)) * (1 + (i < j)) for i, j in octant], float)

    def wave(i: int, j: int) -> NDArray[np.float64]:
        return np.asarray(np.cos(2 * np.pi * down * i) * np.cos(2 * np.pi * across * j))

    waves = np.stack([n * (wave(i, j) + wave(j, i)) / 2 for n, (i, j) in zip(count, octant, strict=True)], axis=1)
    return waves, np.hypot(down, across), octant, count


def _spread_out(radius: float, reach: int) -> NDArray[np.float64]:
    """A disc by linear interpolation between pixels; made smaller, so that the second moment stays right."""
    picture = np.zeros((2 * reach + 1, 2 * reach + 1))
    # Linear interpolation spreads by 1/6 in each direction, a disc by r^2 / 4.
    _fill_disc(math.sqrt(max(radius**2 - 2 / 3, 1 / 4)), picture)
    return picture / picture.sum()


@njit(nogil=True, cache=True, error_model="numpy")
def _fill_disc(radius, picture):  # type: ignore[no-untyped-def]
    """Fill in a disc of light 1, seen through the pyramid that is each pixel's part in linear interpolation."""
    reach = len(picture) // 2
    for i in range(reach + 1):
        for j in range(i, reach + 1):  # alike in all eight octants
            away, light = math.hypot(i, j), 0.0
            if away < radius - math.sqrt(2):
                light = 1.0
            elif away < radius + math.sqrt(2):
                for m in range(2 * FINER):
                    y = (m + 0.5) / FINER - 1
                    for n in range(2 * FINER):
                        x = (n + 0.5) / FINER - 1
                        if math.hypot(i + y, j + x) <= radius:
                            light += (1 - abs(y)) * (1 - abs(x)) / FINER**2
            for y, x in ((i, j), (j, i)):
                picture[reach - y, reach - x] = picture[reach - y, reach + x] = light
                picture[reach + y, reach - x] = picture[reach + y, reach + x] = light
