"""A picture with its depth as seen from beside its camera: pixels moved by their disparity, what was hidden completed.

Each row is taken by itself. Neighbouring pixels of one surface move as one strip, which is stretched or squeezed; the
nearest strip is seen. Where no strip lands something is seen that the picture does not show: the surface behind goes on
there, mirrored about the last pixel that is seen of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Warped", "monocular", "sample", "warp"]

JUMP = 1.0
"""Change of disparity in pixels from one pixel to the next above which they may be of two surfaces; a steeper slope of
one surface is known by neighbours that slope alike, to a factor of 2."""

REACH = 3
"""Pixels to each side from which light between two pixels is interpolated (Lanczos). For a shift of half a pixel its
transfer is 1.02 at 1/4 cycle a pixel and 0.76 at 3/8, where linear interpolation has 0.71 and 0.38."""

NEIGHBOURS = 1.0
"""Pixels of disparity by which a point may differ from what the other eye sees at its place and still be the same."""


class Warped(NamedTuple):
    """A view from beside the camera.

    Parameters
    ----------
    source
        Column of the picture that each pixel shows, H x W, fractional.
    is_invented
        True where the picture shows nothing for this view, so that it was completed, H x W.
    """

    source: NDArray[np.float64]
    is_invented: NDArray[np.bool_]


def warp(shift: NDArray[np.floating], nearness: NDArray[np.floating]) -> Warped:
    """Move each pixel of a picture along its row.

    Parameters
    ----------
    shift
        Pixels by which each goes to the right, H x W.
    nearness
        Which of two pixels hides the other: the greater, H x W (a vergence).

    Examples
    --------
    A near pixel goes right by 2: it hides the far pixel there, and leaves a hole to its left, which is completed.

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


def sample(
    picture: NDArray[np.floating], shift: NDArray[np.floating], source: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the picture, H x W or H x W x C, at the fractional columns `source`, each from its own surface.

    Surfaces are those that `warp` makes out by `shift`.
    """
    channels = np.ascontiguousarray(picture, np.float32).reshape(*picture.shape[:2], -1)
    found = np.empty(channels.shape, np.float32)
    _sample(channels, _joined(np.ascontiguousarray(shift, float)), source, found)
    return found.reshape(picture.shape)


def monocular(own: NDArray[np.floating], other: NDArray[np.floating], step: float, sign: int) -> NDArray[np.bool_]:
    """Return where one eye sees what is hidden from the other, or lies beyond its frame.

    Parameters
    ----------
    own, other
        Vergence in dioptres, from the plane of zero disparity, of what each eye sees, H x W.
    step
        Pixels of disparity in a dioptre.
    sign
        1 for the left eye, -1 for the right.
    """
    height, width = own.shape
    columns = np.rint(np.arange(width) - sign * step * own).astype(np.int64)
    found = other[np.arange(height)[:, None], np.clip(columns, 0, width - 1)]
    return (columns < 0) | (columns >= width) | (step * (found - own) > NEIGHBOURS)


def _joined(shift: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each pixel and its right neighbour are of one surface, H x W - 1."""
    slope = np.diff(shift, axis=1)
    padded = np.pad(slope, ((0, 0), (1, 1)))
    alike = np.zeros(slope.shape, bool)
    for beside in (padded[:, :-2], padded[:, 2:]):
        alike |= (beside * slope > 0) & (np.abs(beside) > np.abs(slope) / 2) & (np.abs(beside) < 2 * np.abs(slope))
    return (np.abs(slope) <= JUMP) | alike


@njit(nogil=True, cache=True)
def _draw(shift, nearness, joined, source):  # type: ignore[no-untyped-def]
    """Draw every strip; of two that land on a pixel the nearer stays."""
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
    """Continue the farther surface into each hole of a row, mirrored about its last pixel."""
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
def _sample(picture, joined, source, found):  # type: ignore[no-untyped-def]
    """Lanczos within the surface; beyond its end the last pixel is repeated."""
    height, width, channels = picture.shape
    weights, columns = np.empty(2 * REACH), np.empty(2 * REACH, np.int64)
    for i in range(height):
        for j in range(width):
            place = source[i, j]
            first = min(max(int(np.floor(place)), 0), width - 1)
            part = place - first
            if part == 0:
                found[i, j] = picture[i, first]
                continue
            total = 0.0
            at = first
            for n in range(REACH):  # first, then to the left
                columns[REACH - 1 - n] = at
                if at > 0 and joined[i, at - 1]:
                    at -= 1
            at = first
            for n in range(REACH):
                if at < width - 1 and joined[i, at]:
                    at += 1
                columns[REACH + n] = at
            for n in range(2 * REACH):
                x = np.pi * (part - (n - REACH + 1))
                weights[n] = np.sin(x) * np.sin(x / REACH) * REACH / (x * x) if abs(x) > 1e-6 else 1.0
                total += weights[n]
            for c in range(channels):
                light, low, high = 0.0, np.inf, -np.inf
                for n in range(2 * REACH):
                    value = picture[i, columns[n], c]
                    light += weights[n] / total * value
                    low, high = min(low, value), max(high, value)
                found[i, j, c] = min(max(light, low), high)  # without overshoot beyond what is there
