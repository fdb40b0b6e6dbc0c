"""Mean of an incomplete table of subjects x scenes, both random, by restricted maximum likelihood (REML).

The model of one value per cell is value = mean + subject + scene + residual. Complete tables have a closed form
(`focalgradient.statistics.crossed.moments`); in incomplete ones the weight of a cell depends on the other cells of its
subject and scene. The deviance is that of Bates et al. (2015, doi:10.18637/jss.v067.i01). It is minimised over the
variances of subjects and scenes relative to that of the residuals, with exact derivatives: over standard deviations its
slope at 0 is always 0, and a search can stop there. The degrees of freedom are Satterthwaite's, as in lmerTest
(Kuznetsova et al. 2017, doi:10.18637/jss.v082.i13): a variance estimated as 0 does not reduce them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray

__all__ = ["Fit", "fit"]


MAX_RATIO = 1e6
"""Maximum variance of subjects or scenes, relative to the residuals; without residuals the deviance has no minimum, and
its rounding error is about 1e-16 times this ratio.
"""

STARTS = (0.0, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e4)
"""Relative variances of subjects and of scenes at which the deviance is evaluated; the search starts from each local
minimum of this grid, as the deviance may have two.
"""

MARGIN = 1e-9
"""Deviance difference that counts as a tie, far above rounding (1e-12) and far below a statistical difference (1): of
two minima the one with smaller variances is taken, and a variance is 0 if the deviance at 0 is as low.
"""

MAX_STEPS = 100
"""Maximum number of Newton steps; 5 to 10 suffice for most tables."""


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
class _Profile:
    """Deviance at the residual variance that minimises it, for given relative variances, with derivatives by these.

    The parameters of `hessian` are the two relative variances and the logarithm of the residual variance; `by_variance`
    is the relative change of the mean's variance with each of them.
    """

    deviance: float
    gradient: FloatArray
    curvature: FloatArray
    hessian: FloatArray
    by_variance: FloatArray
    mean: float
    information: float  # about the mean, multiplied by the residual variance
    residual_variance: float
    modes: FloatArray  # of the levels


@dataclass(frozen=True, slots=True)
class _Table:
    """Standardised values of a table (0 in gaps) with the sufficient statistics of its levels: subjects, then scenes.

    `shared` counts the cells that two levels share; `counts` and `sums` are the number of cells of each level and the
    sum of their values.
    """

    values: FloatArray
    filled: NDArray[np.bool_]
    shared: FloatArray
    counts: FloatArray
    sums: FloatArray
    square: float  # sum of the squared values
    degrees: int  # number of cells minus one

    @classmethod
    def of(cls, values: FloatArray, filled: NDArray[np.bool_]) -> _Table:
        """Sum values over the cells of each level."""
        cells = filled.astype(float)
        counts = np.concatenate([cells.sum(axis=1), cells.sum(axis=0)])
        sums = np.concatenate([values.sum(axis=1), values.sum(axis=0)])
        shared = np.diag(counts)
        shared[: len(cells), len(cells) :], shared[len(cells) :, : len(cells)] = cells, cells.T
        return cls(values, filled, shared, counts, sums, float((values**2).sum()), int(filled.sum()) - 1)

    def deviances(self, ratios: FloatArray, *further: FloatArray) -> tuple[Any, ...]:
        """Return the profiled deviance for relative variances, shape (..., 2).

        Also the mean, the information about it, the sum of squares, the relative variance of each level, and the
        solution for the columns `further`, `counts` and `sums`.
        """
        levels = np.repeat(ratios, self.values.shape, axis=-1)
        system = np.eye(len(self.sums)) + self.shared * levels[..., None, :]
        solved = np.linalg.solve(system, np.column_stack([*further, self.counts, self.sums]))
        ones, values = (levels * solved[..., column] for column in (-2, -1))
        information = self.degrees + 1 - ones @ self.counts
        mean = -(ones @ self.sums) / information
        square = np.maximum(self.square - values @ self.sums - mean**2 * information, np.finfo(float).tiny)
        deviance = self.degrees * np.log(square / self.degrees) + np.linalg.slogdet(system)[1] + np.log(information)
        return deviance, mean, information, square, levels, solved

    def profile(self, ratios: FloatArray) -> _Profile:
        """Return the deviance and its derivatives for two relative variances.

        With V = I + sum of ratio x Z Z' and P the projection of REML, the derivatives by the ratios follow from Z'PZ
        and Z'Py, of which `within` and `pulled` hold the blocks of subjects and scenes.
        """
        *numbers, levels, solved = self.deviances(ratios, self.shared)
        deviance, mean, information, square = map(float, numbers)
        precision, of_ones, of_values = solved[:, :-2], solved[:, -2], solved[:, -1]
        within = precision - np.outer(of_ones, of_ones) / information
        pulled = of_values - of_ones * mean
        free, split = self.degrees, self.values.shape[0]
        parts = (slice(None, split), slice(split, None))
        slope = np.array([-(pulled[part] ** 2).sum() for part in parts])  # of the square
        bend = np.array([[2 * pulled[i] @ within[i, j] @ pulled[j] for j in parts] for i in parts])
        trace = np.array([np.trace(within[i, i]) for i in parts])
        traces = np.array([[-(within[i, j] ** 2).sum() for j in parts] for i in parts])
        gradient = free * slope / square + trace
        fixed = free * bend / square + traces  # at a fixed residual variance
        hessian = np.empty((3, 3))
        hessian[:2, :2], hessian[2, 2] = fixed, free
        hessian[:2, 2] = hessian[2, :2] = -free * slope / square
        curvature = fixed - free * np.outer(slope, slope) / square**2
        by_variance = np.array([*((of_ones[part] ** 2).sum() / information for part in parts), 1.0])
        slopes = gradient, curvature, hessian, by_variance
        return _Profile(deviance, *slopes, mean, information, square / free, levels * pulled)


def fit(cells: ArrayLike) -> Fit:
    """Fit the mean and the variance components of an incomplete table.

    Parameters
    ----------
    cells
        One row per subject, one column per scene; NaN without a value. Each row and column has at least one value, and
        the table at least three.

    Examples
    --------
    A complete table: as `focalgradient.statistics.crossed.moments`.

    >>> found = fit([[0.1, 0.3, 0.2], [0.4, 0.6, 0.2], [0.2, 0.5, 0.1]])
    >>> round(found.mean, 3), round(found.standard_error, 3), round(found.df, 2)
    (0.289, 0.103, 2.82)
    """
    cells = np.atleast_2d(np.asarray(cells, dtype=float))
    filled = np.isfinite(cells)
    centre = float(cells[filled].mean())
    unit = float(cells[filled].std()) or 1.0  # the search is scale-free
    table = _Table.of(np.where(filled, (cells - centre) / unit, 0.0), filled)
    ratios = _minimum(table)
    profile = table.profile(ratios)
    residual = math.sqrt(profile.residual_variance) * unit
    error = residual / math.sqrt(profile.information)
    of_subjects, of_scenes = (float(sd) for sd in np.sqrt(ratios) * residual)
    mean = profile.mean * unit + centre
    of_rows, of_columns = np.split(profile.modes, [len(cells)])
    left = np.where(filled, table.values - profile.mean - of_rows[:, None] - of_columns, np.nan) * unit
    return Fit(mean, error, _satterthwaite(profile, ratios), of_subjects, of_scenes, residual, left)


def _minimum(table: _Table) -> FloatArray:
    """Minimise the deviance over the relative variances of subjects and scenes, each 0 to `MAX_RATIO`.

    A term with one cell a level cannot be distinguished from the residual; its variance is 0.
    """
    estimable = np.array([table.filled.sum(axis=1).max() > 1, table.filled.sum(axis=0).max() > 1])
    starts = [np.array(STARTS if possible else (0.0,)) for possible in estimable]
    grid = np.stack(np.meshgrid(*starts, indexing="ij"), axis=-1)
    heights = np.pad(table.deviances(grid)[0], 1, constant_values=np.inf)
    around = [heights[i : i + len(starts[0]), j : j + len(starts[1])] for i in range(3) for j in range(3)]
    lowest = heights[1:-1, 1:-1] <= np.min(around, axis=0)
    minima = [_descend(table, start, estimable) for start in grid[lowest]]
    least = min(deviance for _, deviance in minima)
    ratios = min((ratios for ratios, deviance in minima if deviance <= least + MARGIN), key=tuple)
    for term in np.flatnonzero(ratios > 0):
        others = estimable.copy()
        others[term] = False
        without, deviance = _descend(table, np.where(others, ratios, 0.0), others)
        if deviance <= least + MARGIN:
            return without
    return ratios


def _descend(table: _Table, start: FloatArray, estimable: NDArray[np.bool_]) -> tuple[FloatArray, float]:
    """Return the local minimum reached by Newton's method from a start, and its deviance."""
    ratios = start
    profile = table.profile(ratios)
    for _ in range(MAX_STEPS):
        gradient = profile.gradient
        at_bound = ((ratios <= 0) & (gradient >= 0)) | ((ratios >= MAX_RATIO) & (gradient <= 0))
        moved = np.flatnonzero(estimable & ~at_bound)
        if not len(moved):
            break
        unit = np.maximum(ratios[moved], 1e-2)
        values, vectors = np.linalg.eigh(profile.curvature[np.ix_(moved, moved)] * np.outer(unit, unit))
        values = np.maximum(np.abs(values), 1e-12 * table.degrees)  # a step downhill, too, where the curve bends down
        along = vectors.T @ (gradient[moved] * unit)
        decrement = float((along**2 / values).sum())
        step = np.zeros(2)
        step[moved] = -(vectors @ (along / values)) * unit
        size = 1.0
        while True:
            reached = np.clip(ratios + size * step, 0.0, MAX_RATIO)
            tried = table.profile(reached)
            if tried.deviance <= profile.deviance + 1e-4 * float(gradient @ (reached - ratios)) or decrement < MARGIN:
                break
            size /= 2
            if size < 1e-10:
                return ratios, profile.deviance
        ratios, profile = reached, tried
        if decrement < 1e-3 * MARGIN:  # the error is squared by each step: the last left about 1e-24
            break
    return ratios, profile.deviance


def _satterthwaite(profile: _Profile, ratios: FloatArray) -> float:
    """Return the degrees of freedom of the mean's variance, over the parameters that are not at a bound."""
    used = np.append(ratios > 0, (ratios < MAX_RATIO).all())
    unit = np.append(np.maximum(ratios, 1e-300), 1.0)[used]  # logarithms of the parameters: scale-free
    values, vectors = np.linalg.eigh(profile.hessian[np.ix_(used, used)] * np.outer(unit, unit))
    kept = values > 1e-8  # directions without curvature are ignored, as in lmerTest
    along = vectors[:, kept].T @ (profile.by_variance[used] * unit)
    uncertainty = float((along**2 / values[kept]).sum())
    return 1 / uncertainty if uncertainty > 0 else math.inf
