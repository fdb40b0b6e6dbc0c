"""What the blur alone predicts: the pinhole picture, gathered along the rays of a lens through the relief of its depth.

In vergence a ray of the lens is straight: where it passes the vergence V it lies over the place

    p(V) = p + a (Vf - V) / pixel angle

of the pinhole picture, p being its pixel and a where it crosses the lens. So the picture with its depth is a relief,
and the light of the ray is that of the place where it dives below the surface. Occlusion comes out right, but for what
the pinhole did not see: behind an edge the ray goes on until it meets something, or else takes the light of the last
place clear of the edge. No ray of the renderer has a part in this.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["predicted"]

RAYS = 12  # of a pixel
STEP = 0.7  # pixels of the ray's way over the picture
THICK = 0.05  # dioptres below a surface where a ray still meets it, and does not pass behind its edge; longest step
GOLDEN = math.pi * (3 - math.sqrt(5))
THREADS = min(8, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath={"contract"})


def predicted(
    picture: NDArray[np.floating],
    depth: NDArray[np.floating],
    aperture: float,
    focus: float,
    pixel_angle: float,
    seed: int = 0,
) -> NDArray[np.float32]:
    """The picture that a lens makes of what a pinhole saw.

    Parameters
    ----------
    picture
        Through the pinhole, H x W, linear.
    depth
        Of each of its pixels in metres, H x W; may be ``inf``.
    aperture
        Diameter of the lens in metres.
    focus
        Its focus vergence in dioptres.
    pixel_angle
        Angle in radians of a pixel.
    seed
        Of the few rays of each pixel: they leave noise, which differs with the seed.

    Returns
    -------
    ndarray
        H x W. The picture goes on beyond the frame as it is at its rim, so that a rim as wide as the blur is not right.

    Examples
    --------
    A step, half a dioptre beyond the focus of a lens of 10 mm: 5 px wide.

    >>> step = np.repeat([[0.0, 1.0]], 16, axis=1).repeat(400, axis=0)
    >>> blurred = predicted(step, np.full((400, 32), 2.0), aperture=0.01, focus=1.0, pixel_angle=1e-3)
    >>> (100 * blurred.mean(axis=0)[12:20]).round(-1).astype(int).tolist()  # the rays of a pixel make noise
    [0, 0, 10, 40, 60, 90, 100, 100]
    """
    image = np.ascontiguousarray(picture, np.float32)
    vergence = np.ascontiguousarray(1 / np.asarray(depth, float))
    near, far = float(vergence.max()), float(vergence.min())
    result = np.empty_like(image)
    pieces = np.linspace(0, len(image), 4 * THREADS + 1).astype(int)
    with ThreadPoolExecutor(THREADS) as pool:
        rest = [
            pool.submit(
                _gather, image, vergence, aperture / 2 / pixel_angle, focus, near, far, start, end, seed, result
            )
            for start, end in pairwise(pieces)
        ]
        for piece in rest:
            piece.result()
    return result


@_compiled
def _gather(image, vergence, radius, focus, near, far, start, end, seed, result):  # type: ignore[no-untyped-def]
    """Fill rows `start` to `end`; the lens's `radius` is in pixels per dioptre."""
    for row in range(start, end):
        for column in range(image.shape[1]):
            # Each pixel turns the pattern of rays by another angle, so that its gaps leave noise and no false detail.
            mixed = (row * 73856093) ^ (column * 19349663) ^ (seed * 83492791)
            mixed = ((mixed ^ (mixed >> 13)) * 1274126177) & 0xFFFFFFFF
            mixed = ((mixed ^ (mixed >> 16)) * 1664525 + 1013904223) & 0xFFFFFFFF
            turn = 2 * math.pi * mixed / 4294967296.0
            total = 0.0
            for ray in range(RAYS):
                length = radius * math.sqrt((ray + 0.5) / RAYS)
                angle = ray * GOLDEN + turn
                total += _met(
                    image, vergence, row, column, length * math.cos(angle), length * math.sin(angle), focus, near, far
                )
            result[row, column] = total / RAYS


@_compiled
def _met(image, vergence, row, column, ax, ay, focus, near, far):  # type: ignore[no-untyped-def]
    """Light of the place where a ray that leaves the lens at (ax, ay), in pixels per dioptre, meets the relief."""
    steps = 1 + math.ceil((near - far) * max(math.hypot(ax, ay) / STEP, 1 / THICK))
    change = (near - far) / steps
    last = at = near  # the last step over the surface, and the one before: clear of pixels that an edge divides
    above = math.inf  # of the last step over the surface; 0 behind it
    for step in range(steps + 1):
        v = near - step * change
        y = min(max(round(row + ay * (focus - v)), 0), image.shape[0] - 1)
        x = min(max(round(column + ax * (focus - v)), 0), image.shape[1] - 1)
        gap = v - vergence[y, x]
        if gap > 1e-9:  # the last step ends at the farthest place but for rounding
            above, last, at = gap, v, last
        elif above == math.inf or -gap <= change + THICK:
            # Between two steps the surface is taken as flat.
            at = v + change * (gap / (gap - above) if 0 < above < math.inf else 0.0)
            break
        else:
            above = 0.0
    return _cubic(image, row + ay * (focus - at), column + ax * (focus - at))


@_compiled
def _cubic(image, y, x):  # type: ignore[no-untyped-def]
    """The image between its pixels, by the cubic convolution that is exact for parabolas."""
    top, left = math.floor(y), math.floor(x)
    v, u = y - top, x - left
    total = 0.0
    for i in range(4):
        row = image[min(max(top + i - 1, 0), image.shape[0] - 1)]
        across = 0.0
        for j in range(4):
            across += _weight(j, u) * row[min(max(left + j - 1, 0), image.shape[1] - 1)]
        total += _weight(i, v) * across
    return total


@_compiled
def _weight(index, t):  # type: ignore[no-untyped-def]
    if index == 0:
        return ((-0.5 * t + 1.0) * t - 0.5) * t
    if index == 1:
        return (1.5 * t - 2.5) * t * t + 1.0
    if index == 2:
        return ((-1.5 * t + 2.0) * t + 0.5) * t
    return (0.5 * t - 0.5) * t * t
