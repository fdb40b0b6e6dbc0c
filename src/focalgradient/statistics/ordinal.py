"""Ordinal answers: a cumulative-link (proportional-odds) mixed model, integrated over subjects by Gauss-Hermite.

P(answer <= k) = logistic(threshold_k - design . fixed - random . L v), v standard normal, one for each subject. The
integral over v is taken about each subject's own mode (adaptive quadrature: Liu and Pierce 1994); with one node it is
Laplace's approximation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from focalgradient.statistics.means import student_effect
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["NODES", "CumulativeFit", "cumulative_fit", "design_matrix", "ordinal_slope"]

FloatArray = NDArray[np.float64]

NODES = 7
"""Of the quadrature, along each random effect."""

SEPARATED = 25.0
"""Log odds beyond which the answers tell only that they are large: the search ends there."""

STEP = 1e-3
"""Of the differences that stand for second derivatives, in units of about a standard deviation."""


@dataclass(frozen=True, slots=True)
class CumulativeFit:
    """A fitted cumulative-link mixed model.

    Parameters
    ----------
    thresholds
        One less than there are categories, rising.
    fixed, standard_errors
        Coefficients of the design's columns, in log odds of a higher answer.
    spread
        L: the random effects' covariance is L L'.
    log_likelihood
        At the maximum.
    at_boundary
        The covariance is singular: the standard errors take it as known.
    """

    thresholds: FloatArray
    fixed: FloatArray
    standard_errors: FloatArray
    spread: FloatArray
    log_likelihood: float
    at_boundary: bool


def design_matrix(amount: FloatArray, kinds: NDArray[np.object_]) -> FloatArray:
    """Columns 1 and the amount, then one for each kind of material (scene) after the first: its difference to that.

    Examples
    --------
    >>> design_matrix(np.array([0.0, 2.0]), np.array(["room", "terrain"], dtype=object))
    array([[1., 0., 0.],
           [1., 2., 1.]])
    """
    return np.column_stack([np.ones(len(amount)), amount, *(kinds == kind for kind in sorted(set(kinds))[1:])]).astype(
        float
    )


def ordinal_slope(answers: NDArray[np.int_], design: FloatArray, subject: NDArray[np.int_]) -> Effect | NotComputed:
    """Slope of ordinal answers, in log odds of a higher answer a unit of the amount; random intercepts and slopes.

    Parameters
    ----------
    answers
        Category of each trial.
    design
        A row a trial: 1, the amount, then covariates: see `design_matrix`.
    subject
        Number of each trial's subject, from 0 up.

    Examples
    --------
    >>> rng = np.random.default_rng(3)
    >>> subject, amount = np.repeat(np.arange(8), 16), np.tile([0.0, 1.0, 2.0, 3.0], 32)
    >>> latent = rng.normal(1.0, 0.3, 8)[subject] * amount + rng.logistic(size=128)
    >>> effect = ordinal_slope(np.digitize(latent, [0.5, 2.0]), np.column_stack([np.ones(128), amount]), subject)
    >>> effect.low < 1.0 < effect.high, effect.p < 0.01
    (True, True)
    """
    subjects = len(np.unique(subject))
    width = float(np.ptp(design[:, 1]))
    if subjects < 2 or width == 0:
        return NotComputed("An ordinal slope over subjects needs two or more subjects, and two or more amounts.")
    _, category = np.unique(answers, return_inverse=True)
    if category.max() == 0:
        return NotComputed("All answers are the same: there is no variation to test a slope against.")
    scaled = design[:, 1:] / np.where(np.arange(design.shape[1] - 1) == 0, width, 1.0)
    random = np.column_stack([np.ones(len(scaled)), scaled[:, 0]])
    fit = cumulative_fit(category, scaled, random, subject)
    if fit is None or not math.isfinite(fit.standard_errors[0]):
        return NotComputed(
            "The cumulative-link mixed model has no finite maximum: answers may follow the amount without exception."
        )
    remarks = ("The random effects' covariance is singular: the standard error takes it as known.",)
    return student_effect(
        float(fit.fixed[0]) / width,
        float(fit.standard_errors[0]) / width,
        subjects,
        "cumulative-link mixed model (logit), random intercepts and slopes, adaptive Gauss-Hermite with "
        f"{NODES} nodes, t on subjects - 1",
        remarks=remarks if fit.at_boundary else (),
    )


def cumulative_fit(
    category: NDArray[np.int_], design: FloatArray, random: FloatArray, subject: NDArray[np.int_], nodes: int = NODES
) -> CumulativeFit | None:
    """Fit by maximum likelihood; None where the search finds no maximum.

    Parameters
    ----------
    category
        0, 1, ..., each occurring.
    design, random
        A row a trial: the fixed effects' columns (no constant: the thresholds are it) and the random effects', of a
        range of about 1.
    subject
        Number of each trial's subject, from 0 up.
    nodes
        Of the quadrature along each random effect.
    """
    last, columns, q = int(category.max()), design.shape[1], random.shape[1]
    lower = np.tril_indices(q)
    marginal = _Marginal(category, random, subject, nodes)

    def unpack(free: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        thresholds = free[0] + np.concatenate([[0.0], np.cumsum(np.exp(free[1:last]))])
        spread = np.zeros((q, q))
        spread[lower] = free[last + columns :]
        return thresholds, free[last : last + columns], spread

    def cost(free: FloatArray) -> float:
        thresholds, fixed, spread = unpack(free)
        value = marginal.log_likelihood(thresholds, design @ fixed, spread)
        return -value if math.isfinite(value) else 1e10

    def stray(intermediate_result: optimize.OptimizeResult) -> None:
        if np.abs(intermediate_result.x).max() > SEPARATED:
            raise StopIteration

    odds = np.cumsum(np.bincount(category))[:-1] / len(category)
    start = np.log(odds / (1 - odds))
    free = np.concatenate([start[:1], np.log(np.diff(start)), np.zeros(columns), np.eye(q)[lower] * 0.5])
    with np.errstate(all="ignore"):
        found = optimize.minimize(cost, free, jac="3-point", method="BFGS", callback=stray, options={"gtol": 1e-4})
        free = found.x
        if np.abs(free).max() > SEPARATED:
            return None
        # the search may end for want of precision: what counts is that the slope there is flat, for its curvature
        information = _curvature(cost, free)
        known = information[: last + columns, : last + columns]
        at_boundary = not _is_positive(information)
        if at_boundary and not _is_positive(known):
            return None
        covariance = np.linalg.inv(known if at_boundary else information)
    if not found.success and float(found.jac @ found.hess_inv @ found.jac) > 1e-4:
        return None
    thresholds, fixed, spread = unpack(free)
    errors = np.sqrt(np.diag(covariance)[last : last + columns])
    return CumulativeFit(thresholds, fixed, errors, spread, -float(found.fun), at_boundary)


class _Marginal:
    """The likelihood of all answers with the subjects' random effects integrated out."""

    def __init__(self, category: NDArray[np.int_], random: FloatArray, subject: NDArray[np.int_], nodes: int):
        self.order = np.argsort(subject, kind="stable")
        self.category, self.random, self.subject = category[self.order], random[self.order], subject[self.order]
        self.first = np.flatnonzero(np.diff(self.subject, prepend=-1))  # trial of each subject
        self.subjects, q = len(self.first), random.shape[1]
        point, weight = np.polynomial.hermite_e.hermegauss(nodes)
        grids = np.meshgrid(*[np.arange(nodes)] * q, indexing="ij")
        at = np.stack([grid.ravel() for grid in grids])
        self.points = point[at]  # q x nodes^q
        self.log_weights = np.log(weight[at]).sum(axis=0) + (self.points**2).sum(axis=0) / 2
        self.mode = np.zeros((self.subjects, q))

    def _of_subjects(self, values: FloatArray) -> FloatArray:
        """Sum over each subject's trials, of any trailing shape."""
        return np.add.reduceat(values, self.first, axis=0)

    def log_likelihood(self, thresholds: FloatArray, level: FloatArray, spread: FloatArray) -> float:
        edges = np.concatenate([[-np.inf], thresholds, [np.inf]])
        level = level[self.order]
        low, high = edges[self.category] - level, edges[self.category + 1] - level
        random = self.random @ spread
        q = random.shape[1]

        def eta(v: FloatArray) -> FloatArray:
            return (random * v[self.subject]).sum(axis=1)

        def joint(v: FloatArray) -> FloatArray:
            """Log density of each subject's answers and effects, but for a constant."""
            return self._of_subjects(_log_difference(low - eta(v), high - eta(v))) - (v**2).sum(axis=1) / 2

        mode, best = self.mode, joint(self.mode)
        for _ in range(50):  # Newton: the joint density is log-concave in the effects, yet whole steps may swing about
            first, second = _derivatives(low - eta(mode), high - eta(mode))
            gradient = self._of_subjects(first[:, None] * random) - mode
            curvature = self._of_subjects(second[:, None, None] * random[:, :, None] * random[:, None, :]) + np.eye(q)
            step = np.linalg.solve(curvature, gradient[:, :, None])[:, :, 0]
            if not np.isfinite(step).all():
                self.mode = np.zeros_like(mode)
                return -math.inf
            if np.abs(step).max() < 1e-8:  # what it still leaves is its square
                break
            while ((reached := joint(mode + step)) < best - 1e-9).any():
                step[reached < best - 1e-9] /= 2
            mode, best = mode + step, reached
        self.mode = mode
        # its product with itself inverts the curvature
        root = np.linalg.inv(np.linalg.cholesky(curvature)).transpose(0, 2, 1)
        v = mode[:, :, None] + root @ self.points  # subjects x q x nodes
        at = (random[:, None, :] @ v[self.subject])[:, 0, :]
        log_p = self._of_subjects(_log_difference(low[:, None] - at, high[:, None] - at)) - (v**2).sum(axis=1) / 2
        log_p += self.log_weights
        peak = log_p.max(axis=1)
        integral = peak + np.log(np.exp(log_p - peak[:, None]).sum(axis=1))
        volume = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)
        return float((integral + volume).sum() - self.subjects * q / 2 * math.log(2 * math.pi))


def _log_difference(low: FloatArray, high: FloatArray) -> FloatArray:
    """log(logistic(high) - logistic(low)), without cancellation."""
    # logistic(b) - logistic(a) = logistic(b) logistic(-a) (1 - exp(a - b))
    return -np.logaddexp(0, -high) - np.logaddexp(0, low) + np.log(-np.expm1(low - high))


def _derivatives(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of `_log_difference` by a shift eta subtracted from both: the first, and minus the second."""
    below, above = 1 / (1 + np.exp(-low)), 1 / (1 + np.exp(-high))
    return below + above - 1, below * (1 - below) + above * (1 - above)


def _curvature(function: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    """Second derivatives by central differences."""
    n = len(at)
    steps = STEP * np.eye(n)
    second = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            corners = [
                sign_i * sign_j * function(at + sign_i * steps[i] + sign_j * steps[j])
                for sign_i in (1, -1)
                for sign_j in (1, -1)
            ]
            second[i, j] = second[j, i] = sum(corners) / (4 * STEP**2)
    return second


def _is_positive(matrix: FloatArray) -> bool:
    values = np.linalg.eigvalsh(matrix) if np.isfinite(matrix).all() else np.array([-1.0])
    return bool(values[0] > 1e-6 * values[-1])
