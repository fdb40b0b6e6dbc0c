"""Export for other software: analysed trials as one long table with a data dictionary, and R scripts of the tests."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.files.cells import as_number
from focalgradient.statistics import (
    ComparisonResult,
    DepthRatingResult,
    Effect,
    NeckerResult,
    OrdinalResult,
)
from focalgradient.statistics.crossed import FEWEST_SCENES
from focalgradient.statistics.ordinal_people import LARGEST_STEP, LEVEL_SD, NEWTON, RISE_SD, ROUNDS
from focalgradient.statistics.questions import NO_ANSWERS, Answers, less
from focalgradient.tasks import task_named
from focalgradient.user_tables.tidy import FIXATIONS, fixations_of

__all__ = ["r_script", "reader", "report_files", "safe_csv", "table_files", "trial_files"]

OF_RATINGS = (
    *("participant_id", "session", "trial", "scene", "aperture", "aperture_mm", "fixation", "repetition", "rating"),
    *("log_rating", "response_time", "dropped_frames", "catch", "kind", "included"),
)
OF_CUBE = (
    *("participant_id", "session", "trial", "gradient", "strength", "onset", "duration", "percept", "censored"),
    *("trial_duration", "dropped_frames", "catch", "kind", "included"),
)
"""Columns that come first in the tables of trials and of reports."""

ADDED = {
    "participant_id": "Participant.",
    "session": "Session label; empty without one.",
    "log_rating": "Natural logarithm of the rating.",
    "kind": "Human or simulated.",
    "place": "Where the participant was tested: laboratory or browser.",
    "included": "Whether the analysis rests on it: kept by the rules of exclusion, and no catch trial.",
}
"""Descriptions of the columns that are not recorded in each trial."""

CONSTANTS = {
    "FEWEST_SCENES": FEWEST_SCENES,
    "LEVEL_SD": LEVEL_SD,
    "RISE_SD": RISE_SD,
    "ROUNDS": ROUNDS,
    "NEWTON": NEWTON,
    "LARGEST_STEP": LARGEST_STEP,
}
"""Numbers of the analysis, by their name in the R scripts."""


def r_script(name: str, answers: Answers = NO_ANSWERS) -> bytes:
    """Return an R script of the folder `scripts` with the code of the questions, and the package's main results."""
    return (_r_text(name) + answers.r_code + _found(answers)).encode()


def _r_text(name: str) -> str:
    """Return a script with the scripts that it includes and the numbers of the analysis."""
    text = Path(__file__).with_name("scripts").joinpath(f"{name}.R").read_text(encoding="utf-8")
    text = re.sub(r"^# include (\w+)\n", lambda found: _r_text(found[1]), text, flags=re.MULTILINE)
    return re.sub(rf"\b({'|'.join(CONSTANTS)})\b", lambda found: f"{CONSTANTS[found[1]]:g}", text)


def trial_files(
    table: pd.DataFrame,
    kept: pd.DataFrame,
    result: DepthRatingResult | ComparisonResult | None,
    data: DataSet | None = None,
) -> dict[str, bytes]:
    """Return all trials as a long CSV, a data dictionary, and scripts that repeat the main test.

    Parameters
    ----------
    table, kept
        All trials with every column, and those that the rules kept, with a common index.
    result
        Analysis; the scripts quote its results.
    data
        Data set whose sidecars describe the columns, if there is one.
    """
    out = table.assign(log_rating=np.log(table["rating"].where(table["rating"] > 0)))
    out = _ordered(out, kept, OF_RATINGS)
    files = _described("depth_rating_trials", out, "depthrating", data)
    if isinstance(result, ComparisonResult):
        files["headline_comparisons.R"] = r_script("headline_comparisons", result.answers)
    if result is not None and not result.analysis.ratios:
        files["depth_rating_wide.csv"] = safe_csv(_answers(out))
    ordinal = result.ordinal if isinstance(result, DepthRatingResult) else None
    if result is not None and isinstance(ordinal, OrdinalResult) and _found(result.answers):
        script = "headline_ordinal_floor" if ordinal.by_people else "headline_ordinal"
        files["headline_ordinal.R"] = r_script(script, result.answers)
    if isinstance(result, DepthRatingResult) and result.analysis.ratios:
        if len(wide := _wide(result.answers)):
            files["depth_rating_wide.csv"] = safe_csv(wide)
        files |= {f"{name}.R": r_script(name, result.answers) for name in ("headline", "headline_jasp")}
    return files


def _found(answers: Answers) -> str:
    """Format the package's main results as comments, for comparison."""
    tested = ((one.level, one.outcome) for one in answers.headlines)
    return "".join(f"# focalgradient: {name}: {test.summary()}\n" for name, test in tested if isinstance(test, Effect))


def _answers(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the mean step, or the proportion of choices, by subject (rows) and condition (columns)."""
    rows = trials[trials["included"]]
    found = {}
    for fixation in fixations_of(rows):
        own = rows[rows["fixation"] == fixation].sort_values("aperture_mm")
        for aperture, answers in own.groupby("aperture", sort=False):
            found[f"{fixation} {aperture}"] = answers.groupby("participant_id")["rating"].mean()
    return pd.DataFrame(found).rename_axis("participant_id").reset_index()


def _wide(answers: Answers) -> pd.DataFrame:
    """Return the log ratios that were tested by subject and scene, for each fixation and difference."""
    columns = {
        "difference" if one.level == less(*FIXATIONS) else one.level.replace(less("", ""), "_less_"): one.values.stack()
        for one in answers.headlines
        if one.values is not None
    }
    wide = pd.DataFrame(columns)
    return wide.rename_axis(["participant_id", "scene"]).reset_index() if columns else wide


def report_files(
    table: pd.DataFrame, kept: pd.DataFrame, result: NeckerResult | None, data: DataSet | None = None
) -> dict[str, bytes]:
    """Return all reports on the cube as a long CSV, a data dictionary, and a script that repeats the main test.

    Parameters
    ----------
    table, kept
        All reports with every column, and those that the rules kept, with a common index.
    result
        Analysis; the script quotes its results.
    data
        Data set whose sidecars describe the columns, if there is one.
    """
    files = _described("necker_reports", _ordered(table, kept, OF_CUBE), "necker", data)
    if result is not None:
        odds = {
            (each.participant_id, f"{each.gradient} {each.strength:g}"): each.log_odds for each in result.subject_shares
        }
        wide = pd.Series(odds, dtype=float).unstack().rename_axis("participant_id").reset_index()
        files["necker_wide.csv"] = safe_csv(wide)
        if _found(result.answers):
            files["necker_headline.R"] = r_script("necker_headline", result.answers)
    return files


def table_files(name: str, table: pd.DataFrame) -> dict[str, bytes]:
    """Return a table as CSV, and an R script that reads it."""
    file = f"{name}.csv"
    return {file: safe_csv(table), f"read_{name}.R": reader(file, table)}


def reader(file: str, table: pd.DataFrame) -> bytes:
    """Return an R script that reads a table as `d` with typed columns: texts as factors, truth values as logical.

    >>> print(reader("a.csv", pd.DataFrame({"scene": ["01"], "mm": [1.5], "catch": [True]})).decode())
    # Reads the table with the type of each column. Run in the report's folder: source("read_a.R")
    d <- read.csv("a.csv", na.strings = "", colClasses = c("factor", "numeric", "logical"))
    <BLANKLINE>
    """
    kinds = {"b": "logical", "i": "integer", "u": "integer", "f": "numeric"}
    types = ", ".join(f'"{kinds.get(table[name].dtype.kind, "factor")}"' for name in table)
    name = file.removesuffix(".csv")
    head = f'# Reads the table with the type of each column. Run in the report\'s folder: source("read_{name}.R")\n'
    return f'{head}d <- read.csv("{file}", na.strings = "", colClasses = c({types}))\n'.encode()


def _ordered(table: pd.DataFrame, kept: pd.DataFrame, first: Sequence[str]) -> pd.DataFrame:
    """Return every column of a table, the usual ones first, and `included`; `kind` says if observers are simulated."""
    table = table.assign(included=table.index.isin(kept.index) & ~table["catch"].astype(bool))
    usual = [name for name in first if name in table]
    return table[[*usual, *(name for name in table if name not in {*usual, "simulated"})]]


def _described(name: str, table: pd.DataFrame, task: str, data: DataSet | None) -> dict[str, bytes]:
    """Return the files of a table, with a dictionary of its columns.

    It has the meaning of each (as the sidecars state it, else as the task does), its type, and numbers of values.
    """
    meaning = {column.name: _with_unit(column.about, column.units) for column in task_named(task).columns()}
    for sidecar in () if data is None else data.sidecars.values():
        entries = {name: entry for name, entry in sidecar.items() if isinstance(entry, dict) and "Description" in entry}
        meaning |= {name: _with_unit(entry["Description"], entry.get("Units")) for name, entry in entries.items()}
    meaning |= ADDED
    described = {
        "column": [*map(str, table)],
        "meaning": [meaning.get(str(column), "as in the table") for column in table],
        "type": table.dtypes.astype(str).to_list(),
        "values": table.nunique().to_list(),
        "missing": table.isna().sum().to_list(),
    }
    return table_files(name, table) | {f"{name}_dictionary.csv": safe_csv(pd.DataFrame(described))}


def _with_unit(about: str, unit: str | None) -> str:
    return f"{about.removesuffix('.')} ({unit})." if unit else about


def safe_csv(table: pd.DataFrame) -> bytes:
    r"""Format a table as CSV; an apostrophe precedes text that a spreadsheet would execute as a formula.

    Truth values are TRUE and FALSE, as in R, JASP and spreadsheets.

    Examples
    --------
    >>> safe_csv(pd.DataFrame({"a": ["=1+1", "b"], "c": [-1.5, 2.0]}))
    b"a,c\n'=1+1,-1.5\nb,2.0\n"
    >>> safe_csv(pd.DataFrame({"a": ["-1.5", "-x"]}))
    b"a\n-1.5\n'-x\n"
    >>> safe_csv(pd.DataFrame({"catch": [True, False]}))
    b'catch\nTRUE\nFALSE\n'
    """

    def safe(value: object) -> object:
        formula = isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r"))
        return f"'{value}" if formula and as_number(str(value)) is None else value

    texts = {name: table[name].map(safe) for name in table if table[name].dtype.kind not in "biuf"}
    out = table.assign(**{str(name): values for name, values in texts.items()}) if texts else table
    truth = {name: out[name].map({True: "TRUE", False: "FALSE"}) for name in out if out[name].dtype.kind == "b"}
    out = out.assign(**{str(name): values for name, values in truth.items()}).rename(
        columns=lambda name: safe(str(name))
    )
    return bytes(out.to_csv(index=False, lineterminator="\n").encode())
