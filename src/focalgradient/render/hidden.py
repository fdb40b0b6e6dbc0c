"""What an outline hides: completed from the surface behind it.

A lens looks round an outline, where the pinhole that took the picture could not. Each pixel of a near surface within
reach of its outline is given a second, hidden point behind it: at the vergence of the nearest visible part of the
surface behind, with the light of its surroundings on that surface. What is hidden cannot be known; their mean is the
guess with the least error.

Vergence is in pixels here: vergence x half the aperture / the pixel's angle. Two surfaces shift against each other by
the difference of theirs between the middle of the lens and its rim, and a disc of blur has as radius the difference to
the focus.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.parallel import share_rows

__all__ = ["NOTHING", "complete", "nearest_behind"]

NOTHING = -1e30
"""Vergence of a hidden point where nothing is hidden."""

JUMP = 3.0
"""Pixels by which vergence differs across an outline. 2 takes the steep rim of a sphere for an outline, 5 misses some
(on the scenes of `benchmarks/blurred_pictures.py` the error near outlines is 1.75, 1.74 and 2.0 % of the mean)."""

MARGIN = 3.0
"""Pixels beyond the reach of blur to which surfaces are completed: the reach of interpolation."""

SAME = 2.0
"""Pixels of vergence within which points belong to one surface behind."""

AROUND = 6
"""Pixels beyond the nearest visible place from which light is taken."""

ACROSS = 12
"""Places, from the middle to the rim of the surroundings, at which light is taken: wider ones are sampled."""

BLOCKS = 8
"""Blocks of rows for each thread, as outlines are not spread evenly."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)

FloatImage = NDArray[np.float32]


def complete(image: FloatImage, vergence: FloatImage, focus: float) -> tuple[FloatImage, FloatImage]:
    """Light (H x W x channels) and vergence (H x W) of the points hidden behind near surfaces, within reach of blur.

    `vergence` and `focus` are in pixels; where nothing is hidden the vergence is `NOTHING`.
    """
    row, column = nearest_behind(vergence, np.float32(focus))
    hidden = np.zeros_like(image)
    behind = np.empty_like(vergence)
    share_rows(len(vergence), partial(_fill, image, vergence, row, column, hidden, behind), each=BLOCKS)
    return hidden, behind


@_compiled
def nearest_behind(vergence, focus):  # type: ignore[no-untyped-def]
    """Row and column of the nearest visible pixel of the surface behind each pixel; -1 where none is within reach.

    Distances spread from the outlines by two sweeps down and two up, each to the right and to the left.
    """
    height, width = vergence.shape
    row = np.full((height, width), -1, np.int32)
    column = np.full((height, width), -1, np.int32)
    for sweep in range(4):
        down = 1 if sweep % 2 == 0 else -1
        for line in range(height):
            i = line if down == 1 else height - 1 - line
            for side in range(2):
                right = 1 if side == 0 else -1
                for place in range(width):
                    j = place if right == 1 else width - 1 - place
                    _take_nearer(vergence, focus, row, column, i, j, down, right)
    return row, column


@_compiled
def _take_nearer(vergence, focus, row, column, i, j, down, right):  # type: ignore[no-untyped-def]
    """Take over what a neighbour already swept knows, where that is nearer than what this pixel knows."""
    height, width = vergence.shape
    best = np.inf
    if row[i, j] >= 0:
        best = (row[i, j] - i) ** 2 + (column[i, j] - j) ** 2
    for n in range(5):  # three pixels of the line before, and the two beside
        a = i - down if n < 3 else i
        b = j + n - 1 if n < 3 else (j - right if n == 3 else j + right)
        if a < 0 or b < 0 or a >= height or b >= width:
            continue
        if vergence[i, j] - vergence[a, b] > JUMP:  # the neighbour itself lies behind
            r, c = a, b
        else:
            r, c = row[a, b], column[a, b]
        if r < 0 or vergence[i, j] - vergence[r, c] <= JUMP:
            continue
        away = (r - i) ** 2 + (c - j) ** 2
        reach = max(abs(vergence[i, j] - focus), abs(vergence[r, c] - focus)) + MARGIN
        if away < best and away <= reach * reach:
            best = away
            row[i, j], column[i, j] = r, c


@_compiled
def _fill(image, vergence, row, column, hidden, behind, first, last):  # type: ignore[no-untyped-def]
    """Fill in the mean light of the surface behind, weighted by 1 / distance^4, in rows `first` to `last`."""
    height, width, channels = image.shape
    for i in range(first, last):
        for j in range(width):
            r, c = row[i, j], column[i, j]
            if r < 0:
                behind[i, j] = NOTHING
                continue
            behind[i, j] = vergence[r, c]
            reach = int(math.sqrt((r - i) ** 2 + (c - j) ** 2)) + AROUND
            stride = 1 + reach // ACROSS
            total = np.float32(0)
            for a in range(max(i - reach, i % stride), min(i + reach + 1, height), stride):
                for b in range(max(j - reach, j % stride), min(j + reach + 1, width), stride):
                    if abs(vergence[a, b] - vergence[r, c]) <= SAME:
                        weight = np.float32(1) / np.float32(((a - i) ** 2 + (b - j) ** 2) ** 2)
                        total += weight
                        for n in range(channels):
                            hidden[i, j, n] += weight * image[a, b, n]
            for n in range(channels):
                hidden[i, j, n] = hidden[i, j, n] / total if total > 0 else image[r, c, n]
