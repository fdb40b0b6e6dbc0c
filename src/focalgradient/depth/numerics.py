"""Numerical work that methods share: block sums, windows, interpolation; compiled loops share rows among threads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeVar

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.parallel import linear_algebra_on_one_thread, share_rows

Value = TypeVar("Value", bound=np.generic)

CACHED_PIXELS = 8192
"""Approximate number of pixels whose residuals at all levels are worked out at a time: 64 images of 32 kB, which a
processor's cache holds. With half of it depth from three foci takes 7 % longer, with 50 times of it 4 %; depth from two
views takes the same time."""

NODES = 1.6
"""Number of grid points of depth per standard deviation of the window: 5 pixels apart for 8. Chosen by hand."""


NEIGHBOURS: tuple[tuple[Any, Any], ...] = ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:]))
"""Slices of an image's pixels and of those below, and of its pixels and of those to the right."""


def step_of(window: float) -> int:
    """Return the spacing of nodes in pixels, for a window of `window` pixels."""
    return max(1, round(window / NODES))


def block_products(images: NDArray[np.float32], weight: NDArray[np.float32], step: int) -> FloatArray:
    """Return the weighted sums, over blocks of step x step pixels, of the products of each pair of images.

    `images` is r x H x W, `weight` H x W; returns r(r+1)/2 x ceil(H/step) x ceil(W/step), pairs (k, l <= k) in order.
    """
    count, height, width = images.shape
    rows, columns = -(-height // step), -(-width // step)
    sums = np.zeros((count * (count + 1) // 2, rows, columns))
    share_rows(rows, lambda first, last: _block_products(images, weight, step, first, last, sums))
    return sums


@njit(nogil=True, cache=True, fastmath=True)
def _block_products(images, weight, step, first, last, sums):  # type: ignore[no-untyped-def]
    count, height, width = images.shape
    weighted, total = np.empty((step, width), np.float32), np.empty(width, np.float32)
    for row in range(first, last):
        top, bottom = row * step, min(height, (row + 1) * step)
        pair = 0
        for k in range(count):
            for y in range(top, bottom):
                for x in range(width):
                    weighted[y - top, x] = weight[y, x] * images[k, y, x]
            for other in range(k + 1):
                total[:] = 0
                for y in range(top, bottom):
                    for x in range(width):
                        total[x] += weighted[y - top, x] * images[other, y, x]
                for column in range(sums.shape[2]):
                    for x in range(column * step, min(width, (column + 1) * step)):
                        sums[pair, row, column] += total[x]
                pair += 1


def block_squares(
    images: NDArray[np.float32], weight: NDArray[np.float32], step: int, levels: NDArray[np.intp] | None = None
) -> NDArray[np.float32]:
    """Weighted sums of squares over blocks of step x step pixels: L x H x W to L x ceil(H/step) x ceil(W/step).

    Where `levels` (M) are given, of these images alone: M x ceil(H/step) x ceil(W/step).
    """
    levels = np.arange(len(images)) if levels is None else levels
    sums = np.empty((len(levels), *(-(-n // step) for n in weight.shape)), np.float32)
    share_rows(sums.shape[1], lambda first, last: _block_squares(images, levels, weight, step, first, last, sums))
    return sums


def block_squares_of_sums(
    images: NDArray[np.float32], coefficients: NDArray[np.float32], weight: NDArray[np.float32], step: int
) -> NDArray[np.float32]:
    """Return `block_squares` of the sums of `images` (r x H x W) with `coefficients` (L x r): L x h x w.

    One part after the other, small enough to stay in a processor's cache.
    """
    rows, columns = (-(-n // step) for n in weight.shape)
    sums = np.empty((len(coefficients), rows, columns), np.float32)
    each = max(1, CACHED_PIXELS // step**2)
    parts = -(-columns // each)
    every = np.arange(len(coefficients))

    def some(first: int, last: int) -> None:
        for number in range(first, last):
            row, column = number // parts, number % parts * each
            here = slice(row * step, (row + 1) * step), slice(column * step, (column + each) * step)
            part = images[:, *here]
            summed = np.matmul(coefficients, part.reshape(len(part), -1)).reshape(-1, *part.shape[1:])
            _block_squares(summed, every, weight[here], step, 0, 1, sums[:, row : row + 1, column : column + each])

    with linear_algebra_on_one_thread:
        share_rows(rows * parts, some)
    return sums


@njit(nogil=True, cache=True, fastmath=True)
def _block_squares(images, levels, weight, step, first, last, sums):  # type: ignore[no-untyped-def]
    height, width = weight.shape
    total = np.empty(width, np.float32)
    for row in range(first, last):
        for number in range(len(levels)):
            total[:] = 0
            for y in range(row * step, min(height, (row + 1) * step)):
                kept, image = weight[y], images[levels[number], y]
                for x in range(width):
                    total[x] += kept[x] * image[x] ** 2
            for column in range(sums.shape[2]):
                part = np.float32(0)
                for x in range(column * step, min(width, (column + 1) * step)):
                    part += total[x]
                sums[number, row, column] = part


def half_sums(
    value: NDArray[np.float32],
    slope: NDArray[np.float32],
    coarse: NDArray[np.complex64],
    weight: NDArray[np.float32],
    step: int,
) -> FloatArray:
    """Return the weighted sums over blocks of -r r' and r'^2 of an image's coarse part, and of the rest: 4 x h x w.

    `value` is r and `slope` r', H x W; `coarse` holds their coarse parts as r + i r'.
    """
    low, low_slope = coarse.real, coarse.imag
    high, high_slope = value - low, slope - low_slope
    parts = -low * low_slope, low_slope**2, -high * high_slope, high_slope**2
    return np.stack([block_sum(weight * part, step) for part in parts])


def gather(blocks: NDArray[np.float32], window: float) -> NDArray[np.float32]:
    """Return the Gaussian sums over blocks (L x h x w), of sd `window` blocks and weight 1 at the middle."""
    reach = math.ceil(4 * window)
    fall = np.exp(-(np.arange(-reach, reach + 1) ** 2) / (2 * window**2)).astype(np.float32)
    sums = np.empty(blocks.shape, np.float32)
    for block, summed in zip(blocks, sums, strict=True):
        cv2.sepFilter2D(block, cv2.CV_32F, fall, fall, summed, borderType=cv2.BORDER_CONSTANT)
    return sums


def block_sum(image: NDArray[np.float32], step: int) -> FloatArray:
    """Return the sums over blocks of step x step pixels; the last blocks may be partial.

    >>> block_sum(np.ones((3, 5), np.float32), 2).tolist()
    [[4.0, 4.0, 2.0], [2.0, 2.0, 1.0]]
    """
    rows, columns = (-(-n // step) for n in image.shape)
    whole = np.pad(image, ((0, rows * step - image.shape[0]), (0, columns * step - image.shape[1])))
    # Of the rows first, in the image's own precision: in a fifth of the time.
    return whole.reshape(rows, step, -1).sum(axis=1).reshape(rows, columns, step).sum(axis=2, dtype=float)


def block_mean(image: NDArray[np.generic], step: int) -> FloatArray:
    """Return the means over blocks of step x step pixels: of a mask, the share of each block that is true.

    >>> block_mean(np.array([[True, True, False], [True, False, False]]), 2).tolist()
    [[0.75, 0.0]]
    """
    return block_sum(image.astype(np.float32), step) / block_sum(np.ones(image.shape, np.float32), step)


def at_levels(values: NDArray[np.floating], level: NDArray[np.float32], spacing: float = 1.0) -> NDArray[np.float32]:
    """Interpolate `values`, given at levels `spacing` apart from 0 on, linearly to the `level` of each pixel (H x W).

    Outside these levels the first or the last value is returned.

    >>> at_levels(np.array([1.0, 3.0, 4.0]), np.array([[-1, 0.5, 9]], np.float32)).tolist()
    [[1.0, 2.0, 4.0]]
    """
    found, table = np.empty(level.shape, np.float32), np.asarray(values, np.float64)
    share_rows(len(level), lambda first, last: _at_levels(table, level, spacing, first, last, found))
    return found


@njit(nogil=True, cache=True)
def _at_levels(values, level, spacing, first, last, found):  # type: ignore[no-untyped-def]
    end, over = len(values) - 1, 1 / spacing
    for y in range(first, last):
        for x in range(level.shape[1]):
            place = min(max(level[y, x] * over, 0.0), float(end))
            base = min(int(place), end - 1)
            found[y, x] = values[base] + (place - base) * (values[base + 1] - values[base])


def select_levels(
    images: NDArray[np.float32], level: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Interpolate a stack of images (L x H x W) at each pixel's fractional level; also return its derivative."""
    base = np.clip(np.rint(level).astype(np.intp), 1, len(images) - 2)
    part = (level - base).astype(np.float32)
    below, at, above = (np.take_along_axis(images, (base + i)[None], axis=0)[0] for i in (-1, 0, 1))
    slope, bend = (above - below) / 2, above - 2 * at + below
    return at + part * (slope + part * bend / 2), slope + part * bend


def combine_levels(
    images: NDArray[np.float32], coefficients: NDArray[np.float32], level: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Average the images with the coefficients of each pixel's level; also return the derivative by level.

    `images` is r x H x W, `coefficients` L x r, `level` H x W (fractional, a parabola through the nearest three).
    """
    value, slope = np.empty_like(level), np.empty_like(level)
    share_rows(
        level.shape[0], lambda first, last: _combine_levels(images, coefficients, level, first, last, value, slope)
    )
    return value, slope


@njit(nogil=True, cache=True, fastmath=True)
def _combine_levels(images, coefficients, level, first, last, value, slope):  # type: ignore[no-untyped-def]
    count = images.shape[0]
    top = coefficients.shape[0] - 2
    for y in range(first, last):
        for x in range(level.shape[1]):
            base = min(max(round(level[y, x]), 1), top)
            part = level[y, x] - base
            below = at = above = np.float32(0)
            for k in range(count):
                pixel = images[k, y, x]
                below += coefficients[base - 1, k] * pixel
                at += coefficients[base, k] * pixel
                above += coefficients[base + 1, k] * pixel
            rise, bend = (above - below) / 2, above - 2 * at + below
            value[y, x] = at + part * (rise + part * bend / 2)
            slope[y, x] = rise + part * bend


def sum_products(images: Sequence[tuple[NDArray[np.float32], NDArray[np.float32]]]) -> NDArray[np.float32]:
    """Return the sums over pairs of images r and r' (H x W each) of r^2, r r' and r'^2: 3 x H x W.

    >>> r, derivative = np.float32([[3]]), np.float32([[2]])
    >>> sum_products([(r, derivative), (r, derivative)]).ravel().tolist()
    [18.0, 12.0, 8.0]
    """
    sums = np.zeros((3, *images[0][0].shape), np.float32)
    for value, slope in images:
        for total, one, other in zip(sums, (value, value, slope), (value, slope, slope), strict=True):
            total += one * other
    return sums


def interpolate_nodes(values: FloatArray, sd: FloatArray | None, step: int, shape: tuple[int, int]) -> FloatArray:
    """Interpolate values at nodes, the centres of blocks of `step` pixels, to the pixels (H x W) of `shape`.

    Linear in between where the nodes around a pixel agree to within their `sd`; across a jump, which they do not, the
    nearest node's. Without `sd` linear everywhere.

    >>> interpolate_nodes(np.array([[0.0, 4.0]]), None, 2, (2, 5)).tolist()
    [[0.0, 1.0, 3.0, 4.0, 4.0], [0.0, 1.0, 3.0, 4.0, 4.0]]
    """
    apart = np.full(values.shape, np.inf) if sd is None else sd
    pixels = np.empty(shape)
    share_rows(shape[0], lambda first, last: _interpolate_nodes(values, apart, step, first, last, pixels))
    return pixels


@njit(nogil=True, cache=True)
def _interpolate_nodes(values, sd, step, first, last, pixels):  # type: ignore[no-untyped-def]
    rows, columns = values.shape
    width = pixels.shape[1]
    lefts, parts = np.empty(width, np.intp), np.empty(width)
    for x in range(width):
        u = min(max((x + 0.5) / step - 0.5, 0.0), columns - 1.0)
        lefts[x] = min(int(u), max(columns - 2, 0))
        parts[x] = u - lefts[x]
    for y in range(first, last):
        v = min(max((y + 0.5) / step - 0.5, 0.0), rows - 1.0)
        top = min(int(v), max(rows - 2, 0))
        low = min(top + 1, rows - 1)
        p = v - top
        row = low if p > 0.5 else top
        for x in range(width):
            left, q = lefts[x], parts[x]
            right = min(left + 1, columns - 1)
            a, b, c, d = values[top, left], values[top, right], values[low, left], values[low, right]
            column = right if q > 0.5 else left
            if max(a, b, c, d) - min(a, b, c, d) > 2.0 + 6 * sd[row, column]:
                pixels[y, x] = values[row, column]
            else:
                pixels[y, x] = (1 - p) * ((1 - q) * a + q * b) + p * ((1 - q) * c + q * d)


def repeat_blocks(values: NDArray[Value], step: int, shape: tuple[int, int]) -> NDArray[Value]:
    """Repeat values at nodes (h x w) over all pixels (H x W) of their blocks of `step` pixels."""
    return values.repeat(step, axis=0).repeat(step, axis=1)[: shape[0], : shape[1]]


def at_nodes(values: NDArray[Value], step: int) -> NDArray[Value]:
    """Return the values (H x W) at the centre of each node's block of `step` pixels: h x w."""
    return values[np.ix_(*(np.minimum(np.arange(0, n, step) + step // 2, n - 1) for n in values.shape))]


def weighted_median(values: FloatArray, weight: FloatArray) -> float:
    """Return the value at which half the weight is reached.

    >>> weighted_median(np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 5.0]))
    2.0
    """
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])
