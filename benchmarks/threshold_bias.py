"""Bias of the threshold of adaptive sessions by slope, lapse rate and number of trials; runs in minutes.

    python benchmarks/threshold_bias.py [--sessions 2000] [--seed 5]

The procedure of benchmarks/blur_thresholds.py, with everything on grids and all sessions at once: QUEST+ chooses among
41 levels from 0.02 to 2 D with the parameters of `focalgradient.design.procedure`, an observer with a Weibull function
answers (threshold log-uniform from 0.06 to 0.7 D), and the posterior of threshold, slope and lapse rate has the priors
of `fit_threshold`: a log-uniform slope (default), and a slope with median 3.5. Printed are the mean log error of the
posterior median with its standard error (%), SD, and coverage of the central 95 %.
"""

from __future__ import annotations

import argparse
import math
import os
from itertools import product

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from focalgradient.design import BlurThresholdDesign
from focalgradient.design.procedure import LAPSES, SLOPES
from focalgradient.statistics.thresholds import LAPSE, LAPSE_QUANTILE, SLOPE_RANGE
from focalgradient.statistics.thresholds import SLOPES as PRIOR_SD

FloatArray = NDArray[np.float64]

LEVELS = np.array(BlurThresholdDesign().levels)
RANGE = (0.06, 0.7)
TRIALS = (40, 60, 100)
TRUE_SLOPES, TRUE_LAPSES = (2.0, 3.5, 5.0), (0.0, 0.02, 0.04)
AT_ONCE = 400

PRIOR = stats.beta(1, 1 / LAPSE - 1)
THRESHOLDS = np.geomspace(LEVELS[0], LEVELS[-1], 120)
GRID_SLOPES = np.geomspace(*SLOPE_RANGE, 25)
GRID_LAPSES = np.linspace(0, float(PRIOR.ppf(LAPSE_QUANTILE)), 12)


def right(level: FloatArray, threshold: FloatArray, slope: float, lapse: float) -> FloatArray:
    """Return the probability of a correct answer."""
    return np.asarray(0.5 + (0.5 - lapse) * (1 - 0.5 ** ((level / threshold) ** slope)))


def table(thresholds: FloatArray, slopes: FloatArray, lapses: FloatArray) -> FloatArray:
    """Return the probabilities of correct answers: parameters x levels."""
    found = [right(LEVELS, t, s, each) for t, s, each in product(thresholds, slopes, lapses)]
    return np.clip(np.array(found), 1e-9, 1 - 1e-9)


def sessions(rng: np.random.Generator, slope: float, lapse: float, count: int) -> tuple[FloatArray, list[FloatArray]]:
    """Return true thresholds, and counts of wrong and right answers (sessions x levels x 2) after each of `TRIALS`."""
    p = table(LEVELS, np.array(SLOPES), np.array(LAPSES))
    likelihoods = np.log(1 - p), np.log(p)
    entropies = [np.exp(one) * one for one in likelihoods]
    true = np.exp(rng.uniform(math.log(RANGE[0]), math.log(RANGE[1]), count))
    log_posterior, counts = np.zeros((count, len(p))), np.zeros((count, len(LEVELS), 2))
    found, every = [], np.arange(count)
    for trial in range(1, max(TRIALS) + 1):
        posterior = np.exp(log_posterior - log_posterior.max(axis=1, keepdims=True))
        posterior /= posterior.sum(axis=1, keepdims=True)
        own = posterior * np.log(np.maximum(posterior, 1e-300))
        entropy = np.zeros((count, len(LEVELS)))
        for one, of in zip(likelihoods, entropies, strict=True):
            share = posterior @ np.exp(one)
            entropy -= own @ np.exp(one) + posterior @ of - share * np.log(np.maximum(share, 1e-12))
        place = entropy.argmin(axis=1)
        answer = rng.random(count) < right(LEVELS[place], true, slope, lapse)
        counts[every, place, answer.astype(int)] += 1
        log_posterior += np.where(answer[:, None], likelihoods[1][:, place].T, likelihoods[0][:, place].T)
        if trial in TRIALS:
            found.append(counts.copy())
    return true, found


def medians(counts: FloatArray, fitted: FloatArray, median: float | None) -> FloatArray:
    """Return median and central 95 % of the posterior of the log threshold (3 x sessions)."""
    about = 0.0 if median is None else -0.5 * (np.log(GRID_SLOPES / median) / PRIOR_SD) ** 2
    prior = np.add.outer(np.broadcast_to(about, GRID_SLOPES.shape), PRIOR.logpdf(GRID_LAPSES)).ravel()
    log = counts[..., 1] @ np.log(fitted).T + counts[..., 0] @ np.log(1 - fitted).T
    log = log.reshape(len(counts), len(THRESHOLDS), -1) + prior
    share = np.exp(log - log.max(axis=(1, 2), keepdims=True)).sum(axis=2)
    share /= share.sum(axis=1, keepdims=True)
    middle = np.cumsum(share, axis=1) - share / 2
    quantiles = (0.5, 0.025, 0.975)
    return np.array([[np.interp(q, one, np.log(THRESHOLDS)) for one in middle] for q in quantiles])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sessions", type=int, default=2000, help="of each slope and lapse rate")
    parser.add_argument("--seed", type=int, default=5)
    asked = parser.parse_args()
    fitted = table(THRESHOLDS, GRID_SLOPES, GRID_LAPSES)
    priors = {"every slope": None, "about 3.5": 3.5}
    print("| slope | lapses | trials | " + " | ".join(f"{name}: bias; spread; coverage" for name in priors) + " |")
    print("| --- " * 5 + "|")
    for slope, lapse in product(TRUE_SLOPES, TRUE_LAPSES):
        rng = np.random.default_rng([asked.seed, round(10 * slope), round(100 * lapse)])
        errors: dict[tuple[int, str], list[FloatArray]] = {}
        for _ in range(math.ceil(asked.sessions / AT_ONCE)):
            true, found = sessions(rng, slope, lapse, AT_ONCE)
            for (trials, counts), (name, median) in product(zip(TRIALS, found, strict=True), priors.items()):
                errors.setdefault((trials, name), []).append(medians(counts, fitted, median) - np.log(true))
        for trials in TRIALS:
            cells = []
            for name in priors:
                off, low, high = 100 * np.concatenate(errors[trials, name], axis=1)
                error = off.std() / math.sqrt(len(off))
                covered = ((low < 0) & (high > 0)).mean()
                cells.append(f"{off.mean():+.1f} ± {error:.1f} %; {off.std():.0f} %; {covered:.3f}")
            print(f"| {slope:g} | {100 * lapse:g} % | {trials} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
