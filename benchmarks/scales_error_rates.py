"""False positives and coverage of the analyses of steps, comparisons in steps, and choices, by simulation.

    python benchmarks/scales_error_rates.py [--sets 300] [--scales steps,bipolar,choice] [--subjects 6]
        [--workers 2 | --scheduler ADDRESS]

Each set is one experiment: N subjects, 6 scenes, 2 repetitions, one fixation. What a subject feels is level + rise x
aperture / largest + logistic noise, in log odds; rises differ over subjects by a standard deviation of 1, about a mean
of none or of 1. "steps" has seven of them, with the pinhole among four apertures; "bipolar" is the nearest whole number
from -3 to 3 and "choice" its sign, for three apertures against a reference. The truth of an interval is that of 100,000
subjects, and of steps the mean rise itself.
"""

from __future__ import annotations

import argparse
import os
from functools import cache
from itertools import product

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only wait for each other

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, special

from focalgradient.parallel import in_order, shared
from focalgradient.statistics import Effect, compare_pictures, depth_rating
from focalgradient.statistics.comparisons import Kind
from focalgradient.statistics.ordinal import OrdinalResult

FloatArray = NDArray[np.float64]

MM = np.array([2.27, 4.55, 8.93])
APERTURES = ("f/22", "f/11", "f/5.6")
SCENES, REPETITIONS = 6, 2
SPREAD = 1.0  # standard deviation of rises and of levels over subjects, log odds
CUTS = np.linspace(-3.0, 3.0, 6)  # between the seven steps
SUBJECTS = (4, 6, 10, 20)
MEANS = (0.0, 1.0)
DIFFERENCES = ("normal", "skewed")


def people(rng: np.random.Generator, subjects: int, kind: str, mean: float) -> FloatArray:
    """Rise of each subject: normal, or a gamma distribution of skewness 1.4."""
    away = rng.normal(size=subjects) if kind == "normal" else (rng.gamma(2.0, size=subjects) - 2) / np.sqrt(2)
    return np.asarray(mean + SPREAD * away, dtype=np.float64)


def answers(felt: FloatArray, scale: str) -> FloatArray:
    """What is answered."""
    if scale == "steps":
        return np.asarray(1.0 + np.digitize(felt, CUTS), dtype=np.float64)
    return np.clip(np.round(felt), -3, 3) if scale == "bipolar" else (felt > 0).astype(float)


def experiment(rng: np.random.Generator, scale: str, subjects: int, kind: str, mean: float) -> pd.DataFrame:
    """One table as the analyses take it."""
    amounts = (
        {"pinhole": 0.0} | dict(zip(APERTURES, MM, strict=True))
        if scale == "steps"
        else dict(zip(APERTURES, MM, strict=True))
    )
    rises = people(rng, subjects, kind, mean)
    levels = rng.normal(0, SPREAD, subjects) if scale == "steps" else np.zeros(subjects)
    rows = list(product(range(subjects), range(SCENES), amounts, range(REPETITIONS)))
    table = pd.DataFrame(rows, columns=["who", "scene", "aperture", "repetition"])
    table["aperture_mm"] = table["aperture"].map(amounts)
    felt = levels[table["who"]] + rises[table["who"]] * table["aperture_mm"].to_numpy() / MM[-1]
    table["rating"] = answers(felt + rng.logistic(size=len(table)), scale)
    return table.assign(
        participant_id=table["who"].map("{:02}".format),
        scene=table["scene"].map("s{}".format),
        trial=range(len(table)),
        fixation="nearest",
        catch=False,
    )


@cache
def truth(scale: str, kind: str, mean: float) -> tuple[float, float]:
    """Slope for a millimetre (of steps the rise), and the answer at the largest aperture, of the population."""
    if scale == "steps":
        return mean, np.nan
    felt = people(np.random.default_rng(1), 100_000, kind, mean)[:, None] * MM / MM[-1]
    if scale == "bipolar":
        cuts = np.arange(-2.5, 3.0)
        means = (special.expit(felt[..., None] - cuts).sum(axis=-1) - 3).mean(axis=0)
        return float(np.polyfit(MM, means, 1)[0]), float(means[-1])
    shares = special.expit(felt).mean(axis=0)

    def score(line: FloatArray) -> FloatArray:
        left = shares - special.expit(line[0] + line[1] * MM)
        return np.array([left.sum(), (left * MM).sum()])

    return float(optimize.root(score, [0.0, 0.0], tol=1e-12).x[1]), float(shares[-1] - 0.5)


def one(task: tuple[int, str, int, str, float, int]) -> tuple[float, float, float]:
    """Whether the intervals of slope and largest aperture hold the truth, and p of the slope; NaN: not computed."""
    seed, scale, subjects, kind, mean, number = task
    place = (("steps", "bipolar", "choice").index(scale), subjects, DIFFERENCES.index(kind), int(mean > 0), number)
    table = experiment(np.random.default_rng([seed, *place]), scale, subjects, kind, mean)
    slope, largest = truth(scale, kind, mean)
    if scale == "steps":
        ordinal = depth_rating(table, equivalence_bound=1.2, scale="ordinal").ordinal
        assert isinstance(ordinal, OrdinalResult)
        tests = [ordinal.rises[0], None]
    else:
        meant: Kind = "bipolar" if scale == "bipolar" else "choice"
        found = compare_pictures(table, meant)
        tests = [found.slopes[0], found.against_reference[0]]
    held = [
        float(test.low < true < test.high) if isinstance(test, Effect) else np.nan
        for test, true in zip(tests, (slope, largest), strict=True)
    ]
    return held[0], held[1], tests[0].p if isinstance(tests[0], Effect) else np.nan


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=300, help="of each cell")
    parser.add_argument("--scales", default="bipolar,choice,steps")
    parser.add_argument("--subjects", type=int, nargs="+", default=SUBJECTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", help="address of a Dask scheduler, in place of processes")
    options = parser.parse_args()
    print("| scale; subjects | mean | N | slope: p < .05 | slope covered | largest covered | not computed |")
    print("| --- | --- | --- | --- | --- | --- | --- |", flush=True)
    with shared(options.workers, options.scheduler) as executor:
        for scale, kind, mean, subjects in product(options.scales.split(","), DIFFERENCES, MEANS, options.subjects):
            tasks = [(options.seed, scale, subjects, kind, mean, number) for number in range(options.sets)]
            found = np.array(list(in_order(executor, one, tasks)))
            lost = np.isnan(found[:, 2])
            slope, largest = found[~lost, 0].mean(), found[:, 1][~np.isnan(found[:, 1])]
            rate = (found[~lost, 2] < 0.05).mean()
            last = f"{largest.mean():.3f}" if len(largest) else "-"
            cells = (f"{scale}; {kind}", f"{mean:g}", subjects, f"{rate:.3f}", f"{slope:.3f}", last, int(lost.sum()))
            print("| " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
