"""An effect over subjects and scenes at once: both are samples, and the result is meant for others of either kind.

One number a subject and scene (a log ratio, a slope): value = mean + subject + scene + residual. The mean's variance
comes from the mean squares of that table, its degrees of freedom from Satterthwaite's (1946) approximation: the
quasi-F of Clark (1973). In a complete table this is what REML gives, as in lmerTest, but that the degrees of freedom do
not fall below those of the fewer of subjects and scenes. A table with gaps is fitted by REML
(`focalgradient.statistics.reml`), also where scenes are nested in subjects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse, stats

from focalgradient.statistics import reml
from focalgradient.statistics.means import paired_effect, student_effect
from focalgradient.statistics.records import ALPHA, Effect, NotComputed
from focalgradient.statistics.sizes import crossed_size
from focalgradient.statistics.skewness import Scatter, error_skewness, robust

__all__ = [
    "CROSSED",
    "FEWEST_SCENES",
    "Components",
    "Moments",
    "components",
    "crossed_effect",
    "moments",
    "noise_share",
    "noise_shares",
    "over_subjects",
    "own_means",
    "random_scenes",
    "with_scenes",
]

FloatArray = NDArray[np.float64]

FEWEST_SCENES = 5
"""With fewer scenes results hold for these scenes only. At .05 the crossed test rejects up to .11 of true null
hypotheses with 2 scenes, up to .07 with 3, at most .05 with 5 (simulated, N = 4 to 20, scenes that differ by a standard
deviation of 0.1)."""

SWEEPS = 200
"""Of the additive model through a table with gaps; it stops sooner where nothing moves any more."""

SATTERTHWAITE = "Satterthwaite's t"
CROSSED = f"mean over subjects and scenes, both random, {SATTERTHWAITE}"
GENERALISED = f"scenes random, {SATTERTHWAITE}"
THESE = "mean over subjects, for these scenes, t on subjects - 1"


@dataclass(frozen=True, slots=True)
class Moments:
    """What one or many tables of subjects by scenes give; each field has the shape of the tables' leading axes.

    Parameters
    ----------
    mean, standard_error, df
        The mean, its standard error and Satterthwaite's degrees of freedom, subjects and scenes both random.
    subjects, scenes, residual
        Mean squares.
    """

    mean: FloatArray
    standard_error: FloatArray
    df: FloatArray
    subjects: FloatArray
    scenes: FloatArray
    residual: FloatArray

    @property
    def noise(self) -> FloatArray:
        """Share of the variance of the subjects' own means that the noise of their answers explains, 0 to 1."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(self.residual < self.subjects, self.residual / self.subjects, 1.0))


@dataclass(frozen=True, slots=True)
class Components:
    """The variance components behind an effect, and a check of what is left.

    Parameters
    ----------
    formula
        The model, as R's lme4 writes it.
    subjects, scenes, residual
        Standard deviations over subjects, over scenes, and of the residuals; 0 where the estimate is negative.
    shapiro_w, shapiro_p
        Shapiro and Wilk's test that the residuals are normal.
    largest
        Largest residual over their standard deviation.
    skewness
        Of the subjects' own means (adjusted Fisher-Pearson coefficient); None with fewer than four.
    subjects_w, subjects_p
        Shapiro and Wilk's test that the subjects' own means are normal; None with fewer than four.
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
        """Whether the subjects' own means are shown not to be normal, at .05."""
        return self.subjects_p is not None and self.subjects_p < ALPHA


def moments(cells: ArrayLike, missing: int = 0) -> Moments:
    """Mean, standard error and degrees of freedom of complete tables.

    Parameters
    ----------
    cells
        Shape (..., subjects, scenes), two or more of each; many tables are done at once.
    missing
        Number of cells of each table that were filled in: the residual has that many degrees of freedom less.

    Notes
    -----
    The scenes' variance is taken as 0 where its estimate is negative, so the error is never below that over subjects
    alone. Where scenes do not differ this is a little careful: intervals of 95 % cover 96 to 97 %. The
    degrees of freedom are not below the fewer of subjects and scenes, less one: of a sum of mean squares they never
    are; that the residual is subtracted takes them below where its share is large, and intervals cover up to 98 %.

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
    freedom = max((subjects - 1) * (scenes - 1) - missing, 1)
    residual = (left**2).sum(axis=(-2, -1)) / freedom
    both = of_rows + of_columns - residual
    with np.errstate(divide="ignore", invalid="ignore"):
        satterthwaite = both**2 / (of_rows**2 / (subjects - 1) + of_columns**2 / (scenes - 1) + residual**2 / freedom)
    differ = of_columns > residual
    variance = np.where(differ, both, of_rows)
    least = float(min(subjects, scenes) - 1)
    df = np.where(differ, np.maximum(satterthwaite, least), subjects - 1.0)
    return Moments(mean, np.sqrt(variance / (subjects * scenes)), df, of_rows, of_columns, residual)


def over_subjects(cells: ArrayLike, *, bounded: bool = False, robust_decides: bool = True) -> Effect | NotComputed:
    """The mean of the subjects' own means, for these scenes only, by Student's t.

    Parameters
    ----------
    cells
        A row a subject, a column a scene; NaN where there is no value.
    bounded, robust_decides
        See `crossed_effect`.

    Examples
    --------
    >>> round(over_subjects([[0.1, 0.3], [0.2, 0.4], [0.3, 0.1]]).p, 3)
    0.02
    """
    shared = _used(cells)
    found = paired_effect(own_means(shared), THESE)
    return found if isinstance(found, NotComputed) or bounded else _robust(found, shared, robust_decides)


def crossed_effect(
    cells: ArrayLike, *, bounded: bool = False, robust_decides: bool = True, quick: bool = False
) -> Effect | NotComputed:
    """The mean of a table of subjects by scenes, generalised over both where there are five or more scenes.

    Parameters
    ----------
    cells
        A row a subject, a column a scene; NaN where there is no value.
    bounded
        Whether values come from a scale with ends, like shares of choices or steps. Student's t then keeps its level
        however skewed people are; else a test robust to skewness stands beside it
        (`focalgradient.statistics.skewness`).
    robust_decides
        Whether the robust test decides, or Student's t.
    quick
        Whether d is left out, and REML searched from one start: for many analyses alike.

    Returns
    -------
    Effect
        `method` says whether scenes are random. The effect size is d over subjects and scenes, d_z over subjects only.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> table = 0.3 + rng.normal(0, 0.2, (8, 1)) + rng.normal(0, 0.1, (1, 12)) + rng.normal(0, 0.2, (8, 12))
    >>> effect = crossed_effect(table)
    >>> round(effect.estimate, 2), round(effect.df, 1), effect.method
    (0.32, 7.0, "mean over subjects and scenes, both random, Satterthwaite's t")
    >>> round(effect.p, 4), round(effect.robust.p, 4), round(effect.d.estimate, 2)
    (0.0007, 0.0196, 1.33)
    """
    shared = _used(cells)
    subjects, scenes = shared.shape
    gaps = int(np.isnan(shared).sum())
    own = over_subjects(shared, bounded=bounded, robust_decides=robust_decides)
    if isinstance(own, NotComputed) or scenes < FEWEST_SCENES:
        return own
    remarks: tuple[str, ...] = ()
    if gaps:
        if shared.size - gaps == subjects == scenes:  # one cell each: nothing separates subjects from scenes
            return own
        left = reml.fit(shared, quick=quick)
        mean, error, df = left.mean, left.standard_error, left.df
        filled = np.isfinite(shared)
        each = stats.hmean(filled.sum(axis=0)), stats.hmean(filled.sum(axis=1))  # subjects a scene, scenes a subject
        squares = (
            left.residual**2 + each[1] * left.subjects**2,
            left.residual**2 + each[0] * left.scenes**2,
            left.residual**2,
        )
        remarks = (f"{gaps} of {shared.size} cells of subjects by scenes have no answers: the rest is fitted by REML.",)
    else:
        found = moments(shared)
        mean, error, df = (float(one) for one in (found.mean, found.standard_error, found.df))
        squares = float(found.subjects), float(found.scenes), float(found.residual)
        each = subjects, scenes
    size = None if quick else crossed_size(mean, squares, float(each[0]), float(each[1]), shared.size - gaps)
    effect = replace(student_effect(mean, error, subjects, CROSSED, df=df, remarks=remarks), d=size)
    return effect if bounded else _robust(effect, shared, robust_decides)


def _robust(effect: Effect, cells: FloatArray, decides: bool) -> Effect:
    """The effect with the test robust to the skewness of the subjects' own means."""
    skewness = float(error_skewness(own_means(cells)[:, None], effect.standard_error))
    scatter = Scatter(effect.subjects, skewness, noise_share(cells))
    test = robust(effect.estimate, effect.standard_error, effect.df, scatter, decides=decides)
    return replace(effect, robust=test)


def random_scenes(effect: Effect) -> bool:
    """Whether an effect is generalised over scenes, too.

    >>> random_scenes(crossed_effect(np.random.default_rng(1).normal(size=(4, 4))))
    False
    """
    return effect.method.endswith(SATTERTHWAITE)


def with_scenes(effect: Effect, scenes: int, between: float, within: float, within_df: float = math.inf) -> Effect:
    """An effect whose standard error is over subjects, for these scenes, generalised to others.

    Parameters
    ----------
    effect
        Over subjects.
    scenes
        How many.
    between
        Variance of the estimate as the scatter of the scenes shows it.
    within, within_df
        What answers to scenes that do not differ would make of it, and its degrees of freedom. Only what `between` has
        beyond this is added, as in `moments`: between, with a degree of freedom less than scenes, less within.

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
    squares = over**2 / effect.df + between**2 / (scenes - 1) + within**2 / within_df
    df = max(both**2 / squares, min(effect.df, scenes - 1))
    found = student_effect(effect.estimate, math.sqrt(both), effect.subjects, method, df=df, dz=effect.dz)
    return replace(found, remarks=effect.remarks)


def components(cells: ArrayLike, response: str) -> Components | NotComputed:
    """The variance components of the model of `crossed_effect`, and whether its residuals look normal.

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
    if np.isnan(shared).any():
        fitted = reml.fit(shared)
        left = fitted.residuals[np.isfinite(shared)]
        of_subjects, of_scenes, residual = fitted.subjects, fitted.scenes, fitted.residual
    else:
        found = moments(shared)
        rows, columns = shared.mean(axis=1, keepdims=True), shared.mean(axis=0, keepdims=True)
        left = (shared - rows - columns + shared.mean()).ravel()
        of_subjects = math.sqrt(max(0.0, float(found.subjects - found.residual) / scenes))
        of_scenes = math.sqrt(max(0.0, float(found.scenes - found.residual) / subjects))
        residual = math.sqrt(float(found.residual))
    if residual <= 1e-12 or len(left) < 4:  # Shapiro and Wilk need a few
        return NotComputed("Nothing is left beside subjects and scenes: there are no residuals to check.")
    w, p = stats.shapiro(left[:: -(-len(left) // 5000)])  # beyond 5000 its p is not accurate
    formula = f"{response} ~ 1 + (1 | participant_id) + (1 | scene)"
    largest = float(np.abs(left).max() / residual)
    own = own_means(shared)
    if subjects < 4:
        return Components(formula, of_subjects, of_scenes, residual, float(w), float(p), largest)
    skewness, (own_w, own_p) = float(stats.skew(own, bias=False)), map(float, stats.shapiro(own))
    check = skewness, own_w, own_p
    return Components(formula, of_subjects, of_scenes, residual, float(w), float(p), largest, *check)


def own_means(cells: FloatArray) -> FloatArray:
    """The subjects' own means; where cells are empty, of cells filled by subject + scene, if that is possible.

    >>> own_means(np.array([[0.1, 0.3], [0.2, 0.6]])).round(2).tolist()
    [0.2, 0.4]
    """
    if not cells.size:
        return np.empty(0)
    return np.asarray(_filled(cells).mean(axis=1) if _connected(cells) else np.nanmean(cells, axis=1))


def noise_share(cells: FloatArray) -> float:
    """Share of the variance of the subjects' own means that the noise of their answers explains, 0 to 1.

    The noise is what subject + scene leave; where scenes do not connect the subjects, what the subjects' means leave. 1
    where neither leaves a degree of freedom.

    >>> round(noise_share(np.array([[0.1, 0.3, 0.2], [0.4, 0.6, 0.2], [0.2, 0.5, 0.1]])), 3)
    0.304
    """
    filled = np.isfinite(cells)
    subjects, scenes = cells.shape
    connected = _connected(cells)
    freedom = int(filled.sum()) - subjects - (scenes - 1 if connected else 0)
    whole = _filled(cells) if connected else cells
    own = np.nanmean(whole, axis=1)
    left = whole - own[:, None] - ((whole.mean(axis=0) - whole.mean()) if connected else 0.0)
    between = float(own.var(ddof=1))
    if freedom < 1 or not between > 0:
        return 1.0
    each = float((1 / filled.sum(axis=1)).mean())
    return min(float(np.nansum(left**2)) / freedom * each / between, 1.0)


def noise_shares(cells: ArrayLike) -> FloatArray:
    """`noise_share` of complete tables, (..., subjects, scenes), many at once.

    >>> noise_shares([[[0.1, 0.3, 0.2], [0.4, 0.6, 0.2], [0.2, 0.5, 0.1]]]).round(3)
    array([0.304])
    """
    cells = np.asarray(cells, dtype=float)
    return moments(cells).noise if cells.shape[-1] > 1 else np.ones(cells.shape[:-2])


def _used(cells: ArrayLike) -> FloatArray:
    """Without the subjects and the scenes that have no value."""
    table = np.atleast_2d(np.asarray(cells, dtype=float))
    table = table[np.isfinite(table).any(axis=1)]
    return table[:, np.isfinite(table).any(axis=0)]


def _connected(cells: FloatArray) -> bool:
    """Whether every subject can be compared with every other through scenes that they share."""
    if np.isfinite(cells).all():
        return True
    subjects = len(cells)
    row, column = np.nonzero(np.isfinite(cells))
    graph = sparse.coo_matrix((np.ones(len(row)), (row, subjects + column)), shape=(sum(cells.shape),) * 2)
    return int(sparse.csgraph.connected_components(graph, directed=False)[0]) == 1


def _filled(cells: FloatArray) -> FloatArray:
    """Gaps filled with subject + scene, fitted to the rest by least squares."""
    gaps = np.isnan(cells)
    if not gaps.any():
        return cells
    whole = np.where(gaps, np.nanmean(cells), cells)
    for _ in range(SWEEPS):
        fit = whole.mean(axis=1, keepdims=True) + whole.mean(axis=0, keepdims=True) - whole.mean()
        moved = float(np.abs(fit - whole)[gaps].max())
        whole = np.where(gaps, fit, cells)
        if moved < 1e-10:
            break
    return whole
