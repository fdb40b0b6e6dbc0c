"""Trace occlusion boundaries as curves between near and far pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["curves"]

SHORTEST = 8
"""Length in points up to which a curve is dropped: about a window. Chosen by hand."""

Point = tuple[int, int]


def curves(side: NDArray[np.int8]) -> list[list[list[float]]]:
    """Return the curves between pixels where `side` (H x W) is 1 and where it is -1.

    The near side (1) lies to the right of the way along a curve. Each is a list of points (column, row), in pixels from
    the first pixel's centre, midway between two pixels.

    >>> side = np.ones((10, 4), np.int8)
    >>> side[:, 2:] = -1
    >>> curves(side)[0][:2]
    [[1.5, 0.0], [1.5, 1.0]]
    """
    # Borders between pixels, from corner to corner; corner (i, j) is the upper left one of pixel (i, j).
    follows: dict[Point, list[Point]] = {}
    for axis in (0, 1):
        first, second = ((slice(None),) * axis + (part,) for part in (slice(-1), slice(1, None)))
        for i, j in np.argwhere(side[first] * side[second] < 0).tolist():
            start, end = ((i + 1, j), (i + 1, j + 1)) if axis == 0 else ((i + 1, j + 1), (i, j + 1))
            if side[i, j] > 0:
                start, end = end, start
            follows.setdefault(start, []).append(end)
    ends = {end for some in follows.values() for end in some}
    found = []
    for start in [point for point in follows if point not in ends] + list(follows):
        corners = [start]
        while follows.get(corners[-1]):
            corners.append(follows[corners[-1]].pop())
        if len(corners) > SHORTEST:
            place = np.array(corners, float)[:, ::-1] - 0.5
            found.append(((place[1:] + place[:-1]) / 2).tolist())
    return found
