"""Within-subject effects of ordinal answers from a penalised cumulative-link model, which always has a maximum.

The mixed model (`focalgradient.statistics.cumulative`) has no maximum, or a singular covariance, if most answers are
the lowest (or highest) step, and its standard errors are then invalid. Here each subject has a separate level and
separate effects with weak normal penalties; the thresholds are common. `RISE_SD` states the error rates of a t-test
over these effects.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.arrays import FloatArray
from focalgradient.statistics.cumulative import answer_derivatives
from focalgradient.statistics.hessian import ascending, free_of, polished

__all__ = ["own_rises"]


LEVEL_SD, RISE_SD = 3.0, 2.0
"""Standard deviations of the normal penalties on a subject's level (and on the differences between fixations) and on
the effects, in log odds: one standard deviation is an odds ratio of 7. Weakly informative (our choice). With them a
t-test of a zero mean effect rejects .049 of 2,000 data sets of 6 normal subjects if 69 % of answers are the lowest step
(benchmarks/statistics_error_rates.py --tables steps).
"""

ROUNDS, NEWTON, LARGEST_STEP = 8, 6, 2.0
"""Alternations between thresholds and subjects; Newton steps per subject in each; and maximum step, in log odds."""


def own_rises(
    category: NDArray[np.int_], amounts: FloatArray, offsets: FloatArray, subject: NDArray[np.int_]
) -> FloatArray:
    """Estimate each subject's effects in log odds of a higher answer (subjects x fixations).

    Parameters
    ----------
    category
        Category of each trial: 0, 1, ..., without gaps.
    amounts
        Aperture of each trial divided by its range, one column per fixation; 0 in trials of the other fixations.
    offsets
        Indicator columns of the fixations, one fewer than their number.
    subject
        Subject index of each trial, from 0.

    Examples
    --------
    >>> amounts = np.tile([0.0, 0.5, 1.0], 8)[:, None]
    >>> subject = np.repeat([0, 1, 2, 3], 6)
    >>> answers = (amounts[:, 0] > 0.7).astype(int) * (subject > 0)
    >>> own_rises(answers, amounts, np.zeros((24, 0)), subject)[:, 0].round(1).tolist()
    [0.0, 2.2, 2.2, 2.2]
    """
    people = int(subject.max()) + 1
    count = offsets.shape[1]
    kind = offsets @ np.arange(1, count + 1)
    # Within a subject and fixation; a subject with constant answers has no effect.
    centered = pd.DataFrame(amounts) - pd.DataFrame(amounts).groupby([subject, kind]).transform("mean")
    design = np.column_stack([np.ones(len(category)), offsets, centered])
    penalty = np.diag(np.concatenate([np.full(1 + count, LEVEL_SD), np.full(amounts.shape[1], RISE_SD)]) ** -2.0)
    share = np.cumsum(np.bincount(category))[:-1] / len(category)
    cuts = np.asarray(special.logit(share), dtype=float)
    effects = np.zeros((people, design.shape[1]))
    for _ in range(ROUNDS):
        for who in range(people):
            own = subject == who
            effects[who] = _fitted(category[own], design[own], cuts, penalty, effects[who])
        level = (design * effects[subject]).sum(axis=1)
        cuts = _thresholds(category, level, cuts)
    return effects[:, 1 + count :]


def _fitted(
    category: NDArray[np.int_], design: FloatArray, cuts: FloatArray, penalty: FloatArray, start: FloatArray
) -> FloatArray:
    """Maximise the penalised log likelihood of one subject by Newton's method; it is concave."""
    effects = start
    for _ in range(NEWTON):
        slope, curvature = answer_derivatives(category, design @ effects, cuts)
        gradient = slope @ design - penalty @ effects
        step = np.linalg.solve((design.T * curvature) @ design + penalty, gradient)
        effects = effects + np.clip(step, -LARGEST_STEP, LARGEST_STEP)
    return np.asarray(effects, dtype=float)


def _thresholds(category: NDArray[np.int_], level: FloatArray, cuts: FloatArray) -> FloatArray:
    """Maximise the likelihood over the thresholds for given levels, starting from `cuts`."""

    def cost(free: FloatArray) -> float:
        edges = np.concatenate([[-np.inf], ascending(free), [np.inf]])
        p = special.expit(edges[category + 1] - level) - special.expit(edges[category] - level)
        return -float(np.log(np.maximum(p, 1e-12)).sum())

    bounds = [(-20.0, 20.0), *[(-7.0, 3.0)] * (len(cuts) - 1)]
    free = optimize.minimize(cost, free_of(cuts, 1e-3), method="L-BFGS-B", bounds=bounds).x
    low, high = np.transpose(bounds)
    end = polished(cost, free, low=low, high=high)
    return ascending(free if end is None else end)
