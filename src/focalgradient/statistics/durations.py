"""Maximum-likelihood distributions of percept durations with right-censoring.

A percept cut off by the end of its trial lasted longer than recorded; excluding it would bias the durations downwards.
`fit_durations` pools all durations; `fit_durations_of_people` lets the mean vary between people.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.statistics.hessian import covariance_at, polished
from focalgradient.statistics.records import NotComputed

__all__ = [
    "FEWEST",
    "DurationFit",
    "DurationsOfPeople",
    "DurationsOfPerson",
    "Family",
    "fit_durations",
    "fit_durations_of_people",
    "gamma_log_density",
    "lognormal_log_density",
]


Family = Literal["gamma", "lognormal"]

FEWEST = 5
"""Minimum number of uncensored durations."""

ALIKE = 1e-6
"""Gain of log likelihood by differences between people below which they count as alike: the search ends at 1e-7."""

MIN_LOG_SD = -3.5
"""Log standard deviation over people below which it is set to 0: durations then differ by less than 3 %."""

NODES = np.linspace(-8.0, 8.0, 81)
"""Integration nodes of a person's mean, in standard deviations; the trapezoidal rule is then exact to 1e-8."""


@dataclass(frozen=True, slots=True)
class DurationFit:
    """Distribution of durations, fitted by maximum likelihood.

    Parameters
    ----------
    family
        Family: gamma or log-normal.
    shape, scale
        Shape and scale (s) of the gamma; for the log-normal, standard deviation of the logarithm and median (s).
    mean, cv
        Mean in seconds, and coefficient of variation.
    log_likelihood
        Maximum of the log likelihood; both families have two parameters, so that the larger value fits better.
    shape_se, mean_se
        Standard errors of shape and mean from the observed information; None if it is singular.
    """

    family: Family
    shape: float
    scale: float
    mean: float
    cv: float
    log_likelihood: float
    shape_se: float | None = None
    mean_se: float | None = None


@dataclass(frozen=True, slots=True)
class DurationsOfPerson:
    """Durations of one person.

    Parameters
    ----------
    participant_id
        Participant.
    durations, censored
        Number of durations, and number censored by the end of a trial.
    fit
        Gamma distribution fitted to this person alone.
    """

    participant_id: str
    durations: int
    censored: int
    fit: DurationFit | NotComputed


@dataclass(frozen=True, slots=True)
class DurationsOfPeople:
    """Gamma distributions of several people, with a common shape and a separate mean for each person.

    The log means are normally distributed over people. Standard errors (se) are from the observed information; None if
    it is singular. If people hardly differ, `log_sd` is 0, without a standard error, and the others are those of one
    gamma distribution of all durations.

    Parameters
    ----------
    geometric_mean
        Geometric mean over people of their mean durations (s); `geometric_mean_log_se` is the standard error of its
        logarithm.
    shape
        Shape of the gamma distribution; 1 is the exponential distribution.
    log_sd
        Standard deviation over people of the log mean; 0, without a standard error, where it is below 3 %.
    log_likelihood
        Maximum of the log likelihood.
    people
        Each person's separate fit.
    """

    geometric_mean: float
    geometric_mean_log_se: float | None
    shape: float
    shape_se: float | None
    log_sd: float
    log_sd_se: float | None
    log_likelihood: float
    people: tuple[DurationsOfPerson, ...]


def fit_durations(durations: ArrayLike, censored: ArrayLike, family: Family) -> DurationFit | NotComputed:
    """Fit a distribution to durations in seconds; `censored` is True for lower limits.

    Examples
    --------
    >>> fit = fit_durations([2.0, 3.0, 5.0, 4.0, 6.0, 1.0], [False] * 5 + [True], "gamma")
    >>> round(fit.mean, 2), round(fit.cv, 2)
    (4.0, 0.37)
    """
    durations, censored = np.asarray(durations, dtype=float), np.asarray(censored, dtype=bool)
    complete = durations[~censored]
    if complete.size < FEWEST:
        return NotComputed(f"A fit needs {FEWEST} uncensored durations, and there are {complete.size}.")
    if np.ptp(complete) == 0:
        return NotComputed(f"All durations are identical ({complete[0]:.3g} s): no distribution can be fitted.")
    spread = float(np.log(complete).std())
    start = np.array([-2 * math.log(spread), math.log(complete.mean() * spread**2)])
    if family == "lognormal":
        start = np.array([math.log(spread), np.log(complete).mean()])

    def cost(free: FloatArray) -> float:
        if family == "gamma":
            return -float(gamma_log_density(durations, float(np.exp(free[0])), free[1], censored).sum())
        return -float(lognormal_log_density(durations, free[1], math.exp(free[0]), censored).sum())

    with np.errstate(over="ignore", invalid="ignore"):  # the search may evaluate extreme parameters
        found = optimize.minimize(
            cost, start, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9, "maxiter": 2000}
        )
        at = polished(cost, found.x)
        covariance = None if at is None else covariance_at(cost, at)
    if at is None or covariance is None:
        return NotComputed(
            f"The likelihood of the {family} distribution has no maximum: too many durations are censored."
        )
    shape, scale = (float(number) for number in np.exp(at))
    if family == "gamma":
        mean, cv, of_mean = shape * scale, shape**-0.5, np.array([1.0, 1.0])
    else:
        mean, cv = scale * math.exp(shape**2 / 2), math.sqrt(math.expm1(shape**2))
        of_mean = np.array([shape**2, 1.0])  # derivatives of the log mean by the logarithms of shape and scale
    shape_se = shape * math.sqrt(covariance[0, 0])
    mean_se = mean * math.sqrt(float(of_mean @ covariance @ of_mean))
    return DurationFit(family, shape, scale, mean, cv, -cost(at), shape_se, mean_se)


def fit_durations_of_people(
    durations: ArrayLike, censored: ArrayLike, participant: ArrayLike
) -> DurationsOfPeople | NotComputed:
    """Fit gamma distributions with a common shape and person-specific means.

    Parameters
    ----------
    durations
        Durations in seconds, one per percept.
    censored
        True if the percept was cut off by the end of the trial: a lower limit.
    participant
        Participant of each percept.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> who = np.repeat(np.arange(40), 50)
    >>> lasted = rng.gamma(1.8, 5.0 * np.exp(0.5 * rng.standard_normal(40))[who] / 1.8)
    >>> fit = fit_durations_of_people(np.minimum(lasted, 20.0), lasted > 20.0, who)
    >>> round(fit.geometric_mean, 1), round(fit.shape, 1), round(fit.log_sd, 1)
    (5.0, 1.8, 0.5)
    """
    durations, censored = np.asarray(durations, dtype=float), np.asarray(censored, dtype=bool)
    names, who = np.unique(np.asarray(participant).astype(str), return_inverse=True)
    if not (durations.ndim == 1 and durations.shape == censored.shape == who.shape):
        raise InputError("durations, censored and participant differ in length: give one entry a percept in each.")
    if not (np.isfinite(durations) & (durations > 0)).all():
        raise InputError("A duration is not positive; remove that row.")
    together = fit_durations(durations, censored, "gamma")
    if isinstance(together, NotComputed):
        return together
    if len(names) < 3:
        return NotComputed(f"How people differ needs 3 of them, and there are {len(names)}.")
    people = tuple(
        DurationsOfPerson(
            str(name),
            int((who == number).sum()),
            int(censored[who == number].sum()),
            fit_durations(durations[who == number], censored[who == number], "gamma"),
        )
        for number, name in enumerate(names)
    )
    cost = _PeopleCost(durations, censored, who, len(names))
    start = np.log([together.shape, together.mean, 0.5])
    found = optimize.minimize(cost, start, method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-7})
    if found.x[2] < MIN_LOG_SD or -float(found.fun) < together.log_likelihood + ALIKE:
        log_se = None if together.mean_se is None else together.mean_se / together.mean
        alike = together.mean, log_se, together.shape, together.shape_se
        return DurationsOfPeople(*alike, 0.0, None, together.log_likelihood, people)
    at = polished(cost, found.x)
    covariance = None if at is None else covariance_at(cost, at)
    if at is None or covariance is None:
        return NotComputed("The likelihood of the distributions has no maximum: too many durations are censored.")
    shape, mean, log_sd = (float(number) for number in np.exp(at))
    of_shape, of_mean, of_sd = np.sqrt(np.diag(covariance)).tolist()
    return DurationsOfPeople(
        mean,
        of_mean,
        shape,
        shape * of_shape,
        log_sd,
        log_sd * of_sd,
        -cost(at),
        people,
    )


class _PeopleCost:
    """Negative log likelihood by log shape, log geometric mean and log SD, integrated over the people's means."""

    def __init__(self, durations: FloatArray, censored: NDArray[np.bool_], who: NDArray[np.intp], people: int):
        complete = ~censored
        self.count = np.bincount(who[complete], minlength=people)
        self.total = np.bincount(who[complete], durations[complete], people)
        self.logs = np.bincount(who[complete], np.log(durations[complete]), people)
        self.cut, self.of_cut, self.people = durations[censored], who[censored], people
        self.exposure = np.bincount(who, durations, people)

    def of_people(self, shape: float, log_mean: FloatArray) -> FloatArray:
        """Return the log likelihood of each person's durations at several means (people x means)."""
        rate = shape * np.exp(-log_mean)
        constant = shape * np.log(rate) - special.gammaln(shape)
        log_likelihood = self.count[:, None] * constant + (shape - 1) * self.logs[:, None] - rate * self.total[:, None]
        beyond = np.log(np.maximum(special.gammaincc(shape, self.cut[:, None] * rate[self.of_cut]), 1e-300))
        np.add.at(log_likelihood, self.of_cut, beyond)
        return np.asarray(log_likelihood)

    def __call__(self, free: FloatArray) -> float:
        """Integrate over each person's mean around its mode by the trapezoidal rule."""
        shape, spread = math.exp(free[0]), math.exp(free[2])

        def joint(log_mean: FloatArray) -> FloatArray:
            prior = -(((log_mean - free[1]) / spread) ** 2) / 2 - free[2] - math.log(2 * math.pi) / 2
            return self.of_people(shape, log_mean) + prior

        # The posterior of the log mean is approximately normal; start from its precision and the exponential's mode.
        precision = shape * self.count + spread**-2.0
        centre = (
            shape * self.count * np.log(self.exposure / np.maximum(self.count, 1)) + free[1] * spread**-2.0
        ) / precision
        sd = precision**-0.5
        for _ in range(2):  # wide nodes first, then nodes scaled to the posterior
            grid = centre[:, None] + sd[:, None] * NODES
            density = joint(grid)
            weight = np.exp(density - density.max(axis=1, keepdims=True))
            weight /= weight.sum(axis=1, keepdims=True)
            centre = (weight * grid).sum(axis=1)
            sd = np.maximum(np.sqrt((weight * (grid - centre[:, None]) ** 2).sum(axis=1)), 1e-6)
        grid = centre[:, None] + sd[:, None] * NODES
        density = joint(grid)
        return -float((special.logsumexp(density, axis=1) + np.log(sd * (NODES[1] - NODES[0]))).sum())


def gamma_log_density(
    seconds: ArrayLike, shape: float, log_scale: float | FloatArray, censored: ArrayLike
) -> FloatArray:
    """Return the log density of gamma-distributed durations, or of lasting longer where they are censored.

    >>> gamma_log_density([2.0, 2.0], 1.0, 0.0, [False, True]).round(6).tolist()
    [-2.0, -2.0]
    """
    seconds = np.asarray(seconds, float)
    scaled = np.asarray(seconds * np.exp(-log_scale))
    density = np.asarray((shape - 1) * np.log(seconds) - scaled - special.gammaln(shape) - shape * log_scale)
    cut = np.broadcast_to(censored, density.shape)
    density[cut] = np.log(np.maximum(special.gammaincc(shape, scaled[cut]), 1e-300))
    return density


def lognormal_log_density(
    seconds: ArrayLike, log_median: float | FloatArray, sd: float | FloatArray, censored: ArrayLike
) -> FloatArray:
    """Return the same of log-normal durations, given log median and standard deviation of the logarithm.

    >>> lognormal_log_density([1.0, 1.0], 0.0, 1.0, [False, True]).round(6).tolist()
    [-0.918939, -0.693147]
    """
    logs = np.log(np.asarray(seconds, float))
    score = np.asarray((logs - log_median) / sd)
    density = np.asarray(-(score**2) / 2 - np.log(sd) - math.log(2 * math.pi) / 2 - logs)
    cut = np.broadcast_to(censored, density.shape)
    density[cut] = special.log_ndtr(-score[cut])
    return density
