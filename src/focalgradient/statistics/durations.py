"""How long percepts last: gamma and log-normal distributions fitted to durations, of which some were cut short.

A report that the end of its trial cut off says only that it lasted longer; to leave it out would favour short ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize, special

from focalgradient.statistics.records import NotComputed

__all__ = ["FEWEST", "DurationFit", "Family", "fit_durations"]

FloatArray = NDArray[np.float64]

Family = Literal["gamma", "lognormal"]

FEWEST = 5
"""Durations seen to their end that a fit needs."""


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
    """

    family: Family
    shape: float
    scale: float
    mean: float
    cv: float
    log_likelihood: float


def fit_durations(durations: ArrayLike, censored: ArrayLike, family: Family) -> DurationFit | NotComputed:
    """Fit a distribution to durations in seconds, `censored` true where only a lower limit was seen.

    Examples
    --------
    >>> fit = fit_durations([2.0, 3.0, 5.0, 4.0, 6.0, 1.0], [False] * 5 + [True], "gamma")
    >>> round(fit.mean, 2), round(fit.cv, 2)
    (4.0, 0.37)
    """
    durations, censored = np.asarray(durations, dtype=float), np.asarray(censored, dtype=bool)
    seen = durations[~censored]
    if seen.size < FEWEST:
        return NotComputed(f"A fit needs {FEWEST} durations seen to their end, and there are {seen.size}.")
    if np.ptp(seen) == 0:
        return NotComputed(f"All durations are the same ({seen[0]:.3g} s): they have no distribution to fit.")
    cut, logs = durations[censored], np.log(seen)
    spread = float(logs.std())
    if family == "gamma":
        start, cost = (spread**-2, float(seen.mean()) * spread**2), _gamma_cost
    else:
        start, cost = (spread, math.exp(float(logs.mean()))), _lognormal_cost
    with np.errstate(over="ignore", invalid="ignore"):  # far off the search may try anything
        found = optimize.minimize(
            cost,
            np.log(start),
            args=(seen, logs, cut),
            method="Nelder-Mead",
            options={"xatol": 1e-7, "fatol": 1e-9, "maxiter": 2000},
        )
    if not (found.success and math.isfinite(found.fun)):
        return NotComputed(f"The {family} distribution has no largest likelihood: too much was cut off.")
    shape, scale = (float(number) for number in np.exp(found.x))
    if family == "gamma":
        mean, cv = shape * scale, shape**-0.5
    else:
        mean, cv = scale * math.exp(shape**2 / 2), math.sqrt(math.expm1(shape**2))
    return DurationFit(family, shape, scale, mean, cv, -float(found.fun))


def _gamma_cost(free: FloatArray, seen: FloatArray, logs: FloatArray, cut: FloatArray) -> float:
    """Negative log-likelihood at the logarithms of shape and scale."""
    shape, scale = np.exp(free)
    density = (shape - 1) * logs - seen / scale - special.gammaln(shape) - shape * free[1]
    with np.errstate(divide="ignore"):  # what could not have lasted so long makes it infinite
        beyond = np.log(special.gammaincc(shape, cut / scale))
    return -float(density.sum() + beyond.sum())


def _lognormal_cost(free: FloatArray, seen: FloatArray, logs: FloatArray, cut: FloatArray) -> float:
    """Negative log-likelihood at the logarithms of the logarithm's deviation and of the median."""
    shape = math.exp(free[0])
    density = -(((logs - free[1]) / shape) ** 2) / 2 - free[0] - logs - math.log(2 * math.pi) / 2
    beyond = special.log_ndtr((free[1] - np.log(cut)) / shape)
    return -float(density.sum() + beyond.sum())
