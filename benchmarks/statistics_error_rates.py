"""Make the tables of docs/report/statistics.md by simulation: error rates, power and coverage of the statistical tests.

    python benchmarks/statistics_error_rates.py [--sets 2000] [--tables ratings cube] [--store FILE] [--out FOLDER]

A table of `TABLES` has a cell for each row and column; its random numbers depend on the seed and the names of table,
row and column only. Each cell is stored as it is finished, and a second run computes those that are missing: an hour of
one processor in all, of which the ordinal model takes half. Tests with a closed form have five times as many sets. The
table `lmertest` needs R with lmerTest (error_rates.R).
"""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import simulated_experiments as simulated
from simulated_experiments import BOUND, NOISE, RARE, SCENES, Rates

from focalgradient.statistics import compare_pictures, depth_rating, necker
from focalgradient.statistics.hypotheses import one_sided
from focalgradient.statistics.meta_analysis import random_effects

PEOPLE = {f"N = {number}": number for number in (6, 12, 20)}


@dataclass(frozen=True, slots=True)
class Table:
    """A table: conditions of rows and of columns by their names, and the function that returns the rates of a cell."""

    heading: str
    rows: Mapping[str, tuple[Any, ...]]
    columns: Mapping[str, Any]
    rates: Callable[..., Rates]
    factor: float = 1
    """Data sets of a cell, relative to `--sets`."""
    part: int = 2000
    """Data sets that are computed and stored at once."""


def crossed(*levels: tuple[Any, ...]) -> dict[str, tuple[Any, ...]]:
    """Name each combination of conditions."""
    return {"; ".join(f"{x:g}" if isinstance(x, float) else str(x) for x in row): row for row in product(*levels)}


SKEWED = ("skewness 2", "skewness 4", "20 % responders", "5 % responders")
TABLES: dict[str, Table] = {
    "ratings": Table(
        "subjects; scenes",
        crossed(("normal", "alike", "t, 3 degrees of freedom", "skewness 1.4", "skewness 4"), (0.0, 0.1)),
        PEOPLE,
        simulated.ratings,
        5,
    ),
    "effect_sizes": Table("d", crossed((0.0, 0.5, 1.5)), PEOPLE, simulated.effect_sizes),
    "pooled": Table(
        "scenes; SD of data sets",
        crossed(
            ("same scenes", "same scenes as if independent", "new scenes", "new scenes; 5, 10 and 30 people in turn"),
            (0.0, 0.1),
        ),
        {f"{number} data sets": number for number in (3, 5, 8)},
        simulated.pooled,
        5,
    ),
    "robust": Table(
        "subjects; noise",
        {name: (*row, False) for name, row in crossed(("normal", *SKEWED), NOISE).items()},
        PEOPLE,
        simulated.robust,
    ),
    "robust_power": Table(
        "subjects; noise",
        {name: (*row, True) for name, row in crossed(("normal",), NOISE).items()},
        PEOPLE,
        simulated.robust,
    ),
    "enough": Table(
        "subjects", crossed(SKEWED), {f"noise {noise:g}": noise for noise in NOISE}, simulated.enough, 30, 60_000
    ),
    "comparisons": Table(
        "scale; subjects; scenes",
        crossed(("bipolar", "choice"), ("normal", "skewness 4"), (0.0, 0.5)),
        PEOPLE,
        simulated.comparisons,
        5,
    ),
    "marginal": Table("scale", {"choice": ()}, {"N = 6": 6, "N = 12": 12}, simulated.marginal),
    "cube": Table(
        "nonrigid time without a gradient",
        {"50 %": (0.0,), "4.5 %": (RARE,)},
        {f"N = {number}": number for number in (6, 8, 12)},
        simulated.cube,
        5,
    ),
    "lmertest": Table(
        "cells; subjects",
        crossed(("complete", "4 of 12 scenes each", "40 % of cells lost"), ("normal",))
        | crossed(("complete",), ("alike",)),
        {"N = 6": 6, "N = 12": 12},
        simulated.against_lmertest,
        0.1,
        100,
    ),
    "steps": Table(
        "level (log odds); scenes",
        crossed((0.0,), (0.0, 0.5)) | crossed((-4.0,), (0.0,)),
        {"N = 6": 6},
        simulated.steps,
        1,
        100,
    ),
}


def cell(seed: int, sets: int, table: str, row: str, column: str, part: int = 0) -> Rates:
    """Compute a part of a cell, whose random numbers depend on its arguments only."""
    made = TABLES[table]
    rng = np.random.default_rng([seed, part, *f"{table}; {row}; {column}".encode()])
    return made.rates(rng, sets, *made.rows[row], made.columns[column])


def mean(parts: Sequence[Rates]) -> Rates:
    """Return the mean rates of the parts of a cell."""
    return {
        rate: value if isinstance(value, str) else float(np.mean([part[rate] for part in parts]))
        for rate, value in parts[0].items()
    }


def printed(rate: str, value: float | str) -> str:
    """Format a rate; bold where a level is above .06 or a coverage differs from .95 by more than .02."""
    if isinstance(value, str):
        return value
    level = rate.startswith(("rejected", "false")) and value > 0.06
    return f"**{value:.3f}**" if level or (rate.startswith("coverage") and abs(value - 0.95) > 0.02) else f"{value:.3f}"


def write(table: str, cells: Mapping[str, Rates], out: Path) -> None:
    """Write a table as CSV: one column for each rate and condition."""
    made = TABLES[table]
    names = list(next(iter(cells.values())))
    with (out / f"{table}.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow([made.heading, *(f"{rate}, {column}" for rate in names for column in made.columns)])
        for row in made.rows:
            values = [printed(rate, cells[f"{row}; {column}"][rate]) for rate in names for column in made.columns]
            rows.writerow([row, *values])


def compare(seed: int) -> None:
    """Analyse one data set of each kind by the package and by this file; raise `AssertionError` if they differ."""
    rng = np.random.default_rng(seed)
    table = simulated.effects_of(rng, 1, 6)
    rows = [
        (f"{who:02}", f"s{scene:02}", *aperture, "nearest", math.exp(table[0, who, scene] * aperture[1]))
        for who, scene, aperture in product(range(6), range(SCENES), (("pinhole", 0.0), ("f/5.6", 1.0)))
    ]
    names = ["participant_id", "scene", "aperture", "aperture_mm", "fixation", "rating"]
    trials = pd.DataFrame(rows, columns=names).assign(trial=range(len(rows)), catch=False)
    result: Any = depth_rating(trials, equivalence_bound=math.exp(BOUND)).fixations[0]
    over_both = simulated.over_both(table)
    p = simulated.student(*over_both)[0], np.maximum(*one_sided(*over_both, BOUND))[0]
    np.testing.assert_allclose((result.rise.p, result.equivalence.p), p, rtol=1e-9)
    for scale in ("bipolar", "choice"):
        data = simulated.answered(rng, 1, scale, "normal", 0.5, 6, 0.0)
        found = compare_pictures(simulated.as_rows(data[0], scale), scale)
        ends = (", subjects and scenes", "") if scale == "choice" else ("", ", these scenes")
        by_package: Any = [next(iter(found.answers.to(f"slope on aperture{end}").values())) for end in ends]
        tests = simulated.over_both, simulated.over_people
        by_file = [simulated.student(*test(simulated.slopes(data)))[0] for test in tests]
        np.testing.assert_allclose([test.p for test in by_package], by_file, rtol=1e-9)
    estimates, errors = rng.normal(0, 0.1, (20, 5)), rng.uniform(0.03, 0.1, (20, 5))
    pooled = [random_effects(*study).p for study in zip(estimates, errors, strict=True)]
    np.testing.assert_allclose(simulated.hartung_knapp(estimates, errors), pooled, rtol=1e-4)
    shown = [*simulated.percepts(rng, simulated.drawn_cubes(rng, 1, 4, 0.0, 1.0))]
    test: Any = necker(_reports(shown), durations=False).effects[0].odds_of_time
    np.testing.assert_allclose(test.p, simulated.cube_tests(shown)[0], rtol=1e-9)


def _reports(shown: Sequence[Any]) -> pd.DataFrame:
    """Return the reports on the cube of one data set as the table that `necker` takes."""
    rows = [
        {
            "participant_id": f"{who:02}",
            "trial": f"{gradient} {trial}",
            "gradient": ("none", "nonrigid")[gradient],
            "strength": 10.0 * gradient,
            "onset": onset[0, who, gradient, trial],
            "duration": duration[0, who, gradient, trial],
            "percept": "rigid" if rigid[0, who, gradient, trial] else "nonrigid",
        }
        for onset, duration, rigid in shown
        for _, who, gradient, trial in np.argwhere(duration > 0)
    ]
    return pd.DataFrame(rows).assign(censored=False, catch=False, trial_duration=simulated.LASTS)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sets", type=int, default=2000, help="data sets of a cell")
    parser.add_argument("--tables", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--store", type=Path, default=Path("error_rates.json"), help="finished parts, continued")
    parser.add_argument("--out", type=Path, default=Path("docs/report/tables"), help="folder for the CSV files")
    options = parser.parse_args()
    compare(options.seed)
    stored = json.loads(options.store.read_text(encoding="utf-8")) if options.store.exists() else {}
    for table in options.tables:
        made = TABLES[table]
        cells = stored.setdefault(f"{table}, seed {options.seed}", {})
        for column, row in product(made.columns, made.rows):
            parts = cells.setdefault(f"{row}; {column}", [])
            while len(parts) * made.part < options.sets * made.factor:
                parts.append(cell(options.seed, made.part, table, row, column, len(parts)))
                options.store.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
            print(table, row, column, len(parts) * made.part, mean(parts), flush=True)
        write(table, {name: mean(parts) for name, parts in cells.items()}, options.out)


if __name__ == "__main__":
    main()
