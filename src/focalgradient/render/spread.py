"""Spreading every pixel by its own blur, and sorting by depth what arrives at a place.

Surfaces are separated by gaps in depth. What arrives from one surface adds up, and the sum of its weights is the
share of the lens that it covers; what it leaves open shows the surface behind. A slanted surface's pixel p takes the
share (1 + d . grad ln|Vf - V|) / (pi r^2) of the lens, d being the way from p: the areas of the picture and of the
lens that its rays join differ so, and light is kept where blur changes from place to place.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.parallel import share_rows
from focalgradient.render.hidden import NOTHING
from focalgradient.render.kernels import LANES, Kernels

__all__ = ["Layer", "layer_of", "spread"]

TILE = 64
"""Side of a tile in pixels: the surfaces of a tile then fit into a processor's cache."""

SURFACES = 24
"""Depths distinguished in a tile, at most. They lie one pixel of vergence apart or more (see `hidden`)."""

NONE = 1e-4
"""Share of the lens below which a depth counts as a gap."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)

FloatImage = NDArray[np.float32]


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
    number = np.empty(vergence.shape, np.int16)
    down, right = np.zeros(vergence.shape, np.float32), np.zeros(vergence.shape, np.float32)
    between = (kernels.at[1:] + kernels.at[:-1]) / 2
    share_rows(len(vergence), partial(_place, vergence, np.float32(focus), between, by_radius, number, down, right))
    return Layer(light, vergence, number, down, right)


@njit(nogil=True, cache=True, error_model="numpy")
def _place(vergence, focus, between, by_radius, number, down, right, first, last):  # type: ignore[no-untyped-def]
    """In rows `first` to `last`: the kernel nearest to each pixel's blur, and the gradient; none across outlines."""
    height, width = vergence.shape
    for i in range(first, last):
        for j in range(width):
            here = vergence[i, j]
            blur = here - focus if here > NOTHING else np.float32(0)
            number[i, j] = np.searchsorted(between, abs(blur) if by_radius else blur)
            if 0 < i < height - 1 and 0 < j < width - 1:
                # As blur / blur^2, but level in focus, where it has no say.
                pull = blur / (blur * blur + np.float32(1))
                down[i, j] = pull * _flatter(vergence[i + 1, j] - here, here - vergence[i - 1, j])
                right[i, j] = pull * _flatter(vergence[i, j + 1] - here, here - vergence[i, j - 1])


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
