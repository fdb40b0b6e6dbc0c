"""Level and power of candidate tests robust to skewed subjects, and the upper bound of power of any such test.

    python benchmarks/robust_tests.py [--sets 20000] [--subjects 6 12 20] [--bound]

Each data set is the mean effects of N people: drawn from a distribution with standard deviation 1 and a given skewness,
with added noise of their answers, whose variance is estimated from the residuals of 12 scenes. The level is the
fraction of data sets with mean 0 that a test rejects at .05, for the worse of both signs of the skewness (by symmetry);
the power is that for normal people with a mean at which Student's t has a power of .50 and .80. `--bound` adds the most
powerful test based on t, sample skewness and noise fraction (binned) that rejects at most .06 in each of the named
cells, found by linear programming: no test of these three statistics has more power.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable
from dataclasses import dataclass

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from focalgradient.statistics.skewness import Scatter, two_sided_p

FloatArray = NDArray[np.float64]
Draw = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]

SCENES = 12
DOCUMENTED = 0.44
"""Noise SD of a person's mean relative to the SD over people: .3 sqrt(2 / 2 / 12) / .2, as in the tables."""


def gamma(skewness: float) -> Draw:
    """Return gamma-distributed people; exponential at a skewness of 2."""
    shape = 4 / skewness**2
    return lambda rng, size: (rng.gamma(shape, size=size) - shape) / math.sqrt(shape)


def log_normal(skewness: float) -> Draw:
    """Return log-normal people."""

    def third(sd: float) -> float:
        return (math.exp(sd * sd) + 2) * math.sqrt(math.exp(sd * sd) - 1)

    sd = float(optimize.brentq(lambda sd: third(sd) - skewness, 0.01, 2))
    middle = math.exp(sd * sd / 2)
    return lambda rng, size: (np.exp(sd * rng.normal(size=size)) - middle) / (middle * math.sqrt(math.exp(sd * sd) - 1))


def two_groups(skewness: float) -> Draw:
    """Return a mixture of people with a common effect and people without any."""
    share = 0.5 * (1 - skewness / math.sqrt(4 + skewness**2))
    return lambda rng, size: ((rng.random(size) < share).astype(float) - share) / math.sqrt(share * (1 - share))


def mixture(rng: np.random.Generator, size: tuple[int, ...]) -> FloatArray:
    """Return exponential people with mean .3, and one in seven with mean 2.5; skewness 3.6."""
    rare, means = 0.15, (0.3, 2.5)
    drawn = rng.exponential(np.where(rng.random(size) < rare, means[1], means[0]))
    mean = (1 - rare) * means[0] + rare * means[1]
    return (drawn - mean) / math.sqrt(2 * ((1 - rare) * means[0] ** 2 + rare * means[1] ** 2) - mean**2)


PEOPLE: dict[str, Draw] = {
    "normal": lambda rng, size: rng.normal(size=size),
    "t with 3 df": lambda rng, size: rng.standard_t(3, size=size) / math.sqrt(3),
    "gamma, 1.4": gamma(1.4),
    "exponential, 2": gamma(2),
    "log-normal, 2": log_normal(2),
    "two groups, 2": two_groups(2),
    "mixture, 3.6": mixture,
    "log-normal, 4": log_normal(4),
    "gamma, 4": gamma(4),
    "two groups, 4": two_groups(4),
}


@dataclass(frozen=True)
class Sets:
    """Data sets of people's mean effects (sets x people), with the noise variance estimated from residuals."""

    values: FloatArray
    noise: FloatArray

    @property
    def people(self) -> int:
        """Number of people per data set."""
        return self.values.shape[1]

    @property
    def t(self) -> FloatArray:
        """Student's t of each data set."""
        sd = self.values.std(axis=1, ddof=1)
        return self.values.mean(axis=1) / np.maximum(sd, 1e-12) * math.sqrt(self.people)

    @property
    def skewness(self) -> FloatArray:
        """Adjusted skewness of each data set."""
        away = self.values - self.values.mean(axis=1, keepdims=True)
        sd = np.maximum(self.values.std(axis=1, ddof=1), 1e-12)
        n = self.people
        return np.asarray(n / ((n - 1) * (n - 2)) * (away**3).sum(axis=1) / sd**3)

    @property
    def share(self) -> FloatArray:
        """Noise fraction of the variance of each data set."""
        return np.minimum(self.noise / np.maximum(self.values.var(axis=1, ddof=1), 1e-24), 1.0)


def drawn(rng: np.random.Generator, kind: str, noise: float, people: int, sets: int, mean: float = 0.0) -> Sets:
    """Draw data sets of one kind of people; noise is relative to their standard deviation."""
    values = PEOPLE[kind](rng, (sets, people)) + noise * rng.normal(size=(sets, people)) + mean
    df = (people - 1) * (SCENES - 1)
    return Sets(values, noise**2 * rng.chisquare(df, size=sets) / df)


def student(sets: Sets) -> FloatArray:
    return np.asarray(2 * stats.t.sf(np.abs(sets.t), sets.people - 1))


def ours(sets: Sets) -> FloatArray:
    scatter = Scatter(sets.people, sets.skewness / math.sqrt(sets.people), sets.share)
    return two_sided_p(sets.t, sets.people - 1, scatter)


def johnson(sets: Sets, factor: float = 1.0) -> FloatArray:
    """Apply Johnson's t, corrected for sample skewness where that is conservative, with p multiplied by a factor."""
    t, against = np.abs(sets.t), np.maximum(-np.sign(sets.t) * sets.skewness / math.sqrt(sets.people), 0)
    root = 1 + 4 / 3 * against * (t - against / 6)
    corrected = 2 * (t - against / 6) / (1 + np.sqrt(np.maximum(root, 0)))
    return np.minimum(2 * factor * stats.t.sf(corrected, sets.people - 1), 1.0)


def two_stage(sets: Sets) -> FloatArray:
    """Apply Student's t, but Johnson's with factor 2.5 if the Shapiro-Wilk test rejects normality at .05."""
    failed = np.array([stats.shapiro(row).pvalue < 0.05 if np.ptp(row) > 1e-9 else True for row in sets.values])
    return np.where(failed, johnson(sets, 2.5), student(sets))


def sign_flips(sets: Sets) -> FloatArray:
    """Apply the sign-flip test: all flips up to 12 people, else 2000 random ones."""
    people = sets.people
    if people <= 12:
        signs = 1 - 2.0 * ((np.arange(2 ** (people - 1))[:, None] >> np.arange(people)) & 1)
    else:
        signs = np.random.default_rng(1).choice([-1.0, 1.0], (2000, people))
    flipped = np.abs(sets.values @ signs.T)
    return np.asarray((flipped >= np.abs(sets.values.sum(axis=1))[:, None] - 1e-12).mean(axis=1))


def bootstrap_t(sets: Sets, draws: int = 399) -> FloatArray:
    """Apply the equal-tailed bootstrap-t with 399 resamples, without those that have no scatter."""
    rng, people = np.random.default_rng(2), sets.people
    p = np.empty(len(sets.values))
    for number, row in enumerate(sets.values):
        again = row[rng.integers(0, people, (draws, people))]
        sd = again.std(axis=1, ddof=1)
        kept = sd > 1e-9
        t = (again.mean(axis=1)[kept] - row.mean()) / sd[kept] * math.sqrt(people)
        own = row.mean() / max(row.std(ddof=1), 1e-12) * math.sqrt(people)
        below = ((t <= own).sum() + 1) / (len(t) + 1)
        above = ((t >= own).sum() + 1) / (len(t) + 1)
        p[number] = min(1.0, 2 * min(below, above))
    return p


def yuen(sets: Sets) -> FloatArray:
    """Apply Yuen's test of the 20 % trimmed mean, which differs from the mean for skewed people."""
    ordered, people = np.sort(sets.values, axis=1), sets.people
    cut = int(0.2 * people)
    middle = ordered[:, cut : people - cut]
    winsorised = np.clip(ordered, ordered[:, [cut]], ordered[:, [people - cut - 1]])
    error = winsorised.std(axis=1, ddof=1) * math.sqrt((people - 1) / (middle.shape[1] * (middle.shape[1] - 1)))
    return np.asarray(2 * stats.t.sf(np.abs(middle.mean(axis=1)) / np.maximum(error, 1e-12), middle.shape[1] - 1))


CANDIDATES: dict[str, Callable[[Sets], FloatArray]] = {
    "Student's t": student,
    "sign flips": sign_flips,
    "bootstrap-t": bootstrap_t,
    "trimmed mean (Yuen)": yuen,
    "Johnson's t": johnson,
    "Johnson's t, p times 2.5": lambda sets: johnson(sets, 2.5),
    "t, or Johnson's times 2.5 by Shapiro-Wilk": two_stage,
    "p of t times a factor (ours)": ours,
}
SLOW = (bootstrap_t, two_stage)

LEVELS = [
    ("normal", DOCUMENTED),
    ("exponential, 2", 0.0),
    ("exponential, 2", DOCUMENTED),
    ("log-normal, 4", 0.0),
    ("log-normal, 4", DOCUMENTED),
    ("gamma, 4", 0.0),
    ("gamma, 4", 0.2),
    ("gamma, 4", DOCUMENTED),
    ("mixture, 3.6", DOCUMENTED),
    ("two groups, 2", DOCUMENTED),
    ("two groups, 4", DOCUMENTED),
]
POWERS = [(noise, power) for noise in (0.0, DOCUMENTED, 0.9, 5.0) for power in (0.5, 0.8)]


def mean_of_power(power: float, noise: float, people: int) -> float:
    """Return the mean of normal people at which Student's t has this power."""
    limit = stats.t.isf(0.025, people - 1)
    ratio = optimize.brentq(lambda nc: stats.nct.sf(limit, people - 1, nc) - power, 0, 20)
    return float(ratio * math.sqrt((1 + noise**2) / people))


def rates(people: int, sets: int, seed: int) -> None:
    """Print a row for each candidate: levels, then powers."""
    names = [f"{kind}; {noise:g}" for kind, noise in LEVELS] + [
        f"power {power:g}; {noise:g}" for noise, power in POWERS
    ]
    print(f"\n| N = {people} | " + " | ".join(names) + " |\n" + "| --- " * (len(names) + 1) + "|")
    for name, test in CANDIDATES.items():
        rng = np.random.default_rng([seed, people])
        many = sets // 10 if test in SLOW else sets
        found = [test(drawn(rng, kind, noise, people, many)) for kind, noise in LEVELS]
        means = [mean_of_power(power, noise, people) for noise, power in POWERS]
        found += [
            test(drawn(rng, "normal", noise, people, many, mean))
            for (noise, _), mean in zip(POWERS, means, strict=True)
        ]
        print(f"| {name} | " + " | ".join(f"{(p < 0.05).mean():.3f}" for p in found) + " |", flush=True)


P_EDGES = np.concatenate([[0], np.geomspace(1e-4, 0.3, 28), [1.001]])
SKEW_EDGES = np.array([-9, -1.7, -1.1, -0.55, 0, 0.55, 1.1, 1.7, 9])
SHARE_EDGES = np.array([-1, 0.01, 0.03, 0.08, 0.15, 0.25, 0.4, 0.6, 0.85, 0.9999, 2])


def binned(sets: Sets) -> FloatArray:
    """Return the fractions of data sets by p of t, skewness towards the effect, and noise fraction."""
    towards = np.sign(sets.t) * sets.skewness
    features = np.stack([student(sets), towards, sets.share], axis=1)
    counts, _ = np.histogramdd(features, bins=[P_EDGES, SKEW_EDGES, SHARE_EDGES])
    return np.asarray(counts.ravel() / len(sets.values))


GRID = (0.0, 0.1, 0.2, 0.3, DOCUMENTED, 0.6, 0.9, 5.0)
MILD = ("normal", "t with 3 df", "gamma, 1.4", "exponential, 2", "log-normal, 2")
BOUNDS = {
    "skewness up to 2": [(kind, noise) for kind in MILD for noise in GRID],
    "and gamma, log-normal 4 and the mixture with noise of .44 and more": [
        (kind, noise) for kind in ("gamma, 4", "log-normal, 4", "mixture, 3.6") for noise in GRID if noise >= DOCUMENTED
    ],
    "and gamma and log-normal 4 without noise": [
        (kind, noise) for kind in ("gamma, 4", "log-normal, 4") for noise in GRID if noise < DOCUMENTED
    ],
    "and two groups of skewness 2 and 4": [
        (kind, noise) for kind in ("two groups, 2", "two groups, 4") for noise in GRID
    ],
}


def bounds(people: int, sets: int, seed: int) -> None:
    """Print the power of the most powerful test with a level of .06 in an increasing number of cells."""
    rng = np.random.default_rng([seed, people, 1])
    found = {
        (noise, power): binned(drawn(rng, "normal", noise, people, sets, mean_of_power(power, noise, people)))
        for noise, power in POWERS
    }
    cells: list[FloatArray] = []
    names = [f"power {power:g}; {noise:g}" for noise, power in POWERS]
    print(f"\n| N = {people}: any test that holds .06 up to | " + " | ".join(names) + " |\n" + "| --- " * 9 + "|")
    for name, kinds in BOUNDS.items():
        cells += [binned(drawn(rng, kind, noise, people, sets)) for kind, noise in kinds]
        best = optimize.linprog(
            -np.sum(list(found.values()), axis=0),
            A_ub=np.array(cells),
            b_ub=np.full(len(cells), 0.06),
            bounds=(0, 1),
            method="highs",
        )
        print(
            f"| {name} | " + " | ".join(f"{float(one @ np.asarray(best.x)):.2f}" for one in found.values()) + " |",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sets", type=int, default=20000, help="of each cell; a tenth for the two slow tests")
    parser.add_argument("--subjects", type=int, nargs="+", default=[6, 12, 20])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bound", action="store_true", help="add the bounds by linear programming, a minute each")
    asked = parser.parse_args()
    for people in asked.subjects:
        rates(people, asked.sets, asked.seed)
        if asked.bound:
            bounds(people, 3 * asked.sets, asked.seed)


if __name__ == "__main__":
    main()
