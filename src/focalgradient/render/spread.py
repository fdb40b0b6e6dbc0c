"""Spreading every pixel by its own blur, and sorting by depth what arrives at a place.

Surfaces are separated by gaps in depth. What arrives from one surface adds up, and the sum of its weights is the
share of the lens that it covers; what it leaves open shows the surface behind. A slanted surface's pixel p takes the
share (1 + d . grad ln|Vf - V|) / (pi r^2) of the lens, d being the way from p: the areas of the picture and of the
lens that its rays join differ so, and light is kept where blur changes from place to place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import product

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.parallel import cores
from focalgradient.render.hidden import NOTHING

__all__ = ["Kernels", "Layer", "disc_kernels", "kernels_of", "layer_of", "spread"]

TILE = 64
"""Side of a tile in pixels: the surfaces of a tile then fit into a processor's cache."""

LANES = 8
"""Numbers by which lines are lengthened, so that loops run in whole vector registers."""

LARGE = 6.0
"""Pixels of a disc's radius from which linear interpolation has its transfer to 0.005 up to 1/8 cycle a pixel."""

SURFACES = 24
"""Depths distinguished in a tile, at most. They lie one pixel of vergence apart or more (see `hidden`)."""

NONE = 1e-4
"""Share of the lens below which a depth counts as a gap."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)

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
    """

    at: NDArray[np.floating]
    values: FloatImage
    start: NDArray[np.int64]
    reach: NDArray[np.int64]
    extent: NDArray[np.int64]

    def number(self, blur: NDArray[np.floating]) -> NDArray[np.int16]:
        """Give the number of the kernel nearest to each `blur`."""
        return np.searchsorted((self.at[1:] + self.at[:-1]) / 2, blur).astype(np.int16)


def kernels_of(at: NDArray[np.floating], pictures: list[NDArray[np.float64]]) -> Kernels:
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
    return Kernels(at, values, np.concatenate([[0], ends[:-1]]), reach, extent)


def disc_kernels(largest: float) -> Kernels:
    """Kernels of uniform discs of radius 0 to `largest`, in pixels, of a picture interpolated between its pixels.

    Radii lie 0.02 px apart, from 2 px on 1 %: the nearest is wrong by half of that at most.
    """
    radii = np.arange(0, min(largest, 2) + 0.02, 0.02)
    if largest > 2:
        radii = np.concatenate([radii[radii < 2], np.geomspace(2, largest, 2 + int(100 * math.log(largest / 2)))])
    reaches = np.where(radii < 0.01, 0, np.ceil(radii + np.where(radii < LARGE, 2, 0))).astype(int)
    pictures = [np.zeros((2 * reach + 1, 2 * reach + 1)) for reach in reaches]
    with ThreadPoolExecutor(cores()) as pool:
        list(pool.map(_add_disc, radii.tolist(), pictures))
    return kernels_of(radii, pictures)


@_compiled
def _add_disc(radius, picture):  # type: ignore[no-untyped-def]
    """Add the disc, as points on rings of equal area, each shared among the pixels around by interpolation.

    Small discs leave fine detail, which wants a level interpolation. Large ones take it away: linear interpolation of a
    disc made smaller, so that the second moment stays right, is then as good, and no weight is negative.
    """
    reach = len(picture) // 2
    if reach == 0:
        picture[0, 0] = 1.0
        return
    large = radius >= LARGE
    if large:
        radius = math.sqrt(
            radius**2 - 2 / 3
        )  # linear interpolation spreads by 1/6 in each direction, a disc by r^2 / 4
    rings = math.ceil(3 * radius) + 4
    before, count = (0, 2) if large else (2, 6)  # pixels that an interpolation reaches
    for ring in range(rings):
        length = radius * math.sqrt((ring + 0.5) / rings)
        spokes = math.ceil(16 * length) + 8
        for spoke in range(spokes):
            angle = 2 * math.pi * (spoke + 0.5 * (ring % 2)) / spokes
            y, x = length * math.sin(angle), length * math.cos(angle)
            top, left = math.floor(y) - before, math.floor(x) - before
            for i in range(max(top, -reach), min(top + count, reach + 1)):
                down = _interpolation(y - i, large) / spokes
                for j in range(max(left, -reach), min(left + count, reach + 1)):
                    picture[i + reach, j + reach] += down * _interpolation(x - j, large)


@_compiled
def _interpolation(t, linear):  # type: ignore[no-untyped-def]
    """Linear, or Lanczos's windowed sinc over 6 pixels: level to 1 % up to 0.3 cycles a pixel."""
    if linear:
        return max(0.0, 1 - abs(t))
    if abs(t) < 1e-9:
        return 1.0
    if abs(t) >= 3:
        return 0.0
    x = math.pi * t
    return 3 * math.sin(x) * math.sin(x / 3) / (x * x)


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Points to spread: light (H x W x channels), vergence in pixels, kernel, and the gradient of ln|Vf - V|."""

    light: FloatImage
    vergence: FloatImage
    kernel: NDArray[np.int16]
    gradient_y: FloatImage
    gradient_x: FloatImage


def layer_of(light: FloatImage, vergence: FloatImage, focus: float, kernels: Kernels, by_radius: bool) -> Layer:
    """Give the points of a picture the kernel of their blur: by its radius, or by their vergence itself."""
    blur = vergence - np.float32(focus)
    inside = np.where(vergence > NOTHING, blur, np.float32(0))
    down, right = _gradient(vergence)
    # As blur / blur^2, but level in focus, where it has no say.
    pull = inside / (inside**2 + 1)
    number = kernels.number(np.abs(inside) if by_radius else inside)
    return Layer(light, vergence, number, down * pull, right * pull)


@_compiled
def _gradient(vergence):  # type: ignore[no-untyped-def]
    """Slope down and to the right, in pixels of vergence a pixel; the flatter of both sides, none across outlines."""
    height, width = vergence.shape
    down, right = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
    for i in range(1, height - 1):
        for j in range(1, width - 1):
            down[i, j] = _flatter(vergence[i + 1, j] - vergence[i, j], vergence[i, j] - vergence[i - 1, j])
            right[i, j] = _flatter(vergence[i, j + 1] - vergence[i, j], vergence[i, j] - vergence[i, j - 1])
    return down, right


@_compiled
def _flatter(a, b):  # type: ignore[no-untyped-def]
    if a * b <= 0 or min(abs(a), abs(b)) > 1:  # from a slope of 1 on a surface hides parts of itself
        return np.float32(0)
    return a if abs(a) < abs(b) else b


def spread(
    layers: list[Layer], kernels: Kernels, pad: int, threads: int, progress: Callable[[float], object]
) -> FloatImage:
    """Spread `layers`, all of one size with a rim of `pad` pixels, into the picture within the rim."""
    height, width = (side - 2 * pad for side in layers[0].vergence.shape)
    channels = layers[0].light.shape[2]
    result = np.empty((height, width, channels), np.float32)

    def fill(y: int, x: int) -> None:
        part = (slice(y, y + TILE + 2 * pad), slice(x, x + TILE + 2 * pad))
        seen = [layer.vergence[part] for layer in layers]
        near = max(float(vergence.max()) for vergence in seen)
        far = min(float(vergence[vergence > NOTHING].min(initial=near)) for vergence in seen)
        step = max(1.0, (near - far) / (SURFACES - 1))
        surfaces = int((near - far) / step) + 1
        tile = result[y : y + TILE, x : x + TILE]
        sums = np.zeros((surfaces, channels + 1, TILE, TILE + LANES), np.float32)
        row = np.zeros(TILE + LANES, np.float32)
        for layer in layers:
            _gather(
                *(layer.light, layer.vergence, layer.kernel, layer.gradient_y, layer.gradient_x),
                *(kernels.values, kernels.start, kernels.reach, kernels.extent),
                *(y + pad, x + pad, *tile.shape[:2], pad, far, step, surfaces, _ramp, row, sums.reshape(-1)),
            )
        _show(sums, tile)

    places = list(product(range(0, height, TILE), range(0, width, TILE)))
    pool = ThreadPoolExecutor(threads)
    try:
        for done, future in enumerate(as_completed([pool.submit(fill, *place) for place in places]), 1):
            future.result()
            progress(done / len(places))
    finally:
        pool.shutdown(cancel_futures=True)
    return result


_ramp = np.arange(TILE + LANES, dtype=np.float32)


@_compiled
def _gather(  # type: ignore[no-untyped-def]
    light, vergence, kernel, gradient_y, gradient_x, values, starts, reaches, extent,
    y0, x0, size_y, size_x, pad, far, step, surfaces, ramp, row, sums,
):  # fmt: skip
    """Add to the tile's `sums` (surfaces x weight and channels x lines) every point of a layer that reaches it."""
    height, width, channels = light.shape
    line = TILE + LANES
    plane = TILE * line
    for i in range(max(y0 - pad, 0), min(y0 + size_y + pad, height)):
        for j in range(max(x0 - pad, 0), min(x0 + size_x + pad, width)):
            if vergence[i, j] <= NOTHING:
                continue
            n = kernel[i, j]
            reach = reaches[n]
            top, bottom = max(i - reach, y0), min(i + reach + 1, y0 + size_y)
            if top >= bottom or j - reach >= x0 + size_x or j + reach < x0:
                continue
            surface = min(int((vergence[i, j] - far) / step), surfaces - 1)
            down, right = gradient_y[i, j], gradient_x[i, j]
            for y in range(top, bottom):
                wide = extent[n, y - i + reach]
                first, last = max(j - wide, x0), min(j + wide + 1, x0 + size_x)
                if first >= last:
                    continue
                # Unsigned: an index that cannot be negative needs no test, and the loops become vector instructions.
                count = np.uint64((last - first + LANES - 1) // LANES * LANES)
                source = np.uint64(starts[n] + (y - i + reach) * (2 * reach + 1 + LANES) + first - j + reach)
                target = np.uint64(surface * (channels + 1) * plane + (y - y0) * line + first - x0)
                base = np.float32(1) + down * np.float32(y - i) + right * np.float32(first - j)
                for x in range(count):
                    row[x] = values[source + x] * max(base + right * ramp[x], np.float32(0))
                for x in range(count):
                    sums[target + x] += row[x]
                for c in range(channels):
                    target += np.uint64(plane)
                    value = light[i, j, c]
                    for x in range(count):
                        sums[target + x] += value * row[x]


@_compiled
def _show(sums, tile):  # type: ignore[no-untyped-def]
    """From near to far, what each surface shows of itself through what those before it leave open."""
    height, width, channels = tile.shape
    surface, shown = np.zeros(channels), np.zeros(channels)
    for y in range(height):
        for x in range(width):
            left, weight = 1.0, 0.0
            surface[:], shown[:] = 0, 0
            for n in range(len(sums) - 1, -2, -1):
                if n >= 0 and abs(sums[n, 0, y, x]) > NONE:
                    weight += sums[n, 0, y, x]
                    for c in range(channels):
                        surface[c] += sums[n, c + 1, y, x]
                elif weight > 10 * NONE:  # behind this surface there is a gap
                    for c in range(channels):
                        shown[c] += left * surface[c] / max(weight, 1.0)
                        surface[c] = 0
                    left *= 1 - min(weight, 1.0)
                    weight = 0.0
                    if left < NONE:
                        break
            for c in range(channels):
                tile[y, x, c] = shown[c] / (1 - left)
