"""Cropping of photographs of unequal size to their common field."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.photographs.photograph import Photograph

__all__ = ["cropped"]

COARSE_SIDE_PX = 240
"""Shorter side in pixels of the images that are registered first."""

MIN_CORRELATION = 0.6
"""Minimum correlation of two images of the same scene: with different blur, texture retains 0.8 and more."""

MAX_EXCESS_FRACTION = 0.35
"""Maximum fraction of a side by which one image may extend beyond another."""


def cropped(photographs: Sequence[Photograph]) -> list[Photograph]:
    """Return the common part of all `photographs`, accurate to some pixels; alignment removes the rest.

    Raises
    ------
    InputError
        If one does not show the smallest one's scene at the same scale: it was resized, or shows another scene.
    """
    smallest = min(photographs, key=lambda photograph: photograph.luminance.size)
    height, width = smallest.luminance.shape
    places = [_place(photograph, smallest) for photograph in photographs]
    # The pixels of each that lie over the smallest, then those present in all.
    top, left = (max(0, *(-place[axis] for place in places)) for axis in (0, 1))
    sizes = [photograph.luminance.shape for photograph in photographs]
    bottom = min(height, *(size[0] - place[0] for size, place in zip(sizes, places, strict=True)))
    right = min(width, *(size[1] - place[1] for size, place in zip(sizes, places, strict=True)))
    result = []
    for photograph, (down, across) in zip(photographs, places, strict=True):
        part = np.s_[top + down : bottom + down, left + across : right + across]
        mask = None if photograph.mask is None else np.ascontiguousarray(photograph.mask[part])
        luminance = np.ascontiguousarray(photograph.luminance[part])
        result.append(replace(photograph, luminance=luminance, mask=mask))
    return result


def _place(photograph: Photograph, smallest: Photograph) -> tuple[int, int]:
    """Return row and column in `photograph` of the first pixel of `smallest`."""
    if photograph.luminance.shape == smallest.luminance.shape:
        return 0, 0  # remaining shifts are removed by alignment
    factor = max(1, min(smallest.luminance.shape) // COARSE_SIDE_PX)
    small, large = (_shrunk(one.luminance, factor) for one in (smallest, photograph))
    rim = [int(np.ceil(MAX_EXCESS_FRACTION / 2 * n)) for n in small.shape]
    inner = small[rim[0] : -rim[0], rim[1] : -rim[1]]
    if any(n > m for n, m in zip(inner.shape, large.shape, strict=True)):
        raise _unrelated(photograph, smallest)
    found = cv2.matchTemplate(large, np.ascontiguousarray(inner), cv2.TM_CCOEFF_NORMED)
    row, column = np.unravel_index(int(np.argmax(found)), found.shape)
    if found[row, column] < MIN_CORRELATION:
        raise _unrelated(photograph, smallest)
    return factor * (int(row) - rim[0]), factor * (int(column) - rim[1])


def _shrunk(image: NDArray[np.float32], factor: int) -> NDArray[np.float32]:
    """Return an image averaged over squares and smoothed, which reduces differences in blur."""
    height, width = (n // factor * factor for n in image.shape)
    size = (width // factor, height // factor)
    small = cv2.resize(image[:height, :width], size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 1.5), np.float32)


def _unrelated(photograph: Photograph, smallest: Photograph) -> InputError:
    return InputError(
        f"{photograph.path} and {smallest.path} differ in size and do not show one scene at one scale, so that they "
        "cannot be cropped to a common field: export them at the same size in pixels, without resizing."
    )
