"""Mean of an incomplete table of subjects x scenes, both random, by restricted maximum likelihood (REML).

The model of one value per cell is value = mean + subject + scene + residual. Complete tables have a closed form
(`focalgradient.statistics.crossed.moments`); in incomplete ones the weight of a cell depends on the other cells of its
subject and scene. The deviance is that of Bates et al. (2015, doi:10.18637/jss.v067.i01), as a function of the relative
standard deviations of subjects and scenes; the degrees of freedom are Satterthwaite's, from the Hessian of the
deviance, as in lmerTest (Kuznetsova et al. 2017, doi:10.18637/jss.v082.i13).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from focalgradient.statistics.hessian import hessian

__all__ = ["Fit", "fit"]

FloatArray = NDArray[np.float64]

LARGEST = 1e3
"""Maximum standard deviation of subjects or scenes, relative to the residuals; without residuals the deviance has no
minimum, and beyond this limit it is flat to rounding.
"""

STEP = 1e-3
"""Relative step of finite differences: with a deviance accurate to 1e-12, second differences are accurate to 1e-5."""

STARTS = ((1.0, 1.0), (0.2, 1.0), (1.0, 0.2), (0.1, 0.1))
"""Start values of the relative standard deviations of subjects and scenes: the deviance may have two minima."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Fitted mean and variance components of a table.

    Parameters
    ----------
    mean, standard_error, df
        Mean, its standard error, and Satterthwaite's degrees of freedom.
    subjects, scenes, residual
        Standard deviations. That of scenes is 0 if each scene has one cell (as with scenes nested in subjects), and
        that of subjects if each subject has one cell; it is then part of the residual.
    residuals
        Values minus the mean and the conditional modes of subject and scene (subjects x scenes); NaN in gaps.
    """

    mean: float
    standard_error: float
    df: float
    subjects: float
    scenes: float
    residual: float
    residuals: FloatArray


@dataclass(frozen=True, slots=True)
class _Solved:
    """Generalised least-squares solution of a table, for given relative standard deviations."""

    log_determinant: float  # of the covariance divided by the residual variance
    information: float  # about the mean, multiplied by the residual variance
    mean: float
    square: float  # residual quadratic form
    residuals: FloatArray


@dataclass(frozen=True, slots=True)
class _Table:
    """Table for the likelihood; empty cells are 0 in `values` and False in `filled`."""

    values: FloatArray
    filled: NDArray[np.bool_]

    def solve(self, subjects: float, scenes: float) -> _Solved:
        """Solve for the mean. The covariance over the residual variance is I + subjects^2 Zs Zs' + scenes^2 Zc Zc'."""
        counts = self.filled.astype(float)
        shrink = subjects**2 / (1 + subjects**2 * counts.sum(axis=1))  # Woodbury, the subjects eliminated
        of_scenes = np.diag(counts.sum(axis=0)) - counts.T @ (shrink[:, None] * counts)
        system = np.eye(len(of_scenes)) + scenes**2 * of_scenes

        def within(values: FloatArray) -> FloatArray:
            """Apply the inverse covariance of subjects alone."""
            return counts * (values - (shrink * (counts * values).sum(axis=1))[:, None])

        def inverse(values: FloatArray) -> FloatArray:
            first = within(values)
            pulled = np.linalg.solve(system, first.sum(axis=0))
            return first - scenes**2 * within(counts * pulled)

        weights = inverse(counts)
        information = float(weights.sum())
        mean = float((weights * self.values).sum()) / information
        away = counts * (self.values - mean)
        left = inverse(away)
        log_determinant = float(np.log1p(subjects**2 * counts.sum(axis=1)).sum() + np.linalg.slogdet(system)[1])
        return _Solved(log_determinant, information, mean, float((away * left).sum()), left)

    def deviance(self, subjects: float, scenes: float, residual: float) -> float:
        """Return minus twice the restricted log likelihood, without its constant."""
        solved, free = self.solve(subjects, scenes), int(self.filled.sum()) - 1
        spread = 2 * free * math.log(residual) + solved.square / residual**2
        return spread + solved.log_determinant + math.log(solved.information)

    def profiled(self, subjects: float, scenes: float) -> float:
        """Return the deviance at the residual variance that minimises it."""
        solved, free = self.solve(subjects, scenes), int(self.filled.sum()) - 1
        square = max(solved.square, np.finfo(float).tiny)
        return free * math.log(square / free) + solved.log_determinant + math.log(solved.information)


def fit(cells: ArrayLike, *, quick: bool = False) -> Fit:
    """Fit the mean and the variance components of an incomplete table.

    Parameters
    ----------
    cells
        One row per subject, one column per scene; NaN without a value. Each row and column has at least one value, and
        the table at least three.
    quick
        True to search from one start only, ending at a relative change of the deviance of 1e-9.

    Examples
    --------
    A complete table: as `focalgradient.statistics.crossed.moments`.

    >>> found = fit([[0.1, 0.3, 0.2], [0.4, 0.6, 0.2], [0.2, 0.5, 0.1]])
    >>> round(found.mean, 3), round(found.standard_error, 3), round(found.df, 2)
    (0.289, 0.103, 2.82)
    """
    table = np.atleast_2d(np.asarray(cells, dtype=float))
    filled = np.isfinite(table)
    unit = float(table[filled].std()) or 1.0  # the search is scale-free
    one = _Table(np.where(filled, table, 0.0) / unit, filled)
    # A term with one cell a level cannot be distinguished from the residual.
    free = np.array([filled.sum(axis=1).max() > 1, filled.sum(axis=0).max() > 1])
    theta = _minimum(one, free, quick)
    solved = one.solve(*theta)
    residual = math.sqrt(max(solved.square, np.finfo(float).tiny) / (int(filled.sum()) - 1))
    df = _satterthwaite(one, np.array([*theta, residual]), np.append(free, True))
    error = residual / math.sqrt(solved.information)
    of_subjects, of_scenes = theta * residual * unit
    left = np.where(filled, solved.residuals * unit, np.nan)
    return Fit(solved.mean * unit, error * unit, df, float(of_subjects), float(of_scenes), residual * unit, left)


def _minimum(table: _Table, free: NDArray[np.bool_], quick: bool) -> FloatArray:
    """Minimise the deviance over the relative SDs of subjects and scenes; those not `free` are 0."""
    if not free.any():
        return np.zeros(2)

    def at(some: FloatArray) -> FloatArray:
        theta = np.zeros(2)
        theta[free] = some
        return theta

    tries = {tuple(np.array(start)[free]) for start in (STARTS[:1] if quick else STARTS)}

    def deviance(some: FloatArray) -> float:
        return table.profiled(*at(some))

    found = [
        optimize.minimize(
            deviance,
            np.array(start, dtype=float),
            method="L-BFGS-B",
            bounds=[(0.0, LARGEST)] * int(free.sum()),
            options={"ftol": 1e-9 if quick else 1e-14, "gtol": 1e-8},
        )
        for start in sorted(tries)
    ]
    return at(min(found, key=lambda one: float(one.fun)).x)


def _satterthwaite(table: _Table, point: FloatArray, free: NDArray[np.bool_]) -> float:
    """Return the degrees of freedom of the mean's variance at (subjects, scenes, residual), by finite differences.

    Standard deviations enter as squares, so that differences across 0 are those of an even function.
    """

    def variance(at: FloatArray) -> float:
        return float(at[2]) ** 2 / table.solve(at[0], at[1]).information

    used = np.flatnonzero(free)
    sizes = STEP * np.array([*np.maximum(point[:2], 1.0), point[2]])
    steps = np.diag(sizes)[used]
    gradient = np.array([(variance(point + h) - variance(point - h)) / (2 * h.sum()) for h in steps])

    def deviance(some: FloatArray) -> float:
        at = point.copy()
        at[used] = some
        return table.deviance(*at)

    values, vectors = np.linalg.eigh(hessian(deviance, point[used], sizes[used]))
    kept = values > 1e-8 * max(values.max(), 1.0)  # directions without curvature are ignored, as in lmerTest
    along = vectors[:, kept].T @ gradient
    uncertainty = float((2 * along**2 / values[kept]).sum())
    return 2 * variance(point) ** 2 / uncertainty if uncertainty > 0 else math.inf
