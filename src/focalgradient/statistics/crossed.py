"""Effects over crossed random subjects and scenes, which generalise to new subjects and new scenes.

The model of one value per subject and scene (a log ratio or a slope) is value = mean + subject + scene + residual. The
variance of the mean follows from the mean squares of the table, the degrees of freedom from Satterthwaite's (1946)
approximation: the quasi-F of Clark (1973). For complete tables this equals REML as in lmerTest, except that the degrees
of freedom do not fall below the smaller of subjects - 1 and scenes - 1. Incomplete tables, and scenes nested in
subjects, are fitted by REML (`focalgradient.statistics.reml`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse, stats

from focalgradient.arrays import FloatArray
from focalgradient.statistics import reml
from focalgradient.statistics.means import paired_effect, student_effect
from focalgradient.statistics.records import ALPHA, Effect, NotComputed, size_interval

__all__ = [
    "CROSSED",
    "FEWEST_SCENES",
    "Components",
    "Moments",
    "additive_means",
    "components",
    "crossed_effect",
    "mean_tests",
    "moments",
    "over_subjects",
    "own_means",
    "random_scenes",
    "with_scenes",
]


FEWEST_SCENES = 5
"""Minimum number of scenes to generalise over scenes. At a level of .05 the crossed test rejects up to .11 of true null
hypotheses with 2 scenes, up to .07 with 3, and at most .05 with 5 (simulated; N = 4 to 20, SD over scenes 0.1).
"""

SATTERTHWAITE = "Satterthwaite's t"
CROSSED = f"mean over subjects and scenes, both random, {SATTERTHWAITE}"
GENERALISED = f"scenes random, {SATTERTHWAITE}"
THESE = "mean over subjects, for these scenes, t on subjects - 1"


@dataclass(frozen=True, slots=True)
class Moments:
    """Moments of one or many tables of subjects x scenes; each field has the shape of the leading axes.

    Parameters
    ----------
    mean, standard_error, df
        Mean, its standard error and Satterthwaite's degrees of freedom, with subjects and scenes random.
    subjects, scenes, residual
        Mean squares of subjects, scenes and residuals.
    """

    mean: FloatArray
    standard_error: FloatArray
    df: FloatArray
    subjects: FloatArray
    scenes: FloatArray
    residual: FloatArray


@dataclass(frozen=True, slots=True)
class Components:
    """Variance components of an effect, with checks of normality.

    Parameters
    ----------
    formula
        Model in the notation of R's lme4.
    subjects, scenes, residual
        Standard deviations over subjects, over scenes, and of the residuals; 0 if the estimate is negative.
    shapiro_w, shapiro_p
        Shapiro-Wilk test of normality of the residuals.
    largest
        Largest absolute residual in units of the residual standard deviation.
    skewness
        Skewness of the subject means (adjusted Fisher-Pearson coefficient); None with fewer than four subjects.
    subjects_w, subjects_p
        Shapiro-Wilk test of normality of the subject means; None with fewer than four subjects.
    """

    formula: str
    subjects: float
    scenes: float
    residual: float
    shapiro_w: float
    shapiro_p: float
    largest: float
    skewness: float | None = None
    subjects_w: float | None = None
    subjects_p: float | None = None

    @property
    def skewed(self) -> bool:
        """True if the subject means deviate from normality at the .05 level."""
        return self.subjects_p is not None and self.subjects_p < ALPHA


def moments(cells: ArrayLike, missing: int = 0) -> Moments:
    """Return mean, standard error and degrees of freedom of complete tables.

    Parameters
    ----------
    cells
        Shape (..., subjects, scenes), at least two of each; the leading axes enumerate tables.
    missing
        Number of imputed cells per table, which reduces the residual degrees of freedom by that number.

    Notes
    -----
    A negative estimate of the scene variance is set to 0, so that the standard error is never below that over subjects
    alone. If scenes do not differ, this is slightly conservative: 95 % intervals cover 96 to 97 %. The degrees of
    freedom are bounded from below by the smaller of subjects and scenes, minus one, as for any sum of mean squares.
    Subtracting the residual mean square would otherwise lower them further where it is large, and intervals
    would cover up to 98 %.

    Examples
    --------
    >>> found = moments([[0.1, 0.3, 0.2], [0.4, 0.6, 0.2], [0.2, 0.5, 0.1]])
    >>> round(float(found.mean), 3), round(float(found.standard_error), 3), round(float(found.df), 2)
    (0.289, 0.103, 2.82)
    """
    cells = np.asarray(cells, dtype=float)
    subjects, scenes = cells.shape[-2:]
    mean = cells.mean(axis=(-2, -1))
    rows, columns = cells.mean(axis=-1), cells.mean(axis=-2)
    of_rows, of_columns = scenes * rows.var(axis=-1, ddof=1), subjects * columns.var(axis=-1, ddof=1)
    left = cells - rows[..., :, None] - columns[..., None, :] + mean[..., None, None]
    residual_df = max((subjects - 1) * (scenes - 1) - missing, 1)
    residual = (left**2).sum(axis=(-2, -1)) / residual_df
    both = of_rows + of_columns - residual
    with np.errstate(divide="ignore", invalid="ignore"):
        satterthwaite = both**2 / (
            of_rows**2 / (subjects - 1) + of_columns**2 / (scenes - 1) + residual**2 / residual_df
        )
    differ = of_columns > residual
    variance = np.where(differ, both, of_rows)
    least = float(min(subjects, scenes) - 1)
    df = np.where(differ, np.maximum(satterthwaite, least), subjects - 1.0)
    return Moments(mean, np.sqrt(variance / (subjects * scenes)), df, of_rows, of_columns, residual)


def mean_tests(cells: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean, standard error and degrees of freedom of complete tables as `crossed_effect` tests them.

    Parameters
    ----------
    cells
        Shape (..., subjects, scenes); the leading axes enumerate tables.

    Examples
    --------
    >>> mean, error, df = mean_tests(np.array([[[0.1, 0.3], [0.2, 0.4], [0.3, 0.1]]]))
    >>> mean.round(3).tolist(), error.round(3).tolist(), df.tolist()
    ([0.233], [0.033], [2.0])
    """
    if cells.shape[-1] >= FEWEST_SCENES:
        found = moments(cells)
        return found.mean, found.standard_error, found.df
    own = cells.mean(axis=-1)
    error = own.std(axis=-1, ddof=1) / math.sqrt(own.shape[-1])
    return own.mean(axis=-1), error, np.full(error.shape, own.shape[-1] - 1.0)


def over_subjects(cells: ArrayLike) -> Effect | NotComputed:
    """Test the mean of the subject means by Student's t, for these scenes only.

    Parameters
    ----------
    cells
        One row per subject, one column per scene; NaN without a value.

    Examples
    --------
    >>> round(over_subjects([[0.1, 0.3], [0.2, 0.4], [0.3, 0.1]]).p, 3)
    0.02
    """
    return paired_effect(own_means(_used(cells)), THESE)


def crossed_effect(cells: ArrayLike) -> Effect | NotComputed:
    """Test the mean of a table of subjects x scenes, generalised over both with five or more scenes.

    Parameters
    ----------
    cells
        One row per subject, one column per scene; NaN without a value.

    Returns
    -------
    Effect
        `method` states whether scenes are random. The effect size is d over subjects and scenes, or d_z over subjects.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> table = 0.3 + rng.normal(0, 0.2, (8, 1)) + rng.normal(0, 0.1, (1, 12)) + rng.normal(0, 0.2, (8, 12))
    >>> effect = crossed_effect(table)
    >>> round(effect.estimate, 2), round(effect.df, 1), effect.method
    (0.32, 7.0, "mean over subjects and scenes, both random, Satterthwaite's t")
    >>> round(effect.p, 4), round(effect.d.estimate, 2)
    (0.0007, 1.33)
    """
    shared = _used(cells)
    subjects, scenes = shared.shape
    gaps = int(np.isnan(shared).sum())
    own = over_subjects(shared)
    # One cell each: subjects and scenes are confounded.
    if isinstance(own, NotComputed) or scenes < FEWEST_SCENES or shared.size - gaps == subjects == scenes:
        return own
    why = f"{gaps} of {shared.size} cells of subjects by scenes have no answers: the rest is fitted by REML."
    found = _model(shared)
    total = found.subjects**2 + found.scenes**2 + found.residual**2
    test = found.mean, found.standard_error, subjects, CROSSED
    effect = student_effect(*test, df=found.df, remarks=(why,) if gaps else ())
    return replace(effect, d=size_interval(effect.statistic, effect.df, found.standard_error / math.sqrt(total)))


def _model(cells: FloatArray) -> reml.Fit:
    """Fit value = mean + subject + scene + residual: by REML with gaps, else by the mean squares."""
    if np.isnan(cells).any():
        return reml.fit(cells)
    found, (subjects, scenes) = moments(cells), cells.shape
    residual = float(found.residual)
    of_subjects = math.sqrt(max(float(found.subjects) - residual, 0.0) / scenes)
    of_scenes = math.sqrt(max(float(found.scenes) - residual, 0.0) / subjects)
    left = cells - cells.mean(axis=1, keepdims=True) - cells.mean(axis=0, keepdims=True) + cells.mean()
    mean, error, df = (float(one) for one in (found.mean, found.standard_error, found.df))
    return reml.Fit(mean, error, df, of_subjects, of_scenes, math.sqrt(residual), left)


def random_scenes(effect: Effect) -> bool:
    """Return whether an effect generalises over scenes.

    >>> random_scenes(crossed_effect(np.random.default_rng(1).normal(size=(4, 4))))
    False
    """
    return effect.method.endswith(SATTERTHWAITE)


def with_scenes(effect: Effect, scenes: int, between: float, within: float) -> Effect:
    """Generalise an effect, whose standard error is over subjects for these scenes, to other scenes.

    Parameters
    ----------
    effect
        Effect over subjects.
    scenes
        Number of scenes.
    between
        Variance of the estimate computed from the scatter between scenes, with scenes - 1 degrees of freedom.
    within
        Variance of the estimate expected if scenes did not differ, known exactly. Only the excess of `between` over it
        is added, as in `moments`.

    Examples
    --------
    >>> one = student_effect(1.0, 0.3, 10, "an example")
    >>> two = with_scenes(one, 8, 0.07, 0.02)
    >>> round(two.standard_error, 3), round(two.df, 1), two.estimate
    (0.374, 12.3, 1.0)
    """
    method = f"{effect.method.removesuffix(', t on subjects - 1')}, {GENERALISED}"
    if between <= within:
        return replace(effect, method=method)
    over = effect.standard_error**2
    both = over + between - within
    squares = over**2 / effect.df + between**2 / (scenes - 1)
    df = max(both**2 / squares, min(effect.df, scenes - 1))
    found = student_effect(effect.estimate, math.sqrt(both), effect.subjects, method, df=df, dz=effect.dz)
    return replace(found, remarks=effect.remarks)


def components(cells: ArrayLike, response: str) -> Components | NotComputed:
    """Estimate the variance components of the model of `crossed_effect`, and test its residuals for normality.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> found = components(rng.normal(0, 0.2, (8, 1)) + rng.normal(0, 0.3, (8, 12)), "log_ratio")
    >>> found.formula, round(found.residual, 2)
    ('log_ratio ~ 1 + (1 | participant_id) + (1 | scene)', 0.27)
    """
    shared = _used(cells)
    subjects, scenes = shared.shape
    if subjects < 2 or scenes < 2 or np.isfinite(shared).sum() == subjects == scenes:
        return NotComputed("Variance components need two or more subjects with two or more scenes.")
    found = _model(shared)
    left, residual = found.residuals[np.isfinite(shared)], found.residual
    if residual <= 1e-12 or len(left) < 4:  # minimum of the Shapiro-Wilk test
        return NotComputed("Subjects and scenes account for all variance: there are no residuals to check.")
    w, p = stats.shapiro(left[:: -(-len(left) // 5000)])  # its p is inaccurate above 5000 values
    formula = f"{response} ~ 1 + (1 | participant_id) + (1 | scene)"
    parts = found.subjects, found.scenes, residual, float(w), float(p), float(np.abs(left).max() / residual)
    if subjects < 4:
        return Components(formula, *parts)
    own = own_means(shared)
    return Components(formula, *parts, float(stats.skew(own, bias=False)), *map(float, stats.shapiro(own)))


def own_means(cells: FloatArray) -> FloatArray:
    """Return the means of subjects with values; gaps are imputed by subject + scene if the design is connected.

    >>> own_means(np.array([[0.1, 0.3], [0.2, 0.6]])).round(2).tolist()
    [0.2, 0.4]
    """
    cells = _used(cells)
    if not cells.size:
        return np.empty(0)
    means = additive_means(cells)
    return np.nanmean(cells, axis=1) if np.isnan(means).any() else means


def additive_means(cells: FloatArray) -> FloatArray:
    """Return the means of rows over all columns, with gaps imputed by row + column; NaN if cells do not connect rows.

    These are the least-squares means of an additive model.

    >>> additive_means(np.array([[0.1, 0.3], [0.2, np.nan]])).round(2).tolist()
    [0.2, 0.3]
    """
    return np.asarray(_filled(cells).mean(axis=1) if _connected(cells) else np.full(len(cells), np.nan))


def _used(cells: ArrayLike) -> FloatArray:
    """Remove subjects and scenes without values."""
    table = np.atleast_2d(np.asarray(cells, dtype=float))
    table = table[np.isfinite(table).any(axis=1)]
    return table[:, np.isfinite(table).any(axis=0)]


def _connected(cells: FloatArray) -> bool:
    """Return whether all subjects are linked by shared scenes."""
    if np.isfinite(cells).all():
        return True
    subjects = len(cells)
    row, column = np.nonzero(np.isfinite(cells))
    graph = sparse.coo_matrix((np.ones(len(row)), (row, subjects + column)), shape=(sum(cells.shape),) * 2)
    return int(sparse.csgraph.connected_components(graph, directed=False)[0]) == 1


def _filled(cells: FloatArray) -> FloatArray:
    """Impute gaps with subject + scene, fitted to the other cells by least squares."""
    filled = np.isfinite(cells)
    if filled.all():
        return cells
    counts = filled.astype(float)
    rows, columns = counts.sum(axis=1), counts.sum(axis=0)
    normal = np.block([[np.diag(rows), counts], [counts.T, np.diag(columns)]])
    sums = np.concatenate([np.nansum(cells, axis=1), np.nansum(cells, axis=0)])
    levels = np.linalg.lstsq(normal, sums, rcond=1e-10)[0]  # up to a constant between subjects and scenes
    return np.where(filled, cells, levels[: len(cells), None] + levels[len(cells) :])
