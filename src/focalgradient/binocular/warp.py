"""Warping of a picture with depth to another viewpoint: pixels shifted by disparity, disocclusions inpainted.

Rows are processed independently. Neighbouring pixels on one surface move as one strip, stretched or compressed; the
nearest strip is visible. Pixels that no strip covers are disoccluded: the farther surface is continued there by
mirroring about its last visible pixel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray, Mask

__all__ = ["Warped", "monocular", "sample", "warp"]

MAX_DISPARITY_STEP = 1.0
"""Disparity difference (px) between neighbouring pixels above which they may belong to two surfaces; a steep slope of
one surface is recognised by neighbours of similar slope (within a factor of 2)."""

KERNEL_HALF_WIDTH = 3
"""Half-width in pixels of the Lanczos interpolation kernel. At a shift of half a pixel its transfer is 1.02 at 1/4
cycle per pixel and 0.76 at 3/8 (linear interpolation: 0.71 and 0.38)."""

MAX_DISPARITY_MISMATCH = 1.0
"""Maximum disparity difference (px) at which the two eyes are taken to see the same point."""


class Warped(NamedTuple):
    """A picture warped to another viewpoint.

    Parameters
    ----------
    source
        Fractional column of the picture that each pixel shows, H x W.
    is_invented
        True where the picture does not show what this view sees, so that it was inpainted, H x W.
    """

    source: FloatArray
    is_invented: Mask


def warp(shift: NDArray[np.floating], nearness: NDArray[np.floating]) -> Warped:
    """Shift each pixel of a picture along its row.

    Parameters
    ----------
    shift
        Rightward shift of each pixel in pixels, H x W.
    nearness
        Vergence, H x W, which decides occlusion: the larger value is visible.

    Examples
    --------
    A near pixel shifted right by 2 occludes the far pixel there, and leaves a hole, which is inpainted.

    >>> shift = np.array([[0.0, 0, 2, 0, 0, 0]])
    >>> found = warp(shift, shift)
    >>> found.source.tolist(), found.is_invented.astype(int).tolist()
    ([[0.0, 1.0, 1.0, 3.0, 2.0, 5.0]], [[0, 0, 1, 0, 0, 0]])
    """
    moved = np.ascontiguousarray(shift, float)
    joined = _joined(moved)
    source = np.full(moved.shape, np.nan)
    _draw(moved, np.ascontiguousarray(nearness, float), joined, source)
    is_invented = np.isnan(source)
    _fill(source, np.ascontiguousarray(nearness, float), joined)
    return Warped(source, is_invented)


def sample(picture: NDArray[np.floating], shift: NDArray[np.floating], source: FloatArray) -> NDArray[np.float32]:
    """Return the picture, H x W or H x W x C, at the fractional columns `source`, each interpolated on its surface.

    Surfaces are segmented by `shift`, as in `warp`.
    """
    channels = np.ascontiguousarray(picture, np.float32).reshape(*picture.shape[:2], -1)
    sampled = np.empty(channels.shape, np.float32)
    _sample(channels, _joined(np.ascontiguousarray(shift, float)), source, sampled)
    return sampled.reshape(picture.shape)


def monocular(own: NDArray[np.floating], other: NDArray[np.floating], step: float, sign: int) -> Mask:
    """Return True where one eye sees a place that is occluded from the other eye or outside its frame.

    Parameters
    ----------
    own, other
        Vergence in dioptres relative to the plane of zero disparity, as seen by each eye, H x W.
    step
        Disparity in pixels per dioptre.
    sign
        1 for the left eye, -1 for the right.
    """
    height, width = own.shape
    columns = np.rint(np.arange(width) - sign * step * own).astype(np.int64)
    facing = other[np.arange(height)[:, None], np.clip(columns, 0, width - 1)]
    return (columns < 0) | (columns >= width) | (step * (facing - own) > MAX_DISPARITY_MISMATCH)


def _joined(shift: FloatArray) -> Mask:
    """Return whether each pixel and its right neighbour belong to one surface, H x W - 1."""
    slope = np.diff(shift, axis=1)
    padded = np.pad(slope, ((0, 0), (1, 1)))
    alike = np.zeros(slope.shape, bool)
    for beside in (padded[:, :-2], padded[:, 2:]):
        alike |= (beside * slope > 0) & (np.abs(beside) > np.abs(slope) / 2) & (np.abs(beside) < 2 * np.abs(slope))
    return (np.abs(slope) <= MAX_DISPARITY_STEP) | alike


@njit(nogil=True, cache=True)
def _draw(shift, nearness, joined, source):  # type: ignore[no-untyped-def]
    """Draw all strips; where two overlap, keep the nearer."""
    height, width = shift.shape
    depth = np.full(width, -np.inf)
    for i in range(height):
        depth[:] = -np.inf
        for j in range(width):
            here = j + shift[i, j]
            after = j < width - 1 and joined[i, j]
            before = j > 0 and joined[i, j - 1]
            left = here if before else here - 0.5
            right = j + 1 + shift[i, j + 1] if after else here + 0.5
            if before and not after:
                left = here
            for column in range(max(0, int(np.ceil(left))), min(width - 1, int(np.floor(right))) + 1):
                if column >= here and after:
                    length = right - here
                    share = (column - here) / length if length > 0 else 0.0
                    near = nearness[i, j] + share * (nearness[i, j + 1] - nearness[i, j])
                    place = j + share
                else:
                    if column == here + 0.5:
                        continue
                    near, place = nearness[i, j], float(j)
                if near > depth[column]:
                    depth[column], source[i, column] = near, place


@njit(nogil=True, cache=True)
def _fill(source, nearness, joined):  # type: ignore[no-untyped-def]
    """Inpaint each hole of a row with the farther surface, mirrored about its last visible pixel."""
    height, width = source.shape
    for i in range(height):
        row = source[i].copy()
        j = 0
        while j < width:
            if row[j] == row[j]:
                j += 1
                continue
            end = j
            while end < width and row[end] != row[end]:
                end += 1
            left, right = j - 1, end
            from_left = left >= 0
            if from_left and right < width:
                from_left = nearness[i, round(row[left])] <= nearness[i, round(row[right])]
            edge, way = (left, -1) if from_left else (right, 1)
            if 0 <= edge < width:
                last = edge
                for step in range(1, end - j + 1):
                    near = edge + way * (step - 1)
                    if 0 <= near < width and row[near] == row[near]:
                        a, b = sorted((round(row[last]), round(row[near])))
                        same = True
                        for column in range(a, b):
                            same = same and joined[i, column]
                        if same:
                            last = near
                    source[i, edge - way * step] = row[last]
            else:
                for column in range(j, end):
                    source[i, column] = column
            j = end


@njit(nogil=True, cache=True)
def _sample(picture, joined, source, sampled):  # type: ignore[no-untyped-def]
    """Interpolate by Lanczos within each surface, repeating its last pixel beyond its edge."""
    height, width, channels = picture.shape
    weights, columns = np.empty(2 * KERNEL_HALF_WIDTH), np.empty(2 * KERNEL_HALF_WIDTH, np.int64)
    for i in range(height):
        for j in range(width):
            place = source[i, j]
            first = min(max(int(np.floor(place)), 0), width - 1)
            part = place - first
            if part == 0:
                sampled[i, j] = picture[i, first]
                continue
            total = 0.0
            at = first
            for n in range(KERNEL_HALF_WIDTH):  # first, then to the left
                columns[KERNEL_HALF_WIDTH - 1 - n] = at
                if at > 0 and joined[i, at - 1]:
                    at -= 1
            at = first
            for n in range(KERNEL_HALF_WIDTH):
                if at < width - 1 and joined[i, at]:
                    at += 1
                columns[KERNEL_HALF_WIDTH + n] = at
            for n in range(2 * KERNEL_HALF_WIDTH):
                x = np.pi * (part - (n - KERNEL_HALF_WIDTH + 1))
                weights[n] = (
                    np.sin(x) * np.sin(x / KERNEL_HALF_WIDTH) * KERNEL_HALF_WIDTH / (x * x) if abs(x) > 1e-6 else 1.0
                )
                total += weights[n]
            for c in range(channels):
                light, low, high = 0.0, np.inf, -np.inf
                for n in range(2 * KERNEL_HALF_WIDTH):
                    value = picture[i, columns[n], c]
                    light += weights[n] / total * value
                    low, high = min(low, value), max(high, value)
                sampled[i, j, c] = min(max(light, low), high)  # clipped to the neighbours' range: no overshoot
