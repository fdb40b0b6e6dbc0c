"""Inpainting of surfaces hidden behind occlusion boundaries.

A lens sees around an occlusion boundary, which the pinhole that took the picture could not. Each pixel of a near
surface past which rays of the lens can travel is given a second, hidden point behind it: at the vergence of the nearest
visible part of the farther surface, with the mean radiance of its surroundings on that surface. Hidden texture is
unknown; the mean minimises the expected error.

Vergence here is in pixels: vergence x half the aperture / pixel angle. The parallax between two surfaces, from the
centre of the lens to its rim, equals the difference of their vergences, and a blur disc's radius equals the difference
from the focus. Along a ray of the lens the image position changes by at most one pixel per pixel of vergence: the whole
lens sees a surface with slope below 1, and sees past a steeper one as far as the *cone* of slope 1 from the surface
behind extends under it. The part of the lens that does so goes to zero with the depth discontinuity: there is no
threshold.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from focalgradient.arrays import FloatImage
from focalgradient.loops import reordered
from focalgradient.parallel import share_rows
from focalgradient.render.mixed import NOTHING, SAME_SURFACE_PX, parted
from focalgradient.render.visibility import CELL, highest

__all__ = ["NOTHING", "ceiling", "complete", "nearest_behind", "surfaces"]

HALF_PIXEL = 0.5
"""Distance in pixels from the centre of a pixel of the surface behind to its edge, beyond which all is hidden."""

NEIGHBOURHOOD_PX = 6
"""Radius in pixels, beyond the nearest visible pixel, of the neighbourhood whose radiance is averaged."""

MAX_SAMPLES = 12
"""Maximum number of samples from the centre to the rim of the neighbourhood; wider ones are subsampled."""

BLOCKS_PER_THREAD = 8
"""Blocks of rows per thread, to balance the load of unevenly distributed occlusion boundaries."""

STRAIGHT_STEP, DIAGONAL_STEP = math.cos(math.pi / 8), math.sqrt(2) * math.cos(math.pi / 8)
"""Lengths of steps to neighbouring pixels for which path length never exceeds the straight-line distance."""


def complete(
    image: FloatImage, vergence: FloatImage, before: FloatImage | None = None
) -> tuple[FloatImage, FloatImage]:
    """Return radiance (H x W x channels) and vergence (H x W) of hidden points that the lens can see.

    `vergence` is in pixels; `before`, if given, is the vergence of the occluding surface. Where nothing is hidden,
    the vergence of the hidden points is `NOTHING`.
    """
    before = vergence if before is None else before
    row, column = nearest_behind(vergence, before)
    hidden = np.zeros(image.shape, np.float32)
    behind = np.empty(vergence.shape, np.float32)
    share_rows(
        len(vergence), partial(_fill, image, vergence, before, row, column, hidden, behind), each=BLOCKS_PER_THREAD
    )
    return hidden, behind


def surfaces(
    image: FloatImage, vergence: FloatImage
) -> tuple[tuple[FloatImage, FloatImage, FloatImage], tuple[FloatImage, FloatImage, FloatImage]]:
    """Return radiance, vergence and coverage per pixel: of the visible surface, and of the surface behind it."""
    light, near, cover, shown, far = parted(image, vergence)
    parts, uncovered = far > NOTHING, far == vergence
    hidden, behind = complete(np.where(uncovered[:, :, None], shown, light), vergence, near)
    hidden[parts], behind[parts] = shown[parts], far[parts]
    fading = np.clip(near - behind - np.float32(SAME_SURFACE_PX), 0, 1)
    return (light, near, cover), (hidden, behind, np.where(uncovered, np.float32(1), fading))


@reordered
def ceiling(vergence):  # type: ignore[no-untyped-def]
    """Return the upper envelope of cones of slope 1 that stand on the pixels' vergences (never below it)."""
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
                    best = max(best, found[a, j] - np.float32(STRAIGHT_STEP))
                    if j > 0:
                        best = max(best, found[a, j - 1] - np.float32(DIAGONAL_STEP))
                    if j < width - 1:
                        best = max(best, found[a, j + 1] - np.float32(DIAGONAL_STEP))
                b = j - down
                if 0 <= b < width:
                    best = max(best, found[i, b] - np.float32(STRAIGHT_STEP))
                found[i, j] = best
    return found


def nearest_behind(
    vergence: FloatImage, before: FloatImage | None = None
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return row and column of the nearest visible farther pixel whose cone extends under each pixel; else -1."""
    before = vergence if before is None else before
    row, column = np.full((2, *vergence.shape), -1, np.int32)
    under = binary_dilation(ceiling(-vergence) > -before, np.ones((3, 3), bool))
    share_rows(
        len(vergence), partial(_find, vergence, before, under, -highest(-vergence), row, column), each=BLOCKS_PER_THREAD
    )
    return row, column


@reordered
def _find(vergence, before, under, lowest, row, column, first, last):  # type: ignore[no-untyped-def]
    """Search for these pixels, from near to far, in those cells of the picture that are deep enough."""
    height, width = vergence.shape
    deepest = lowest.min()
    for i in range(first, last):
        for j in range(width):
            if not under[i, j]:
                continue
            here = before[i, j]
            best = (here - deepest + np.float32(HALF_PIXEL)) ** 2
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
                        jump, away = here - lowest[p, q] + np.float32(HALF_PIXEL), down * down + aside * aside
                        if away >= best or jump <= HALF_PIXEL or jump * jump <= away:
                            continue
                        for a in range(p * CELL, min(p * CELL + CELL, height)):
                            for b in range(q * CELL, min(q * CELL + CELL, width)):
                                jump, away = here - vergence[a, b] + np.float32(HALF_PIXEL), (a - i) ** 2 + (b - j) ** 2
                                if away < best and jump > HALF_PIXEL and jump * jump > away and away > 0:
                                    best = away
                                    row[i, j], column[i, j] = a, b


@reordered
def _fill(image, vergence, before, row, column, hidden, behind, first, last):  # type: ignore[no-untyped-def]
    """Fill rows `first` to `last` with the mean radiance of the surface behind, weighted by 1 / distance^4."""
    height, width, channels = image.shape
    for i in range(first, last):
        for j in range(width):
            r, c = row[i, j], column[i, j]
            if r < 0:
                behind[i, j] = NOTHING
                continue
            reach = int(math.sqrt((r - i) ** 2 + (c - j) ** 2)) + NEIGHBOURHOOD_PX
            stride = 1 + reach // MAX_SAMPLES
            total, mean = np.float32(0), np.float32(0)
            for a in range((max(i - reach, 0) + stride - 1) // stride * stride, min(i + reach + 1, height), stride):
                for b in range((max(j - reach, 0) + stride - 1) // stride * stride, min(j + reach + 1, width), stride):
                    jump = before[i, j] - vergence[a, b] + np.float32(HALF_PIXEL)
                    if jump <= HALF_PIXEL:
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
