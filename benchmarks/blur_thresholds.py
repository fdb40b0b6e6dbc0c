"""Recovery of thresholds and coverage of their intervals, for simulated observers with known thresholds.

    python benchmarks/blur_thresholds.py [--runs 1000] [--slope 3.5] [--processes 2]
        [--lapse 0.015] [--prior-slope 3]

Each run is a session of 60 trials: QUEST+ chooses the levels, an observer with a Weibull function answers (threshold
log-uniform from 0.06 to 0.7 D, 2 % lapses), psignifit fits. Printed are the bias of the threshold, its SD over runs,
the fraction of runs whose 95 % interval contains the true value, and the Cramer-Rao bound of the SD for these trials
with known slope and lapse rate. The priors of lapse rate and slope in the fit are `--lapse` (mean) and `--prior-slope`
(median; default: log-uniform). psignifit's search for the mode of the posterior, whose result is not used, is skipped:
it affects neither median nor interval, and takes longest. A run takes about 1.3 s of processor time.
"""

from __future__ import annotations

import argparse
import importlib
import math
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from focalgradient.design import BlurThresholdDesign
from focalgradient.observers import OBSERVERS, choose, right_share
from focalgradient.statistics import fit_threshold
from focalgradient.statistics.thresholds import LAPSE

LAPSES = 0.02
RANGE = (0.06, 0.7)  # dioptres


def session(job: tuple[int, float, float, float | None]) -> tuple[float, float, float, float, float]:
    """Return log10 of true threshold, estimate and ends of its interval, and the Fisher information."""
    seed, slope, lapse, prior = job
    warnings.simplefilter("ignore")
    library = importlib.import_module("psignifit.psignifit")  # the module, which its function of the same name hides
    vars(library)["maximize_posterior"] = lambda data, param_init, **others: param_init
    design = BlurThresholdDesign(catch_trials=0, practice_trials=0)
    true = 10 ** np.random.default_rng([seed, 11]).uniform(*np.log10(RANGE))
    observer = replace(OBSERVERS["default"], lapses=LAPSES)
    answers = choose(design, observer, "01", seed, true, slope)
    levels = np.array([one.level for one in answers])
    right = np.array([one.correct for one in answers])
    fit = fit_threshold(levels, right, least=design.least_level, most=design.most_level, lapse=lapse, slope=prior)
    step = 1e-4
    share, moved = (
        np.array([right_share(level, true * 10**by, slope, LAPSES) for level in levels]) for by in (0.0, step)
    )
    information = float((((moved - share) / step) ** 2 / (share * (1 - share))).sum())
    return math.log10(true), math.log10(fit.threshold), math.log10(fit.low), math.log10(fit.high), information


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--runs", type=int, default=1000)
    options.add_argument("--slope", type=float, default=3.5)
    options.add_argument("--lapse", type=float, default=LAPSE, help="mean of the prior of the lapse rate")
    options.add_argument("--prior-slope", type=float, help="median of the prior of the slope; default: none")
    options.add_argument("--first", type=int, default=1, help="the first seed")
    options.add_argument("--processes", type=int, default=2)
    given = options.parse_args()
    jobs = [
        (seed, given.slope, given.lapse, given.prior_slope) for seed in range(given.first, given.first + given.runs)
    ]
    found = []
    with ProcessPoolExecutor(given.processes) as pool:
        for number, row in enumerate(pool.map(session, jobs, chunksize=5), start=1):
            found.append(row)
            if number % 100 == 0 or number == len(jobs):
                report(np.array(found), given.slope)


def report(found: np.ndarray, slope: float) -> None:
    true, estimate, low, high, information = found.T
    error = estimate - true
    covered = ((low <= true) & (true <= high)).mean()
    bound = 10 ** (1 / np.sqrt(information.mean())) - 1
    within = (np.abs(error) <= math.log10(1.05)).mean()
    print(
        f"slope {slope:g}, {len(found)} runs of 60 trials: bias {100 * (10 ** error.mean() - 1):+.1f} %, "
        f"spread {100 * (10 ** error.std() - 1):.1f} % (bound {100 * bound:.1f} %), "
        f"within 5 %: {100 * within:.0f} % of runs, covered {100 * covered:.1f} % "
        f"(too high {100 * (low > true).mean():.1f} %, too low {100 * (high < true).mean():.1f} %), "
        f"median interval a factor {10 ** np.median(high - low):.2f} wide"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    main()
