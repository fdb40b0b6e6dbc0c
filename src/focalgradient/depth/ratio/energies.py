"""The inner loops of the real-time form, compiled; rows are shared among threads.

Images are read once, in bands of rows that stay in the nearest cache: stored values are decoded by table, second
differences are taken, squared and summed, and brightness is summed, before the next rows are touched. What follows
happens on the grid of 4 x 4 pixels, a sixteenth of the data.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import Mask
from focalgradient.depth.filters import Image
from focalgradient.loops import compiled
from focalgradient.parallel import share_rows

StoredImage = Image | NDArray[np.uint8]

BLOCK = 4
"""Side in pixels of the squares over which high-frequency energy is averaged, as in the paper."""

CLEAR_OF_NOISE = 3.0
"""Minimum ratio of the energy of the sharper view's detail to that of noise in a band in use. Chosen by hand."""


def binned(images: Sequence[StoredImage] | Image, levels: Image | None) -> list[Image]:
    """Return the means over 2 x 2 pixels of `images` (H x W each), as floor(H/2) x floor(W/2) of linear radiance."""
    halves = [np.empty((image.shape[0] // 2, image.shape[1] // 2), np.float32) for image in images]

    def work(first: int, last: int) -> None:
        for image, half in zip(images, halves, strict=True):
            _bin_rows(image, levels, first, last, half)

    share_rows(len(halves[0]), work)
    return halves


@compiled
def _bin_rows(image, levels, first, last, half):  # type: ignore[no-untyped-def]
    quarter = np.float32(0.25)
    columns = np.empty(image.shape[1], np.float32)
    for row in range(first, last):
        above, below = image[2 * row], image[2 * row + 1]
        for x in range(columns.size):
            if levels is None:
                columns[x] = above[x] + below[x]
            else:
                columns[x] = levels[above[x]] + levels[below[x]]
        for j in range(half.shape[1]):
            half[row, j] = quarter * (columns[2 * j] + columns[2 * j + 1])


def energies(images: Sequence[StoredImage], levels: Image | None, side: int, absolute: bool) -> tuple[Image, Image]:
    """Mean squared second difference (Laplacian), and mean, of each image over squares of `side` pixels.

    Parameters
    ----------
    images
        n images, H x W: linear radiance as float32, or stored values as uint8.
    levels
        Linear radiance of each of the 256 stored values; None for float32.
    side
        4, 2 or 1.
    absolute
        The mean *size* of the second difference, squared, instead of its mean square.

    Returns
    -------
    energy, brightness
        n x floor(H/side) x floor(W/side) each. Beyond the frame its outermost pixels are repeated.
    """
    height, width = images[0].shape
    energy, brightness = np.empty((2, len(images), height // side, width // side), np.float32)

    # Stored values as they are need no decoding: whole numbers, of which more fit into a register.
    whole = side == BLOCK and not absolute and levels is not None and bool((levels == np.arange(256)).all())

    def work(first: int, last: int) -> None:
        for image, squares, light in zip(images, energy, brightness, strict=True):
            if whole:
                _whole_rows(image, first, last, squares, light)
                continue
            _energy_rows(image, levels, side, absolute, first, last, squares, light)

    share_rows(height // side, work)
    return energy, brightness


@compiled
def _energy_rows(image, levels, side, absolute, first, last, energy, brightness):  # type: ignore[no-untyped-def]
    height, width = image.shape
    # Each row with its ends repeated, so that one inner loop serves all columns; row y lies in slot (y + 1) % 6.
    lines = np.empty((6, width + 2), np.float32)
    square, light = np.empty(width, np.float32), np.empty(width, np.float32)
    share = np.float32(1 / (side * side))
    loaded = first * side - 2
    for row in range(first, last):
        top = row * side
        for y in range(max(loaded + 1, top - 1), top + side + 1):
            _load(image[min(max(y, 0), height - 1)], levels, lines[(y + 1) % 6])
        loaded = top + side
        if side == 4 and not absolute:
            a, b, c, d, e, f = top % 6, (top + 1) % 6, (top + 2) % 6, (top + 3) % 6, (top + 4) % 6, (top + 5) % 6
            _four_rows(lines[a], lines[b], lines[c], lines[d], lines[e], lines[f], square, light)
        else:
            square[:] = 0
            light[:] = 0
            for y in range(top, top + side):
                _one_row(lines[y % 6], lines[(y + 1) % 6], lines[(y + 2) % 6], absolute, square, light)
        if side == 4:
            for j in range(energy.shape[1]):
                i = 4 * j
                energy[row, j] = share * (square[i] + square[i + 1] + square[i + 2] + square[i + 3])
                brightness[row, j] = share * (light[i] + light[i + 1] + light[i + 2] + light[i + 3])
        else:
            for j in range(energy.shape[1]):
                energy[row, j] = share * square[side * j : side * (j + 1)].sum()
                brightness[row, j] = share * light[side * j : side * (j + 1)].sum()
        if absolute:
            for j in range(energy.shape[1]):
                energy[row, j] *= energy[row, j]


@compiled
def _whole_rows(image, first, last, energy, brightness):  # type: ignore[no-untyped-def]
    """As `_energy_rows`, for stored values on squares of 4 pixels. Second differences fit into 16 bits."""
    height, width = image.shape
    second = np.empty((BLOCK, width), np.int16)
    square, light = np.empty(width, np.int32), np.empty(width, np.int16)
    share = np.float32(1 / BLOCK**2)
    for row in range(first, last):
        top = row * BLOCK
        for i in range(BLOCK):
            y = top + i
            _second_difference(image[max(y - 1, 0)], image[y], image[min(y + 1, height - 1)], second[i])
        a, b, c, d = image[top], image[top + 1], image[top + 2], image[top + 3]
        p, q, r, s = second[0], second[1], second[2], second[3]
        for x in range(width):
            p_, q_, r_, s_ = np.int32(p[x]), np.int32(q[x]), np.int32(r[x]), np.int32(s[x])
            square[x] = p_ * p_ + q_ * q_ + r_ * r_ + s_ * s_
            light[x] = np.int16(a[x]) + np.int16(b[x]) + np.int16(c[x]) + np.int16(d[x])
        energies, lights = energy[row], brightness[row]
        for j in range(energies.size):
            i = BLOCK * j
            energies[j] = share * np.float32(square[i] + square[i + 1] + square[i + 2] + square[i + 3])
            lights[j] = share * np.float32(light[i] + light[i + 1] + light[i + 2] + light[i + 3])


@compiled
def _second_difference(above, row, below, out):  # type: ignore[no-untyped-def]
    last = row.size - 1
    inner, up, middle, down, left, right = out[1:-1], above[1:-1], row[1:-1], below[1:-1], row[:-2], row[2:]
    for x in range(inner.size):
        inner[x] = (
            4 * np.int16(middle[x]) - np.int16(up[x]) - np.int16(down[x]) - np.int16(left[x]) - np.int16(right[x])
        )
    for x, inside in ((0, 1), (last, last - 1)):  # the frame's outermost pixels are repeated
        out[x] = 3 * np.int16(row[x]) - np.int16(above[x]) - np.int16(below[x]) - np.int16(row[inside])


@compiled
def _load(row, levels, line):  # type: ignore[no-untyped-def]
    inner = line[1:-1]
    for x in range(row.size):
        if levels is None:
            inner[x] = row[x]
        else:
            inner[x] = levels[row[x]]
    line[0], line[-1] = inner[0], inner[-1]


@compiled
def _one_row(up, middle, down, absolute, square, light):  # type: ignore[no-untyped-def]
    a, m, b = up[1:-1], middle[1:-1], down[1:-1]
    left, right = middle[:-2], middle[2:]
    four = np.float32(4)
    for x in range(square.size):
        value = four * m[x] - a[x] - b[x] - left[x] - right[x]
        square[x] += abs(value) if absolute else value * value
        light[x] += m[x]


@compiled
def _four_rows(r0, r1, r2, r3, r4, r5, square, light):  # type: ignore[no-untyped-def]
    a, b, c, d, e, f = r0[1:-1], r1[1:-1], r2[1:-1], r3[1:-1], r4[1:-1], r5[1:-1]
    b0, c0, d0, e0 = r1[:-2], r2[:-2], r3[:-2], r4[:-2]
    b1, c1, d1, e1 = r1[2:], r2[2:], r3[2:], r4[2:]
    four = np.float32(4)
    for x in range(square.size):
        p = four * b[x] - a[x] - c[x] - b0[x] - b1[x]
        q = four * c[x] - b[x] - d[x] - c0[x] - c1[x]
        r = four * d[x] - c[x] - e[x] - d0[x] - d1[x]
        s = four * e[x] - d[x] - f[x] - e0[x] - e1[x]
        square[x] = p * p + q * q + r * r + s * s
        light[x] = b[x] + c[x] + d[x] + e[x]


def smoothed(planes: Image, sd: float) -> Image:
    """Return the Gaussian means, of `sd` grid steps, of planes (n x h x w); the frame is mirrored around."""
    side = 2 * math.ceil(3.5 * sd) + 1
    return np.stack([cv2.GaussianBlur(plane, (side, side), sd, borderType=cv2.BORDER_REFLECT) for plane in planes])


def compared(energy: Image, brightness: Image, noise: Image, span: float, least: float) -> tuple[Image, Mask]:
    """Return the focal disparity, and where it is valid, from two views' energy and brightness (2 x h x w each).

    `noise` is the energy that noise has at a brightness of 0 .. `span` in equal steps, 2 x levels.
    """
    shape = energy.shape[1:]
    disparity, valid = np.empty(shape, np.float32), np.empty(shape, np.bool_)

    given = energy, brightness, noise, np.float32((noise.shape[1] - 1) / span), np.float32(least**2)
    share_rows(shape[0], lambda first, last: _compare_rows(*given, first, last, disparity, valid))
    return disparity, valid


@compiled
def _compare_rows(energy, brightness, noise, step, least, first, last, disparity, valid):  # type: ignore[no-untyped-def]
    zero, clear = np.float32(0), np.float32(CLEAR_OF_NOISE)
    floors, others = np.empty(disparity.shape[1], np.float32), np.empty(disparity.shape[1], np.float32)
    for row in range(first, last):
        light, other, out, ok = brightness[0, row], brightness[1, row], disparity[row], valid[row]
        detail, blurred = energy[0, row], energy[1, row]
        noise_at(noise[0], step, light, floors)
        noise_at(noise[1], step, other, others)
        for x in range(out.size):
            sharp = detail[x] - floors[x]
            # No short cuts: they would keep the loop from running eight columns at a time.
            good = (
                (light[x] > zero)
                & (other[x] > zero)
                & (sharp > clear * floors[x])
                & (sharp > least * light[x] * light[x])
            )
            ratio = np.sqrt(max(blurred[x] - others[x], zero) / sharp) * light[x] / other[x]
            ok[x] = good
            out[x] = ratio if good else zero


@compiled
def noise_at(noise, step, light, energy):  # type: ignore[no-untyped-def]
    """Fill `energy` with what `noise`, tabulated at `step` places per unit of brightness, has at brightness `light`."""
    bottom, top = np.int32(0), np.int32(noise.size - 1)
    for x in range(light.size):
        energy[x] = noise[min(max(np.int32(step * light[x]), bottom), top)]
