"""Maximum-likelihood difference scaling: a scale of perceived depth from comparisons of differences.

For a quadruple (a, b; c, d), a person judges whether the difference between c and d is larger than that between a and
b; for a triad (a, b, c), whether the difference between b and c is larger than that between a and b. The scale values
are the coefficients of a probit model (Maloney & Yang 2003, Journal of Vision 3(8):5; as a generalised linear model
Knoblauch & Maloney 2008, Journal of Statistical Software 25(2)).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from focalgradient.errors import InputError
from focalgradient.statistics.records import NotComputed

__all__ = ["DifferenceScale", "draw_quadruples", "draw_triads", "fit_difference_scale"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int_]

ITERATIONS = 100
"""Maximum number of Newton iterations."""

LARGEST = 50.0
"""Maximum scale value, in standard deviations of a judgement; larger values indicate separated answers."""

Z95 = 1.959963984540054
"""97.5 % quantile of the standard normal distribution."""


@dataclass(frozen=True, slots=True, eq=False)
class DifferenceScale:
    """Perceptual scale, in standard deviations of the judgement of a difference of differences.

    Parameters
    ----------
    values
        Scale value of each stimulus; the first is 0.
    standard_errors
        Standard errors from the expected information; 0 for the first.
    low, high
        95 % intervals from the bias-corrected bootstrap (Efron 1982), or from the standard errors without a bootstrap.
    log_likelihood
        Maximum of the log likelihood.
    trials
        Number of judgements.
    explained
        Fraction (0 to 1) of the deviance of guessing that the scale explains.
    six_point_p
        p value of the six-point test of the model, by the parametric bootstrap (Maloney & Yang 2003), in which the
        data count as one of the samples, so that it is above 0; NaN without a bootstrap, for triads, or if no trials
        test the condition.
    """

    values: FloatArray
    standard_errors: FloatArray
    low: FloatArray
    high: FloatArray
    log_likelihood: float
    trials: int
    explained: float
    six_point_p: float

    @property
    def normalised(self) -> FloatArray:
        """Scale values rescaled to 0 to 1."""
        return np.asarray(self.values / self.values[-1])

    @property
    def sigma(self) -> float:
        """Standard deviation of a judgement on the normalised scale."""
        return float(1 / self.values[-1])


def draw_quadruples(stimuli: int, trials: int | None = None, seed: int = 0) -> IntArray:
    """Draw non-overlapping quadruples (trials x 4) of stimulus indices from 0.

    Parameters
    ----------
    stimuli
        Number of stimuli, in order of magnitude; at least 4.
    trials
        Number of trials; None: each quadruple a < b < c < d once. Larger numbers repeat the quadruples evenly.
    seed
        Random seed of the order of trials and of the pairs within each.

    Examples
    --------
    >>> draw_quadruples(11).shape
    (330, 4)
    """
    return _drawn(stimuli, 4, trials, seed)


def draw_triads(stimuli: int, trials: int | None = None, seed: int = 0) -> IntArray:
    """Draw triads (trials x 3), ascending or descending; otherwise like `draw_quadruples`.

    Examples
    --------
    >>> draw_triads(11).shape
    (165, 3)
    """
    return _drawn(stimuli, 3, trials, seed)


def _drawn(stimuli: int, size: int, trials: int | None, seed: int) -> IntArray:
    if stimuli < size:
        raise InputError(f"stimuli must be at least {size}, got {stimuli}.")
    every = np.array(list(itertools.combinations(range(stimuli), size)))
    trials = len(every) if trials is None else trials
    if trials < 1:
        raise InputError(f"trials must be at least 1, got {trials}.")
    rng = np.random.default_rng(seed)
    rounds = -(-trials // len(every))
    drawn = np.concatenate([rng.permutation(every) for _ in range(rounds)])[:trials]
    turned = rng.random(trials) < 0.5
    drawn[turned] = drawn[turned][:, [2, 3, 0, 1] if size == 4 else [2, 1, 0]]
    return np.asarray(drawn)


def _design(shown: IntArray, stimuli: int) -> FloatArray:
    """Return the coefficients of the scale values in the second difference minus the first, both taken as positive."""
    if shown.shape[1] == 3:
        shown = shown[:, [0, 1, 1, 2]]
    first, second = np.sort(shown[:, :2], axis=1), np.sort(shown[:, 2:], axis=1)
    rows, design = np.arange(len(shown)), np.zeros((len(shown), stimuli))
    for places, sign in ((second[:, 1], 1), (second[:, 0], -1), (first[:, 1], -1), (first[:, 0], 1)):
        np.add.at(design, (rows, places), sign)
    return design


def _log_likelihood(eta: FloatArray, larger: NDArray[np.bool_]) -> FloatArray:
    return np.asarray(special.log_ndtr(np.where(larger, eta, -eta)))


def _fit(design: FloatArray, larger: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray] | None:
    """Fit the probit model; return coefficients and expected information, or None without a finite maximum."""
    free, beta = design[:, 1:], np.zeros(design.shape[1] - 1)
    sign = np.where(larger, 1.0, -1.0)

    def slope(beta: FloatArray) -> FloatArray:
        eta = free @ beta
        return np.asarray(sign * np.exp(-(eta**2) / 2 - math.log(2 * math.pi) / 2 - special.log_ndtr(sign * eta)))

    for _ in range(ITERATIONS):
        eta, rise = free @ beta, slope(beta)
        observed = free.T @ ((rise * (rise + eta))[:, None] * free)
        try:
            step = np.linalg.solve(observed, free.T @ rise)
        except np.linalg.LinAlgError:
            return None
        now, size = _log_likelihood(eta, larger).sum(), 1.0
        while size > 1e-6 and _log_likelihood(free @ (beta + size * step), larger).sum() < now - 1e-10:
            size /= 2
        beta = beta + size * step
        if not np.isfinite(beta).all() or np.abs(beta).max() > LARGEST:
            return None
        if np.abs(step).max() < 1e-9:
            break
    else:
        return None
    eta = free @ beta
    weight = np.exp(-(eta**2) - math.log(2 * math.pi) - special.log_ndtr(eta) - special.log_ndtr(-eta))
    return np.concatenate([[0.0], beta]), np.asarray(free.T @ (weight[:, None] * free))


def _six_points(shown: IntArray) -> IntArray:
    """Return triples of trials (a, b; d, e), (b, c; e, f), (a, c; d, f), as trial indices in that order."""
    by_pairs: dict[tuple[tuple[int, ...], tuple[int, ...]], int] = {}
    following: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    for number, quad in enumerate(shown.tolist()):
        first, second = sorted([tuple(sorted(quad[:2])), tuple(sorted(quad[2:]))])
        if (first, second) not in by_pairs:
            by_pairs[first, second] = number
            following.setdefault((first[0], second[0]), []).append((first[1], second[1], number))
    found = [
        (number, next_number, by_pairs[(a, c), (d, f)])
        for ((a, b), (d, e)), number in by_pairs.items()
        for c, f, next_number in following.get((b, e), [])
        if ((a, c), (d, f)) in by_pairs
    ]
    return np.array(found, int).reshape(-1, 3)


def _six_point_score(eta: FloatArray, larger: NDArray[np.bool_], triples: IntArray, up: FloatArray) -> float:
    """Return the log likelihood of the violations of the six-point condition (parts agree, the sum differs)."""
    says = (larger[triples] == (up[triples] > 0)).astype(float)
    p = special.ndtr(eta[triples] * up[triples])
    violated = (says[:, 0] == says[:, 1]) & (says[:, 2] != says[:, 0])
    probability = p[:, 0] * p[:, 1] * (1 - p[:, 2]) + (1 - p[:, 0]) * (1 - p[:, 1]) * p[:, 2]
    probability = np.clip(probability, 1e-12, 1 - 1e-12)
    return float(np.log(np.where(violated, probability, 1 - probability)).sum())


def fit_difference_scale(
    shown: ArrayLike, larger: ArrayLike, *, bootstrap: int = 0, seed: int = 0
) -> DifferenceScale | NotComputed:
    """Estimate a difference scale by maximum likelihood.

    Parameters
    ----------
    shown
        Stimulus indices of each trial, from 0 in order of magnitude: trials x 4 (a, b; c, d) or x 3 (a, b, c).
        Differences are taken as positive, in either order of the two stimuli.
    larger
        1 or True if the second difference was judged larger, else 0.
    bootstrap
        Number of bootstrap samples for the intervals and the six-point test; 0: none.
    seed
        Random seed of the bootstrap.

    Returns
    -------
    DifferenceScale or NotComputed
        `NotComputed` if the answers do not determine every value.

    Raises
    ------
    InputError
        If shapes are wrong, an index is not an integer, or an answer is not 0 or 1.

    Examples
    --------
    >>> shown = draw_quadruples(7, 1000)
    >>> scale = 8 * np.linspace(0, 1, 7) ** 2
    >>> difference = np.abs(scale[shown[:, 3]] - scale[shown[:, 2]]) - np.abs(scale[shown[:, 1]] - scale[shown[:, 0]])
    >>> larger = difference + np.random.default_rng(1).standard_normal(1000) > 0
    >>> found = fit_difference_scale(shown, larger)
    >>> bool((np.abs(found.values - scale) <= 3 * found.standard_errors).all())
    True
    """
    given, answers = np.asarray(shown), np.asarray(larger)
    if given.ndim != 2 or given.shape[1] not in (3, 4) or answers.shape != given.shape[:1] or not len(answers):
        raise InputError("shown must have 4 columns (quadruples) or 3 (triads), and larger one answer for each row.")
    if not np.issubdtype(given.dtype, np.number) or (given != np.round(given)).any() or given.min() < 0:
        raise InputError("shown must have the whole numbers of the stimuli, from 0.")
    if not np.isin(answers, (0, 1)).all():
        raise InputError("larger must be 1 where the second difference was judged larger, else 0.")
    shown, larger = given.astype(int), answers.astype(bool)
    stimuli = int(shown.max()) + 1
    if stimuli < 3:
        return NotComputed(f"A difference scale needs 3 stimuli, but there are {stimuli}.")
    if lacking := sorted(set(range(stimuli)) - set(shown.ravel().tolist())):
        return NotComputed(f"Stimulus {lacking[0]} was never shown, so that its value is not determined.")
    design = _design(shown, stimuli)
    fit = _fit(design, larger)
    if fit is None:
        return NotComputed("The answers do not determine the scale: they are too few, or none contradicts another.")
    values, information = fit
    errors = np.concatenate([[0.0], np.sqrt(np.diag(np.linalg.inv(information)))])
    if values[-1] <= 0:
        return NotComputed("The last stimulus has no larger value than the first: order the stimuli by magnitude.")
    eta = design @ values
    of_trials = _log_likelihood(eta, larger)
    explained = 1 - float(of_trials.sum()) / (len(larger) * math.log(0.5))
    low, high = values - Z95 * errors, values + Z95 * errors
    six_point_p = math.nan
    if bootstrap:
        low, high, six_point_p = _bootstrapped(shown, design, values, larger, bootstrap, seed)
    return DifferenceScale(values, errors, low, high, float(of_trials.sum()), len(larger), explained, six_point_p)


def _bootstrapped(
    shown: IntArray, design: FloatArray, values: FloatArray, larger: NDArray[np.bool_], samples: int, seed: int
) -> tuple[FloatArray, FloatArray, float]:
    """Return bootstrap intervals and the p value of the six-point test, refitting the scale to each sample."""
    rng = np.random.default_rng(seed)
    eta = design @ values
    triples = _six_points(shown) if shown.shape[1] == 4 else np.empty((0, 3), int)
    first = np.sort(shown[:, :2], axis=1)
    second = np.sort(shown[:, -2:], axis=1)
    behind = (second[:, 0] > first[:, 0]) | ((second[:, 0] == first[:, 0]) & (second[:, 1] >= first[:, 1]))
    up = np.where(behind, 1.0, -1.0)  # sign of the pair order relative to `_six_points`
    own_six = _six_point_score(eta, larger, triples, up) if len(triples) else math.nan
    drawn, sixes = [], []
    for _ in range(samples):
        simulated = rng.random(len(eta)) < special.ndtr(eta)
        fit = _fit(design, simulated)
        if fit is None:
            continue
        drawn.append(fit[0])
        if len(triples):
            sixes.append(_six_point_score(design @ fit[0], simulated, triples, up))
    if len(drawn) < samples / 2:
        return np.full(len(values), math.nan), np.full(len(values), math.nan), math.nan
    low, high = _bias_corrected(np.array(drawn), values)
    six = (1 + int((np.array(sixes) <= own_six).sum())) / (1 + len(sixes)) if sixes else math.nan
    return low, high, six


def _bias_corrected(drawn: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return Efron's bias-corrected intervals: with few trials, scales in units of their own noise are too long."""
    below = (drawn < values).mean(axis=0)
    shift = special.ndtri(np.clip(below, 1 / len(drawn), 1 - 1 / len(drawn)))
    ends = [
        [np.quantile(column, special.ndtr(2 * of + z)) for column, of in zip(drawn.T, shift, strict=True)]
        for z in (-Z95, Z95)
    ]
    low, high = np.array(ends)
    low[0] = high[0] = 0.0
    return low, high
