"""Validation of tables of ratings and reports: the first invalid row is named, and nothing is corrected silently."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
import pandas as pd

from focalgradient.analyses import Analysis, analysis_named
from focalgradient.errors import InputError
from focalgradient.user_tables.names import with_article
from focalgradient.user_tables.schema import GRADIENTS, PERCEPTS

__all__ = ["FIXATIONS", "PINHOLE", "fixations_of", "in_order", "main_trials", "rating_table", "report_table"]

PINHOLE: Final = "pinhole"
"""Aperture without blur, the reference of all comparisons."""

FIXATIONS: Final = ("nearest", "farthest")
"""Fixated (focused) objects of the paper; other data may have other fixations."""

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
ABOVE_0: Final = (
    'above 0: a ratio to the standard (give scale="ordinal" where answers are steps; with by=["aperture"], too, where '
    "they are places on a line)"
)
"""Requirement of ratings that are ratios."""

CLOCK: Final = 0.05
"""Maximum time in seconds by which a report may extend beyond its trial: three frames of a display."""


def rating_table(table: pd.DataFrame, scale: Analysis | str = "ratio") -> pd.DataFrame:
    """Return a validated copy of a table of depth ratings, one row per trial, including catch trials.

    Parameters
    ----------
    table
        Columns `participant_id`, `trial`, `scene`, `aperture` ("pinhole" or "f/NUMBER"), `aperture_mm` (diameter; 0 for
        the pinhole), `fixation` ("nearest", "farthest", or other names), `rating` (ratio to the standard) and `catch`;
        other columns are kept. With an index of (file, row), messages name both. If there is a column `kind` ("human"
        or "simulated"), all rows must have the same kind; if there is a column `session`, trials are numbered within
        it.
    scale
        Analysis of the ratings, or its name, which determines whether ratings may be 0 or negative.

    Raises
    ------
    InputError
        If the table is invalid; the message states the first invalid row.
    """
    analysis = analysis_named(scale)
    table = _checked(table, RATING_COLUMNS, "depth ratings", ["participant_id", "session", "trial"])
    _refuse(table, table["scene"].isna(), "scene", "but every row must name its scene")
    named = table["fixation"].map(lambda name: isinstance(name, str) and bool(name.strip()))
    _refuse(table, ~named.astype(bool), "fixation", "but every row must name the object in focus")
    names = table["aperture"].astype(str)
    wrong = ~names.map(lambda name: bool(re.fullmatch(r"pinhole|f/\d+(\.\d+)?", name)))
    _refuse(table, wrong, "aperture", 'but must be "pinhole" or "f/" and a number')
    for column, least in (("rating", ABOVE_0), ("aperture_mm", "0 or more")):
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
    _refuse(table, names != first, "aperture", "but its aperture_mm has another name in another row")
    return table


def main_trials(table: pd.DataFrame, scale: Analysis | str = "ratio") -> pd.DataFrame:
    """Return a validated copy of a table of depth ratings without catch trials; the rating is the column `answer`, too.

    Parameters
    ----------
    table, scale
        As in `rating_table`.

    Raises
    ------
    InputError
        If the table is invalid, all trials are catch trials, or steps are not integers.
    """
    analysis = analysis_named(scale)
    table = rating_table(table, analysis)
    table = table[~table["catch"]]
    if table.empty:
        raise InputError("All trials are catch trials: there are no answers to analyse.")
    if analysis.whole:
        check_steps(table)
    return table.assign(answer=np.log(table["rating"]) if analysis.ratios else table["rating"])


def check_steps(table: pd.DataFrame) -> None:
    """Raise `InputError` unless all ratings are integers, as on an ordinal scale.

    >>> check_steps(pd.DataFrame({"rating": [1.0, 7.0]}))
    """
    if (table["rating"] % 1 != 0).any():
        raise InputError(
            "Ordinal ratings must be whole numbers, the steps of the scale, and some are not: for places on a line, "
            'give the conditions, too, as by=["aperture"].'
        )


def fixations_of(table: pd.DataFrame) -> tuple[str, ...]:
    """Return the fixations in a table: nearest, farthest, then others in alphabetical order.

    >>> fixations_of(pd.DataFrame({"fixation": ["middle", "farthest", "nearest"]}))
    ('nearest', 'farthest', 'middle')
    """
    return in_order(set(table["fixation"]))


def in_order(fixations: Collection[str]) -> tuple[str, ...]:
    """Return fixations in the order of reports: nearest, farthest, then others in alphabetical order."""
    return (*(name for name in FIXATIONS if name in fixations), *sorted({*fixations} - {*FIXATIONS}))


def report_table(table: pd.DataFrame) -> pd.DataFrame:
    """Return a validated copy of a table of reports on the Necker cube, one row per report, including catch trials.

    Parameters
    ----------
    table
        Columns `participant_id`, `trial`, `gradient` ("none", "rigid" or "nonrigid"), `strength` (aperture in mm; 0
        without a gradient), `catch`, `onset` (s, from the start of the trial), `duration` (s), `percept` ("rigid",
        "nonrigid", "none" or "both"), `censored` (cut off by the end of the trial) and `trial_duration` (s); other
        columns are kept. For index, `kind` and `session` see `rating_table`.

    Raises
    ------
    InputError
        If the table is invalid; the message states the first invalid row.
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
    """Return a copy after the checks that both kinds of table share."""
    if not isinstance(table, pd.DataFrame):
        raise InputError(
            f"The table of {kind} is {with_article(type(table).__name__)}, but must be a pandas DataFrame"
            f"{': give its table' * hasattr(table, 'table')}."
        )
    missing = [column for column in columns if column not in table]
    if missing:
        raise InputError(
            f"The table of {kind} has no column {', '.join(missing)}: it needs {', '.join(columns)}, one row a trial "
            "or report; read_ratings and read_reports make it of a file with other names."
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
    _refuse(table, again, "trial", "but that trial occurs in a row above: leave one of them out")
    return table


def _present(table: pd.DataFrame, columns: list[str]) -> list[str]:
    return [column for column in columns if column in table]


def _numbers(table: pd.DataFrame, column: str) -> pd.Series[float]:
    return pd.to_numeric(table[column], errors="coerce").astype(float)


def _truth(table: pd.DataFrame, column: str) -> pd.Series[bool]:
    """Convert a column to bool; the text "true" is rejected, as it may be wrongly quoted."""
    _refuse(table, ~table[column].isin([True, False]), column, "but must be true or false")
    return table[column].astype(bool)


def _levels(table: pd.DataFrame, column: str, levels: Sequence[str]) -> None:
    _refuse(table, ~table[column].isin(levels), column, f"but must be one of {', '.join(levels)}")


def _refuse(table: pd.DataFrame, wrong: pd.Series[bool], column: str, expected: str) -> None:
    """Raise `InputError` for the first invalid row, with its place, its value and the expected value."""
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
