"""A picture with its depth, seen through a lens or an eye.

A point at vergence V of the pinhole picture lands on a disc of radius r = (A/2) |Vf - V| about its own pixel. Every pixel
is spread by its own blur, and what arrives at a place is sorted by depth:

- surfaces are told apart by gaps in depth. Light of one surface adds up, and its weights say how much of the lens it
  covers; what it leaves open shows the surface behind it. So near things blur over far ones, and far things do not bleed
  onto near ones;
- what an outline hides is completed from the surface behind it: the part next to the outline, mirrored at the outline.

Spreading I(p) of a slanted surface over the lens, an area dp of the picture takes the share
(1 + d . grad ln|Vf - V|) dp / (pi r^2) of the lens, d being the way from p: light is kept, also where blur changes.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

TILE = 64
LANES = 8
JUMP = 3.0
SAME = 1.0
POWER = 2.0
MORE = 6
MOST_SURFACES = 24
MOST_RADIUS = 200.0

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)


def disc_kernels(radii):
    reaches = np.ceil(radii + 2).astype(np.int64) - 1
    reaches = np.where(radii < 0.02, 0, np.maximum(reaches, 1))
    sides = 2 * reaches + 1
    offsets = np.concatenate([[0], np.cumsum(sides * (sides + LANES))])
    flat = np.zeros(offsets[-1] + LANES, np.float32)
    extents = np.full((len(radii), sides.max()), -1, np.int64)
    for n, (radius, reach, offset, side) in enumerate(zip(radii, reaches, offsets, sides)):
        kernel = np.zeros(side * side)
        _disc(float(radius), int(reach), kernel)
        kernel = kernel.reshape(side, side)
        flat[offset : offset + side * (side + LANES)].reshape(side, side + LANES)[:, :side] = kernel
        away = np.where(kernel != 0, np.abs(np.arange(side) - reach), -1)
        extents[n, :side] = away.max(axis=1)
    return flat, offsets[:-1], reaches, extents


@_compiled
def _cubic_weight(t):
    t = abs(t)
    if t < 1:
        return (1.5 * t - 2.5) * t * t + 1.0
    if t < 2:
        return ((-0.5 * t + 2.5) * t - 4.0) * t + 2.0
    return 0.0


@_compiled
def _disc(radius, reach, out):
    side = 2 * reach + 1
    if reach == 0:
        out[0] = 1.0
        return
    rings = int(math.ceil(3 * radius)) + 4
    total = 0.0
    for ring in range(rings):
        rho = radius * math.sqrt((ring + 0.5) / rings)
        spokes = int(math.ceil(16 * rho)) + 8
        share = 1.0 / spokes
        for spoke in range(spokes):
            angle = 2 * math.pi * (spoke + 0.5 * (ring % 2)) / spokes
            y, x = rho * math.sin(angle), rho * math.cos(angle)
            top, left = int(math.floor(y)) - 1, int(math.floor(x)) - 1
            for i in range(top, top + 4):
                if abs(i) > reach:
                    continue
                wy = _cubic_weight(y - i) * share
                for j in range(left, left + 4):
                    if abs(j) <= reach:
                        w = wy * _cubic_weight(x - j)
                        out[(i + reach) * side + j + reach] += w
                        total += w
    for n in range(side * side):
        out[n] /= total


@_compiled
def _minmod(a, b):
    if a * b <= 0:
        return 0.0
    return a if abs(a) < abs(b) else b


@_compiled
def _slopes(u, jump):
    height, width = u.shape
    gy, gx = np.zeros((height, width), np.float32), np.zeros((height, width), np.float32)
    for i in range(height):
        for j in range(width):
            if 0 < i < height - 1:
                gy[i, j] = _minmod(u[i + 1, j] - u[i, j], u[i, j] - u[i - 1, j])
            if 0 < j < width - 1:
                gx[i, j] = _minmod(u[i, j + 1] - u[i, j], u[i, j] - u[i, j - 1])
    return gy, gx


@_compiled
def _behind(u, focus, jump, margin):
    """Row and column of the nearest pixel of the surface behind, where an outline is within reach; -1 elsewhere."""
    height, width = u.shape
    row = np.full((height, width), -1, np.int32)
    column = np.full((height, width), -1, np.int32)
    for sweep in range(4):
        down = 1 if sweep % 2 == 0 else -1
        for step_i in range(height):
            i = step_i if down == 1 else height - 1 - step_i
            for side in range(2):
                right = 1 if side == 0 else -1
                for step_j in range(width):
                    j = step_j if right == 1 else width - 1 - step_j
                    best = 1e30
                    if row[i, j] >= 0:
                        best = (row[i, j] - i) ** 2 + (column[i, j] - j) ** 2
                    for n in range(5):
                        di = -down if n < 3 else 0
                        dj = n - 1 if n < 3 else (-right if n == 3 else right)
                        a, b = i + di, j + dj
                        if a < 0 or b < 0 or a >= height or b >= width:
                            continue
                        # a neighbour across an outline, or the one that the neighbour knows
                        fi, fj = row[a, b], column[a, b]
                        if u[i, j] - u[a, b] > jump:
                            fi, fj = a, b
                        if fi < 0 or u[i, j] - u[fi, fj] <= jump:
                            continue
                        away = (fi - i) ** 2 + (fj - j) ** 2
                        reach = max(abs(u[i, j] - focus), abs(u[fi, fj] - focus)) + margin
                        if away < best and away <= reach * reach:
                            best = away
                            row[i, j], column[i, j] = fi, fj
    return row, column


@_compiled
def _complete(image, u, row, column, hidden, hidden_u, same, power, more):
    """Light and depth of what outlines hide: the mean of the surface behind, nearer parts of it counting more."""
    height, width = u.shape
    for i in range(height):
        for j in range(width):
            fi, fj = row[i, j], column[i, j]
            if fi < 0:
                hidden_u[i, j] = -1e30
                continue
            behind = u[fi, fj]
            hidden_u[i, j] = behind
            away = math.sqrt((fi - i) ** 2 + (fj - j) ** 2)
            reach = int(away + more)
            stride = 1 + reach // 12
            total = 0.0
            for m in range(fi - i - stride * (reach // stride), reach + 1, stride) if False else range(-reach, reach + 1, stride):
                a = i + m
                if a < 0 or a >= height:
                    continue
                for n in range(-reach, reach + 1, stride):
                    b = j + n
                    if b < 0 or b >= width or abs(u[a, b] - behind) > same:
                        continue
                    d = float(m * m + n * n)
                    w = 1.0 / d ** power
                    total += w
                    for c in range(image.shape[2]):
                        hidden[i, j, c] += w * image[a, b, c]
            for c in range(image.shape[2]):
                hidden[i, j, c] = hidden[i, j, c] / total if total > 0 else image[fi, fj, c]


@_compiled
def _spread(image, u, level, gy, gx, y0, x0, size_y, size_x, reach, least, width_of, surfaces, kernels, offsets, reaches, extents, acc, row):
    """Spread every pixel that reaches the tile into the tile's surfaces."""
    height, width, channels = image.shape
    line = TILE + LANES
    plane = TILE * line
    for i in range(max(y0 - reach, 0), min(y0 + size_y + reach, height)):
        for j in range(max(x0 - reach, 0), min(x0 + size_x + reach, width)):
            if u[i, j] < -1e29:
                continue
            n = level[i, j]
            k = reaches[n]
            top, bottom = max(i - k, y0), min(i + k + 1, y0 + size_y)
            if top >= bottom or j - k >= x0 + size_x or j + k < x0:
                continue
            surface = min(int((u[i, j] - least) / width_of), surfaces - 1)
            stride = 2 * k + 1 + LANES
            a, b = gy[i, j], gx[i, j]
            flat = a == 0 and b == 0
            for y in range(top, bottom):
                wide = extents[n, y - i + k]
                left, right = max(j - wide, x0), min(j + wide + 1, x0 + size_x)
                if left >= right:
                    continue
                count = (right - left + LANES - 1) // LANES * LANES
                # Unsigned: an index that cannot be negative needs no test, and the loops become vector instructions.
                most = np.uint64(count)
                start = np.uint64(offsets[n] + (y - i + k) * stride + (left - j + k))
                at = np.uint64(surface * (channels + 1) * plane + (y - y0) * line + left - x0)
                base, growth = np.float32(1), np.float32(0)
                if not flat:
                    base, growth = np.float32(1) + a * np.float32(y - i) + b * np.float32(left - j), b
                for x in range(most):
                    row[x] = kernels[start + x] * max(base + growth * np.float32(x), np.float32(0))
                for x in range(most):
                    acc[at + x] += row[x]
                for c in range(channels):
                    at += np.uint64(plane)
                    light = image[i, j, c]
                    for x in range(most):
                        acc[at + x] += light * row[x]


@_compiled
def _resolve(acc, surfaces, y0, x0, size_y, size_x, pad, result):
    """From near to far, what each surface shows of itself through what those before it leave open."""
    channels = result.shape[2]
    light = np.zeros(channels)
    out = np.zeros(channels)
    for y in range(size_y):
        for x in range(size_x):
            left = 1.0
            weight = 0.0
            out[:] = 0
            light[:] = 0
            for n in range(surfaces - 1, -2, -1):
                w = acc[n, 0, y, x] if n >= 0 else 0.0
                if n >= 0 and abs(w) > 1e-4:
                    weight += w
                    for c in range(channels):
                        light[c] += acc[n, c + 1, y, x]
                    continue
                if weight <= 1e-3:
                    continue
                # a gap in depth: a surface is complete
                cover = max(weight, 1.0)
                for c in range(channels):
                    out[c] += left * light[c] / cover
                    light[c] = 0
                left *= 1 - min(weight, 1.0)
                weight = 0.0
                if left < 1e-4:
                    break
            for c in range(channels):
                result[y0 - pad + y, x0 - pad + x, c] = out[c] / (1 - left)


def blur_picture(picture, distance, aperture, focus, pixel_angle, complete=True):
    image = np.asarray(picture, np.float32)
    image = np.ascontiguousarray(image[..., None] if image.ndim == 2 else image)
    scale = aperture / 2 / pixel_angle
    u = (scale / np.asarray(distance, float)).astype(np.float32)
    f = np.float32(scale * focus)
    radius = np.abs(u - f)
    most = float(radius.max())
    pad = int(np.ceil(most + 2))
    around = ((pad, pad), (pad, pad))
    image = np.pad(image, (*around, (0, 0)), mode="symmetric")
    u = np.pad(u, around, mode="symmetric")
    fine = np.arange(0, min(most, 2) + 0.02, 0.02)
    coarse = np.exp(np.arange(np.log(2), np.log(max(most, 2)) + 0.01, 0.01)) if most > 2 else np.array([])
    radii = np.unique(np.concatenate([fine, coarse]))
    kernels, offsets, reaches, extents = disc_kernels(radii)
    edges = (radii[1:] + radii[:-1]) / 2

    def levels(u):
        return np.searchsorted(edges, np.abs(u - f)).astype(np.int16)

    jump = 1.0
    gy, gx = _slopes(u, jump)
    r = u - f
    pull = r / (r * r + 1)
    gy, gx = gy * pull, gx * pull
    layers = [(image, u, levels(u), gy, gx)]
    if complete:
        row, column = _behind(u, f, JUMP, 2.0)
        hidden, hidden_u = np.zeros_like(image), np.empty_like(u)
        _complete(image, u, row, column, hidden, hidden_u, 2.0, POWER, MORE)
        zero = np.zeros_like(gy)
        layers.append((hidden, hidden_u, levels(np.where(hidden_u < -1e29, f, hidden_u)), zero, zero))
    height, width = np.shape(distance)
    result = np.empty((height, width, image.shape[2]), np.float32)

    def tile(place):
        y0, x0 = place
        size_y, size_x = min(TILE, height - y0), min(TILE, width - x0)
        y0, x0 = y0 + pad, x0 + pad
        part = (slice(y0 - pad, y0 + size_y + pad), slice(x0 - pad, x0 + size_x + pad))
        near = float(u[part].max())
        far = min(float(layer[1][part][layer[1][part] > -1e29].min(initial=near)) for layer in layers)
        wide = max(1.0, (near - far) / (MOST_SURFACES - 1))
        surfaces = int((near - far) / wide) + 1
        acc = np.zeros((surfaces, image.shape[2] + 1, TILE, TILE + LANES), np.float32)
        line = np.zeros(TILE + LANES, np.float32)
        for im, uu, lev, ga, gb in layers:
            _spread(im, uu, lev, ga, gb, y0, x0, size_y, size_x, pad, far, wide, surfaces, kernels, offsets, reaches, extents, acc.reshape(-1), line)
        _resolve(acc, surfaces, y0, x0, size_y, size_x, pad, result)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(tile, product(range(0, height, TILE), range(0, width, TILE))))
    return result.reshape(np.shape(picture))
