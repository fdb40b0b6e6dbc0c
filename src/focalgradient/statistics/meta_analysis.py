"""Random-effects meta-analysis of the same effect in several data sets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.errors import InputError
from focalgradient.statistics.records import CONFIDENCE

__all__ = ["Pooled", "random_effects"]


@dataclass(frozen=True, slots=True)
class Pooled:
    """An effect over data sets.

    Parameters
    ----------
    estimate, low, high
        Mean effect and its 95 % interval by Hartung and Knapp.
    standard_error, statistic, df, p
        Of the mean; Student's t with a degree of freedom less than data sets.
    tau
        Standard deviation of the effects between data sets (Paule and Mandel's estimate).
    predicted_low, predicted_high
        95 % interval of the effect in a new data set; None with fewer than three.
    q, q_p, i2
        Cochran's Q, its probability, and the share of the variance that is between data sets (Higgins and Thompson).
    studies
        Number of data sets.
    """

    estimate: float
    low: float
    high: float
    standard_error: float
    statistic: float
    df: float
    p: float
    tau: float
    predicted_low: float | None
    predicted_high: float | None
    q: float
    q_p: float
    i2: float
    studies: int


def random_effects(estimates: ArrayLike, standard_errors: ArrayLike) -> Pooled:
    """Pool effects by a random-effects model with Hartung and Knapp's interval.

    The variance between data sets is that at which the generalised Q is its degrees of freedom (Paule & Mandel 1982).
    The standard error is that of Hartung & Knapp (2001), not below the one without their factor (Röver, Knapp & Friede
    2015), as with few data sets the factor can be near 0.

    Parameters
    ----------
    estimates, standard_errors
        One a data set, two or more.

    Raises
    ------
    InputError
        If there are fewer than two, or an error is not above 0 or not finite.

    Examples
    --------
    >>> found = random_effects([0.1, 0.3, 0.35], [0.05, 0.05, 0.1])
    >>> round(found.estimate, 3), round(found.tau, 3), found.df
    (0.238, 0.115, 2)
    """
    from scipy import optimize, stats

    y, se = np.asarray(estimates, float), np.asarray(standard_errors, float)
    if y.ndim != 1 or y.shape != se.shape or y.size < 2:
        raise InputError(f"estimates has {y.size} values, but a meta-analysis needs two or more, each with its error.")
    if not (np.isfinite(y).all() and np.isfinite(se).all() and (se > 0).all()):
        raise InputError("estimates and standard_errors must be finite, and the errors above 0: leave others out.")
    df = y.size - 1

    def generalised(tau2: float) -> float:
        weights = 1 / (se**2 + tau2)
        return float(weights @ (y - weights @ y / weights.sum()) ** 2)

    q, most = generalised(0.0), 100 * (float(y.var()) + float((se**2).max()))
    tau2 = 0.0 if q <= df else float(optimize.brentq(lambda value: generalised(value) - df, 0.0, most))
    weights = 1 / (se**2 + tau2)
    mean = float(weights @ y / weights.sum())
    error = math.sqrt(max(generalised(tau2) / df, 1.0) / float(weights.sum()))
    half = float(stats.t.ppf((1 + CONFIDENCE) / 2, df)) * error
    low = high = None
    if df >= 2:
        wide = float(stats.t.ppf((1 + CONFIDENCE) / 2, df - 1)) * math.sqrt(tau2 + error**2)
        low, high = mean - wide, mean + wide
    p = 2 * float(stats.t.sf(abs(mean) / error, df))
    i2 = max(0.0, (q - df) / q) if q > 0 else 0.0
    between = (math.sqrt(tau2), low, high)
    return Pooled(
        mean, mean - half, mean + half, error, mean / error, df, p, *between, q, float(stats.chi2.sf(q, df)), i2, y.size
    )
