"""The inner loops of the depth core, compiled; rows are shared among threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

THREADS = min(8, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)

SEPARATE = 49.0
"""Squared distance, over the variance, beyond which two values do not lie on one surface."""

RIVAL = 9.0
"""A second minimum whose cost comes within this (three sd) of the least leaves the depth undecided."""


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(THREADS, thread_name_prefix="focalgradient")


def share_rows(rows: int, work: Callable[[int, int], object]) -> None:
    """Call ``work(first, last)`` on bands of rows that cover ``range(rows)``, side by side."""
    edges = np.linspace(0, rows, THREADS + 1).astype(int).tolist()
    others = [_pool().submit(work, first, last) for first, last in pairwise(edges[1:])]
    work(edges[0], edges[1])
    for other in others:
        other.result()


def block_products(images: NDArray[np.float32], weight: NDArray[np.float32], step: int) -> NDArray[np.float64]:
    """Weighted sums, over blocks of step x step pixels, of the products of each pair of images.

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


def block_squares(images: NDArray[np.float32], weight: NDArray[np.float32], step: int) -> NDArray[np.float64]:
    """Weighted sums of squares over blocks of step x step pixels: L x H x W to L x ceil(H/step) x ceil(W/step)."""
    count, height, width = images.shape
    sums = np.zeros((count, -(-height // step), -(-width // step)))
    share_rows(sums.shape[1], lambda first, last: _block_squares(images, weight, step, first, last, sums))
    return sums


@njit(nogil=True, cache=True, fastmath=True)
def _block_squares(images, weight, step, first, last, sums):  # type: ignore[no-untyped-def]
    count, height, width = images.shape
    for k in range(count):
        for row in range(first, last):
            for y in range(row * step, min(height, (row + 1) * step)):
                for column in range(sums.shape[2]):
                    total = np.float32(0)
                    for x in range(column * step, min(width, (column + 1) * step)):
                        total += weight[y, x] * images[k, y, x] ** 2
                    sums[k, row, column] += total


def gather(blocks: NDArray[np.float32], window: float) -> NDArray[np.float32]:
    """Gaussian sums over blocks (L x h x w), of sd `window` blocks and weight 1 at the middle."""
    across, down = np.empty_like(blocks), np.empty_like(blocks)
    fall = np.exp(-(np.arange(int(np.ceil(4 * window)) + 1) ** 2) / (2 * window**2)).astype(np.float32)
    share_rows(len(blocks), lambda first, last: _gather(blocks, fall, first, last, across, down))
    return down


@njit(nogil=True, cache=True, fastmath=True)
def _gather(blocks, fall, first, last, across, down):  # type: ignore[no-untyped-def]
    rows, columns = blocks.shape[1:]
    for k in range(first, last):
        for row in range(rows):
            for x in range(columns):
                across[k, row, x] = fall[0] * blocks[k, row, x]
            for d in range(1, min(len(fall), columns)):
                for x in range(columns - d):
                    across[k, row, x] += fall[d] * blocks[k, row, x + d]
                    across[k, row, x + d] += fall[d] * blocks[k, row, x]
        for row in range(rows):
            for x in range(columns):
                down[k, row, x] = 0
            for other in range(max(0, row - len(fall) + 1), min(rows, row + len(fall))):
                for x in range(columns):
                    down[k, row, x] += fall[abs(other - row)] * across[k, other, x]


def block_sum(image: NDArray[np.float32], step: int) -> NDArray[np.float64]:
    """Sums over blocks of step x step pixels; the last blocks may be partial."""
    rows, columns = (np.arange(0, n, step) for n in image.shape)
    return np.add.reduceat(np.add.reduceat(image.astype(float), rows, axis=0), columns, axis=1)


def pick(images: NDArray[np.float32], level: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The stack of images (L x H x W) read, at each pixel, at that pixel's fractional level; and its derivative."""
    base = np.clip(np.rint(level).astype(np.intp), 1, len(images) - 2)
    part = (level - base).astype(np.float32)
    below, at, above = (np.take_along_axis(images, (base + i)[None], axis=0)[0] for i in (-1, 0, 1))
    slope, bend = (above - below) / 2, above - 2 * at + below
    return at + part * (slope + part * bend / 2), slope + part * bend


def mix(
    images: NDArray[np.float32], coefficients: NDArray[np.float32], level: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The image mixed, at each pixel, with the coefficients of that pixel's level, and its derivative by level.

    `images` is r x H x W, `coefficients` L x r, `level` H x W (fractional, a parabola through the nearest three).
    """
    value, slope = np.empty_like(level), np.empty_like(level)
    share_rows(level.shape[0], lambda first, last: _mix(images, coefficients, level, first, last, value, slope))
    return value, slope


@njit(nogil=True, cache=True, fastmath=True)
def _mix(images, coefficients, level, first, last, value, slope):  # type: ignore[no-untyped-def]
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


def read_minima(
    energy: NDArray[np.floating],
    expected: NDArray[np.float64],
    noise_slope: NDArray[np.float64],
    noise: float,
    size: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Where along its levels each node's residual energy is least, how sharply, how well it fits, whether alone.

    Parameters
    ----------
    energy
        Mean squared residual, nodes x L.
    expected
        What noise alone leaves of it, per level.
    noise_slope
        What noise of variance 1 adds to the variance of the score, per level^2, per level.
    noise
        Noise variance.
    size
        Pixels that each node's window is worth.

    Returns
    -------
    values
        4 x nodes: the level (fractional); its standard deviation in levels; the energy over what noise explains; the
        power of what tells depth over that of the noise in the same band.
    flags
        2 x nodes: no rival minimum fits about as well; the best fit lies within the levels, not beyond their ends.
    """
    values, flags = np.empty((4, len(energy))), np.empty((2, len(energy)), np.bool_)
    share_rows(
        len(energy),
        lambda first, last: _read_minima(energy, expected, noise_slope, noise, size, first, last, *values, *flags),
    )
    return values, flags


@njit(nogil=True, cache=True)
def _crossing(cost, start, direction, bound, level):  # type: ignore[no-untyped-def]
    """How far from `level` the cost first rises to `bound` in one direction; infinity if it never does."""
    i = start
    while 0 <= i + direction < cost.size:
        if cost[i + direction] > bound:
            inner = min(cost[i], bound)
            return abs(i + direction * (bound - inner) / (cost[i + direction] - inner) - level)
        i += direction
    return np.inf


@njit(nogil=True, cache=True)
def _read_minima(  # type: ignore[no-untyped-def]
    energy, expected, noise_slope, noise, size, first, last, level, sd, misfit, texture, alone, inside
):
    levels = energy.shape[1]
    cost = np.empty(levels)
    for node in range(first, last):
        best = 0
        for i in range(levels):
            cost[i] = (energy[node, i] - expected[i]) * size[node] / noise
            if cost[i] < cost[best]:
                best = i
        # A quartic through five levels: exact where blur vanishes and the cost has the form (r^2 - r0^2)^2.
        c = min(max(best, 2), levels - 3)
        m2, m1, z, p1, p2 = cost[c - 2], cost[c - 1], cost[c], cost[c + 1], cost[c + 2]
        a1 = (m2 - 8 * m1 + 8 * p1 - p2) / 12
        a2 = (-m2 + 16 * m1 - 30 * z + 16 * p1 - p2) / 24
        a3 = (-m2 + 2 * m1 - 2 * p1 + p2) / 12
        a4 = (m2 - 4 * m1 + 6 * z - 4 * p1 + p2) / 24
        # Its slope changes sign between the neighbours of the least level: bisect.
        left, right = max(best - 1.0, 0.0) - c, min(best + 1.0, levels - 1.0) - c
        for _ in range(14):
            middle = (left + right) / 2
            if a1 + middle * (2 * a2 + middle * (3 * a3 + middle * 4 * a4)) > 0:
                right = middle
            else:
                left = middle
        t = (left + right) / 2
        least = min(z + t * (a1 + t * (a2 + t * (a3 + t * a4))), cost[best])
        level[node] = c + t
        misfit[node] = (least * noise / size[node] + expected[best]) / expected[best]

        # The cost's rise at one sd is 1 where signal dominates, more where noise meets noise or the model misfits.
        curvature = a2 + t * (3 * a3 + t * 6 * a4)
        slope = noise_slope[best] * size[node]
        # Noise alone makes the cost wander over its levels, the more so the more of it they let through.
        wander = np.sqrt(2 * size[node] * expected.max() / noise) * max(1.0, misfit[node])
        texture[node] = curvature / slope if slope > 0 and cost.max() - cost[best] > 6 * wander else 0.0
        spread = max(1.0, misfit[node]) * (1 + slope / max(curvature, slope / 3 + 1e-30))
        rise = 4 * spread
        narrow = np.sqrt(rise / curvature) if curvature > 0 else np.inf
        if narrow < 1.0:
            sd[node] = narrow / 2
        else:
            # Half the width of what lies within two sd: honest where the cost is no parabola.
            down = _crossing(cost, best, -1, least + rise, level[node])
            up = _crossing(cost, best, 1, least + rise, level[node])
            # Where the range ends first, that side says nothing and the other stands for both.
            sd[node] = (max(down, up) if max(down, up) < np.inf else min(down, up, levels - 1.0)) / 2

        # At an end of the range: would the cost still fall by three sd beyond it?
        outward = 0.0
        if best == 0:
            outward = cost[1] - cost[0]
        elif best == levels - 1:
            outward = cost[levels - 2] - cost[levels - 1]
        fall = outward**2 / (4 * max(curvature, slope / 3 + 1e-30))
        inside[node] = fall <= RIVAL * spread or outward <= 2 * curvature

        # A rival fits about as well and lies beyond a barrier that both could not share.
        bound = least + RIVAL * spread
        alone[node] = True
        for direction in (-1, 1):
            i = best
            over = False
            while 0 <= i + direction < levels:
                i += direction
                apart = abs(expected[i] - expected[best]) / noise
                if cost[i] > bound + 3 * np.sqrt(2 * size[node] * apart):
                    over = True
                elif over:
                    alone[node] = False


def spread(
    values: NDArray[np.float64], sd: NDArray[np.float64], step: int, shape: tuple[int, int]
) -> NDArray[np.float64]:
    """Carry values from nodes, at the middles of blocks of `step` pixels, to the pixels (H x W) of `shape`.

    Linear in between where the nodes around a pixel agree; across a jump, which they do not, the nearest node's.
    """
    pixels = np.empty(shape)
    share_rows(shape[0], lambda first, last: _spread(values, sd, step, first, last, pixels))
    return pixels


@njit(nogil=True, cache=True)
def _spread(values, sd, step, first, last, pixels):  # type: ignore[no-untyped-def]
    rows, columns = values.shape
    for y in range(first, last):
        v = min(max((y + 0.5) / step - 0.5, 0.0), rows - 1.0)
        top = min(int(v), max(rows - 2, 0))
        low = min(top + 1, rows - 1)
        for x in range(pixels.shape[1]):
            u = min(max((x + 0.5) / step - 0.5, 0.0), columns - 1.0)
            left = min(int(u), max(columns - 2, 0))
            right = min(left + 1, columns - 1)
            a, b, c, d = values[top, left], values[top, right], values[low, left], values[low, right]
            p, q = v - top, u - left
            row, column = (low if p > 0.5 else top), (right if q > 0.5 else left)
            if max(a, b, c, d) - min(a, b, c, d) > 2.0 + 6 * sd[row, column]:
                pixels[y, x] = values[row, column]
            else:
                pixels[y, x] = (1 - p) * ((1 - q) * a + q * b) + p * ((1 - q) * c + q * d)


def grow_planes(
    weight: NDArray[np.float64],
    weighted: NDArray[np.float64],
    level: NDArray[np.float64],
    doubt: NDArray[np.float64],
    windows: list[float],
    steep: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Planes fitted about each block, in windows that grow over whatever lies on one surface.

    Adaptive weights (propagation and separation, after Polzehl and Spokoiny): from one window to the next, a
    neighbour counts by how well its own value agrees with the plane so far, so that depth is gathered along a
    surface and not across its edge.

    Parameters
    ----------
    weight, weighted
        What each block says, and its value times that weight; h x w.
    level
        Value to start from, h x w.
    doubt
        Standard deviation of the noise in which `weight` is an inverse variance, h x w.
    windows
        Gaussian windows (sd, in blocks), from the narrowest up.
    steep
        Prior standard deviation of a plane's slope, per block.

    Returns
    -------
    value, sd
        h x w each.
    """
    # value, slope down, slope right, variance for noise of variance 1, still growing
    state = np.stack([level, 0 * level, 0 * level, np.full_like(level, np.inf), np.ones_like(level)])
    for window in windows:
        grown, variance = np.empty_like(state), state[3] * doubt**2

        def work(first: int, last: int) -> None:
            _grow_planes(weight, weighted, variance, state, window, steep, first, last, grown)  # noqa: B023

        share_rows(len(level), work)
        state = grown
    return state[0], doubt * np.sqrt(state[3])


@njit(nogil=True, cache=True, fastmath={"contract", "reassoc", "nsz", "arcp"})
def _grow_planes(weight, weighted, variances, state, window, steep, first, last, grown):  # type: ignore[no-untyped-def]
    rows, columns = weight.shape
    reach = int(np.ceil(2.2 * window))
    fall = np.exp(-(np.arange(reach + 1) ** 2) / (2 * window * window))
    for row in range(first, last):
        for column in range(columns):
            value, down, right = state[0, row, column], state[1, row, column], state[2, row, column]
            variance = variances[row, column]
            start = not np.isfinite(variance)
            a00 = a01 = a02 = a11 = a12 = a22 = 0.0
            q00 = q01 = q02 = q11 = q12 = q22 = 0.0
            b0 = b1 = b2 = 0.0
            if state[4, row, column] > 0:
                for i in range(max(0, row - reach), min(rows, row + reach + 1)):
                    y = i - row
                    fall_y = fall[abs(y)]
                    for j in range(max(0, column - reach), min(columns, column + reach + 1)):
                        x = j - column
                        # At the start every variance is infinite, and every neighbour counts.
                        apart = state[0, i, j] - (value + down * y + right * x)
                        s = min(1.0, apart * apart / (SEPARATE * (variance + variances[i, j])))
                        w = fall_y * fall[abs(x)] * (1 - s) * (1 - s)
                        a = w * weight[i, j]
                        b = w * (weighted[i, j] - weight[i, j] * value)
                        ay, ax = a * y, a * x
                        a00 += a
                        a01 += ay
                        a02 += ax
                        a11 += ay * y
                        a12 += ay * x
                        a22 += ax * x
                        q00 += w * a
                        q01 += w * ay
                        q02 += w * ax
                        q11 += w * ay * y
                        q12 += w * ay * x
                        q22 += w * ax * x
                        b0 += b
                        b1 += b * y
                        b2 += b * x
            # Without evidence the plane is flat.
            a11 += steep**-2
            a22 += steep**-2
            a00 += 1e-9
            c0, c1, c2 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
            det = a00 * c0 + a01 * c1 + a02 * c2
            e0, e1, e2 = c0 / det, c1 / det, c2 / det
            step = e0 * b0 + e1 * b1 + e2 * b2
            spread = e0 * (e0 * q00 + 2 * (e1 * q01 + e2 * q02)) + e1 * (e1 * q11 + 2 * e2 * q12) + e2 * e2 * q22
            if state[4, row, column] == 0 or (not start and step * step > 9 * variance):
                # What a wider window says contradicts the narrower one: growth ends here.
                grown[:, row, column] = state[:, row, column]
                grown[4, row, column] = 0
                continue
            grown[0, row, column] = value + step
            grown[1, row, column] = (c1 * b0 + (a00 * a22 - a02 * a02) * b1 + (a01 * a02 - a00 * a12) * b2) / det
            grown[2, row, column] = (c2 * b0 + (a01 * a02 - a00 * a12) * b1 + (a00 * a11 - a01 * a01) * b2) / det
            grown[3, row, column] = max(spread, 1e-12)
            grown[4, row, column] = 1
