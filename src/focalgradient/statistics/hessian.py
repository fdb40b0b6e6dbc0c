"""Minima of smooth costs that do not depend on rounding, and their curvature.

Searches end where a cost changes little, at a place that rounding decides: another processor, number of threads or
order of rows gives other digits. `polished` carries a search on to the zero of the gradient.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray

__all__ = ["MIN_CURVATURE", "ascending", "covariance_at", "curvature_at", "free_of", "hessian", "polished"]


STEP = 1e-3
"""Step of finite differences: of a cost of 1000 they are accurate to 1e-10 (gradient) and 1e-7 (second derivatives)."""

MIN_CURVATURE = 1e-4
"""Minimum eigenvalue of the Hessian of a negative log likelihood whose parameters are logarithms or standardised: a
standard error of 100. Below it the likelihood is flat and the parameters are not determined; rounding reaches 1e-7.
"""

MAX_STEPS = 100
"""Maximum number of Newton steps."""

CONVERGED = 3e-8
"""Length of the last Newton step, in units of the parameters, below which a minimum counts as reached; what is left is
at most a third of it.
"""


def ascending(free: FloatArray) -> FloatArray:
    """Return ascending values, such as thresholds, of their free parameters: the first, and the logarithms of the gaps.

    >>> ascending(np.array([-1.0, 0.0, 0.0])).tolist()
    [-1.0, 0.0, 1.0]
    """
    return np.asarray(free[0] + np.concatenate([[0.0], np.cumsum(np.exp(free[1:]))]))


def free_of(values: FloatArray, least_gap: float = 0.0) -> FloatArray:
    """Return the free parameters of ascending values: see `ascending`.

    >>> free_of(np.array([-1.0, 0.0, 1.0])).tolist()
    [-1.0, 0.0, 0.0]
    """
    return np.concatenate([values[:1], np.log(np.maximum(np.diff(values), least_gap))])


def hessian(function: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    """Return the second derivatives of a function, exact up to third order.

    Parameters
    ----------
    function
        Function of the n parameters.
    at
        Point, shape (n,).

    Examples
    --------
    >>> hessian(lambda x: 3 * x[0] ** 2 - x[0] * x[1], np.array([1.0, 2.0])).round(6).tolist()
    [[6.0, -1.0], [-1.0, 0.0]]
    """
    from statsmodels.tools.numdiff import approx_hess3  # type: ignore[import-untyped]

    return np.asarray(approx_hess3(at, function, epsilon=STEP))


def polished(
    cost: Callable[[FloatArray], float],
    at: ArrayLike,
    *,
    gradient: Callable[[FloatArray], FloatArray] | None = None,
    low: ArrayLike = -np.inf,
    high: ArrayLike = np.inf,
) -> FloatArray | None:
    """Move a minimum found by a search to the zero of the gradient, by Newton's method.

    Parameters
    ----------
    cost
        Smooth negative log likelihood of the n parameters, each a logarithm or of order 1.
    at
        Result of the search, shape (n,).
    gradient
        First derivatives of the cost; None: central differences.
    low, high
        Bounds of the parameters; one that the cost pushes against its bound stays there.

    Returns
    -------
    ndarray or None
        None if the point is not a minimum. Directions in which the curvature is below `MIN_CURVATURE` are not searched:
        there the parameters are not determined, and `covariance_at` returns None.

    Examples
    --------
    >>> polished(lambda x: 2 * (x[0] - 1) ** 2 + x[1] ** 4 + x[1] ** 2, [0.99, 0.01]).round(9).tolist()
    [1.0, 0.0]
    >>> polished(lambda x: -x[0]**2, [1.0]) is None
    True
    """
    point = np.clip(np.asarray(at, dtype=float), low, high)
    low, high = np.broadcast_to(low, point.shape), np.broadcast_to(high, point.shape)
    slope_at = gradient or (lambda x: _slope(cost, x))
    moved, curvature, length = np.array([], dtype=int), np.empty((0, 0)), np.inf
    values, vectors = np.empty(0), curvature
    for _ in range(MAX_STEPS):
        slope = slope_at(point)
        inner = np.flatnonzero(~(((point <= low) & (slope >= 0)) | ((point >= high) & (slope <= 0))))
        if not (np.isfinite(slope).all() and len(inner)):
            return point if np.isfinite(slope).all() else None
        if not (len(curvature) and np.array_equal(inner, moved)):
            moved = inner
            curvature = curvature_at(cost, gradient, point)[np.ix_(moved, moved)]
            if not np.isfinite(curvature).all():
                return None
            values, vectors = np.linalg.eigh(curvature)
            if values[0] < -MIN_CURVATURE:
                return None
            values[values < MIN_CURVATURE] = np.inf  # flat directions
        step = np.zeros(len(point))
        step[moved] = -vectors @ (vectors.T @ slope[moved] / values)
        before, length = length, float(np.abs(step).max())
        if length > 0.3 * before:  # the curvature has changed since it was computed
            curvature = np.empty((0, 0))
        point = np.clip(point + step * min(1.0, 1 / max(length, 1e-300)), low, high)
        if length < CONVERGED:
            return point
    return None


def covariance_at(cost: Callable[[FloatArray], float], at: FloatArray) -> FloatArray | None:
    """Invert the Hessian of a negative log likelihood; return None if an eigenvalue is below `MIN_CURVATURE`.

    >>> covariance_at(lambda x: 2 * x[0] ** 2 + x[1] ** 2 / 4, np.array([0.0, 0.0])).round(6).tolist()
    [[0.25, 0.0], [0.0, 2.0]]
    >>> covariance_at(lambda x: 2 * x[0] ** 2 + 1e-9 * x[1] ** 2, np.array([0.0, 0.0])) is None
    True
    """
    second = hessian(cost, at)
    return np.asarray(np.linalg.inv(second)) if _is_positive(second) else None


def _is_positive(second: FloatArray) -> bool:
    return bool(np.isfinite(second).all() and (np.linalg.eigvalsh(second) >= MIN_CURVATURE).all())


def _slope(cost: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    """Return the gradient by central differences, exact up to fourth order."""
    slope = np.empty(len(at))
    for i, step in enumerate(STEP * np.eye(len(at))):
        near, far = cost(at + step) - cost(at - step), cost(at + 2 * step) - cost(at - 2 * step)
        slope[i] = (8 * near - far) / (12 * STEP)
    return slope


def curvature_at(
    cost: Callable[[FloatArray], float], gradient: Callable[[FloatArray], FloatArray] | None, at: FloatArray
) -> FloatArray:
    """Return the second derivatives of a cost, of its gradient if there is one."""
    if gradient is None:
        return hessian(cost, at)
    from statsmodels.tools.numdiff import approx_fprime

    second = np.atleast_2d(approx_fprime(at, gradient, epsilon=STEP, centered=True))
    return np.asarray((second + second.T) / 2)
