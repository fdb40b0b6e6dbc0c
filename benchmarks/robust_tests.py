"""Level and power of Student's t, the bootstrap-t and sign flips for a mean over subjects who may be skewed.

    python benchmarks/robust_tests.py [--sets 2000] [--subjects 6 12 20] [--enough]

Each data set is the mean effects of N subjects: a distribution with standard deviation 1 and a given skewness, plus the
noise of their answers (`NOISE`, relative to that standard deviation). The level is the proportion of data sets with a
mean of 0 that a test rejects at .05, for the worse of both signs of the skewness; the power is for a mean at which
Student's t of normal subjects has a power of .80. `--enough` raises the number of subjects until the level of
Student's t is .06 at most.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from focalgradient.statistics.bootstrap import BootstrapT, bootstrap_t

FloatArray = NDArray[np.float64]
Draw = Callable[[np.random.Generator, tuple[int, ...]], FloatArray]

NOISE = (0.1, 0.44)
"""Noise SD of a subject's mean relative to the SD over subjects: precise answers, and .3 sqrt(2 / 2 / 12) / .2."""

DRAWS = 1999
"""Resamples of the bootstrap: enough for a level, as its error averages over data sets."""

NUMBERS = (20, 30, 40, 50, 60, 80, 100, 120, 160, 200, 300, 400)
"""Numbers of subjects tried by `--enough`."""

LEVEL = 0.06
"""Level that counts as kept by `--enough`."""


def gamma(skewness: float) -> Draw:
    """Return gamma-distributed subjects; exponential at a skewness of 2."""
    shape = 4 / skewness**2
    return lambda rng, size: (rng.gamma(shape, size=size) - shape) / math.sqrt(shape)


def responders(share: float) -> Draw:
    """Return subjects of whom a share has a common effect, the others none."""
    sd = math.sqrt(share * (1 - share))
    return lambda rng, size: ((rng.random(size) < share).astype(float) - share) / sd


SUBJECTS: dict[str, Draw] = {
    "normal": lambda rng, size: rng.normal(size=size),
    "gamma, skewness 2": gamma(2),
    "gamma, skewness 4": gamma(4),
    "20 % responders (skewness 1.5)": responders(0.2),
    "5 % responders (skewness 4.1)": responders(0.05),
}


def student(values: FloatArray) -> FloatArray:
    """Return the p values of Student's t, one for each data set."""
    return np.asarray(stats.ttest_1samp(values, 0, axis=1).pvalue)


def bootstrapped(values: FloatArray) -> FloatArray:
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


TESTS = {"Student's t": student, "bootstrap-t": bootstrapped, "sign flips": sign_flips}


def drawn(rng: np.random.Generator, kind: str, noise: float, shape: tuple[int, int], mean: float = 0.0) -> FloatArray:
    """Draw mean effects of subjects: data sets x subjects."""
    return SUBJECTS[kind](rng, shape) + noise * rng.normal(size=shape) + mean


def power_mean(subjects: int, noise: float, power: float = 0.8) -> float:
    """Return the mean at which Student's t of normal subjects has the power."""
    error, df = math.sqrt((1 + noise**2) / subjects), subjects - 1
    critical = float(stats.t.isf(0.025, df))
    centre = optimize.brentq(lambda at: stats.nct.sf(critical, df, at) - power, 0.1, 20)
    return float(centre) * error


def level(test: Callable[[FloatArray], FloatArray], values: FloatArray) -> float:
    return float((test(values) < 0.05).mean())


def enough(kind: str, noise: float, sets: int) -> int | None:
    """Return the smallest of `NUMBERS` from which on Student's t keeps `LEVEL`; None if it never does."""
    rng = np.random.default_rng([7, round(100 * noise)])
    kept = [level(student, drawn(rng, kind, noise, (sets, number))) <= LEVEL for number in NUMBERS]
    first = len(kept) - next((back for back, fine in enumerate(reversed(kept)) if not fine), len(kept))
    return NUMBERS[first] if first < len(NUMBERS) else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sets", type=int, default=2000)
    parser.add_argument("--subjects", type=int, nargs="+", default=[6, 12, 20])
    parser.add_argument("--enough", action="store_true")
    asked = parser.parse_args()
    if asked.enough:
        for kind in SUBJECTS:
            print(kind, {noise: enough(kind, noise, 10 * asked.sets) for noise in NOISE}, flush=True)
        return
    print("| subjects' effects; noise; N | " + " | ".join(TESTS) + " |\n|" + " --- |" * (1 + len(TESTS)))
    for kind in SUBJECTS:
        for noise in NOISE:
            for number in asked.subjects:
                rng = np.random.default_rng([number, round(100 * noise), *kind.encode()])
                values = drawn(rng, kind, noise, (asked.sets, number))
                more = drawn(rng, kind, noise, (asked.sets, number), power_mean(number, noise))
                cells = [f"{level(test, values):.3f} ({level(test, more):.2f})" for test in TESTS.values()]
                print(f"| {kind}; {noise:g}; {number} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
