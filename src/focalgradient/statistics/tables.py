"""Tables as they come, checked: the first thing wrong is named with its row, and nothing is mended in silence."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.scales import Analysis, analysis_named

__all__ = ["FIXATIONS", "PERCEPTS", "PINHOLE", "fixations_of", "rating_table", "report_table"]

PINHOLE: Final = "pinhole"
"""The aperture that leaves no blur: what the others are compared with."""

FIXATIONS: Final = ("nearest", "farthest")
"""Which object is fixated, and in focus, in the paper; a laboratory may have others."""

PERCEPTS: Final = ("rigid", "nonrigid", "none", "both")
"""What was reported of the cube: no key held is "none", and both at once is "both"."""

GRADIENTS: Final = ("none", "rigid", "nonrigid")
"""Which reading of the cube its focal gradient favours."""

RATING_COLUMNS: Final = ("participant_id", "trial", "scene", "aperture", "aperture_mm", "fixation", "rating", "catch")
REPORT_COLUMNS: Final = (
    "participant_id",
    "trial",
    "gradient",
    "strength",
    "catch",
    "onset",
    "duration",
    "percept",
    "censored",
    "trial_duration",
)
CLOCK: Final = 0.05
"""Seconds by which a report may outlast its trial: three frames of a display."""


def rating_table(table: pd.DataFrame, scale: Analysis | str = "ratio") -> pd.DataFrame:
    """A checked copy of a table of depth ratings, one row a trial, catch trials among them.

    Parameters
    ----------
    table
        Columns `participant_id`, `trial`, `scene`, `aperture` ("pinhole" or "f/NUMBER"), `aperture_mm` (diameter; 0 for
        the pinhole), `fixation` ("nearest", "farthest", or other names), `rating` (ratio to the standard) and `catch`;
        others are kept. An index of (file, row) makes complaints name both. With a column `kind` ("human" or
        "simulated"), people and simulated observers must not be mixed; with a column `session`, trials are counted
        within it.
    scale
        Analysis of the ratings, or its name: it says whether a rating may be 0, or below it.

    Raises
    ------
    InputError
        At the first thing wrong, with its row.
    """
    analysis = analysis_named(scale)
    table = _checked(table, RATING_COLUMNS, "depth ratings", ["participant_id", "session", "trial"])
    _refuse(table, table["scene"].isna(), "scene", "but every row must name its scene")
    named = table["fixation"].map(lambda name: isinstance(name, str) and bool(name.strip()))
    _refuse(table, ~named.astype(bool), "fixation", "but every row must name the object in focus")
    names = table["aperture"].astype(str)
    wrong = ~names.map(lambda name: bool(re.fullmatch(r"pinhole|f/\d+(\.\d+)?", name)))
    _refuse(table, wrong, "aperture", 'but must be "pinhole" or "f/" and a number')
    for column, least in (("rating", "above 0: a ratio to the standard"), ("aperture_mm", "0 or more")):
        values = _numbers(table, column)
        low = values < 0
        if column == "rating" and analysis.positive:
            low = values <= 0
        elif column == "rating":
            low, least = values < (-math.inf if analysis.signed else 0), "of the scale"
        _refuse(table, low | ~np.isfinite(values), column, f"but must be a number {least}")
        table[column] = values
    pinhole = names == PINHOLE
    wrong = pinhole != (table["aperture_mm"] == 0)
    _refuse(table, wrong, "aperture_mm", "but a pinhole, and only a pinhole, has 0")
    first = table.groupby("aperture")["aperture_mm"].transform("first")
    _refuse(table, table["aperture_mm"] != first, "aperture_mm", "but must be the same wherever its aperture is named")
    first = table.groupby("aperture_mm")["aperture"].transform("first")
    _refuse(table, names != first, "aperture", "but its aperture_mm goes by another name in another row")
    return table


def check_steps(table: pd.DataFrame) -> None:
    """Raise InputError where a rating is not a whole number, as on an ordinal scale.

    >>> check_steps(pd.DataFrame({"rating": [1.0, 7.0]}))
    """
    if (table["rating"] % 1 != 0).any():
        raise InputError("Ordinal ratings must be whole numbers, the steps of the scale, and some are not.")


def fixations_of(table: pd.DataFrame) -> tuple[str, ...]:
    """Names of the fixations in a table: nearest and farthest first, then others by their names.

    >>> fixations_of(pd.DataFrame({"fixation": ["middle", "farthest", "nearest"]}))
    ('nearest', 'farthest', 'middle')
    """
    there = set(table["fixation"])
    return (*(name for name in FIXATIONS if name in there), *sorted(there - {*FIXATIONS}))


def report_table(table: pd.DataFrame) -> pd.DataFrame:
    """A checked copy of a table of reports on the Necker cube, one row a report, catch trials among them.

    Parameters
    ----------
    table
        Columns `participant_id`, `trial`, `gradient` ("none", "rigid" or "nonrigid"), `strength` (aperture in mm; 0
        without a gradient), `catch`, `onset` (s, from the start of the trial), `duration` (s), `percept` ("rigid",
        "nonrigid", "none" or "both"), `censored` (cut off by the end of the trial) and `trial_duration` (s); others are
        kept. Index, `kind` and `session`: see `rating_table`.

    Raises
    ------
    InputError
        At the first thing wrong, with its row.
    """
    table = _checked(table, REPORT_COLUMNS, "reports on the cube", ["participant_id", "session", "trial", "onset"])
    _levels(table, "gradient", GRADIENTS)
    _levels(table, "percept", PERCEPTS)
    table["censored"] = _truth(table, "censored")
    for column, above in (("strength", False), ("onset", False), ("duration", True), ("trial_duration", True)):
        values = _numbers(table, column)
        low = values <= 0 if above else values < 0
        _refuse(
            table, low | ~np.isfinite(values), column, f"but must be a number {'above 0' if above else '0 or more'}"
        )
        table[column] = values
    late = table["onset"] + table["duration"] > table["trial_duration"] + CLOCK
    _refuse(table, late, "duration", "but must end with its trial: onset + duration is beyond trial_duration")
    wrong = (table["gradient"] == "none") != (table["strength"] == 0)
    _refuse(table, wrong, "strength", 'but the gradient "none", and only that one, has 0')
    trial = table.groupby(_present(table, ["participant_id", "session", "trial"]), sort=False)
    for column in ("gradient", "strength", "catch", "trial_duration"):
        _refuse(table, table[column] != trial[column].transform("first"), column, "but must not change within a trial")
    return table


def _checked(table: pd.DataFrame, columns: Sequence[str], kind: str, key: list[str]) -> pd.DataFrame:
    """A copy with what both kinds of table share checked."""
    if not isinstance(table, pd.DataFrame):
        raise InputError(f"The table of {kind} is a {type(table).__name__}, but must be a pandas DataFrame.")
    missing = [column for column in columns if column not in table]
    if missing:
        raise InputError(
            f"The table of {kind} has no column {', '.join(missing)}: it needs {', '.join(columns)}, one row a trial "
            "or report."
        )
    if table.empty:
        raise InputError(f"The table of {kind} has no rows: check that the data set has this experiment.")
    table = table.copy()
    _refuse(table, table["participant_id"].isna(), "participant_id", "but every row must name its participant")
    _refuse(table, table["trial"].isna(), "trial", "but every row must have its trial's number")
    table["participant_id"] = table["participant_id"].astype(str)
    if "session" in table:
        table["session"] = table["session"].astype(object).fillna("").astype(str)
    if "kind" in table:
        _levels(table, "kind", ("human", "simulated"))
        other = table["kind"] != table["kind"].iloc[0]
        _refuse(table, other, "kind", "but the rows above say otherwise: analyse people and simulated observers apart")
    table["catch"] = _truth(table, "catch")
    again = table.duplicated(_present(table, key))
    _refuse(table, again, "trial", "but that trial stands in a row above: leave one of them out")
    return table


def _present(table: pd.DataFrame, columns: list[str]) -> list[str]:
    return [column for column in columns if column in table]


def _numbers(table: pd.DataFrame, column: str) -> pd.Series[float]:
    return pd.to_numeric(table[column], errors="coerce").astype(float)


def _truth(table: pd.DataFrame, column: str) -> pd.Series[bool]:
    """The column as bool; text that reads "true" must not pass for true."""
    _refuse(table, ~table[column].isin([True, False]), column, "but must be true or false")
    return table[column].astype(bool)


def _levels(table: pd.DataFrame, column: str, levels: Sequence[str]) -> None:
    _refuse(table, ~table[column].isin(levels), column, f"but must be one of {', '.join(levels)}")


def _refuse(table: pd.DataFrame, wrong: pd.Series[bool], column: str, expected: str) -> None:
    """Complain about the first row that is wrong: where it is, what it says and what was expected."""
    if not wrong.any():
        return
    at = int(np.flatnonzero(wrong)[0])
    label, row = table.index[at], table.iloc[at]
    where = f"{label[0]}, row {label[1]}" if isinstance(label, tuple) else f"Row {label}"
    more = f" ({int(wrong.sum())} such rows)" if wrong.sum() > 1 else ""
    raise InputError(
        f"{where} (participant {row['participant_id']}, trial {row['trial']}): {column} is {row[column]}, "
        f"{expected}{more}."
    )
