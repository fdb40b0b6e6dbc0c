"""Names of the types of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["FloatArray", "FloatImage", "Mask"]

FloatArray = NDArray[np.float64]
FloatImage = NDArray[np.float32]
Mask = NDArray[np.bool_]
