"""Recovery of hierarchical psychometric functions and coverage of their intervals, for simulated people.

    python benchmarks/psychometric_recovery.py [--sets 2000] [--subjects 6,12] [--trials 60] [--workers 2]
        [--overdispersion 0] [--lapse people]

Each data set is an experiment with N people, 2 conditions, two alternatives, and nine levels shown equally often. A
person's log threshold is normal around log 0.2 (SD 0.4), with an additional SD of 0.15 between conditions; log slopes
are normal around log 3.5 (0.2), log odds of lapses around those of 2 % (0.5). Conditions do not differ on average, so
that rejections are errors. Printed are bias (relative to the mean of these people) and coverage of mean threshold and
slope, false positives and coverage of the difference, coverage over persons, the SD of a person's estimate, the mean
standard deviations, and the number of data sets without a fit.
"""

from __future__ import annotations

import argparse
import math
import os
from typing import Literal, NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only slow it down

import numpy as np
from numpy.typing import NDArray
from scipy import special

from focalgradient.parallel import in_order, shared
from focalgradient.statistics import NotComputed, fit_psychometric_groups

FloatArray = NDArray[np.float64]

THRESHOLD, SLOPE, LAPSE = 0.2, 3.5, 0.02
SD, SD_BY_CONDITION, SD_SLOPE, SD_LAPSE = 0.4, 0.15, 0.2, 0.5
LEVELS = np.geomspace(0.05, 0.8, 9)
CONDITIONS = 2


class Cell(NamedTuple):
    """Settings common to the data sets of a cell."""

    subjects: int
    trials: int
    overdispersion: float
    lapse: Literal["common", "people"]


def experiment(rng: np.random.Generator, cell: Cell) -> tuple[dict[str, FloatArray], FloatArray, FloatArray]:
    """Return answers, log thresholds of people in conditions, and their slopes."""
    people = cell.subjects
    own = math.log(THRESHOLD) + SD * rng.normal(size=(people, 1)) + SD_BY_CONDITION * rng.normal(size=(people, 2))
    slope = SLOPE * np.exp(SD_SLOPE * rng.normal(size=(people, 1, 1)))
    lapse = special.expit(special.logit(LAPSE) + SD_LAPSE * rng.normal(size=(people, 1, 1)))
    level = np.resize(LEVELS, cell.trials)
    right = 0.5 + (0.5 - lapse) * (1 - 0.5 ** ((level / np.exp(own)[..., None]) ** slope))
    if cell.overdispersion:
        m = (1 - cell.overdispersion) / cell.overdispersion
        share = right[..., : len(LEVELS)]
        right = rng.beta(m * share, m * (1 - share))[..., np.arange(cell.trials) % len(LEVELS)]
    who, where, _ = np.indices(right.shape)
    table = {
        "participant_id": who.ravel(),
        "condition": where.ravel(),
        "level": np.broadcast_to(level, right.shape).ravel(),
        "correct": (rng.random(right.shape) < right).ravel(),
    }
    return table, own, slope


def session(job: tuple[Cell, int]) -> FloatArray:
    """Return errors and coverage of one data set, or NaN without a fit."""
    cell, seed = job
    rng = np.random.default_rng([seed, cell.subjects, cell.trials])
    table, own, slopes = experiment(rng, cell)
    found = fit_psychometric_groups(table, lapse=cell.lapse, overdispersed=cell.overdispersion > 0)
    if isinstance(found, NotComputed):
        return np.full(13, np.nan)
    group, effect = found.groups[0], found.differences[0].effect
    persons = [(one, own[int(one.participant_id), int(one.condition)]) for one in found.people]
    errors = np.array([math.log(one.threshold.estimate) - at for one, at in persons])

    def covers(interval: object, at: float) -> float:
        low, high = getattr(interval, "low", None), getattr(interval, "high", None)
        return math.nan if low is None or high is None else float(low <= at <= high)

    return np.array(
        [
            np.mean([math.log(each.threshold.estimate) for each in found.groups]) - own.mean(),
            covers(group.threshold, THRESHOLD),
            np.mean([math.log(each.slope.estimate) for each in found.groups]) - np.log(slopes).mean(),
            covers(group.slope, SLOPE),
            effect.p < 0.05,
            effect.low <= 0 <= effect.high,
            np.mean([covers(one.threshold, math.exp(at)) for one, at in persons]),
            errors.std(),
            found.lapse.estimate,
            covers(found.lapse, LAPSE),
            found.sd["threshold"].estimate,
            found.sd["threshold by condition"].estimate,
            found.sd["log slope"].estimate,
        ]
    )


HEADS = (
    "bias threshold (log)",
    "covered",
    "bias slope (log)",
    "covered",
    "difference rejected",
    "difference covered",
    "persons covered",
    "persons' error (log)",
    "lapse",
    "covered",
    "sd threshold",
    "sd by condition",
    "sd log slope",
)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--sets", type=int, default=2000)
    options.add_argument("--subjects", default="6,12")
    options.add_argument("--trials", default="60", help="of a person in a condition")
    options.add_argument("--overdispersion", type=float, default=0.0)
    options.add_argument("--lapse", default="people", choices=("common", "people"))
    options.add_argument("--workers", type=int, default=2)
    given = options.parse_args()
    for subjects in map(int, given.subjects.split(",")):
        for trials in map(int, given.trials.split(",")):
            cell = Cell(subjects, trials, given.overdispersion, given.lapse)
            with shared(given.workers) as pool:
                found = np.array(list(in_order(pool, session, [(cell, seed) for seed in range(given.sets)])))
            print(f"{subjects} people, {trials} trials each: {np.isnan(found[:, 0]).sum()} without a fit")
            for head, mean, sd in zip(HEADS, np.nanmean(found, axis=0), np.nanstd(found, axis=0), strict=True):
                print(f"    {head}: {mean:.3f} +- {sd / math.sqrt(len(found)):.3f}", flush=True)


if __name__ == "__main__":
    main()
