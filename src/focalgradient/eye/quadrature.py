"""Gauss-Legendre quadrature in panels, accurate to rounding for oscillations of known total phase (radians)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from focalgradient.arrays import FloatArray

__all__ = ["gauss", "panels"]

ORDER = 48
"""Nodes in one panel: an oscillation over RADIANS is integrated to rounding."""

RADIANS = 50.0


@lru_cache(maxsize=64)
def gauss(order: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights of the Gauss-Legendre rule of this order on 0 to 1.

    >>> nodes, weights = gauss(8)
    >>> round(float(weights @ np.exp(nodes)), 12)  # e - 1
    1.718281828459
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return (nodes + 1) / 2, weights / 2


@lru_cache(maxsize=64)
def panels(radians: float) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights on 0 to 1 for an integrand whose phase varies by at most `radians`.

    >>> import math
    >>> nodes, weights = panels(1000.0)
    >>> round(float(weights @ np.cos(1000 * nodes)), 12) == round(math.sin(1000) / 1000, 12)
    True
    """
    count = 1 + int(radians / RADIANS)
    nodes, weights = gauss(ORDER)
    return ((np.arange(count)[:, None] + nodes) / count).ravel(), np.tile(weights / count, count)
