"""The pixel's own blur."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["pixel_transfer"]


def pixel_transfer(frequency_y: ArrayLike, frequency_x: ArrayLike) -> NDArray[np.float64]:
    """Transfer of a square pixel that averages the light over its whole area, in cycles per pixel; broadcasts.

    The sinc in frequency that the paper's appendix adds to blur.

    >>> round(float(pixel_transfer(0.0, 0.5)), 4)
    0.6366
    """
    return np.sinc(np.asarray(frequency_y, dtype=float)) * np.sinc(np.asarray(frequency_x, dtype=float))
