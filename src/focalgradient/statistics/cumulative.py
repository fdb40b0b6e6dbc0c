"""Cumulative-link (proportional-odds) mixed model, fitted by maximum likelihood with adaptive Gauss-Hermite quadrature.

P(answer <= k) = logistic(threshold_k - design . fixed - random . L v), with v standard normal for each subject. The
integral over v is centred on each subject's mode (Liu and Pierce 1994); one node gives Laplace's approximation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.arrays import FloatArray
from focalgradient.progress import Progress
from focalgradient.statistics.hessian import ascending, curvature_at, free_of, polished

__all__ = ["CumulativeFit", "answer_derivatives", "cumulative_fit"]


SEPARATED = 25.0
"""Absolute value of a parameter (log odds) beyond which the answers are separated and the search ends without a
maximum.
"""


NEWTON, HALVINGS = 50, 60
"""Maximum number of Newton steps to the subjects' conditional modes, and maximum number of halvings of a step."""

NEAR = 1e-8
"""Step length at which the search ends; the remaining error is its square."""


@dataclass(frozen=True, slots=True, eq=False)
class CumulativeFit:
    """Fitted cumulative-link mixed model.

    Parameters
    ----------
    thresholds, threshold_errors
        Thresholds, ascending, one fewer than the categories, and their standard errors.
    fixed, covariance
        Fixed effects (columns of the design), in log odds of a higher answer, and their covariance.
    cholesky
        Cholesky factor L of the covariance L L' of the random effects.
    log_likelihood
        Maximum of the log likelihood.
    at_boundary
        True if the random effects' covariance is singular; the standard errors then treat it as known.
    effects
        Conditional modes of the random effects (subjects x effects), in log odds.
    """

    thresholds: FloatArray
    threshold_errors: FloatArray
    fixed: FloatArray
    covariance: FloatArray
    cholesky: FloatArray
    log_likelihood: float
    at_boundary: bool
    effects: FloatArray

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of the fixed effects."""
        return np.sqrt(np.diag(self.covariance))


def cumulative_fit(
    category: NDArray[np.int_],
    design: FloatArray,
    random: FloatArray,
    subject: NDArray[np.int_],
    nodes: int,
    progress: Progress | None = None,
) -> CumulativeFit | None:
    """Fit the model by maximum likelihood; return None if there is no finite maximum.

    Parameters
    ----------
    category
        Category of each answer: 0, 1, ..., without gaps.
    design, random
        Design matrices (one row per trial) of the fixed effects, without a constant, and of the random effects; columns
        have a range of about 1.
    subject
        Subject index of each trial, from 0.
    nodes
        Number of quadrature nodes per random effect; 1 gives Laplace's approximation.
    progress
        Function called with a rough estimate of the completed fraction.
    """
    last, columns, q = int(category.max()), design.shape[1], random.shape[1]
    lower = np.tril_indices(q)
    marginal = _Marginal(category, random, subject, nodes)
    size = last + columns + len(lower[0])

    def unpack(free: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        cholesky = np.zeros((q, q))
        cholesky[lower] = free[last + columns :]
        return ascending(free[:last]), free[last : last + columns], cholesky

    def cost(free: FloatArray) -> tuple[float, FloatArray]:
        thresholds, fixed, cholesky = unpack(free)
        value, by_threshold, by_level, by_cholesky = marginal.evaluate(thresholds, design @ fixed, cholesky)
        if not math.isfinite(value):
            return 1e10, np.zeros(size)
        above = np.cumsum(by_threshold[::-1])[::-1]  # each gap shifts all thresholds above it
        by_free = np.concatenate([above[:1], above[1:] * np.exp(free[1:last])])
        return -value, -np.concatenate([by_free, design.T @ by_level, by_cholesky[lower]])

    def height(free: FloatArray) -> float:
        return cost(free)[0]

    def watched(intermediate_result: optimize.OptimizeResult) -> None:
        steps[0] += 1
        if progress is not None:
            progress(1 - 1 / (1 + steps[0] / 20), "ordinal model")
        if np.abs(intermediate_result.x).max() > SEPARATED:
            raise StopIteration

    steps = [0]
    free = np.concatenate([_first_thresholds(category), np.zeros(columns), np.eye(q)[lower] * 0.5])
    exact = nodes > 1  # the gradient is exact for quadrature, but not for Laplace's approximation
    slope = (lambda at: cost(at)[1]) if exact else None
    tolerance = max(1e-4, 3e-6 * len(category))  # the gradient scales with the number of trials
    search: dict[str, Any] = {"method": "BFGS", "callback": watched, "options": {"gtol": tolerance}}
    with np.errstate(all="ignore"):
        if exact:
            found = optimize.minimize(cost, free, jac=True, **search)
        else:
            found = optimize.minimize(height, free, jac="3-point", **search)
        free = found.x if np.abs(found.x).max() > SEPARATED else polished(height, found.x, gradient=slope)
        if free is None or np.abs(free).max() > SEPARATED:
            return None
        information = curvature_at(height, slope, free)
        covariance, at_boundary = _covariance(information, last + columns)
    if covariance is None:
        return None
    thresholds, fixed, cholesky = unpack(free)
    errors = _threshold_errors(free[:last], covariance[:last, :last])
    of_fixed = np.asarray(covariance[last:, last:], dtype=float)
    marginal.evaluate(thresholds, design @ fixed, cholesky)  # restore the modes, which the last derivative step moved
    effects = marginal.mode @ cholesky.T
    return CumulativeFit(thresholds, errors, fixed, of_fixed, cholesky, -height(free), at_boundary, effects)


def _first_thresholds(category: NDArray[np.int_]) -> FloatArray:
    """Return start values from the cumulative proportions: first threshold, then logarithms of the gaps."""
    odds = np.cumsum(np.bincount(category))[:-1] / len(category)
    return free_of(np.log(odds / (1 - odds)))


def _covariance(information: FloatArray, wanted: int) -> tuple[FloatArray | None, bool]:
    """Return the covariance of the first `wanted` parameters (None: no maximum), and if the rest is at a boundary."""
    known = information[:wanted, :wanted]
    at_boundary = not _is_positive(information)
    if at_boundary and not _is_positive(known):
        return None, at_boundary
    covariance = np.linalg.inv(known if at_boundary else information)[:wanted, :wanted]
    return np.asarray(covariance, dtype=float), at_boundary


def _threshold_errors(free: FloatArray, covariance: FloatArray) -> FloatArray:
    """Convert the covariance of first threshold and log gaps to standard errors of the thresholds."""
    turn = np.tril(np.concatenate([[1.0], np.exp(free[1:])])[None, :] * np.ones((len(free), 1)))
    return np.asarray(np.sqrt(np.diag(turn @ covariance @ turn.T)))


def answer_derivatives(
    category: NDArray[np.int_], level: FloatArray, thresholds: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the first derivative of each answer's log probability by its level, and the negative second derivative.

    Examples
    --------
    >>> slope, curvature = answer_derivatives(np.array([1]), np.array([0.0]), np.array([0.0]))
    >>> float(slope[0]), float(curvature[0])
    (0.5, 0.25)
    """
    edges = np.concatenate([[-np.inf], thresholds, [np.inf]])
    _, slope, at_low, at_high = _between(edges[category] - level, edges[category + 1] - level)
    return slope, at_low + at_high


def _between(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the logistic probability between two bounds, computed in the more accurate tail.

    Also the derivative of its logarithm by the level, and the densities at the lower and the upper bound.
    """
    sign = np.copysign(1.0, -low - high)
    below, above = special.expit(sign * low), special.expit(sign * high)
    return sign * (above - below), sign * (below + above - 1), below * (1 - below), above * (1 - above)


GOLDEN = (1 + math.sqrt(5)) / 2
ICOSAHEDRON = (
    math.sqrt(5 / (1 + GOLDEN**2))
    * np.array(
        [(0.0, 0.0, 0.0)]
        + [
            tuple(np.roll((0.0, one, two * GOLDEN), turn))
            for one in (-1.0, 1.0)
            for two in (-1.0, 1.0)
            for turn in range(3)
        ]
    ).T
)
WEIGHTS = np.array([2 / 5] + [1 / 20] * 12)
"""Weights of 13 points (centre and icosahedron) that integrate polynomials of degree 5 over a trivariate normal exactly
(Stroud 1971), like the 27 points of a 3 x 3 x 3 product rule.
"""


class _Marginal:
    """Marginal likelihood of all answers, integrated over the subjects' random effects."""

    def __init__(self, category: NDArray[np.int_], random: FloatArray, subject: NDArray[np.int_], nodes: int):
        self.order = np.argsort(subject, kind="stable")
        self.category, self.random = category[self.order], random[self.order]
        self.who = np.unique(subject[self.order], return_inverse=True)[1]
        self.first = np.flatnonzero(np.diff(self.who, prepend=-1))  # first trial of each subject
        self.subjects, q = len(self.first), random.shape[1]
        point, weight = np.polynomial.hermite_e.hermegauss(nodes)
        grids = np.meshgrid(*[np.arange(nodes)] * q, indexing="ij")
        at = np.stack([grid.ravel() for grid in grids])
        self.points = point[at]  # q x nodes^q
        log_weights = np.log(weight[at]).sum(axis=0)
        if nodes == 3 and q == 3:
            self.points, log_weights = ICOSAHEDRON, np.log(WEIGHTS * (2 * math.pi) ** 1.5)
        self.log_weights = log_weights + (self.points**2).sum(axis=0) / 2
        self.mode = np.zeros((self.subjects, q))

    def evaluate(
        self, thresholds: FloatArray, level: FloatArray, cholesky: FloatArray
    ) -> tuple[float, FloatArray, FloatArray, FloatArray]:
        """Return the log likelihood and its gradients by thresholds, by each trial's level, and by the Cholesky factor.

        The gradients are posterior means of those of the joint density, over each subject's random effects.
        """
        edges = np.concatenate([[-np.inf], thresholds, [np.inf]])
        level = level[self.order]
        low, high = edges[self.category] - level, edges[self.category + 1] - level
        random = self.random @ cholesky
        nowhere = -math.inf, np.zeros(len(thresholds)), np.zeros(len(level)), np.zeros_like(cholesky)
        curvature = self.curvature_at_modes(low, high, random)
        if curvature is None:
            return nowhere
        # root root' is the inverse of the curvature
        root = np.linalg.inv(np.linalg.cholesky(curvature)).transpose(0, 2, 1)
        q, last = random.shape[1], len(thresholds)
        value = float(np.log(np.diagonal(root, axis1=1, axis2=2)).sum()) - self.subjects * q / 2 * math.log(2 * math.pi)
        by_level, by_low, by_high, by_v = *np.empty((3, len(level))), np.empty((len(level), q))
        for mode, factor, start, end in zip(self.mode, root, self.first, [*self.first[1:], len(level)], strict=True):
            own = slice(start, end)
            v = mode[:, None] + factor @ self.points  # q x nodes
            eta = random[own] @ v
            probability, slope, at_low, at_high = _between(low[own, None] - eta, high[own, None] - eta)
            joint = np.log(probability).sum(axis=0) - (v**2).sum(axis=0) / 2 + self.log_weights
            share = np.exp(joint - joint.max())
            value += float(joint.max() + np.log(share.sum()))
            share /= share.sum()
            by_level[self.order[own]] = slope @ share
            by_low[own], by_high[own] = (at_low / probability) @ share, (at_high / probability) @ share
            by_v[own] = (slope * share) @ v.T
        lost = np.bincount(self.category, by_low, last + 1)[1:]
        by_threshold = np.asarray(np.bincount(self.category, by_high, last + 1)[:-1] - lost, dtype=float)
        return value, by_threshold, by_level, self.random.T @ by_v

    def curvature_at_modes(self, low: FloatArray, high: FloatArray, random: FloatArray) -> FloatArray | None:
        """Search each subject's conditional modes from the last ones, and return the curvature there.

        `low` and `high` bound each answer on the latent scale, relative to the fixed effects; `random` (trials x q) has
        the columns of the random effects times their Cholesky factor. By Newton's method with step halving, as full
        steps may oscillate although the joint density is log-concave. None if a step diverges.
        """

        def density(effects: FloatArray) -> tuple[FloatArray, ...]:
            eta = (random * effects[self.who]).sum(axis=1)
            probability, *derivatives = _between(low - eta, high - eta)
            return self._of_subjects(np.log(probability)) - (effects**2).sum(axis=1) / 2, *derivatives

        height, slope, at_low, at_high = density(self.mode)
        for _ in range(NEWTON):
            gradient = self._of_subjects(slope[:, None] * random) - self.mode
            products = (at_low + at_high)[:, None, None] * random[:, :, None] * random[:, None]
            curvature = np.eye(random.shape[1]) + self._of_subjects(products)
            if not (np.isfinite(gradient).all() and np.isfinite(curvature).all()):
                self.mode[:] = 0.0
                return None
            step = np.linalg.solve(curvature, gradient[..., None])[..., 0]
            step[np.abs(step).max(axis=1) < NEAR] = 0.0
            if not step.any():
                break
            before = height
            for _ in range(HALVINGS):
                height, slope, at_low, at_high = density(self.mode + step)
                if not (worse := height < before - 1e-9).any():
                    break
                step[worse] /= 2
            self.mode += step
        return curvature

    def _of_subjects(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.add.reduceat(values, self.first))


def _is_positive(matrix: FloatArray) -> bool:
    values = np.linalg.eigvalsh(matrix) if np.isfinite(matrix).all() else np.array([-1.0])
    return bool(values[0] > 1e-6 * values[-1])
