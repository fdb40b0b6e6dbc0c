"""Photographs of unequal size, cropped to what all of them show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.photographs.images import Photograph

__all__ = ["cropped"]

COARSE = 240
"""Shorter side in pixels of the images that are laid over each other at first."""

ALIKE = 0.6
"""Correlation from which two images show the same: texture that is blurred differently keeps 0.8 and more."""

MOST_CUT = 0.35
"""Share of a side that one image may show more than another."""


def cropped(photographs: Sequence[Photograph]) -> list[Photograph]:
    """The part that all `photographs` show, to some pixels, of each: aligning removes what is left.

    Raises
    ------
    InputError
        If one does not show what the smallest shows at the same scale: it was resized, or shows another scene.
    """
    smallest = min(photographs, key=lambda photograph: photograph.luminance.size)
    height, width = smallest.luminance.shape
    places = [_place(photograph, smallest) for photograph in photographs]
    # Of each, the pixels that lie over the smallest; then those that are there in all.
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
    """Row and column in `photograph` of the first pixel of `smallest`."""
    if photograph.luminance.shape == smallest.luminance.shape:
        return 0, 0  # what is left of a shift is the alignment's
    factor = max(1, min(smallest.luminance.shape) // COARSE)
    small, large = (_shrunk(one.luminance, factor) for one in (smallest, photograph))
    rim = [int(np.ceil(MOST_CUT / 2 * n)) for n in small.shape]
    inner = small[rim[0] : -rim[0], rim[1] : -rim[1]]
    if any(n > m for n, m in zip(inner.shape, large.shape, strict=True)):
        raise _apart(photograph, smallest)
    found = cv2.matchTemplate(large, np.ascontiguousarray(inner), cv2.TM_CCOEFF_NORMED)
    row, column = np.unravel_index(int(np.argmax(found)), found.shape)
    if found[row, column] < ALIKE:
        raise _apart(photograph, smallest)
    return factor * (int(row) - rim[0]), factor * (int(column) - rim[1])


def _shrunk(image: NDArray[np.float32], factor: int) -> NDArray[np.float32]:
    """Averaged over squares, and smoothed, for a difference of blur not to matter."""
    height, width = (n // factor * factor for n in image.shape)
    size = (width // factor, height // factor)
    small = cv2.resize(image[:height, :width], size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 1.5), np.float32)


def _apart(photograph: Photograph, smallest: Photograph) -> InputError:
    return InputError(
        f"{photograph.path} and {smallest.path} differ in size, and do not show one scene at one scale, so that "
        "cropping does not make them alike: export them with the same size in pixels, not resized."
    )
