"""What an outline hides: completed from the surface behind it.

A lens looks round an outline, where the pinhole that took the picture could not. Each pixel of a near surface beside
which a ray of the lens can pass is given a second, hidden point behind it: at the vergence of the nearest visible part
of the surface behind, with the light of its surroundings on that surface. What is hidden cannot be known; their mean is
the guess with the least error.

Vergence is in pixels here: vergence x half the aperture / the pixel's angle. Two surfaces shift against each other by
the difference of theirs between the middle of the lens and its rim, and a disc of blur has as radius the difference to
the focus. A ray of the lens moves by at most one pixel for a pixel of vergence, so that the lens sees all of a surface
whose slope is less than 1, and passes beside a steeper one as far as the *cone* of slope 1 from the surface behind
reaches under it. The share of the lens that does so goes to zero with the jump: there is no threshold.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from focalgradient.parallel import share_rows
from focalgradient.render.mixed import LEAST, NOTHING, parted
from focalgradient.render.visibility import CELL, highest

__all__ = ["NOTHING", "ceiling", "complete", "nearest_behind", "surfaces"]

EDGE = 0.5
"""Pixels from the middle of a pixel of the surface behind to its edge, beyond which all is hidden."""

AROUND = 6
"""Pixels beyond the nearest visible place from which light is taken."""

ACROSS = 12
"""Places, from the middle to the rim of the surroundings, at which light is taken: wider ones are sampled."""

BLOCKS = 8
"""Blocks of rows for each thread, as outlines are not spread evenly."""

STRAIGHT, DIAGONAL = math.cos(math.pi / 8), math.sqrt(2) * math.cos(math.pi / 8)
"""Lengths of a step to the next pixel that make the way along steps nowhere longer than the straight one."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)

FloatImage = NDArray[np.float32]


def complete(
    image: FloatImage, vergence: FloatImage, before: FloatImage | None = None
) -> tuple[FloatImage, FloatImage]:
    """Light (H x W x channels) and vergence (H x W) of the points hidden behind near surfaces that a lens can see.

    `vergence` is in pixels, and `before` that of what hides, where it is not the same; where nothing is hidden the
    vergence of the hidden points is `NOTHING`.
    """
    before = vergence if before is None else before
    row, column = nearest_behind(vergence, before)
    hidden = np.zeros(image.shape, np.float32)
    behind = np.empty(vergence.shape, np.float32)
    share_rows(len(vergence), partial(_fill, image, vergence, before, row, column, hidden, behind), each=BLOCKS)
    return hidden, behind


def surfaces(
    image: FloatImage, vergence: FloatImage
) -> tuple[tuple[FloatImage, FloatImage, FloatImage], tuple[FloatImage, FloatImage, FloatImage]]:
    """Light, vergence and share of each pixel covered: of what a picture shows, and of what lies behind it."""
    light, near, cover, shown, far = parted(image, vergence)
    parts, uncovered = far > NOTHING, far == vergence
    hidden, behind = complete(np.where(uncovered[:, :, None], shown, light), vergence, near)
    hidden[parts], behind[parts] = shown[parts], far[parts]
    fading = np.clip(near - behind - np.float32(LEAST), 0, 1)
    return (light, near, cover), (hidden, behind, np.where(uncovered, np.float32(1), fading))


@_compiled
def ceiling(vergence):  # type: ignore[no-untyped-def]
    """Upper envelope of slope 1: the highest cone that stands on a pixel's vergence, or a little above it."""
    height, width = vergence.shape
    found = vergence.copy()
    for sweep in range(2):
        down = 1 if sweep == 0 else -1
        for line in range(height):
            i = line if down == 1 else height - 1 - line
            for place in range(width):
                j = place if down == 1 else width - 1 - place
                best = found[i, j]
                a = i - down
                if 0 <= a < height:
                    best = max(best, found[a, j] - np.float32(STRAIGHT))
                    if j > 0:
                        best = max(best, found[a, j - 1] - np.float32(DIAGONAL))
                    if j < width - 1:
                        best = max(best, found[a, j + 1] - np.float32(DIAGONAL))
                b = j - down
                if 0 <= b < width:
                    best = max(best, found[i, b] - np.float32(STRAIGHT))
                found[i, j] = best
    return found


def nearest_behind(
    vergence: FloatImage, before: FloatImage | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Row and column of the nearest visible pixel behind each whose cone reaches under it; -1 where there is none."""
    before = vergence if before is None else before
    row, column = np.full((2, *vergence.shape), -1, np.int32)
    under = binary_dilation(ceiling(-vergence) > -before, np.ones((3, 3), bool))
    share_rows(len(vergence), partial(_find, vergence, before, under, -highest(-vergence), row, column), each=BLOCKS)
    return row, column


@_compiled
def _find(vergence, before, under, lowest, row, column, first, last):  # type: ignore[no-untyped-def]
    """Look for them in the cells of the picture that go deep enough, from near to far."""
    height, width = vergence.shape
    deepest = lowest.min()
    for i in range(first, last):
        for j in range(width):
            if not under[i, j]:
                continue
            here = before[i, j]
            best = (here - deepest + np.float32(EDGE)) ** 2
            reach = int(here - deepest + 1) // CELL + 1
            for ring in range(reach + 1):
                if ring > 1 and ((ring - 1) * CELL) ** 2 > best:
                    break
                for p in range(i // CELL - ring, i // CELL + ring + 1):
                    if p < 0 or p >= lowest.shape[0]:
                        continue
                    for q in range(j // CELL - ring, j // CELL + ring + 1):
                        if q < 0 or q >= lowest.shape[1] or max(abs(p - i // CELL), abs(q - j // CELL)) < ring:
                            continue
                        down = max(max(p * CELL - i, i - (p * CELL + CELL - 1)), 0)
                        aside = max(max(q * CELL - j, j - (q * CELL + CELL - 1)), 0)
                        jump, away = here - lowest[p, q] + np.float32(EDGE), down * down + aside * aside
                        if away >= best or jump <= EDGE or jump * jump <= away:
                            continue
                        for a in range(p * CELL, min(p * CELL + CELL, height)):
                            for b in range(q * CELL, min(q * CELL + CELL, width)):
                                jump, away = here - vergence[a, b] + np.float32(EDGE), (a - i) ** 2 + (b - j) ** 2
                                if away < best and jump > EDGE and jump * jump > away and away > 0:
                                    best = away
                                    row[i, j], column[i, j] = a, b


@_compiled
def _fill(image, vergence, before, row, column, hidden, behind, first, last):  # type: ignore[no-untyped-def]
    """Fill in the mean light of the surface behind, weighted by 1 / distance^4, in rows `first` to `last`."""
    height, width, channels = image.shape
    for i in range(first, last):
        for j in range(width):
            r, c = row[i, j], column[i, j]
            if r < 0:
                behind[i, j] = NOTHING
                continue
            reach = int(math.sqrt((r - i) ** 2 + (c - j) ** 2)) + AROUND
            stride = 1 + reach // ACROSS
            total, mean = np.float32(0), np.float32(0)
            for a in range((max(i - reach, 0) + stride - 1) // stride * stride, min(i + reach + 1, height), stride):
                for b in range((max(j - reach, 0) + stride - 1) // stride * stride, min(j + reach + 1, width), stride):
                    jump = before[i, j] - vergence[a, b] + np.float32(EDGE)
                    if jump <= EDGE:
                        continue
                    away = np.float32((a - i) ** 2 + (b - j) ** 2)
                    if jump * jump > away:
                        weight = (np.float32(1) - np.sqrt(away) / jump) ** 2 / (away * away)
                        total += weight
                        mean += weight * vergence[a, b]
                        for n in range(channels):
                            hidden[i, j, n] += weight * image[a, b, n]
            behind[i, j] = mean / total if total > 0 else vergence[r, c]
            for n in range(channels):
                hidden[i, j, n] = hidden[i, j, n] / total if total > 0 else image[r, c, n]
