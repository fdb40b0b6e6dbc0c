"""Names of the types of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["FloatArray", "FloatImage"]

FloatArray = NDArray[np.float64]
FloatImage = NDArray[np.float32]
