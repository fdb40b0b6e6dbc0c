"""Loops over the answers of each subject for the integral over the random effects, compiled by Numba.

Arrays: `low` and `high` (trials) bound each answer on the latent scale, relative to the fixed effects; `random` (trials
x q) contains the columns of the random effects times their Cholesky factor; `first` (subjects + 1) contains the first
trial of each subject, and the number of trials.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray

__all__ = ["conditional_modes", "joint_densities", "mean_derivatives"]


_compiled = njit(nogil=True, cache=True, error_model="numpy")

NEWTON, HALVINGS = 50, 60
"""Maximum number of Newton steps to a subject's conditional modes, and maximum number of halvings of a step."""

NEAR = 1e-8
"""Step length at which the search ends; the remaining error is its square."""


@_compiled
def _logistic(x: float) -> float:
    if x >= 0:
        return 1 / (1 + math.exp(-x))
    e = math.exp(x)
    return e / (1 + e)


@_compiled
def _interval_probability(low: float, high: float) -> tuple[float, float, float]:
    """Return logistic(high) - logistic(low), computed in the more accurate tail, and both logistic values."""
    if low + high > 0:
        one, two = _logistic(-high), _logistic(-low)
        return two - one, 1 - two, 1 - one
    one, two = _logistic(low), _logistic(high)
    return two - one, one, two


@_compiled
def _height(low: FloatArray, high: FloatArray, random: FloatArray, start: int, end: int, effects: FloatArray) -> float:
    """Return the log density of one subject's answers and effects, up to a constant."""
    height = -(effects**2).sum() / 2
    for t in range(start, end):
        eta = 0.0
        for j in range(len(effects)):
            eta += random[t, j] * effects[j]
        height += math.log(_interval_probability(low[t] - eta, high[t] - eta)[0])
    return height


@_compiled
def _rise(
    low: FloatArray,
    high: FloatArray,
    random: FloatArray,
    bounds: tuple[int, int],
    effects: FloatArray,
    gradient: FloatArray,
    curvature: FloatArray,
) -> None:
    """Compute the gradient of that density and its curvature (negative second derivatives) in place."""
    q = len(effects)
    gradient[:] = -effects
    curvature[:] = np.eye(q)
    for t in range(bounds[0], bounds[1]):
        eta = 0.0
        for j in range(q):
            eta += random[t, j] * effects[j]
        _, below, above = _interval_probability(low[t] - eta, high[t] - eta)
        slope, second = below + above - 1, below * (1 - below) + above * (1 - above)
        for j in range(q):
            gradient[j] += slope * random[t, j]
            for k in range(q):
                curvature[j, k] += second * random[t, j] * random[t, k]


@_compiled
def conditional_modes(
    low: FloatArray, high: FloatArray, random: FloatArray, first: NDArray[np.int_], mode: FloatArray
) -> tuple[FloatArray, bool]:
    """Write each subject's conditional modes to `mode` (subjects x q), and return the curvature there.

    Newton's method with step halving, as full steps may oscillate although the joint density is log-concave. The second
    value is False if a step diverges.
    """
    subjects, q = mode.shape
    curvature = np.zeros((subjects, q, q))
    gradient, reached = np.empty(q), np.empty(q)
    for s in range(subjects):
        start, end = first[s], first[s + 1]
        best = _height(low, high, random, start, end, mode[s])
        for _ in range(NEWTON):
            _rise(low, high, random, (start, end), mode[s], gradient, curvature[s])
            if not (np.isfinite(gradient).all() and np.isfinite(curvature[s]).all()):
                mode[:] = 0.0
                return curvature, False
            step = np.linalg.solve(curvature[s], gradient)
            if np.abs(step).max() < NEAR:
                break
            for _ in range(HALVINGS):
                reached = mode[s] + step
                height = _height(low, high, random, start, end, reached)
                if height >= best - 1e-9:
                    break
                step /= 2
            best = height
            mode[s] = reached
    return curvature, True


@_compiled
def joint_densities(
    low: FloatArray, high: FloatArray, random: FloatArray, first: NDArray[np.int_], v: FloatArray
) -> FloatArray:
    """Return log probabilities (subjects x nodes) of each subject's answers at effects `v` (subjects x q x nodes)."""
    subjects, q, nodes = v.shape
    joint = np.zeros((subjects, nodes))
    for s in range(subjects):
        for t in range(first[s], first[s + 1]):
            for n in range(nodes):
                eta = 0.0
                for j in range(q):
                    eta += random[t, j] * v[s, j, n]
                joint[s, n] += math.log(_interval_probability(low[t] - eta, high[t] - eta)[0])
    return joint


@_compiled
def mean_derivatives(
    low: FloatArray, high: FloatArray, random: FloatArray, first: NDArray[np.int_], v: FloatArray, share: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return derivatives of each answer's log probability, averaged over nodes with weights `share` (subjects x nodes).

    The derivatives are by the level, by the upper and the lower bound (trials each), and by the effects (trials x q).
    """
    subjects, q, nodes = v.shape
    trials = len(low)
    by_level, by_high, by_low, by_v = np.zeros(trials), np.zeros(trials), np.zeros(trials), np.zeros((trials, q))
    for s in range(subjects):
        for t in range(first[s], first[s + 1]):
            for n in range(nodes):
                eta = 0.0
                for j in range(q):
                    eta += random[t, j] * v[s, j, n]
                probability, below, above = _interval_probability(low[t] - eta, high[t] - eta)
                slope = (below + above - 1) * share[s, n]
                by_level[t] += slope
                by_high[t] += above * (1 - above) / probability * share[s, n]
                by_low[t] += below * (1 - below) / probability * share[s, n]
                for j in range(q):
                    by_v[t, j] += slope * v[s, j, n]
    return by_level, by_high, by_low, by_v
