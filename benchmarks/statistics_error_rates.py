"""How often the tests find what is not there: false positives at .05 with few subjects, by simulation.

    python benchmarks/statistics_error_rates.py [--experiments 1000] [--subjects 6,10,20] [--out FILE.json]

Each experiment is a whole one, analysed by the whole chain. Subjects differ, as people do, by their level and *by
their own effect*, whose mean over people is none; with the equivalence test the true rise is just at the bound, and to
call it equivalent is the false positive. How much subjects differ beside the noise of their answers is "large" or
"small": where small, the mixed model often finds that they do not differ, and its standard error is at its worst.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only wait for each other

import numpy as np
import pandas as pd

from focalgradient.statistics import Effect, depth_rating, necker

APERTURES = {"pinhole": 0.0, "f/22": 2.27, "f/11": 4.55, "f/5.6": 8.93}
LARGEST = max(APERTURES.values())
SCENES = ("room", "terrain")
REPETITIONS = 2
BOUND = 1.2
SPREADS = {"small": 0.02, "large": 0.2}  # sd over subjects of the log rise at the largest aperture
NOISE = 0.2  # sd of the logarithm of one answer
STEPS = np.array([-1.5, -0.5, 0.5, 1.5])  # between the answers of the ordinal scale, in logits
TRIALS, LASTS = 3, 30.0  # of each gradient of the cube, and seconds


def ratings(rng: np.random.Generator, subjects: int, spread: float, rise: float = 0.0) -> pd.DataFrame:
    """Depth ratings by people whose log rise is `rise` on the mean, with both fixations."""
    rows = [
        (
            f"{subject:02}",
            fixation,
            aperture,
            mm,
            scene,
            repetition,
            level + mm / LARGEST * own + 0.1 * (scene == "room"),
        )
        for subject in range(subjects)
        for level in [rng.normal(0, 0.15)]
        for fixation in ("nearest", "farthest")
        for own in [rng.normal(rise, spread)]
        for aperture, mm in APERTURES.items()
        for scene in SCENES
        for repetition in range(REPETITIONS)
    ]
    names = ["participant_id", "fixation", "aperture", "aperture_mm", "scene", "repetition", "answer"]
    table = pd.DataFrame(rows, columns=names)
    table["rating"] = np.exp(table["answer"] + rng.normal(0, NOISE, len(table)))
    return table.assign(trial=np.arange(len(table)), catch=False)


def steps(rng: np.random.Generator, subjects: int, spread: float) -> pd.DataFrame:
    """The same in five steps, with one fixation: the latent answer is in logits."""
    table = ratings(rng, subjects, spread)
    table = table[table["fixation"] == "nearest"]
    logits = math.pi / math.sqrt(3) / NOISE
    latent = logits * table["answer"] + rng.logistic(size=len(table))
    return table.assign(rating=1 + np.digitize(latent, STEPS))


def reports(rng: np.random.Generator, subjects: int, spread: float) -> pd.DataFrame:
    """Reports on the cube by people who see both readings for as long, on the mean, with a gradient as without.

    Both last alike: then the mean share of time and the mean odds are none together, for their curve bends at a half.
    """
    rows = []
    for subject in range(subjects):
        level = rng.normal(0, 0.3)
        for gradient, strength in (("none", 0.0), ("nonrigid", 10.0)):
            own = rng.normal(0, 2 * spread) if strength else 0.0
            for trial in range(TRIALS):
                now, rigid = 0.0, bool(rng.integers(2))
                while now < LASTS:
                    mean = 4.5 * math.exp(-level - own if rigid else level + own)
                    lasts = rng.gamma(3.0, mean / 3.0)
                    seen, cut = min(lasts, LASTS - now), now + lasts >= LASTS
                    rows.append((f"{subject:02}", f"{gradient} {trial}", gradient, strength, now, seen, rigid, cut))
                    now, rigid = now + lasts, not rigid
    names = ["participant_id", "trial", "gradient", "strength", "onset", "duration", "rigid", "censored"]
    table = pd.DataFrame(rows, columns=names)
    table["percept"] = np.where(table["rigid"], "rigid", "nonrigid")
    return table.assign(catch=False, trial_duration=LASTS)


def found(results: dict[str, Any]) -> dict[str, float]:
    """Probability of each test; NaN where it could not be done."""
    return {name: result.p if isinstance(result, Effect) else math.nan for name, result in results.items()}


def experiment(kind: str, subjects: int, spread: float, seed: np.random.SeedSequence) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    if kind == "necker":
        (effect,) = necker(reports(rng, subjects, spread)).effects
        of = {"GEE, time": effect.odds_of_time, "GEE, reports": effect.odds_of_reports, "paired t, share": effect.share}
        return found(of) | {"Wilcoxon, share": math.nan if effect.wilcoxon_p is None else effect.wilcoxon_p}
    if kind == "ordinal":
        only = depth_rating(steps(rng, subjects, spread), equivalence_bound=BOUND, scale="ordinal").fixations[0]
        return found({"ordinal slope (CLMM)": only.ordinal})
    result = depth_rating(ratings(rng, subjects, spread), equivalence_bound=BOUND)
    near = result.fixations[0]
    largest = result.means[len(APERTURES) - 1].against_pinhole
    tests = {
        "rise": near.rise,
        "slope": near.slope,
        "interaction": result.interaction,
        "largest against pinhole": largest,
    }
    at_bound = ratings(rng, subjects, spread, math.log(BOUND)).query("fixation == 'farthest'")
    far = depth_rating(at_bound, equivalence_bound=BOUND).fixations[0].equivalence
    return found(tests) | {"equivalence, true rise at bound": getattr(far, "p", math.nan)}


def cell(task: tuple[str, int, str, int, int]) -> dict[str, float]:
    kind, subjects, spread, seed, number = task
    entropy = np.random.SeedSequence([seed, subjects, sorted(SPREADS).index(spread), number])
    return experiment(kind, subjects, SPREADS[spread], entropy)


def rates(kind: str, subjects: int, spread: str, experiments: int, seed: int, pool: Any) -> Iterator[dict[str, Any]]:
    """Of each test: share of p below .05 among the experiments where it could be done, and its Monte Carlo error."""
    tasks = [(kind, subjects, spread, seed, number) for number in range(experiments)]
    table = pd.DataFrame(list(pool.map(cell, tasks, chunksize=8)))
    for test in table:
        p = table[test].dropna()
        rate, error = (p < 0.05).mean(), math.sqrt(0.05 * 0.95 / max(len(p), 1))
        yield {
            "test": test,
            "subjects": subjects,
            "differences": spread,
            "rate": round(float(rate), 4),
            "standard_error": round(error, 4),
            "excess": bool(rate > 0.05 + 1.96 * error),
            "not_done": int(table[test].isna().sum()),
            "experiments": experiments,
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--experiments", type=int, default=1000)
    parser.add_argument("--ordinal", type=int, default=400, help="experiments with the ordinal scale, the slowest")
    parser.add_argument("--subjects", default="6,10,20")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = []
    print(f"{'test':34}{'N':>4}  {'subjects differ':16}{'rate':>6}{'+-':>7}{'not done':>10}")
    with ProcessPoolExecutor(asked.workers) as pool:
        for kind in ("rating", "necker", "ordinal"):
            for spread in SPREADS:
                for subjects in map(int, asked.subjects.split(",")):
                    experiments = asked.ordinal if kind == "ordinal" else asked.experiments
                    for row in rates(kind, subjects, spread, experiments, asked.seed, pool):
                        rows.append(row)
                        mark = "  above .05" if row["excess"] else ""
                        print(
                            f"{row['test']:34}{subjects:4}  {spread:16}{row['rate']:6.3f}{row['standard_error']:7.3f}"
                            f"{row['not_done']:10}{mark}",
                            flush=True,
                        )
    if asked.out:
        asked.out.write_text(json.dumps({"seed": asked.seed, "rates": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
