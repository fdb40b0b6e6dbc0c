"""Reports with untrue statements about people.

    python benchmarks/wrong_statements.py [LINE ...]

Each row is one fault, with the result before it was fixed, and the present result.
"""

from __future__ import annotations

import csv
import io
import math
import tempfile
from pathlib import Path

import malformed
import numpy as np
from reruns import Lines

from focalgradient.errors import InputError
from focalgradient.report import Stated, make_report
from focalgradient.report.preregister import preregistration
from focalgradient.statistics import Quality, Rules, quality, read_ratings

TABLE = Lines("Reports that stated what was not so about people")

APERTURES = (("pinhole", 0.0), ("f/22", 2.27), ("f/11", 4.55), ("f/5.6", 8.93))


def ratings(people: int, blind: int, *, effect: float = 1.35, noise: float = 0.02, seed: int = 0) -> list[list[str]]:
    """Return rows of a table of ratings, rounded to .1; the first people perceive no effect of blur."""
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
    """Return the files of the report of a table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "own.csv")
        text = io.StringIO()
        csv.writer(text).writerows(rows)
        path.write_text(text.getvalue(), encoding="utf-8")
        return dict(make_report(path, **settings).files)  # type: ignore[arg-type]


def judged(rows: list[list[str]]) -> Quality:
    """Return the result of the exclusion rules for a table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "own.csv")
        with path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
        return quality(read_ratings(path).table)[1]


def first_rise(files: dict[str, bytes]) -> dict[str, str]:
    """Return the first row of the table of results with and without exclusions, by column."""
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


def preregistered(settings: str, **options: object) -> str:
    """Return the text of the preregistration of a rating design."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "design.toml")
        path.write_text(f'task = "depthrating"\n{settings}', encoding="utf-8")
        files = preregistration(path, stated=Stated(Rules()), **options)  # type: ignore[arg-type]
    return files["preregistration.md"].decode()


@TABLE.line("3.2.1", "scale = steps: words of the analysis", "analysed on their logarithm, power for ratios")
def _plan_of_steps() -> str:
    text = preregistered('scale = "steps"\nsteps = 7\nscenes = ["a"]\nfixations = ["nearest"]\nrepetitions = 3\n')
    found = ("analysed on their logarithm", "cumulative-link mixed model", "ratio of the odds of a higher answer")
    return ", ".join(words for words in found if words in text)


@TABLE.line("3.2.2", "a rating study: rules of the cube, and '1 scenes'", "2 rules, 1 scenes")
def _rules_of_the_cube() -> str:
    text = preregistered('scenes = ["a"]\n')
    rules = sum(rule in text for rule in ("catch_share", "shortest_both"))
    return f"{rules} rules, {'1 scenes' if '1 scenes' in text else '1 scene'}"


@TABLE.line("3.2.3", "effects of 1.3 and 2: power of H1 with 6 subjects", "no option for it")
def _own_effect() -> str:
    texts = (preregistered("", **given) for given in ({}, {"effect": 2.0}))
    return " and ".join(text.split("| 6 | ")[1].split(" ")[0] for text in texts)


@TABLE.line(
    "3.3", "no column of catch trials, response times or marker: rules that Methods claims to have applied", "3"
)
def _claimed_rules() -> str:
    text = report(ratings(6, 0))["report.md"].decode()
    applied = text[text.index("By rules that do not look") :].split("Rules that could not be applied")[0]
    return str(sum(words in applied for words in ("catch trials", "answered too fast", "first key")))


def notices(rows: list[list[str]], **settings: object) -> str:
    """Return the notices at the top of a table's report, subjects and primary result; or the error message."""
    try:
        files = report(rows, **settings)
    except InputError as error:
        return f"refused: {str(error)[:70]}..."
    top = files["report.md"].decode().split("## Depth ratings")[0]
    rise = first_rise(files)
    return f"{top.count('> **')} noted, {rise['subjects']} subjects, {float(rise['value']):.2f}"


def honest(people: int = 8, seed: int = 3) -> list[list[str]]:
    """Return rows with ratings to two decimals, of people who differ."""
    rows = ratings(people, 0, noise=0.0)
    rng = np.random.default_rng(seed)
    away = rng.normal(0, 0.1, people)
    size = (len(rows) - 1) // people
    for number, row in enumerate(rows[1:]):
        mm = dict(APERTURES)[row[2]]
        row[4] = f"{math.exp((0.3 + away[number // size]) * mm / 8.93 + rng.normal(0, 0.1)):.2f}"
    return rows


@TABLE.line("3.4.1", "8 people, half of the rows spelt 'P01 ', 'p01', 'P1'", "0 noted, 24 subjects, 1.31")
def _spelt() -> str:
    head, *rows = honest()
    spell = (str, str.lower, lambda name: f"{name} ", lambda name: name.replace("P0", "P"))
    return notices([head, *([spell[number % 4](row[0]), *row[1:]] for number, row in enumerate(rows))])


@TABLE.line("3.4.2", "8 people and rows called Mean, Mittelwert", "0 noted, 10 subjects, 1.34")
def _summaries() -> str:
    head, *rows = honest()
    more = [[name, *row[1:]] for name in ("Mean", "Mittelwert") for row in rows[: len(rows) // 8]]
    return notices([head, *rows, *more])


@TABLE.line("3.4.3", "8 people, one pasted twice, once more under another name", "0 noted, 9 subjects, 1.32")
def _pasted() -> str:
    head, *rows = honest()
    block = rows[: len(rows) // 8]
    return notices([head, *rows, *block, *(["P77", *row[1:]] for row in block)])


def millimetres(sizes: dict[str, str]) -> str:
    """Return the notices if the column of apertures contains diameters."""
    head, *rows = honest()
    return notices([head, *([*row[:2], sizes[row[2]], *row[3:]] for row in rows)])


@TABLE.line("3.4.4", "diameters 0, 2.27, 4.55, 8.93 mm in a column aperture", "0 noted, 8 subjects, 1.06")
def _millimetres() -> str:
    return millimetres({name: f"{mm:g}" for name, mm in APERTURES})


@TABLE.line("3.4.5", "the same of 0, 2, 4, 8 mm, which are f-numbers of lenses, too", "0 noted, 8 subjects, 1.06")
def _doubtful_millimetres() -> str:
    return millimetres(dict(zip((name for name, _ in APERTURES), "0248", strict=True)))


@TABLE.line("3.4.6", "whole numbers 1 to 7 taken as ratios", "0 noted, 8 subjects, 1.00")
def _whole() -> str:
    head, *rows = honest()
    steps = np.random.default_rng(1).integers(1, 8, len(rows))
    return notices([head, *([*row[:4], str(step)] for row, step in zip(rows, steps, strict=True))])


@TABLE.line("3.4.7", "999 for two missing answers", "0 noted, 7 subjects, 1.26")
def _codes() -> str:
    head, *rows = honest()
    rows[3][4] = rows[70][4] = "999"
    return notices([head, *rows])


@TABLE.line("3.4.8", "--conditions near=near, far=hinten2", "0 noted, 8 subjects, 1.29")
def _nowhere() -> str:
    return notices(honest(), conditions={"near": "near", "far": "hinten2"})


@TABLE.line("3.4.9", "four unknown words: how many one message names", "1")
def _unknown() -> str:
    head, *rows = honest()
    words = {"pinhole": "zu", "f/22": "halb", "near": "vorn", "far": "hinten"}
    try:
        report([head, *([words.get(cell, cell) for cell in row] for row in rows)])
    except InputError as error:
        return str(sum(repr(word) in str(error) for word in words.values()))
    return "none"


@TABLE.line("3.4.10", "response times in milliseconds", "0 noted, all 8 left out")
def _milliseconds() -> str:
    head, *rows = honest()
    return notices([[*head, "rt"], *([*row, "1500"] for row in rows)])


malformed.register_statements(TABLE)

if __name__ == "__main__":
    TABLE.main()
