"""Simulation-based calibration of the Bayesian models (Talts et al. 2018); needs the extra `bayes`.

    python benchmarks/bayes_calibration.py [--sets 20] [--exact 1000] [--steps 0] [--workers 2 | --scheduler ADDRESS]

Each data set draws the effect and the standard deviations from the priors, then log ratios from the model. There are
two tests. First, the quantiles of the true values in the *exact* posterior must be uniform: --exact sets (a complete
table has a closed form except for the three standard deviations, which are summed over a grid). Second, the draws of
the sampler must follow that posterior: in --sets of them, its distribution function, evaluated at the draws, must have
mean 1/2, within the error implied by the effective sample size. The second test is far more sensitive than ranks of the
true values alone.

The ordinal model has no closed-form posterior. --steps data sets with both fixations and three steps are drawn from its
priors, and the true values must be uniform over the quantiles of the sampler's draws.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only slow it down

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import special, stats

from focalgradient.parallel import in_order, shared
from focalgradient.statistics.bayes import effective_number, posterior_of_rises, posteriors_of_steps
from focalgradient.statistics.posteriors import ORDINAL_PRIORS, RATIO_PRIORS, Posterior

FloatArray = NDArray[np.float64]

SHARES = (0.5, 0.8, 0.95)
BINS = 10
DRAWS, TUNE = 500, 500
GRID = 90
"""Number of grid points per standard deviation, logarithmically spaced."""


@dataclass(frozen=True, slots=True)
class Exact:
    """Exact posterior of one complete table: weights over a grid of the three SDs, and distribution of the effect."""

    spreads: tuple[FloatArray, FloatArray, FloatArray]
    weights: FloatArray
    mean: FloatArray
    sd: FloatArray

    @classmethod
    def of(cls, table: FloatArray) -> Exact:
        """Compute the posterior from log ratios of subjects by scenes."""
        subjects, scenes = table.shape
        rows, columns, whole = table.mean(axis=1), table.mean(axis=0), float(table.mean())
        squares = (
            scenes * float(((rows - whole) ** 2).sum()),
            subjects * float(((columns - whole) ** 2).sum()),
            float(((table - rows[:, None] - columns + whole) ** 2).sum()),
        )
        freedom = (subjects - 1, scenes - 1, (subjects - 1) * (scenes - 1))
        left = math.sqrt(squares[2] / freedom[2])
        of_subjects, of_scenes = (
            np.geomspace(1e-4, 6 * RATIO_PRIORS[name].sd, GRID) for name in ("subjects", "scenes")
        )
        residual = np.geomspace(left / 2.5, left * 2.5, GRID)
        a, b, e = np.meshgrid(of_subjects, of_scenes, residual, indexing="ij")
        expected = (e**2 + scenes * a**2, e**2 + subjects * b**2, e**2)
        about = (expected[0] + expected[1] - e**2) / table.size  # variance of the mean around the effect
        prior = RATIO_PRIORS["rise"].sd ** 2
        log = -0.5 * (np.log(about + prior) + whole**2 / (about + prior))
        for square, df, scale in zip(squares, freedom, expected, strict=True):
            log -= 0.5 * (df * np.log(scale) + square / scale)
        for name, value in (("subjects", a), ("scenes", b), ("residual", e)):
            log += np.log(RATIO_PRIORS[name].density(value)) + np.log(value)  # Jacobian of the logarithmic spacing
        weights = np.exp(log - log.max())
        weight = prior / (about + prior)
        return cls((of_subjects, of_scenes, residual), weights / weights.sum(), weight * whole, np.sqrt(weight * about))

    def below(self, name: str, values: ArrayLike) -> FloatArray:
        """Return the probability that a parameter is below each value."""
        values = np.atleast_1d(np.asarray(values, dtype=float))
        if name == "rise":
            likely = self.weights > 1e-7 * self.weights.max()
            z = (values[:, None] - self.mean[likely]) / self.sd[likely]
            return np.asarray(special.ndtr(z) @ self.weights[likely] / self.weights[likely].sum())
        axis = ("subjects", "scenes", "residual").index(name)
        own = self.weights.sum(axis=tuple(other for other in range(3) if other != axis))
        middle = np.cumsum(own) - own / 2
        return np.interp(np.log(values), np.log(self.spreads[axis]), middle, left=0.0, right=1.0)


def drawn(seed: int, number: int, subjects: int, scenes: int) -> tuple[dict[str, float], FloatArray]:
    """Draw the true values of one data set, and its table."""
    rng = np.random.default_rng([seed, number])
    truth = {name: prior.draw(rng) for name, prior in RATIO_PRIORS.items()}
    table = truth["rise"] + truth["subjects"] * rng.normal(size=(subjects, 1))
    table = table + truth["scenes"] * rng.normal(size=(1, scenes))
    return truth, table + truth["residual"] * rng.normal(size=(subjects, scenes))


def exact(task: tuple[int, int, int, int]) -> dict[str, float]:
    """Return the quantile of each true value of one data set in its exact posterior; depends on `task` only."""
    truth, table = drawn(*task)
    posterior = Exact.of(table)
    return {name: float(posterior.below(name, value)[0]) for name, value in truth.items()}


def sampled(task: tuple[int, int, int, int]) -> dict[str, dict[str, float]]:
    """Compare the sampler's draws of one data set with the exact posterior, in standard errors; add true quantiles."""
    truth, table = drawn(*task)
    posterior = Exact.of(table)
    who, scene = np.indices(table.shape)
    rows = pd.DataFrame({"log_ratio": table.ravel(), "participant_id": who.ravel(), "scene": scene.ravel()})
    rows = rows.astype({"participant_id": str, "scene": str})
    found = posterior_of_rises(rows, "nearest", 1.2, seed=task[1] + 1, draws=DRAWS, tune=TUNE, chains=2)
    assert isinstance(found, Posterior)
    compared = {}
    for name, draws in ({"rise": found.draws} | dict(found.spread)).items():
        quantile = posterior.below(name, draws)
        effective = effective_number(quantile.reshape(2, DRAWS))
        z = (quantile.mean() - 0.5) * math.sqrt(12 * effective)
        compared[name] = {"z": float(z), "quantile": float((draws < truth[name]).mean()), "effective": effective}
    return compared


STEPS = 3


def drawn_steps(seed: int, number: int, subjects: int, scenes: int) -> tuple[dict[str, float], pd.DataFrame]:
    """Draw true values of one ordinal data set (pinhole and largest aperture, both fixations), and its table.

    Sets that do not use every step are drawn again: a selection by the answers alone keeps the true values uniform over
    their posteriors.
    """
    rng = np.random.default_rng([seed, number, STEPS])
    rows = pd.MultiIndex.from_product([range(subjects), range(scenes), ("nearest", "farthest"), (0.0, 1.0)])
    table = rows.to_frame(index=False, name=["participant_id", "scene", "fixation", "aperture_mm"])
    near, far = ((table["fixation"] == name) * table["aperture_mm"] for name in ("nearest", "farthest"))
    prior = ORDINAL_PRIORS
    even = np.arange(1, STEPS) / STEPS
    while True:
        rises = {name: prior["rise"].draw(rng) for name in ("nearest", "farthest")}
        latent = prior["fixation"].draw(rng) * (table["fixation"] == "farthest") + rng.logistic(size=len(table))
        truth = dict(rises)
        for group, column, count in (("subjects", "participant_id", subjects), ("scenes", "scene", scenes)):
            sds = [prior[group].draw(rng) for _ in range(3)]
            level, of_near, of_far = (sd * rng.normal(size=count)[table[column]] for sd in sds)
            latent = latent + level + of_near * near + of_far * far
            truth[f"{group}, nearest"], truth[f"{group}, farthest"] = sds[1:]
        latent = latent + rises["nearest"] * near + rises["farthest"] * far
        thresholds = np.zeros(STEPS - 1)
        while not (np.diff(thresholds) > 0).all():
            thresholds = special.logit(even) + prior["thresholds"].sd * rng.normal(size=STEPS - 1)
        answers = 1 + np.digitize(latent, thresholds)
        if len(np.unique(answers)) == STEPS:
            return truth | {"difference": rises["nearest"] - rises["farthest"]}, table.assign(rating=answers)


def of_steps(task: tuple[int, int, int, int]) -> dict[str, float]:
    """Return quantiles of the true values of one data set in the draws, smallest effective sample size, divergences."""
    truth, table = drawn_steps(*task)
    _, found = posteriors_of_steps(table, 1.44, seed=task[1] + 1, draws=DRAWS, tune=TUNE, chains=2)
    quantiles: dict[str, float] = {}
    for name, posterior in found.items():
        assert isinstance(posterior, Posterior)
        own = {str(name): posterior.draws} | {f"{group}, {name}": draws for group, draws in posterior.spread.items()}
        quantiles |= {each: float((draws < truth[each]).mean()) for each, draws in own.items()}
    worst = found["nearest"]
    assert isinstance(worst, Posterior)
    return quantiles | {"effective": worst.effective, "divergences": worst.divergences}


def evenness(table: pd.DataFrame) -> None:
    """Print tests of the uniformity of the true values' quantiles."""
    print("| parameter | chi-squared (9) | p | " + " | ".join(f"in {share:.0%}" for share in SHARES) + " |")
    print("| --- " * (3 + len(SHARES)) + "|")
    for name in table:
        quantile = table[name].to_numpy()
        test = stats.chisquare(np.histogram(quantile, BINS, (0, 1))[0])
        within = [np.abs(quantile - 0.5) < share / 2 for share in SHARES]
        cells = [str(name), f"{test.statistic:.1f}", f"{test.pvalue:.2f}", *(f"{one.mean():.3f}" for one in within)]
        print("| " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=20, help="fitted by the sampler, about 15 s of processor time each")
    parser.add_argument("--exact", type=int, default=1000, help="of the exact posterior, about 0.1 s each")
    parser.add_argument("--steps", type=int, default=0, help="sets of answers in steps, about 20 s each")
    parser.add_argument("--subjects", type=int, default=6)
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", help="address of a Dask scheduler, instead of processes")
    parser.add_argument("--out", type=Path, help="file for what each fitted set gave (JSON)")
    asked = parser.parse_args()

    def tasks(count: int) -> list[tuple[int, int, int, int]]:
        return [(asked.seed, number, asked.subjects, asked.scenes) for number in range(count)]

    with shared(asked.workers, asked.scheduler) as executor:
        if asked.exact:
            table = pd.DataFrame(list(in_order(executor, exact, tasks(asked.exact))))
            print(f"exact posterior, {len(table)} sets of {asked.subjects} subjects by {asked.scenes} scenes")
            evenness(table)
        found: list[dict[str, dict[str, float]]] = []
        for one in in_order(executor, sampled, tasks(asked.sets)):
            found.append(one)
            if asked.out:  # saved after each set, so that interrupted runs lose nothing
                asked.out.write_text(json.dumps({"ratios": found}) + "\n", encoding="utf-8")
        steps: list[dict[str, float]] = []
        for each in in_order(executor, of_steps, tasks(asked.steps)):
            steps.append(each)
            if asked.out:
                asked.out.write_text(json.dumps({"ratios": found, "steps": steps}) + "\n", encoding="utf-8")
    if found:
        against_exact(found)
    if steps:
        ran = pd.DataFrame(steps)
        print(f"answers in steps, {len(ran)} sets of {asked.subjects} subjects by {asked.scenes} scenes")
        evenness(ran.drop(columns=["effective", "divergences"]))
        print(f"effective draws {ran['effective'].min():.0f} or more; {int(ran['divergences'].sum())} divergences")


def against_exact(found: list[dict[str, dict[str, float]]]) -> None:
    """Print the comparison of the sampler's draws with the exact posterior."""
    print(f"sampler against the exact posterior, {len(found)} sets")
    print("| parameter | chi-squared | degrees of freedom | p | largest z | least effective draws |")
    print("| --- " * 6 + "|")
    for name in found[0]:
        z = np.array([one[name]["z"] for one in found])
        least = min(one[name]["effective"] for one in found)
        p = stats.chi2.sf((z**2).sum(), len(z))
        print(f"| {name} | {(z**2).sum():.1f} | {len(z)} | {p:.2f} | {np.abs(z).max():.2f} | {least:.0f} |")


if __name__ == "__main__":
    main()
