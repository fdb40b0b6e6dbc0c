"""The sRGB transfer function (IEC 61966-2-1) and its inverse."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["linear_to_srgb", "srgb_to_linear"]


def srgb_to_linear(value: ArrayLike) -> NDArray[np.float64]:
    """Decode sRGB values (IEC 61966-2-1) to linear radiance: `value` and result from 0 to 1, any shape.

    >>> srgb_to_linear([0, 0.04045, 0.5, 1]).round(5).tolist()
    [0.0, 0.00313, 0.21404, 1.0]
    """
    value = np.asarray(value, dtype=float)
    return np.where(value <= 0.04045, value / 12.92, ((np.maximum(value, 0) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(light: NDArray[np.floating]) -> NDArray[np.floating]:
    """Encode linear radiance as sRGB (IEC 61966-2-1): `light` and result from 0 to 1, any shape, same dtype.

    >>> linear_to_srgb(np.array([0, 0.00313, 0.21404, 1])).round(3).tolist()
    [0.0, 0.04, 0.5, 1.0]
    """
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
