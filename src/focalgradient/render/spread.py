"""Scattering of every pixel by its own blur, restricted to the positions from which it is visible.

A point is spread by its kernel, each part of which corresponds to a part of the lens; parts of the lens from which
nearer surfaces hide the point (`visibility`) are omitted. Contributions at a position are summed and divided by the sum
of their weights: every ray of the lens meets exactly one point, so the sum is 1 except where surfaces are unknown. A
pixel p of a slanted surface receives the fraction (1 + d . grad ln|Vf - V|) / (pi r^2) of the lens, d being the vector
from p: this is the ratio of the areas of picture and lens that its rays connect, and conserves energy where blur
varies.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from focalgradient.arrays import FloatImage
from focalgradient.loops import reordered
from focalgradient.parallel import share_rows
from focalgradient.render.hidden import NOTHING, ceiling
from focalgradient.render.kernels import LANES, Kernels
from focalgradient.render.visibility import CELL, LENS, SHARE, highest, sees_all

__all__ = ["Layer", "layer_of", "rim_of", "spread"]

BLOCK_PX = 64
"""Side in pixels of the blocks of points processed by one thread, chosen so that a block's sums fit into a cache."""

MAX_SLOPE = 3.0
"""Maximum slope of a surface (pixels of vergence per pixel); steeper slopes are clipped."""

SPLIT_PX = 1.0, 2.0
"""Blur radii in pixels: up to the first, all parts of the lens are weighted equally, since the disc is hardly larger
than a pixel; from the second, each part individually; in between, both are blended. Individual weighting from 0.5 px
would let light pass nearer surfaces (steps of 5 % where a picture is blurred by 0.7 px); without blending, pictures
would jump by 7 % as focus changes."""

MIN_WEIGHT = 1e-3
"""Sum of weights up to which a position is considered unknown and left sharp."""

LENS_MARGIN_CELLS = 1.0
"""Margin around the lens, in cells of its grid, within which nearer surfaces still cover part of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Points to spread: radiance (H x W x channels), vergence (px), coverage, kernel, and gradient of ln|Vf - V|."""

    light: FloatImage
    vergence: FloatImage
    cover: FloatImage
    kernel: NDArray[np.int16]
    gradient_y: FloatImage
    gradient_x: FloatImage


def layer_of(
    light: FloatImage, vergence: FloatImage, cover: FloatImage, focus: float, kernels: Kernels, by_radius: bool
) -> Layer:
    """Return a layer that assigns each point the kernel for its blur, by radius or by signed blur."""
    number = np.empty(vergence.shape, np.int16)
    down, right = np.zeros(vergence.shape, np.float32), np.zeros(vergence.shape, np.float32)
    between = (kernels.at[1:] + kernels.at[:-1]) / 2
    share_rows(len(vergence), partial(_place, vergence, np.float32(focus), between, by_radius, number, down, right))
    return Layer(light, vergence, cover, number, down, right)


@njit(nogil=True, cache=True, error_model="numpy")
def _place(vergence, focus, between, by_radius, number, down, right, first, last):  # type: ignore[no-untyped-def]
    """For rows `first` to `last`, find the nearest kernel of each blur, and the gradient (0 at discontinuities)."""
    height, width = vergence.shape
    for i in range(first, last):
        for j in range(width):
            here = vergence[i, j]
            blur = here - focus if here > NOTHING else np.float32(0)
            number[i, j] = np.searchsorted(between, abs(blur) if by_radius else blur)
            if 0 < i < height - 1 and 0 < j < width - 1:
                down[i, j] = _flatter(vergence[i + 1, j] - here, here - vergence[i - 1, j])
                right[i, j] = _flatter(vergence[i, j + 1] - here, here - vergence[i, j - 1])


@reordered
def _flatter(a, b):  # type: ignore[no-untyped-def]
    if a * b <= 0 or max(abs(a), abs(b)) > -np.float32(NOTHING) / 2:
        return np.float32(0)
    least = a if abs(a) < abs(b) else b
    return min(max(least, -np.float32(MAX_SLOPE)), np.float32(MAX_SLOPE))


def rim_of(kernels: Kernels) -> int:
    """Return the margin in pixels that `spread` needs: whole cells, since hidden surfaces are searched by cells.

    With cells aligned otherwise, another of several equally near surfaces might be found, and pictures would jump
    with focus.
    """
    return CELL * -(-(int(kernels.reach.max()) + 1) // CELL)


def spread(
    layers: list[Layer], focus: float, kernels: Kernels, pad: int, threads: int, progress: Callable[[float], object]
) -> FloatImage:
    """Spread `layers`, all of one size with a margin of `pad` pixels, into the picture within the margin.

    The first layer is the pinhole view, which hides parts of the lens from everything behind.
    """
    visible = layers[0]
    height, width = visible.vergence.shape
    channels = visible.light.shape[2]
    lens = kernels.lens
    steep = np.float32(lens) * visible.vergence
    over = binary_dilation(ceiling(steep) > steep, np.ones((3, 3), bool))
    sheets = tuple((layer.vergence, layer.cover, layer.gradient_y, layer.gradient_x) for layer in layers)
    cells = tuple(highest(layer.vergence) for layer in layers)
    tops = tuple(nearest.max() for nearest in cells)

    def fill(y: int, x: int) -> tuple[int, NDArray[np.float32]]:
        part = (slice(y, y + BLOCK_PX), slice(x, x + BLOCK_PX))
        rim = max(int(kernels.reach[layer.kernel[part]].max()) for layer in layers)
        tall, wide = (side + 2 * rim for side in visible.vergence[part].shape)
        sums = np.zeros((channels + 1, tall, wide + LANES), np.float32)
        for layer in layers:
            _scatter(
                *(layer.light, layer.vergence, layer.cover, layer.kernel, layer.gradient_y, layer.gradient_x),
                *(kernels.values, kernels.start, kernels.reach, kernels.extent),
                *(sheets, cells, tops, over, layer is visible, np.float32(focus), np.float32(lens)),
                *(y, x, tall - 2 * rim, wide - 2 * rim, rim, tall, wide + LANES, sums.reshape(-1)),
            )
        return rim, sums

    total = np.zeros((channels + 1, height, width), np.float32)
    places = list(product(range(0, height, BLOCK_PX), range(0, width, BLOCK_PX)))
    pool = ThreadPoolExecutor(threads)
    try:
        futures = deque(pool.submit(fill, *place) for place in places)
        for done, (y, x) in enumerate(places, 1):  # in order, so that sums do not depend on the number of threads
            rim, sums = futures.popleft().result()
            top, left = max(y - rim, 0), max(x - rim, 0)
            into = total[:, top : y - rim + sums.shape[1], left : x - rim + sums.shape[2] - LANES]
            into += sums[:, top - y + rim :, left - x + rim :][:, : into.shape[1], : into.shape[2]]
            progress(done / len(places))
    finally:
        pool.shutdown(cancel_futures=True)
    inside = np.moveaxis(total[:, pad : height - pad, pad : width - pad], 0, 2)
    weight = inside[..., :1]
    return np.divide(
        inside[..., 1:],
        weight,
        out=visible.light[pad : height - pad, pad : width - pad].copy(),
        where=weight > MIN_WEIGHT,
    )


@reordered
def _scatter(  # type: ignore[no-untyped-def]
    light, vergence, cover, kernel, gradient_y, gradient_x, values, starts, reaches, extent,
    sheets, cells, tops, over, visible, focus, lens, y0, x0, size_y, size_x, rim, tall, line, sums,
):  # fmt: skip
    """Add each point of a block, weighted by the visible parts of the lens, to `sums` (weight and channels x lines)."""
    channels = light.shape[2]
    plane = tall * line
    blocked = np.zeros(max((2 * rim + 1) ** 2, LENS * LENS) + LANES, np.float32)
    coarse = np.zeros(LENS * LENS + LANES, np.float32)
    row = np.empty(2 * rim + 1 + LANES, np.float32)
    for i in range(y0, y0 + size_y):
        for j in range(x0, x0 + size_x):
            here = vergence[i, j]
            if here <= NOTHING or cover[i, j] <= 0:
                continue
            n = kernel[i, j]
            reach = reaches[n]
            share, split = cover[i, j], np.float32(0)
            blur = here - focus
            alike = np.float32(1)  # fraction of the lens that sees the point, under equal weighting
            if not visible or over[i, j]:
                split = (abs(blur) - np.float32(SPLIT_PX[0])) / np.float32(SPLIT_PX[1] - SPLIT_PX[0])
                split = min(max(split, np.float32(0)), np.float32(1))
                whole = True
                for by_parts in range(2):
                    if (split if by_parts else 1 - split) <= 0:
                        continue
                    half = reach if by_parts else LENS // 2
                    scale = -blur if by_parts else np.float32(LENS / 2)
                    hides = blocked if by_parts else coarse
                    hides[: (2 * half + 1) ** 2] = 0
                    for sheet in range(2):
                        before, covers, slopes_y, slopes_x = sheets[sheet]
                        if not sees_all(
                            *(before, covers, slopes_y, slopes_x, cells[sheet], tops[sheet], i, j, here, visible),
                            *(gradient_y[i, j], gradient_x[i, j], lens + np.float32(LENS_MARGIN_CELLS) / abs(scale)),
                            *(scale, half, hides),
                        ):
                            whole = False
                    if not by_parts and not whole:
                        for x in range(LENS * LENS):
                            alike -= SHARE[x] * min(coarse[x], np.float32(1))
                if whole:
                    split = np.float32(0)
                if split <= 0:
                    share *= alike
                    if share <= 0:
                        continue
            # The gradient of the logarithm is 1 / blur times that of blur, regularised near focus, where it has no
            # effect.
            pull = blur / (blur * blur + np.float32(1))
            down, right = pull * gradient_y[i, j], pull * gradient_x[i, j]
            for y in range(-reach, reach + 1):
                wide = extent[n, y + reach]
                if wide < 0:
                    continue
                # Unsigned indices need no bounds test, so that the loops are vectorised.
                count = np.uint64((2 * wide + 1 + LANES - 1) // LANES * LANES)
                source = np.uint64(starts[n] + (y + reach) * (2 * reach + 1 + LANES) + reach - wide)
                target = np.uint64((i - y0 + rim + y) * line + j - x0 + rim - wide)
                base = share * (np.float32(1) + down * np.float32(y) - right * np.float32(wide))
                slope = share * right
                for x in range(count):
                    row[x] = values[source + x] * max(base + slope * np.float32(x), np.float32(0))
                if split > 0:
                    together = (np.float32(1) - split) * alike
                    hidden = np.uint64((y + reach) * (2 * reach + 1) + reach - wide)
                    for x in range(count):
                        row[x] *= together + split * max(np.float32(1) - blocked[hidden + x], np.float32(0))
                for x in range(count):
                    sums[target + x] += row[x]
                for c in range(channels):
                    target += np.uint64(plane)
                    value = light[i, j, c]
                    for x in range(count):
                        sums[target + x] += value * row[x]
