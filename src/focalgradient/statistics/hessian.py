"""Second derivatives by central differences, and the covariance of a maximum-likelihood estimate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["covariance_at", "hessian"]

FloatArray = NDArray[np.float64]


def hessian(function: Callable[[FloatArray], float], at: FloatArray, step: ArrayLike = 1e-3) -> FloatArray:
    """Return the second derivatives of a function, exact up to third order.

    Parameters
    ----------
    function
        Function of the n parameters.
    at
        Point, shape (n,).
    step
        Step of each parameter, in its unit, or one for all.

    Examples
    --------
    >>> hessian(lambda x: 3 * x[0] ** 2 - x[0] * x[1], np.array([1.0, 2.0])).round(6).tolist()
    [[6.0, -1.0], [-1.0, 0.0]]
    """
    sizes = np.broadcast_to(np.asarray(step, float), at.shape)
    steps = np.diag(sizes)
    second = np.empty((len(at), len(at)))
    for i in range(len(at)):
        for j in range(i + 1):
            corners = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            found = sum(a * b * function(at + a * steps[i] + b * steps[j]) for a, b in corners)
            second[i, j] = second[j, i] = found / (4 * sizes[i] * sizes[j])
    return second


def covariance_at(cost: Callable[[FloatArray], float], at: FloatArray) -> FloatArray | None:
    """Invert the Hessian of a negative log likelihood; return None if it is not positive definite.

    >>> covariance_at(lambda x: 2 * x[0] ** 2 + x[1] ** 2 / 4, np.array([0.0, 0.0])).round(6).tolist()
    [[0.25, 0.0], [0.0, 2.0]]
    """
    second = hessian(cost, at)
    if not (np.isfinite(second).all() and np.linalg.eigvalsh(second)[0] > 0):
        return None
    return np.asarray(np.linalg.inv(second))
