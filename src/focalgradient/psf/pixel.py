"""Blur of the pixel aperture."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["PIXEL_VARIANCE", "pixel_transfer"]

PIXEL_VARIANCE = 1 / 12
"""Variance of the square pixel aperture along an axis (px^2)."""


def pixel_transfer(frequency_y: ArrayLike, frequency_x: ArrayLike) -> NDArray[np.float64]:
    """Return the transfer of a square pixel aperture; frequencies in cycles per pixel; broadcasts.

    The sinc function that the paper's appendix multiplies by the transfer of the blur.

    >>> round(float(pixel_transfer(0.0, 0.5)), 4)
    0.6366
    """
    return np.sinc(np.asarray(frequency_y, dtype=float)) * np.sinc(np.asarray(frequency_x, dtype=float))
