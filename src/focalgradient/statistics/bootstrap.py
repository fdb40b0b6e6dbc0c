"""Bootstrap-t test of a mean over subjects (Hall 1988): a sensitivity analysis that does not assume normal subjects."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.statistics.records import ALPHA, NotComputed

__all__ = ["FEWEST_SUBJECTS", "BootstrapT", "bootstrap_t"]

DRAWS = 9999
"""Number of resamples: a p value near .05 is accurate to .004 (standard error)."""

SEED = 1
"""Seed of the resamples, so that the same data always give the same p value."""

FEWEST_SUBJECTS = 5
"""Minimum number of subjects: fewer give too few distinct resamples for an interval of 95 %."""


@lru_cache(maxsize=64)
def _counts(subjects: int, draws: int) -> FloatArray:
    """Return how often each subject is in each resample (draws x subjects); resamples of one subject are left out."""
    rng = np.random.default_rng([SEED, subjects])
    counts = rng.multinomial(subjects, np.full(subjects, 1 / subjects), draws).astype(float)
    return np.asarray(counts[counts.max(axis=1) < subjects])


@dataclass(frozen=True, slots=True)
class BootstrapT:
    """Bootstrap-t of a mean over subjects: mean, ends of the 95 % interval, two-sided p value of a mean of zero."""

    estimate: float
    low: float
    high: float
    p: float
    subjects: int

    @property
    def significant(self) -> bool:
        """True if p is below .05."""
        return self.p < ALPHA


def bootstrap_t(values: ArrayLike, draws: int = DRAWS) -> BootstrapT | NotComputed:
    """Test a mean by the bootstrap-t, with an equal-tailed interval.

    Student's t of the values is compared with the t of resamples about the mean of the values, separately on each side.

    Parameters
    ----------
    values
        One value per subject, not all equal.
    draws
        Number of resamples.

    Examples
    --------
    >>> found = bootstrap_t([0.1, 0.2, 0.3, 0.4, 0.5, 1.6])
    >>> round(found.low, 2), round(found.high, 2), round(found.p, 3)
    (0.16, 2.02, 0.012)
    """
    subject_means = np.asarray(values, dtype=float)
    subjects = len(subject_means)
    if subjects < FEWEST_SUBJECTS:
        return NotComputed(f"The bootstrap-t needs {FEWEST_SUBJECTS} or more subjects, and there are {subjects}.")
    away = subject_means - subject_means.mean()
    counts = _counts(subjects, draws)
    shift = counts @ away / subjects
    variance = (counts @ away**2 / subjects - shift**2) / (subjects - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        drawn = np.where(
            variance > 1e-12 * away.var(), shift / np.sqrt(np.maximum(variance, 0)), np.sign(shift) * np.inf
        )
    error = float(away.std(ddof=1)) / math.sqrt(subjects)
    t = float(subject_means.mean()) / error
    tails = (1 + (drawn >= t).sum()) / (1 + len(drawn)), (1 + (drawn <= t).sum()) / (1 + len(drawn))
    low, high = np.quantile(drawn, [ALPHA / 2, 1 - ALPHA / 2], method="inverted_cdf")
    mean = float(subject_means.mean())
    p = min(1.0, 2 * float(min(tails)))
    return BootstrapT(mean, mean - float(high) * error, mean - float(low) * error, p, subjects)
