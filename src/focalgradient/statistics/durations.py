"""How long percepts last: distributions fitted to durations by maximum likelihood, some of them right-censored.

A percept that the end of its trial cut off lasted longer than was recorded; to leave it out would favour short ones.
`fit_durations` takes all durations as one sample; `fit_durations_of_people` lets the mean differ between people.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from focalgradient.errors import InputError
from focalgradient.statistics.records import NotComputed

__all__ = [
    "FEWEST",
    "DurationFit",
    "DurationsOfPeople",
    "DurationsOfPerson",
    "Family",
    "covariance_at",
    "fit_durations",
    "fit_durations_of_people",
]

FloatArray = NDArray[np.float64]

Family = Literal["gamma", "lognormal"]

FEWEST = 5
"""Uncensored durations that a fit needs."""

NODES = np.linspace(-8.0, 8.0, 81)
"""Of the integral over a person's mean, in standard deviations: so dense the trapezoidal rule is exact to 1e-8."""


@dataclass(frozen=True, slots=True)
class DurationFit:
    """A distribution of durations, fitted by maximum likelihood.

    Parameters
    ----------
    family
        Gamma or log-normal.
    shape, scale
        The gamma's shape and scale (s); or the log-normal's standard deviation of the logarithm and median (s).
    mean, cv
        Mean in seconds, and the standard deviation over it.
    log_likelihood
        At the maximum. Both families have two parameters: the larger is the better fit.
    shape_se, mean_se
        Standard errors of shape and mean, by the observed information; None where it is singular.
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
    """One person's durations.

    Parameters
    ----------
    participant_id
        Whose.
    durations, censored
        How many, and how many of them were cut off by the end of a trial.
    fit
        The person's own gamma distribution.
    """

    participant_id: str
    durations: int
    censored: int
    fit: DurationFit | NotComputed


@dataclass(frozen=True, slots=True)
class DurationsOfPeople:
    """Durations of several people: each has a mean of their own, and all share the shape of a gamma distribution.

    The logarithms of the means are normally distributed over people. Each estimate has its standard error (se) by the
    observed information; None where that is singular.

    Parameters
    ----------
    geometric_mean
        Geometric mean over people of their mean durations, in seconds; `geometric_mean_log_se` is of its logarithm.
    shape
        Of the gamma distribution; 1 is the exponential distribution.
    log_sd
        Standard deviation over people of the logarithm of the mean.
    log_likelihood
        At the maximum.
    people
        Each person, fitted separately.
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
    """Fit a distribution to durations in seconds, `censored` true where only a lower limit is known.

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
        return NotComputed(f"All durations are the same ({complete[0]:.3g} s): they have no distribution to fit.")
    cut, logs = durations[censored], np.log(complete)
    spread = float(logs.std())
    if family == "gamma":
        start, cost = (spread**-2, float(complete.mean()) * spread**2), _gamma_cost
    else:
        start, cost = (spread, math.exp(float(logs.mean()))), _lognormal_cost
    with np.errstate(over="ignore", invalid="ignore"):  # far off the search may try anything
        found = optimize.minimize(
            cost,
            np.log(start),
            args=(complete, logs, cut),
            method="Nelder-Mead",
            options={"xatol": 1e-7, "fatol": 1e-9, "maxiter": 2000},
        )
    if not (found.success and math.isfinite(found.fun)):
        return NotComputed(f"The {family} distribution has no largest likelihood: too much was cut off.")
    shape, scale = (float(number) for number in np.exp(found.x))
    if family == "gamma":
        mean, cv, of_mean = shape * scale, shape**-0.5, np.array([1.0, 1.0])
    else:
        mean, cv = scale * math.exp(shape**2 / 2), math.sqrt(math.expm1(shape**2))
        of_mean = np.array([shape**2, 1.0])  # derivatives of log mean by the logarithms of shape and scale
    covariance = covariance_at(lambda free: cost(free, complete, logs, cut), found.x)
    shape_se = mean_se = None
    if covariance is not None:
        shape_se = shape * math.sqrt(covariance[0, 0])
        mean_se = mean * math.sqrt(float(of_mean @ covariance @ of_mean))
    return DurationFit(family, shape, scale, mean, cv, -float(found.fun), shape_se, mean_se)


def fit_durations_of_people(
    durations: ArrayLike, censored: ArrayLike, participant: ArrayLike
) -> DurationsOfPeople | NotComputed:
    """Fit gamma distributions of one shape to durations of people whose means differ.

    Parameters
    ----------
    durations
        In seconds, one entry a percept.
    censored
        True where the end of a trial cut the percept off: only a lower limit is known.
    participant
        Whose each is.

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
        raise InputError("A duration is not a positive number of seconds: leave out what has none.")
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
    if not (found.success and math.isfinite(found.fun)):
        return NotComputed("The distributions have no largest likelihood: too much was cut off.")
    shape, mean, log_sd = (float(number) for number in np.exp(found.x))
    covariance = covariance_at(cost, found.x)
    log_se: list[float | None] = [None] * 3 if covariance is None else [*np.sqrt(np.diag(covariance)).tolist()]
    of_shape, of_mean, of_sd = log_se
    return DurationsOfPeople(
        mean,
        of_mean,
        shape,
        None if of_shape is None else shape * of_shape,
        log_sd,
        None if of_sd is None else log_sd * of_sd,
        -float(found.fun),
        people,
    )


class _PeopleCost:
    """Negative log-likelihood at the logarithms of shape, geometric mean and SD, the people's means integrated out."""

    def __init__(self, durations: FloatArray, censored: NDArray[np.bool_], who: NDArray[np.intp], people: int):
        complete = ~censored
        self.count = np.bincount(who[complete], minlength=people)
        self.total = np.bincount(who[complete], durations[complete], people)
        self.logs = np.bincount(who[complete], np.log(durations[complete]), people)
        self.cut, self.of_cut, self.people = durations[censored], who[censored], people
        self.exposure = np.bincount(who, durations, people)

    def of_people(self, shape: float, log_mean: FloatArray) -> FloatArray:
        """Log-likelihood of each person's durations for so many means of each, people x means."""
        rate = shape * np.exp(-log_mean)
        constant = shape * np.log(rate) - special.gammaln(shape)
        log_likelihood = self.count[:, None] * constant + (shape - 1) * self.logs[:, None] - rate * self.total[:, None]
        beyond = np.log(np.maximum(special.gammaincc(shape, self.cut[:, None] * rate[self.of_cut]), 1e-300))
        np.add.at(log_likelihood, self.of_cut, beyond)
        return np.asarray(log_likelihood)

    def __call__(self, free: FloatArray) -> float:
        """Integrate over each person's mean about its likeliest value, by the trapezoidal rule."""
        shape, spread = math.exp(free[0]), math.exp(free[2])

        def joint(log_mean: FloatArray) -> FloatArray:
            prior = -(((log_mean - free[1]) / spread) ** 2) / 2 - free[2] - math.log(2 * math.pi) / 2
            return self.of_people(shape, log_mean) + prior

        # The posterior of log mean is about normal: of this precision, and where the exponential's would be.
        precision = shape * self.count + spread**-2.0
        centre = (
            shape * self.count * np.log(self.exposure / np.maximum(self.count, 1)) + free[1] * spread**-2.0
        ) / precision
        sd = precision**-0.5
        for _ in range(2):  # looked for widely, then closely
            grid = centre[:, None] + sd[:, None] * NODES
            density = joint(grid)
            weight = np.exp(density - density.max(axis=1, keepdims=True))
            weight /= weight.sum(axis=1, keepdims=True)
            centre = (weight * grid).sum(axis=1)
            sd = np.maximum(np.sqrt((weight * (grid - centre[:, None]) ** 2).sum(axis=1)), 1e-6)
        grid = centre[:, None] + sd[:, None] * NODES
        density = joint(grid)
        return -float((special.logsumexp(density, axis=1) + np.log(sd * (NODES[1] - NODES[0]))).sum())


def covariance_at(cost: Callable[[FloatArray], float], at: FloatArray) -> FloatArray | None:
    """Inverse of the second derivatives of a negative log-likelihood; None where they are not those of a minimum."""
    n, step = len(at), 1e-3 * np.eye(len(at))
    second = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            corners = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            second[i, j] = sum(a * b * cost(at + a * step[i] + b * step[j]) for a, b in corners) / 4e-6
    if not (np.isfinite(second).all() and np.linalg.eigvalsh(second)[0] > 0):
        return None
    return np.asarray(np.linalg.inv(second))


def _gamma_cost(free: FloatArray, complete: FloatArray, logs: FloatArray, cut: FloatArray) -> float:
    """Negative log-likelihood at the logarithms of shape and scale."""
    shape, scale = np.exp(free)
    density = (shape - 1) * logs - complete / scale - special.gammaln(shape) - shape * free[1]
    with np.errstate(divide="ignore"):  # what could not have lasted so long makes it infinite
        beyond = np.log(special.gammaincc(shape, cut / scale))
    return -float(density.sum() + beyond.sum())


def _lognormal_cost(free: FloatArray, complete: FloatArray, logs: FloatArray, cut: FloatArray) -> float:
    """Negative log-likelihood at the logarithms of the logarithm's deviation and of the median."""
    shape = math.exp(free[0])
    density = -(((logs - free[1]) / shape) ** 2) / 2 - free[0] - logs - math.log(2 * math.pi) / 2
    beyond = special.log_ndtr((free[1] - np.log(cut)) / shape)
    return -float(density.sum() + beyond.sum())
