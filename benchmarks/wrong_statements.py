"""Reports that stated what was not so about people.

    python benchmarks/wrong_statements.py [LINE ...]

One row for each fault: what it gave before it was fixed, and what it gives now.
"""

from __future__ import annotations

import csv
import io
import math
import tempfile
from pathlib import Path

import numpy as np
from reruns import Lines

from focalgradient.report import make_report
from focalgradient.statistics import Quality, quality, read_ratings

TABLE = Lines("Reports that stated what was not so about people")

APERTURES = (("pinhole", 0.0), ("f/22", 2.27), ("f/11", 4.55), ("f/5.6", 8.93))


def ratings(people: int, blind: int, *, effect: float = 1.35, noise: float = 0.02, seed: int = 0) -> list[list[str]]:
    """Rows of a table of ratings, rounded to .1; the first people see no effect of blur."""
    rng = np.random.default_rng(seed)
    rows = [["participant", "scene", "aperture", "fixation", "rating"]]
    for who in range(people):
        rise = 0.0 if who < blind else math.log(effect)
        rows += [
            [f"P{who + 1:02}", f"s{scene}", name, fixation, f"{math.exp(rise * mm / 8.93 + rng.normal(0, noise)):.1f}"]
            for scene in range(6)
            for fixation in ("near", "far")
            for name, mm in APERTURES
            for _ in range(2)
        ]
    return rows


def report(rows: list[list[str]], **settings: object) -> dict[str, bytes]:
    """Files of the report of a table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "own.csv")
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        path.write_text(text.getvalue(), encoding="utf-8")
        return dict(make_report(path, **settings).files)  # type: ignore[arg-type]


def judged(rows: list[list[str]]) -> Quality:
    """What the exclusion rules find in a table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "own.csv")
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
        return quality(read_ratings(path).table)[1]


def first_rise(files: dict[str, bytes]) -> dict[str, str]:
    """The first row of the table of results with and without exclusions, by column."""
    return next(csv.DictReader(io.StringIO(files["depth_rating_exclusions_effect.csv"].decode())))


@TABLE.line(
    "3.1.1", "5 of 12 honest people see no effect; mean over all 1.19", "5 excluded, 1.35 [1.33, 1.38], d_z 17.6"
)
def _blind() -> str:
    files = report(ratings(12, 5))
    rise = first_rise(files)
    count = 12 - int(rise["subjects"])
    low, high = float(rise["value_low"]), float(rise["value_high"])
    return f"{count} excluded, {float(rise['value']):.2f} [{low:.2f}, {high:.2f}], d_z {float(rise['dz']):.1f}"


@TABLE.line("3.1.2", "30 and 50 % of 24 see no effect, 10 tables each", "72 of 72 and 133 of 133 excluded")
def _shares_of_the_blind() -> str:
    found = []
    for blind in (7, 12):
        lost = [24 - judged(ratings(24, blind, seed=seed)).subjects_after for seed in range(10)]
        found.append(f"{sum(lost)} of {10 * blind}")
    return " and ".join(found) + " excluded"


@TABLE.line("3.1.3", "results with and without exclusions stand in HTML, CSV and JSON", "in none of them")
def _both_results() -> str:
    files = report(ratings(6, 2))
    there = ["without exclusions" in files.get(name, b"").decode() for name in ("report.html", "results.json")]
    there.append("without exclusions" in files["depth_rating_exclusions_effect.csv"].decode())
    return f"in {sum(there)} of 3"


@TABLE.line(
    "3.3", "no column of catch trials, response times or marker: rules that Methods claims to have applied", "3"
)
def _claimed_rules() -> str:
    text = report(ratings(6, 0))["report.md"].decode()
    applied = text[text.index("By rules that do not look") :].split("Rules that could not be applied")[0]
    return str(sum(words in applied for words in ("catch trials", "answered too fast", "first key")))


if __name__ == "__main__":
    TABLE.main()
