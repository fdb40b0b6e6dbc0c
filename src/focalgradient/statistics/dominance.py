"""Log-normal model of percept durations whose median, spread and preference vary between people.

Each person's median, spread (standard deviation of the logarithm) and preference for one of the two readings are drawn
from normal distributions over people, so that people with few percepts are partially pooled with the others. Common
parameters are the ratio of the first percept of a trial, the drift over trials, and the serial correlation between
consecutive percepts of a trial. Percepts cut off by the end of a trial are right-censored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.statistics.durations import FEWEST, MIN_LOG_SD
from focalgradient.statistics.hessian import MIN_CURVATURE, covariance_at, hessian, polished
from focalgradient.statistics.records import NotComputed

__all__ = ["DominanceModel", "PerceptDurations", "fit_dominance", "log_likelihood_of_people"]


NODES_PER_EFFECT = 5
"""Number of Gauss-Hermite nodes per random effect: with 7, the log likelihood of 22 people changes by less than 0.05.
"""

ADAPTATIONS = 6
"""Number of times the nodes are moved to each person's posterior mean and covariance."""

MAX_POLISHES = 20
"""Maximum number of times that nodes and parameters are moved in turn until both stand still; 3 to 5 suffice."""

CONVERGED = 1e-8
"""Change of the parameters below which they stand still."""

MAX_PARAMETER = 4.0
"""Maximum absolute value of a free parameter, beyond the plausible range, which keeps the search finite."""


@dataclass(frozen=True, slots=True, eq=False)
class PerceptDurations:
    """Percept durations of several people; arrays with one entry per percept, in the order of report.

    Parameters
    ----------
    seconds
        Duration in seconds.
    censored
        True if the percept was cut off by the end of the trial.
    participant
        Participant.
    reading
        Reading: +0.5 or -0.5.
    trial
        Trial number within the participant's session, from 1.
    first
        True for the first percept of a trial; any other percept follows the entry before it.

    Raises
    ------
    InputError
        If the arrays differ in length, or a duration is not positive.
    """

    seconds: FloatArray
    censored: NDArray[np.bool_]
    participant: NDArray[Any]
    reading: FloatArray
    trial: FloatArray
    first: NDArray[np.bool_]

    def __post_init__(self) -> None:
        kinds = (float, bool, str, float, float, bool)
        for one, kind in zip(fields(self), kinds, strict=True):
            object.__setattr__(self, one.name, np.asarray(getattr(self, one.name)).astype(kind))
        lengths = {getattr(self, one.name).shape for one in fields(self)}
        if len(lengths) != 1 or len(next(iter(lengths))) != 1:
            raise InputError("The arrays of PerceptDurations differ in length: give one entry a percept in each.")
        if not (np.isfinite(self.seconds) & (self.seconds > 0)).all():
            raise InputError("seconds has a duration that is not a positive number: leave out what has none.")


@dataclass(frozen=True, slots=True)
class DominanceModel:
    """Fitted distribution of percept durations over people.

    Parameters
    ----------
    median
        Geometric mean over people of their median duration (s), averaged over the readings, in the first trial.
    median_log_sd
        Standard deviation over people of the log median.
    spread, spread_log_sd
        Geometric mean over people of the standard deviation of log duration, and the SD of its logarithm over people.
    preference, preference_sd
        Log ratio of the median of reading +0.5 to that of reading -0.5: mean and SD over people.
    first_ratio
        Ratio of the median duration of the first percept of a trial to that of later ones.
    drift
        Exponent of the trial number: the median is proportional to trial ** drift.
    serial
        Partial correlation of log duration with that of the preceding percept of the trial.
    log_likelihood
        Maximum of the marginal log likelihood (natural logarithm; durations in seconds).
    people, percepts, censored
        Numbers of people, percepts and censored percepts.
    standard_errors
        Standard errors from the observed information: of the logarithms of medians, spreads, SDs and ratios, of
        atanh(serial), and of preference and drift themselves. Empty if the information is singular.
    """

    median: float
    median_log_sd: float
    spread: float
    spread_log_sd: float
    preference: float = 0.0
    preference_sd: float = 0.0
    first_ratio: float = 1.0
    drift: float = 0.0
    serial: float = 0.0
    log_likelihood: float = math.nan
    people: int = 0
    percepts: int = 0
    censored: int = 0
    standard_errors: dict[str, float] = field(default_factory=dict)


LOGARITHMIC = {"median", "median_log_sd", "spread", "spread_log_sd", "preference_sd", "first_ratio"}
"""Parameters estimated on their logarithm; the serial correlation is estimated on atanh."""


BETWEEN = ("median_log_sd", "spread_log_sd", "preference_sd")
"""Standard deviations over people."""


def _model(free: FloatArray, names: tuple[str, ...]) -> DominanceModel:
    values: dict[str, Any] = {"median_log_sd": 0.0, "spread_log_sd": 0.0}
    for name, value in zip(names, free.tolist(), strict=True):
        values[name] = math.exp(value) if name in LOGARITHMIC else math.tanh(value) if name == "serial" else value
    return DominanceModel(**values)


class _Likelihood:
    """Log likelihood of each person, integrated over the random effects by Gauss-Hermite quadrature.

    Uncensored durations enter through their sums of squares and products, so that the cost does not depend on their
    number.
    """

    def __init__(self, data: PerceptDurations):
        logs = np.log(data.seconds)
        cut = data.censored
        names, who = np.unique(data.participant, return_inverse=True)
        self.people, self.percepts = len(names), len(logs)
        self.count = np.bincount(who[~cut], minlength=len(names))
        first = data.first
        rows = np.stack([logs, np.ones_like(logs), data.reading, first, np.log(data.trial)], axis=1)
        before = np.where(first[:, None], 0.0, np.roll(rows, 1, axis=0))
        of_person = [who[~cut] == number for number in range(self.people)]
        rows_seen, before_seen = rows[~cut], before[~cut]
        products = [(rows_seen[own], before_seen[own]) for own in of_person]
        self.squares = np.array([a.T @ a for a, _ in products])
        self.mixed = np.array([a.T @ b + b.T @ a for a, b in products])
        self.before_squares = np.array([b.T @ b for _, b in products])
        self.logs = np.bincount(who[~cut], logs[~cut], self.people)
        self.cut, self.before_cut, self.of_cut = rows[cut], before[cut], who[cut]
        nodes, weights = np.polynomial.hermite_e.hermegauss(NODES_PER_EFFECT)
        grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 3)
        share = np.log(weights / math.sqrt(2 * math.pi))
        self.nodes = grid
        self.weights = np.sum(np.meshgrid(share, share, share, indexing="ij"), axis=0).ravel() + (grid**2).sum(1) / 2
        self.centre = np.zeros((self.people, 3))
        self.root = np.repeat(0.5 * np.eye(3)[None], self.people, axis=0)

    def _given(self, model: DominanceModel, own: FloatArray) -> FloatArray:
        """Return the log likelihood given the standardised random effects (people x nodes)."""
        log_median = math.log(model.median) + model.median_log_sd * own[..., 0]
        log_spread = math.log(model.spread) + model.spread_log_sd * own[..., 1]
        preference = model.preference + model.preference_sd * own[..., 2]
        shared = np.broadcast_to([-math.log(model.first_ratio), -model.drift], (*log_median.shape, 2))
        along = np.concatenate(
            [np.ones((*log_median.shape, 1)), -log_median[..., None], -preference[..., None], shared], axis=-1
        )
        products = self.squares - model.serial * self.mixed + model.serial**2 * self.before_squares
        square = (along @ products * along).sum(axis=-1)
        count = self.count[:, None]
        found = -square * np.exp(-2 * log_spread) / 2 - count * (log_spread + math.log(2 * math.pi) / 2)
        found -= self.logs[:, None]
        residual = np.einsum("ci,cni->cn", self.cut - model.serial * self.before_cut, along[self.of_cut])
        np.add.at(found, self.of_cut, special.log_ndtr(-residual * np.exp(-log_spread[self.of_cut])))
        return np.asarray(found)

    def _integrated(self, model: DominanceModel) -> tuple[FloatArray, FloatArray, FloatArray]:
        own = self.centre[:, None] + self.nodes @ self.root.transpose(0, 2, 1)
        density = self._given(model, own) - (own**2).sum(-1) / 2 + self.weights
        peak = density.max(axis=1)
        volume = np.log(np.diagonal(self.root, axis1=1, axis2=2)).sum(axis=1)  # a Cholesky factor
        return peak + np.log(np.exp(density - peak[:, None]).sum(axis=1)) + volume, density, own

    def adapt(self, model: DominanceModel) -> None:
        """Centre and scale the nodes on each person's posterior."""
        for _ in range(ADAPTATIONS):
            _, density, own = self._integrated(model)
            weight = np.exp(density - density.max(axis=1, keepdims=True))
            weight /= weight.sum(axis=1, keepdims=True)
            self.centre = np.einsum("pn,pni->pi", weight, own)
            away = own - self.centre[:, None]
            covariance = np.einsum("pn,pni,pnj->pij", weight, away, away) + 1e-4 * np.eye(3)
            self.root = np.linalg.cholesky(covariance)

    def of_people(self, model: DominanceModel) -> FloatArray:
        return self._integrated(model)[0]


def log_likelihood_of_people(model: DominanceModel, data: PerceptDurations) -> dict[str, float]:
    """Return the marginal log likelihood of each person's durations, for new people.

    The person's median, spread and preference are integrated over the model's distribution: the score of a held-out
    person (natural logarithm, durations in seconds).
    """
    likelihood = _Likelihood(data)
    likelihood.adapt(model)
    names = np.unique(data.participant).tolist()
    return dict(zip(names, likelihood.of_people(model).tolist(), strict=True))


def fit_dominance(data: PerceptDurations) -> DominanceModel | NotComputed:
    """Fit the log-normal model of percept durations by maximum likelihood.

    Terms without information in the data are omitted: preference without both readings, drift with one trial per
    person, serial correlation and first percepts with one percept per trial.

    Returns
    -------
    DominanceModel or NotComputed
        `NotComputed` states the reason: fewer than three people or too few uncensored durations.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> who = np.repeat(np.arange(30), 40)
    >>> logs = np.log(4) + 0.5 * rng.standard_normal(30)[who] + 0.8 * rng.standard_normal(1200)
    >>> lasted, reading = np.minimum(np.exp(logs), 9), np.tile([0.5, -0.5], 600)
    >>> data = PerceptDurations(lasted, lasted == 9, who, reading, np.ones(1200), np.ones(1200))
    >>> fit = fit_dominance(data)
    >>> round(fit.median, 1), round(fit.median_log_sd, 1), round(fit.spread, 1)
    (3.7, 0.4, 0.8)
    """
    cut, first = data.censored, data.first
    who = data.participant
    people = len(np.unique(who))
    if people < 3:
        return NotComputed(f"How people differ needs 3 of them, and there are {people}.")
    if (~cut).sum() < max(FEWEST, 2 * people):
        return NotComputed(f"A fit needs 2 uncensored durations a person, and there are {(~cut).sum()} in all.")
    logs = {"median": float(np.median(data.seconds)), "median_log_sd": 0.5, "spread": 0.8, "spread_log_sd": 0.2}
    start = {name: math.log(value) for name, value in logs.items()}
    if len(np.unique(data.reading)) > 1:
        start |= {"preference": 0.0, "preference_sd": math.log(0.25)}
    if first.any() and not first.all():
        start["first_ratio"] = 0.0
    if len(np.unique(data.trial)) > 1:
        start["drift"] = 0.0
    if not first.all():
        start["serial"] = 0.1
    return _fitted(_Likelihood(data), start)


def _fitted(likelihood: _Likelihood, start: dict[str, float]) -> DominanceModel | NotComputed:
    """Maximise from `start`; fix vanishing standard deviations over people at 0 and fit the rest again."""
    chosen, free = tuple(start), np.array(list(start.values()))

    def cost(free: FloatArray) -> float:
        beyond = float(np.square(np.maximum(np.abs(free) - MAX_PARAMETER, 0.0)).sum())
        return 100 * beyond - float(
            likelihood.of_people(_model(np.clip(free, -MAX_PARAMETER, MAX_PARAMETER), chosen)).sum()
        )

    def adapt() -> None:
        likelihood.adapt(_model(np.clip(free, -MAX_PARAMETER, MAX_PARAMETER), chosen))

    for _ in range(3):  # the nodes are fixed during each search, so that the cost is smooth
        adapt()
        free = np.asarray(optimize.minimize(cost, free, method="BFGS", options={"gtol": 0.02}).x)
    for _ in range(MAX_POLISHES):
        adapt()
        end = polished(cost, free)
        if end is None or (np.abs(end) > MAX_PARAMETER).any():  # then the search's own end stands, if it is a minimum
            break
        moved, free = float(np.abs(end - free).max()), end
        if moved < CONVERGED:
            break
    flat = np.diag(hessian(cost, free)) < MIN_CURVATURE
    vanished = [name in BETWEEN and (flat[i] or free[i] < MIN_LOG_SD) for i, name in enumerate(chosen)]
    if any(vanished):
        return _fitted(likelihood, {name: free[i] for i, name in enumerate(chosen) if not vanished[i]})
    covariance = covariance_at(cost, free)
    if covariance is None or (np.abs(free) > MAX_PARAMETER).any():
        return NotComputed(
            "The likelihood of the durations has no maximum: too many are censored, or too few were reported."
        )
    errors = dict(zip(chosen, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    return replace(
        _model(free, chosen),
        log_likelihood=-cost(free),
        people=likelihood.people,
        percepts=likelihood.percepts,
        censored=len(likelihood.cut),
        standard_errors=errors,
    )
