"""Calibration of the Bayesian model of the rises by simulation (Talts et al. 2018), with the extra `bayes`.

    python benchmarks/bayes_calibration.py [--sets 200] [--subjects 6] [--scenes 6] [--workers 2 | --scheduler ADDRESS]

Each set draws the rise and the standard deviations from the priors, then log ratios from the model, and fits them. The
rank of the true value among 99 draws of its posterior must then be even between 0 and 99, whatever the model: prior,
likelihood and sampler are tested together. Printed are the chi-squared test of ten bins for each parameter, and how
often the central intervals of 50, 80 and 95 % hold the true value.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are small: threads would only wait for each other

import numpy as np
import pandas as pd
from scipy import stats

from focalgradient.parallel import in_order, shared
from focalgradient.statistics.bayes import RATIO_PRIORS, Posterior, posterior_of_rises

KEPT = 99
"""Draws that a true value is ranked among, evenly from the chain: nearly independent."""

BINS = 10
SHARES = (0.5, 0.8, 0.95)
DRAWS, TUNE = 495, 500


def ranks(task: tuple[int, int, int, int]) -> dict[str, int]:
    """Rank of each true value of one set; it depends on the task alone."""
    seed, number, subjects, scenes = task
    rng = np.random.default_rng([seed, number])
    truth = {name: prior.draw(rng) for name, prior in RATIO_PRIORS.items()}
    table = truth["rise"] + truth["subjects"] * rng.normal(size=(subjects, 1))
    table = table + truth["scenes"] * rng.normal(size=(1, scenes))
    table = table + truth["residual"] * rng.normal(size=(subjects, scenes))
    who, scene = np.indices(table.shape)
    rows = pd.DataFrame({"log_ratio": table.ravel(), "participant_id": who.ravel(), "scene": scene.ravel()})
    rows = rows.astype({"participant_id": str, "scene": str})
    found = posterior_of_rises(rows, "nearest", 1.2, seed=number + 1, draws=DRAWS, tune=TUNE, chains=1)
    assert isinstance(found, Posterior)
    draws = {"rise": found.draws, **found.spread}
    return {name: int((draws[name][:: DRAWS // KEPT] < value).sum()) for name, value in truth.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=200, help="about 15 s of processor time each")
    parser.add_argument("--subjects", type=int, default=6)
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", help="address of a Dask scheduler, in place of processes")
    parser.add_argument("--out", type=Path, help="file for the ranks (JSON)")
    asked = parser.parse_args()
    tasks = [(asked.seed, number, asked.subjects, asked.scenes) for number in range(asked.sets)]
    found = []
    with shared(asked.workers, asked.scheduler) as executor:
        for one in in_order(executor, ranks, tasks):
            found.append(one)
            if asked.out:  # after each set, so that what was cut off is not lost
                asked.out.write_text(json.dumps(found) + "\n", encoding="utf-8")
    table = pd.DataFrame(found)
    print(f"{len(table)} sets of {asked.subjects} subjects by {asked.scenes} scenes")
    print("| parameter | chi-squared (9) | p | " + " | ".join(f"in {share:.0%}" for share in SHARES) + " |")
    print("| --- " * (3 + len(SHARES)) + "|")
    for name in table:
        rank = table[name].to_numpy()
        test = stats.chisquare(np.bincount(rank * BINS // (KEPT + 1), minlength=BINS))
        within = [np.abs((rank + 0.5) / (KEPT + 1) - 0.5) < share / 2 for share in SHARES]
        cells = [str(name), f"{test.statistic:.1f}", f"{test.pvalue:.2f}", *(f"{one.mean():.2f}" for one in within)]
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
