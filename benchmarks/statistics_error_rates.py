"""False-positive rates of all tests of depth ratings, and coverage of their intervals, by simulation.

    python benchmarks/statistics_error_rates.py [--sets 8000] [--equivalence 20000] [--incomplete 2000] [--cube 2000]
        [--workers 2 | --scheduler ADDRESS] [--markdown FILE]

Each data set is one experiment: N subjects, 12 scenes, 4 apertures, 2 repetitions, near and far fixation. Subjects
differ in their effect in one of six ways, scenes not at all or with an SD of 0.1, and the curve is linear or saturates.
The mean effect is zero (or, for equivalence, exactly at the bound; for coverage, a factor of 1.3 for near). All data
sets of a cell are analysed at once by the functions that analyse one; a check compares both.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from collections.abc import Callable
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only slow it down

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from focalgradient.parallel import in_order, shared
from focalgradient.statistics import Effect, Equivalence, depth_rating, necker
from focalgradient.statistics.cells import slope_weights
from focalgradient.statistics.crossed import crossed_effect, moments
from focalgradient.statistics.hypotheses import one_sided

FloatArray = NDArray[np.float64]

APERTURES = {"pinhole": 0.0, "f/22": 2.27, "f/11": 4.55, "f/5.6": 8.93}
MM = np.array(list(APERTURES.values()))
REPETITIONS = 2
SCENES = 12
BOUND = 1.2
RISE = 1.3  # effect at near fixation for which coverage is computed
NOISE = 0.3  # standard deviation of the log of one answer
SUBJECTS = (4, 6, 10, 20)
SCENE_SD = (0.0, 0.1)
CURVES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "linear": lambda mm: mm / MM[-1],
    "saturating": lambda mm: (1 - np.exp(-mm / 3)) / (1 - math.exp(-MM[-1] / 3)),
}
LOG_SD = 0.83255  # log SD of a log-normal distribution with a skewness of 4
# Distributions of subjects' log effects: standard deviation 0.02 or 0.2; skewness 1.4 and 4; Student's t with 3 df.
DIFFERENCES: dict[str, Callable[[np.random.Generator, tuple[int, ...]], FloatArray]] = {
    "little": lambda rng, size: 0.02 * rng.normal(size=size),
    "much": lambda rng, size: 0.2 * rng.normal(size=size),
    "skewed": lambda rng, size: 0.2 * (rng.gamma(2.0, size=size) - 2.0) / math.sqrt(2.0),
    "very skewed": lambda rng, size: 0.2 * (rng.gamma(0.25, size=size) - 0.25) / math.sqrt(0.25),
    "log-normal": lambda rng, size: 0.2 * _standard(np.exp(LOG_SD * rng.normal(size=size))),
    "heavy-tailed": lambda rng, size: 0.2 * rng.standard_t(3, size=size) / math.sqrt(3.0),
}
# Distributions for the equivalence test only: skewness 2, and one subject in five with an effect of one half.
EXTREME: dict[str, Callable[[np.random.Generator, tuple[int, ...]], FloatArray]] = {
    "exponential": lambda rng, size: 0.2 * (rng.exponential(size=size) - 1),
    "one in five": lambda rng, size: 0.5 * ((rng.random(size) < 0.2).astype(float) - 0.2),
}
BATCH = 250  # data sets at a time: 250 x 20 x 12 x 4 numbers


def _standard(values: FloatArray) -> FloatArray:
    """Return log-normal values standardised to mean 0 and standard deviation 1."""
    mean = math.exp(LOG_SD**2 / 2)
    return (values - mean) / (mean * math.sqrt(math.exp(LOG_SD**2) - 1))


def answers(
    rng: np.random.Generator, sets: int, subjects: int, kind: str, scene_sd: float, curve: str, rise: float
) -> FloatArray:
    """Return mean log answers of one fixation: sets x subjects x scenes x apertures."""
    own = math.log(rise) + DIFFERENCES[kind](rng, (sets, subjects, 1, 1))
    of_scenes = rng.normal(0, scene_sd, (sets, 1, SCENES, 1)) if scene_sd else 0.0
    level = rng.normal(0, 0.1, (sets, subjects, SCENES, 1))
    noise = rng.normal(0, NOISE / math.sqrt(REPETITIONS), (sets, subjects, SCENES, len(MM)))
    return np.asarray(level + (own + of_scenes) * CURVES[curve](MM) + noise)


def rated(cells: FloatArray, truth: float = 0.0) -> dict[str, FloatArray]:
    """Test tables sets x subjects x scenes: p and coverage over both, and for these scenes."""
    found = moments(cells)
    own = cells.mean(axis=2)
    error = own.std(axis=1, ddof=1) / math.sqrt(own.shape[1])
    freedom = own.shape[1] - 1
    return {
        "p": np.asarray(2 * stats.t.sf(np.abs(found.mean / found.standard_error), found.df)),
        "covers": _covers(found.mean - truth, found.standard_error, found.df),
        "p these": np.asarray(2 * stats.t.sf(np.abs(own.mean(axis=1) / error), freedom)),
        "covers these": _covers(own.mean(axis=1) - truth, error, freedom),
        "outside": np.maximum(*one_sided(found.mean, found.standard_error, found.df, math.log(BOUND))),
    }


def _covers(off: FloatArray, error: FloatArray, df: FloatArray | int) -> FloatArray:
    """Return whether the interval by Student's t covers a value at distance `off` from the estimate."""
    return np.asarray(np.abs(off) < stats.t.isf(0.025, df) * error, dtype=float)


def batch(rng: np.random.Generator, sets: int, subjects: int, kind: str, scene_sd: float, curve: str) -> dict[str, int]:
    """Count the data sets in which each test rejects, and in which each interval covers the truth."""
    draw = partial(answers, rng, sets, subjects, kind, scene_sd, curve)
    near, far, raised, at_bound = draw(1.0), draw(1.0), draw(RISE), draw(BOUND)

    def rise(table: FloatArray) -> FloatArray:
        return table[..., -1] - table[..., 0]

    tests = {"near": rated(rise(near)), "interaction": rated(rise(near) - rise(far))}
    tests["slope"] = rated(near @ _weights(slope_weights(MM)))
    covered = rated(rise(raised), math.log(RISE))
    equal = rated(rise(at_bound))
    middle = rated(raised[..., 2] - raised[..., 0], math.log(RISE) * float(CURVES[curve](MM)[2]))
    found = {
        "rise": tests["near"]["p"] < 0.05,
        "interaction": tests["interaction"]["p"] < 0.05,
        "slope": tests["slope"]["p"] < 0.05,
        "equivalence, true rise at the bound": equal["outside"] < 0.05,
        "rise, for these scenes": tests["near"]["p these"] < 0.05,
        "coverage: rise": covered["covers"],
        "coverage: f/11 to pinhole": middle["covers"],
        "coverage: rise, for these scenes": covered["covers these"],
    }
    return {name: int(value.sum()) for name, value in found.items()}


def _weights(weights: Any) -> FloatArray:
    return np.asarray(weights, dtype=float)


def cell(task: tuple[int, int, int, str, float, str]) -> dict[str, Any]:
    """Compute one cell of the table: rates of each test and interval, which depend on `task` only."""
    seed, sets, subjects, kind, scene_sd, curve = task
    place = (subjects, list(DIFFERENCES).index(kind), int(scene_sd > 0), list(CURVES).index(curve))
    rng = np.random.default_rng(np.random.SeedSequence([seed, *place]))
    total: dict[str, int] = {}
    for start in range(0, sets, BATCH):
        for name, count in batch(rng, min(BATCH, sets - start), subjects, kind, scene_sd, curve).items():
            total[name] = total.get(name, 0) + count
    return {
        "subjects": subjects,
        "differences": kind,
        "scene_sd": scene_sd,
        "curve": curve,
        "sets": sets,
        "rates": {name: count / sets for name, count in total.items()},
    }


def at_bounds(task: tuple[int, int, int, str, float]) -> tuple[float, ...]:
    """Return rates of equivalence if the true effect is exactly at the upper and at the lower bound."""
    seed, sets, subjects, kind, scene_sd = task
    every = DIFFERENCES | EXTREME
    rng = np.random.default_rng(np.random.SeedSequence([seed, subjects, list(every).index(kind), scene_sd > 0]))
    found = np.zeros(2)
    for start in range(0, sets, BATCH):
        many = min(BATCH, sets - start)
        rises = every[kind](rng, (many, subjects, 1)) + scene_sd * rng.normal(size=(many, 1, SCENES))
        rises = rises + rng.normal(0, NOISE * math.sqrt(2 / REPETITIONS), (many, subjects, SCENES))
        tests = [rated(rises + side * math.log(BOUND)) for side in (1, -1)]
        found += [(one["outside"] < 0.05).sum() for one in tests]
    return tuple((found / sets).tolist())


def equivalence_table(seed: int, sets: int, executor: Any) -> str:
    """Format false equivalence at both bounds, one line for each kind of subjects and scenes."""
    kinds = list(product(SCENE_SD, DIFFERENCES | EXTREME))
    tasks = [(seed, sets, subjects, kind, scene_sd) for scene_sd, kind in kinds for subjects in SUBJECTS]
    rates = [f"{high:.3f} / {low:.3f}" for high, low in in_order(executor, at_bounds, tasks)]
    lines = [
        "| subjects differ; scenes | " + " | ".join(f"N = {subjects}" for subjects in SUBJECTS) + " |",
        "| --- " * (len(SUBJECTS) + 1) + "|",
    ]
    for number, (scene_sd, kind) in enumerate(kinds):
        own = rates[number * len(SUBJECTS) : (number + 1) * len(SUBJECTS)]
        lines.append(f"| {kind}; {scene_sd:g} | " + " | ".join(own) + " |")
    return "\n".join(lines) + "\n"


PATTERNS = ("4 of 12 scenes each", "40 % lost", "own scenes each")
INCOMPLETE = [
    (pattern, kind, subjects) for pattern in PATTERNS for kind in ("much", "very skewed") for subjects in (6, 10)
]
INCOMPLETE_RISE = 1.2


def incomplete(task: tuple[int, int, str, str, int]) -> dict[str, float]:
    """Return rates for incomplete tables: rejections of an effect of zero and of `INCOMPLETE_RISE`, and coverage."""
    seed, sets, pattern, kind, subjects = task
    place = (PATTERNS.index(pattern), list(DIFFERENCES).index(kind), subjects)
    rng = np.random.default_rng(np.random.SeedSequence([seed, *place, 7]))
    total: dict[str, float] = {}
    for _ in range(sets):
        scenes = SCENES if pattern != PATTERNS[2] else 4 * subjects
        cells = DIFFERENCES[kind](rng, (subjects, 1)) + rng.normal(0, 0.1, (1, scenes))
        cells = cells + rng.normal(0, NOISE * math.sqrt(2 / REPETITIONS), (subjects, scenes))
        if pattern == PATTERNS[0]:
            kept = rng.permuted(np.tile(np.arange(scenes) < 4, (subjects, 1)), axis=1)
        elif pattern == PATTERNS[1]:
            kept = rng.random(cells.shape) > 0.4
        else:
            kept = np.arange(scenes) // 4 == np.arange(subjects)[:, None]
        cells[~kept] = np.nan
        none = crossed_effect(cells)
        assert isinstance(none, Effect)
        raised = (none.estimate + math.log(INCOMPLETE_RISE)) / none.standard_error  # of an effect, with the same error
        rates = {
            "rejected": none.p < 0.05,
            "coverage": none.low < 0 < none.high,
            "power": 2 * stats.t.sf(abs(raised), none.df) < 0.05,
        }
        for name, value in rates.items():
            total[name] = total.get(name, 0.0) + value / sets
    return total


def incomplete_table(seed: int, sets: int, executor: Any) -> str:
    """Format one line for each kind of incomplete table."""
    tasks = [(seed, sets, *one) for one in INCOMPLETE]
    rows = list(in_order(executor, incomplete, tasks))
    lines = ["| cells; subjects; N | " + " | ".join(rows[0]) + " |", "| --- " * (len(rows[0]) + 1) + "|"]
    for (pattern, kind, subjects), row in zip(INCOMPLETE, rows, strict=True):
        lines.append(f"| {pattern}; {kind}; {subjects} | " + " | ".join(f"{rate:.3f}" for rate in row.values()) + " |")
    return "\n".join(lines) + "\n"


def compare(seed: int) -> None:
    """Analyse one data set by `depth_rating` and by this file; exit if they differ."""
    rng = np.random.default_rng(seed)
    logs = answers(rng, 1, 6, "much", 0.1, "saturating", RISE)
    rows = [
        (f"{who:02}", f"s{scene:02}", name, APERTURES[name], "nearest", float(np.exp(logs[0, who, scene, number])))
        for who, scene, (number, name) in product(range(6), range(SCENES), enumerate(APERTURES))
    ]
    table = pd.DataFrame(rows, columns=["participant_id", "scene", "aperture", "aperture_mm", "fixation", "rating"])
    result = depth_rating(table.assign(trial=range(len(table)), catch=False), equivalence_bound=BOUND).fixations[0]
    mine = rated(logs[..., -1] - logs[..., 0])
    assert isinstance(result.rise, Effect)
    np.testing.assert_allclose(result.rise.p, mine["p"][0], rtol=1e-9)
    assert isinstance(result.equivalence, Equivalence)
    np.testing.assert_allclose(result.equivalence.p, mine["outside"][0], rtol=1e-9)


TRIALS, LASTS = 3, 30.0  # trials per gradient of the cube, and their duration in seconds


def reports(rng: np.random.Generator, subjects: int, spread: float, middle: float = 0.0) -> pd.DataFrame:
    """Simulate reports on the cube by people whose two percepts last equally long on average, with any gradient.

    Then both the mean proportion of time and the mean log odds are without effect, although their curve is nonlinear.
    `middle` is half the mean log odds of the nonrigid reading: where it is rare, it and all strengths have the same
    variation.
    """
    rows = []
    for subject in range(subjects):
        level = rng.normal(middle, 0.3)
        for gradient, strength in (("none", 0.0), ("nonrigid", 10.0)):
            own = (
                rng.normal(0, 2 * spread) if strength or middle else 0.0
            )  # equal variation, so that shares do not differ
            for trial in range(TRIALS):
                now, rigid = 0.0, bool(rng.integers(2))
                while now < LASTS:
                    mean = 4.5 * math.exp(-level - own if rigid else level + own)
                    lasts = rng.gamma(3.0, mean / 3.0)
                    shown, cut = min(lasts, LASTS - now), now + lasts >= LASTS
                    rows.append((f"{subject:02}", f"{gradient} {trial}", gradient, strength, now, shown, rigid, cut))
                    now, rigid = now + lasts, not rigid
    names = ["participant_id", "trial", "gradient", "strength", "onset", "duration", "rigid", "censored"]
    table = pd.DataFrame(rows, columns=names)
    table["percept"] = np.where(table["rigid"], "rigid", "nonrigid")
    return table.assign(catch=False, trial_duration=LASTS)


RARE = -1.53  # half the log odds of a proportion of 4.5 %


def cube(task: tuple[int, int, int, float]) -> dict[str, float]:
    """Return p values of each test of one experiment on the cube; NaN if not computed."""
    seed, subjects, number, middle = task
    table = reports(np.random.default_rng([seed, subjects, number]), subjects, 0.2, middle)
    (effect,) = necker(table, durations=False).effects
    test = effect.odds_of_time
    return {"odds, time": test.p if isinstance(test, Effect) else math.nan}


SHOWN = {
    "rise": "rejected",
    "interaction": "difference rejected",
    "equivalence, true rise at the bound": "false equivalence",
    "coverage: rise": "coverage",
    "rise, for these scenes": "rejected, these scenes",
}
"""Rates of the table, with their headings."""


def markdown(rows: list[dict[str, Any]]) -> str:
    """Format one line for each kind of subjects and scenes; bold above .06, or .02 off a coverage of .95."""
    lines = ["| subjects; scenes; N | " + " | ".join(SHOWN.values()) + " |", "| --- " * (len(SHOWN) + 1) + "|"]
    for row in rows:
        cells = []
        for name in SHOWN:
            rate = row["rates"][name]
            bad = abs(rate - 0.95) > 0.02 if name.startswith("coverage") else rate > 0.06
            cells.append(f"**{rate:.3f}**" if bad else f"{rate:.3f}")
        lines.append(f"| {row['differences']}; {row['scene_sd']:g}; {row['subjects']} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=4000, help="of each cell; 0 for none")
    parser.add_argument("--equivalence", type=int, default=0, help="sets of each cell, for that test alone")
    parser.add_argument("--incomplete", type=int, default=0, help="sets of each kind of incomplete table, slow")
    parser.add_argument("--cube", type=int, default=0, help="experiments on the cube with each N, slow")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", help="address of a Dask scheduler, instead of processes")
    parser.add_argument("--markdown", type=Path, help="file for the table")
    parser.add_argument("--out", type=Path, help="file for all rates (JSON)")
    asked = parser.parse_args()
    compare(asked.seed)
    tasks = [
        (asked.seed, asked.sets, subjects, kind, scene_sd, "linear")
        for scene_sd, kind, subjects in product(SCENE_SD, DIFFERENCES, SUBJECTS)
    ]
    with shared(asked.workers, asked.scheduler) as executor:
        if asked.equivalence:
            print(equivalence_table(asked.seed, asked.equivalence, executor), flush=True)
        if asked.incomplete:
            print(incomplete_table(asked.seed, asked.incomplete, executor), flush=True)
        rows = list(in_order(executor, cell, tasks)) if asked.sets else []
        print(markdown(rows) if rows else "")
        for subjects in SUBJECTS if asked.cube else ():
            for middle in (0.0, RARE):
                of_cube = [(asked.seed, subjects, number, middle) for number in range(asked.cube)]
                p = pd.DataFrame(list(in_order(executor, cube, of_cube)))
                rates = dict((p < 0.05).mean().round(3))
                print(f"cube, N = {subjects}, nonrigid {100 / (1 + math.exp(-2 * middle)):.1f} %:", rates, flush=True)
    if asked.markdown and rows:
        asked.markdown.write_text(markdown(rows), encoding="utf-8")
    if asked.out:
        asked.out.write_text(json.dumps({"seed": asked.seed, "cells": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
