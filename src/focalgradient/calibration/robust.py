"""Robust least squares of linear terms, for observations of which some are far off."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray

__all__ = ["fit_terms"]

Floats = NDArray[np.floating[Any]]


def fit_terms(terms: Floats, values: Floats, weight: Floats, rounds: int) -> tuple[FloatArray, float]:
    """Return the coefficients of `terms` that fit `values`, and the standard deviation of the residuals.

    Each of the `rounds` weighs observations by their residuals r in the round before, as 1 / sqrt(1 + (r / 2 sd)^2).

    Parameters
    ----------
    terms
        Terms of each observation, n x m.
    values, weight
        Observations, and their weights: 1 / standard deviation, or 0 for those left out.
    rounds
        Number of fits.

    Examples
    --------
    >>> terms = np.stack([np.ones(9), np.arange(9.0)], axis=1)
    >>> values = terms @ [1.0, 2.0]
    >>> values[3] = 99.0
    >>> fit_terms(terms, values, np.ones(9), rounds=20)[0].round(3).tolist()
    [1.0, 2.0]
    """
    reweighted, used = weight, weight > 0
    for _ in range(rounds):
        fit: FloatArray = np.asarray(
            np.linalg.lstsq(terms * reweighted[:, None], values * reweighted, rcond=None)[0], float
        )
        off = np.abs(values - terms @ fit)
        sd = 1.48 * float(np.median(off[used])) + 1e-9
        reweighted = weight / np.sqrt(1 + (off / (2 * sd)) ** 2)
    return fit, sd
