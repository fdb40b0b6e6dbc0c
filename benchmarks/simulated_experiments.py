"""Simulated experiments, and the rates at which the statistical tests reject: the cells of statistics_error_rates.py.

Tests with a closed form are computed for all data sets at once, as the package computes one.
"""

from __future__ import annotations

import math
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only slow it down

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import optimize, special, stats

from focalgradient.statistics import NotComputed
from focalgradient.statistics.bootstrap import BootstrapT, bootstrap_t
from focalgradient.statistics.cells import slope_weights
from focalgradient.statistics.crossed import crossed_effect, moments
from focalgradient.statistics.cube_questions import log_odds
from focalgradient.statistics.hypotheses import one_sided
from focalgradient.statistics.ordinal import ordinal_rating

FloatArray = NDArray[np.float64]
Rng = np.random.Generator
Rates = dict[str, float | str]
Draw = Callable[[Rng, tuple[int, ...]], FloatArray]

BOUND = RISE = math.log(1.2)
"""Bound of equivalence, and effect of which the power is computed."""
SCENES, SCENE_SD, SUBJECT_SD = 12, 0.1, 0.2
CELL_SD = 0.3
"""Standard deviation of a log rating, and of a depth effect of one subject and scene: two means of two ratings each."""


def gamma(skewness: float) -> Draw:
    """Return standardised gamma-distributed subjects; exponential at a skewness of 2."""
    shape = 4 / skewness**2
    return lambda rng, size: (rng.gamma(shape, size=size) - shape) / math.sqrt(shape)


def responders(share: float) -> Draw:
    """Return standardised subjects of whom a share has a common effect, the others none."""
    sd = math.sqrt(share * (1 - share))
    return lambda rng, size: ((rng.random(size) < share).astype(float) - share) / sd


SUBJECTS: dict[str, Draw] = {
    "normal": lambda rng, size: rng.normal(size=size),
    "alike": lambda rng, size: 0.1 * rng.normal(size=size),
    "t, 3 degrees of freedom": lambda rng, size: rng.standard_t(3, size=size) / math.sqrt(3),
    "skewness 1.4": gamma(math.sqrt(2)),
    "skewness 2": gamma(2),
    "skewness 4": gamma(4),
    "20 % responders": responders(0.2),
    "5 % responders": responders(0.05),
}
"""Distributions of subjects' effects, with mean 0 and standard deviation 1 ("alike": 0.1)."""


def rejected(p: Any) -> float:
    """Return the share of p values below .05."""
    return float((np.asarray(p) < 0.05).mean())


def student(mean: Any, error: Any, df: Any) -> FloatArray:
    """Return two-sided p values by Student's t."""
    return np.asarray(2 * stats.t.sf(np.abs(mean) / error, df))


def over_both(table: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean, standard error and degrees of freedom over subjects and scenes."""
    found = moments(table)
    return found.mean, found.standard_error, found.df


def over_people(table: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """Return mean, standard error and degrees of freedom over subjects."""
    people = table.mean(axis=-1)
    count = people.shape[-1]
    return people.mean(axis=-1), people.std(axis=-1, ddof=1) / math.sqrt(count), count - 1


# Ratings: tables of depth effects, data sets x subjects x scenes.


def effects_of(rng: Rng, sets: int, subjects: int, kind: str = "normal", scene_sd: float = SCENE_SD) -> FloatArray:
    """Draw depth effects with a mean of 0: data sets x subjects x scenes."""
    people = SUBJECT_SD * SUBJECTS[kind](rng, (sets, subjects, 1))
    return people + scene_sd * rng.normal(size=(sets, 1, SCENES)) + CELL_SD * rng.normal(size=(sets, subjects, SCENES))


def tested(mean: FloatArray, error: FloatArray, df: FloatArray) -> Rates:
    """Return rates of the test of the depth effect and of its equivalence to zero; the true effect is 0."""

    def equivalent(effect: float) -> float:
        return rejected(np.maximum(*one_sided(mean + effect, error, df, BOUND)))

    return {
        "rejected": rejected(student(mean, error, df)),
        "power": rejected(student(mean + RISE, error, df)),
        "false equivalence": equivalent(BOUND),
        "power of equivalence": equivalent(0),
    }


def ratings(rng: Rng, sets: int, kind: str, scene_sd: float, subjects: int) -> Rates:
    """Return rates of complete tables."""
    table = moments(effects_of(rng, sets, subjects, kind, scene_sd))
    return tested(table.mean, table.standard_error, table.df)


def gaps(rng: Rng, cells: FloatArray, pattern: str) -> None:
    """Set cells of one table (subjects x scenes) to NaN."""
    if pattern == "4 of 12 scenes each":
        cells[~rng.permuted(np.tile(np.arange(cells.shape[1]) < 4, (len(cells), 1)), axis=1)] = np.nan
    elif pattern == "40 % of cells lost":
        cells[rng.random(cells.shape) < 0.4] = np.nan


def against_lmertest(rng: Rng, sets: int, pattern: str, kind: str, subjects: int) -> Rates:
    """Return rates of `crossed_effect`, and the difference of its power from that of lmerTest on the same tables."""
    tables = list(effects_of(rng, sets, subjects, kind))
    for table in tables:
        gaps(rng, table, pattern)
    ours = np.array([(test.estimate, test.standard_error, test.df) for test in map(crossed_effect, tables)]).T  # type: ignore[union-attr]
    with tempfile.TemporaryDirectory() as folder:
        given, fits = Path(folder, "tables.csv"), Path(folder, "fits.csv")
        rows = [
            np.column_stack([np.full(len(at), number), at, table[tuple(at.T)]])
            for number, table in enumerate(tables)
            for at in [np.argwhere(np.isfinite(table))]
        ]
        names = ["set", "subject", "scene", "value"]
        pd.DataFrame(np.vstack(rows), columns=names).to_csv(given, index=False)
        subprocess.run(["Rscript", str(Path(__file__).with_name("error_rates.R")), given, fits], check=True)
        theirs = pd.read_csv(fits).sort_values("set")[["mean", "error", "df"]].to_numpy().T
    test, by_r = tested(*ours), tested(*theirs)
    rates: Rates = {name: test[name] for name in ("rejected", "power")}
    return rates | {f"lmerTest: {name}": by_r[name] for name in ("rejected", "power")}


def effect_sizes(rng: Rng, sets: int, d: float, subjects: int) -> Rates:
    """Return the coverage of the interval of d (Westfall, Kenny and Judd 2014)."""
    true = d * math.sqrt(SUBJECT_SD**2 + SCENE_SD**2 + CELL_SD**2)
    sizes: list[Any] = [crossed_effect(table + true).d for table in effects_of(rng, sets, subjects)]  # type: ignore[union-attr]
    return {"coverage of d": float(np.mean([size.low < d < size.high for size in sizes]))}


def hartung_knapp(estimates: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the p values of `random_effects` for independent data sets: sets x data sets."""
    df = estimates.shape[1] - 1

    def pool(between: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        weights = 1 / (errors**2 + between[:, None])
        mean = (weights * estimates).sum(axis=1) / weights.sum(axis=1)
        return mean, weights.sum(axis=1), (weights * (estimates - mean[:, None]) ** 2).sum(axis=1)

    low, high = np.zeros(len(estimates)), np.full(len(estimates), 1e3)
    low_q = pool(low)[2]
    for _ in range(100):  # the generalised Q of Paule and Mandel falls with the variance between data sets
        middle = (low + high) / 2
        above = pool(middle)[2] > df
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    mean, weight, q = pool(np.where(low_q > df, low, 0.0))
    return student(mean, np.sqrt(q / df / weight), df)


def pooled(rng: Rng, sets: int, scenes: str, sd: float, studies: int) -> Rates:
    """Return how often a pooled effect of 0 is rejected; data sets differ by a standard deviation of `sd`."""
    tests, by_scene = [], []
    common = rng.normal(0, 0.2, (sets, 1, SCENES))
    for study in range(studies):
        number = (5, 10, 30)[study % 3] if "5, 10 and 30" in scenes else 10
        shown = rng.normal(0, 0.2, (sets, 1, SCENES)) if scenes.startswith("new") else common
        cells = effects_of(rng, sets, number, scene_sd=0.0) + shown + rng.normal(0, sd, (sets, 1, 1))
        by_scene.append(cells.mean(axis=1))
        tests.append(over_both(cells)[:2])
    if scenes == "same scenes":
        return {"rejected": rejected(student(*over_both(np.stack(by_scene, axis=1))))}
    estimates, errors = np.array(tests).transpose(1, 2, 0)
    return {"rejected": rejected(hartung_knapp(estimates, errors))}


# Sensitivity analysis: means of subjects, data sets x subjects.

NOISE = (0.1, 0.44)
"""Noise SD of a subject's mean relative to the SD over subjects: precise answers, and .3 / sqrt(12) / .2."""
DRAWS = 1999
"""Resamples of the bootstrap: enough for a level, as its error averages over data sets."""
NUMBERS = (20, 30, 40, 50, 60, 80, 100, 120, 160, 200, 300, 400)
"""Numbers of subjects tried by `enough`."""
BATCH = 5000
"""Data sets that `enough` draws at once."""


def bootstrapped(values: FloatArray) -> FloatArray:
    """Return the p values of the bootstrap-t, one for each data set."""
    tests = [bootstrap_t(row, DRAWS) for row in values]
    return np.array([test.p if isinstance(test, BootstrapT) else 1.0 for test in tests])


def sign_flips(values: FloatArray) -> FloatArray:
    """Return p values of the sign-flip test: all flips up to 12 subjects, else 2000 random ones."""
    count = values.shape[1]
    if count <= 12:
        signs = 1 - 2.0 * ((np.arange(2 ** (count - 1))[:, None] >> np.arange(count)) & 1)
    else:
        signs = np.vstack([np.ones(count), np.random.default_rng(1).choice([-1.0, 1.0], (1999, count))])
    return np.array([(np.abs(signs @ row) >= abs(row.sum()) - 1e-12 * np.abs(row).sum()).mean() for row in values])


def drawn(rng: Rng, kind: str, noise: float, shape: tuple[int, int]) -> FloatArray:
    """Draw mean effects of subjects with a mean of 0."""
    return SUBJECTS[kind](rng, shape) + noise * rng.normal(size=shape)


def power_mean(subjects: int, noise: float) -> float:
    """Return the mean at which Student's t of normal subjects has a power of .80."""
    error, df = math.sqrt((1 + noise**2) / subjects), subjects - 1
    critical = float(stats.t.isf(0.025, df))
    return error * float(optimize.brentq(lambda at: stats.nct.sf(critical, df, at) - 0.8, 0.1, 20))


def robust(rng: Rng, sets: int, kind: str, noise: float, powerful: bool, subjects: int) -> Rates:
    """Return rates of Student's t and of two sensitivity analyses."""
    values = drawn(rng, kind, noise, (sets, subjects)) + powerful * power_mean(subjects, noise)
    name = "power of {}" if powerful else "rejected by {}"
    tests = {
        "Student's t": stats.ttest_1samp(values, 0, axis=1).pvalue,
        "bootstrap-t": bootstrapped(values),
        "sign flips": sign_flips(values),
    }
    return {name.format(test): rejected(p) for test, p in tests.items()}


def enough(rng: Rng, sets: int, kind: str, noise: float) -> Rates:
    """Return the number of `NUMBERS` from which on Student's t rejects at most .06."""
    least: int | None = None
    for number in reversed(NUMBERS):
        batches = [drawn(rng, kind, noise, (BATCH, number)) for _ in range(sets // BATCH)]
        if np.mean([rejected(stats.ttest_1samp(values, 0, axis=1).pvalue) for values in batches]) > 0.06:
            break
        least = number
    return {"subjects": str(least or f"more than {NUMBERS[-1]}")}


# Comparisons of two pictures, and steps: answers, data sets x subjects x scenes x apertures x repetitions.

MM = {"f/22": 2.27, "f/11": 4.55, "f/5.6": 8.93}
LARGEST = 8.93
FEW_SCENES = 6
CUTS = np.linspace(-3.0, 3.0, 6)
"""Thresholds between the seven steps, log odds."""


def answers(scale: str, felt: FloatArray) -> FloatArray:
    """Return the answers to latent percepts (log odds)."""
    if scale == "bipolar":
        return np.clip(np.round(felt), -3, 3)
    return np.asarray(felt > 0 if scale == "choice" else 1 + np.digitize(felt, CUTS), dtype=float)


def answered(
    rng: Rng, sets: int, scale: str, kind: str, scene_sd: float, subjects: int, mean: float, level: float = 0.0
) -> FloatArray:
    """Draw answers of which effects differ over subjects by 1 and over scenes by `scene_sd`; steps have a pinhole."""
    amounts = np.array([0.0] * (scale == "steps") + list(MM.values()))
    rise = mean + SUBJECTS[kind](rng, (sets, subjects, 1, 1, 1))
    rise = rise + scene_sd * rng.normal(size=(sets, 1, FEW_SCENES, 1, 1))
    if scale == "steps":
        level = level + rng.normal(size=(sets, subjects, 1, 1, 1))  # type: ignore[assignment]
    noise = rng.logistic(size=(sets, subjects, FEW_SCENES, len(amounts), 2))
    return answers(scale, level + rise * amounts[:, None] / LARGEST + noise)


def as_rows(data: FloatArray, scale: str) -> pd.DataFrame:
    """Convert one data set to the table of trials that the analyses take."""
    amounts = {"pinhole": 0.0} | MM if scale == "steps" else MM
    rows = pd.DataFrame(np.argwhere(np.isfinite(data)), columns=["who", "place", "number", "repetition"])
    return rows.assign(
        rating=data.ravel(),
        participant_id=rows["who"].map("{:02}".format),
        scene=rows["place"].map("s{}".format),
        aperture=rows["number"].map([*amounts].__getitem__),
        aperture_mm=rows["number"].map([*amounts.values()].__getitem__),
        trial=range(len(rows)),
        fixation="nearest",
        catch=False,
    )


@cache
def true_slope(scale: str, kind: str, scene_sd: float, mean: float) -> float:
    """Return the slope per millimetre over a population of 100,000 subjects with one scene each."""
    rng = np.random.default_rng(1)
    rises = mean + SUBJECTS[kind](rng, (100_000,)) + scene_sd * rng.normal(size=100_000)
    felt = rises[:, None] * np.array(list(MM.values())) / LARGEST
    steps = np.arange(-2.5, 3.0) if scale == "bipolar" else np.zeros(1)
    means = special.expit(felt[..., None] - steps).sum(axis=-1).mean(axis=0)
    return float(np.polyfit(list(MM.values()), means, 1)[0])


def slopes(data: FloatArray) -> FloatArray:
    """Return the slope of each subject and scene."""
    return np.asarray(data.mean(axis=-1) @ np.asarray(slope_weights(np.array(list(MM.values())))))


def comparisons(rng: Rng, sets: int, scale: str, kind: str, scene_sd: float, subjects: int) -> Rates:
    """Return rates for the slopes of comparisons, over subjects and over subjects and scenes; the power is at 1."""
    null, raised = (slopes(answered(rng, sets, scale, kind, scene_sd, subjects, mean)) for mean in (0.0, 1.0))
    rates: Rates = {}
    for name, table in (("rejected", null), ("power", raised)):
        rates[f"{name}, subjects"] = rejected(student(*over_people(table)))
        rates[f"{name}, subjects and scenes"] = rejected(student(*over_both(table)))
    mean, error, df = over_both(raised)
    away = np.abs(mean - true_slope(scale, kind, scene_sd, 1.0))
    return rates | {"coverage, subjects and scenes": float((away < stats.t.isf(0.025, df) * error).mean())}


def marginal(rng: Rng, sets: int, subjects: int) -> Rates:
    """Return rates of Wald's test of a marginal logistic slope (GEE, bias-reduced), and of a t-test over subjects."""
    import statsmodels.api as sm  # type: ignore[import-untyped]

    rates: Rates = {}
    for name, mean in (("rejected", 0.0), ("power", 1.0)):
        data = answered(rng, sets, "choice", "normal", 0.0, subjects, mean)
        amounts = np.broadcast_to(np.array(list(MM.values()))[:, None], data.shape[1:]).ravel()
        groups = np.repeat(np.arange(subjects), data[0, 0].size)
        predictors = np.column_stack([np.ones_like(amounts), amounts])
        models = [sm.GEE(row.ravel(), predictors, groups, family=sm.families.Binomial()) for row in data]
        wald = np.array([model.fit(cov_type="bias_reduced").tvalues[1] for model in models])
        rates[f"{name}, GEE"] = rejected(2 * stats.norm.sf(np.abs(wald)))
        rates[f"{name}, GEE, by t on N - 1"] = rejected(2 * stats.t.sf(np.abs(wald), subjects - 1))
        rates[f"{name}, subjects"] = rejected(student(*over_people(slopes(data))))
    return rates


def steps(rng: Rng, sets: int, level: float, scene_sd: float, subjects: int) -> Rates:
    """Return rates of the ordinal analysis; the true effect is 0."""
    data = answered(rng, sets, "steps", "normal", scene_sd, subjects, 0.0, level)
    tests = [ordinal_rating(as_rows(answer, "steps"), []).rises[0] for answer in data]
    return {
        "rejected": rejected([getattr(test, "p", np.nan) for test in tests]),
        "not computed": float(np.mean([isinstance(test, NotComputed) for test in tests])),
        "in the lowest step": float((data == 1).mean()),
    }


# The Necker cube.

TRIALS, LASTS = 3, 30.0
"""Trials per gradient, and their duration in seconds."""
ODDS = 1.7
"""Odds ratio of time of which the power is computed."""
RARE = math.log(0.045 / 0.955)
"""Log odds of a reading seen in 4.5 % of the time."""


def drawn_cubes(rng: Rng, sets: int, subjects: int, level: float, effect: float) -> FloatArray:
    """Draw half of the log odds of nonrigid time: data sets x subjects x (no gradient, gradient) x trials.

    `level` and `effect` are the mean log odds without a gradient and their change by it; subjects' log odds differ by
    0.6 in level and by 0.5 in effect.
    """
    base, change = rng.normal(level, 0.6, (sets, subjects)), rng.normal(effect, 0.5, (sets, subjects))
    odds = np.stack([base, base + change], axis=-1)
    return np.repeat(odds[..., None] / 2, TRIALS, axis=-1)


Percepts = tuple[FloatArray, FloatArray, NDArray[np.bool_]]
"""Onset, duration (0 after the end of a trial) and whether rigid, of one percept of each trial."""


def percepts(rng: Rng, half: FloatArray) -> Iterator[Percepts]:
    """Yield successive percepts."""
    now: FloatArray = np.zeros(half.shape)
    rigid = rng.random(half.shape) < 0.5
    while (now < LASTS).any():
        lasts = rng.gamma(3.0, 1.5 * np.exp(np.where(rigid, -half, half)))
        yield now, np.clip(LASTS - now, 0, lasts), rigid
        now, rigid = now + lasts, ~rigid


def cube_tests(shown: Iterable[Percepts]) -> FloatArray:
    """Return the p value of the primary test of `necker` for each data set."""
    times, reports = np.zeros(2), np.zeros(1)
    for _, duration, rigid in shown:
        times = times + np.stack([np.where(rigid, 0, duration), np.where(rigid, duration, 0)]).sum(axis=-1)
        reports = reports + (duration > 0).sum(axis=(1, 2, 3))
    nonrigid, rigid_time = times + (times.sum(axis=(0, 2, 3)) / reports / 2)[:, None, None]  # half a report is added
    odds = log_odds(nonrigid, rigid_time, 0.0)
    change = odds[..., 1] - odds[..., 0]
    return np.asarray(stats.ttest_1samp(change, 0, axis=1).pvalue)


def cube(rng: Rng, sets: int, level: float, subjects: int) -> Rates:
    """Return rates of the primary test of the cube."""
    effects = {"rejected": 0.0, "power": math.log(ODDS)}
    return {
        name: rejected(cube_tests(percepts(rng, drawn_cubes(rng, sets, subjects, level, effect))))
        for name, effect in effects.items()
    }
