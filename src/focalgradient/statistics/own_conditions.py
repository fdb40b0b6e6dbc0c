"""Ratings by any condition from the user's own table: no fixation, scene, catch trial or repetition is needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number
from focalgradient.statistics.conditions import ConditionTest, condition_tests, planned_tests
from focalgradient.statistics.crossed import crossed_effect
from focalgradient.statistics.means import family
from focalgradient.statistics.own_names import clean, few
from focalgradient.statistics.own_ratings import ROLES, check_rating
from focalgradient.statistics.own_tables import Paths, Source, Where, answered, catch_trials, found_columns, read_table
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["OwnConditions", "holds_conditions", "rating_tests", "read_conditions"]

KEPT = ("participant_id", "rating", "scene", "catch", "kind", "session")
"""Roles that are read besides the conditions."""

MOST_LEVELS = 50
"""Maximum number of levels of a condition that is no number."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnConditions:
    """Imported ratings with their conditions.

    Parameters
    ----------
    table
        One row per trial: participant_id, rating, catch, kind, the conditions, and scene if there is one.
    conditions
        Columns of the conditions, each with its levels in ascending order, or in the order of the file.
    log
        True if all ratings are above 0 and are analysed on their logarithm.
    notes, notices
        As in `focalgradient.statistics.OwnRatings`.
    """

    table: pd.DataFrame
    conditions: Mapping[str, Sequence[Any]]
    log: bool
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()


def holds_conditions(path: Paths, columns: Mapping[str, str] | None = None) -> bool:
    """Return whether a table has ratings and apertures, but no fixation: conditions are then what was varied."""
    if (columns or {}).get("rating", "").endswith("*"):
        return False
    table = read_table(path)
    found = found_columns(table.name, table.cells, ROLES, columns or {})
    return "rating" in found and "fixation" not in found and bool({"aperture", "aperture_mm"} & set(found))


def read_conditions(
    path: Paths,
    columns: Mapping[str, str] | None = None,
    by: Sequence[str] = (),
    where: Where | None = None,
    *,
    steps: bool = False,
) -> OwnConditions:
    r"""Read ratings by condition from a CSV, TSV, XLSX or JSON file with one row per trial.

    Parameters
    ----------
    path
        The file, or several of one data set.
    columns
        Name in the file of each column: participant and rating; optionally scene, catch and aperture_mm.
    by
        Columns of the conditions; none: that of the apertures.
    where
        Values by column: only rows that have one of them are read.
    steps
        True if the ratings are steps of a scale, which are not analysed on their logarithm.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "own.csv")
    ...     _ = file.write_text("subject,aperture_mm,rating\nA,2,1.1\nA,8,1.4\nB,2,1.0\nB,8,1.3\n")
    ...     own = read_conditions(file)
    >>> dict(own.conditions), own.log
    ({'aperture_mm': [2.0, 8.0]}, True)
    """
    own = Source.read(path, ROLES, columns, where)
    check_rating(own)
    if "rating" not in own.columns:
        raise own.no_column("rating")
    if not by:
        by = [own.columns[role] for role in ("aperture_mm", "aperture") if role in own.columns][:1]
    by_name = {clean(str(name)).casefold(): str(name) for name in own.cells}
    theirs = [by_name.get(clean(name).casefold(), "") for name in by]
    if not by or not all(theirs):
        missing = f"no column {by[theirs.index('')]}" if by else "no column of conditions"
        raise InputError(f"{own.name} has {missing}: give by, one or more of {few([*map(str, own.cells)])}.")
    for role in [role for role in own.columns if role not in KEPT or own.columns[role] in theirs]:
        if role in ("participant_id", "rating"):
            raise InputError(f"by names {own.columns[role]}, which is the column of the {role}: give a condition.")
        del own.columns[role]
    own.columns.update({name: name for name in theirs})
    numeric = [name for name in theirs if _is_numeric(own.cells[name])]
    table = own.rows(["rating", *numeric], theirs)
    table = answered(own, table, "rating", "rating")
    table["rating"] = own.numbers(table, "rating")
    levels: dict[str, Sequence[Any]] = {}
    for name in theirs:
        table = answered(own, table, name, "condition", frozenset({"", "na", "n/a", "nan", "null"}))
        if name in numeric:
            table[name] = own.numbers(table, name)
            levels[name] = sorted(table[name].unique().tolist())
        else:
            levels[name] = list(dict.fromkeys(table[name]))
            if len(levels[name]) > MOST_LEVELS:
                raise InputError(
                    f"{printable(name)} has {len(levels[name])} levels that are no numbers: give a condition."
                )
        if len(levels[name]) < 2:
            raise InputError(f"{printable(name)} has the one level {levels[name][0]}: give a condition that varies.")
    sharp = {"pinhole", "ph", "sharp", "0", "f/inf"}
    for name, found in levels.items():
        levels[name] = (
            sorted(found, key=lambda level: str(level).casefold() not in sharp) if name not in numeric else found
        )
    silent: list[str] = []
    table = catch_trials(table, own.notes if "catch" in table else silent)
    table["kind"] = table["kind"].str.strip() if "kind" in table else "human"
    log = bool((table["rating"] > 0).all()) and not steps
    return OwnConditions(table, levels, log, tuple(own.notes), tuple(own.notices))


def _is_numeric(cells: pd.Series[str]) -> bool:
    """Return whether all cells are numbers with either decimal mark, or empty."""
    texts = [cell.strip() for cell in cells.unique() if cell.strip() and cell.strip().casefold() not in ("na", "n/a")]
    return bool(texts) and all(as_number(clean(text).replace(",", ".")) is not None for text in texts)


def rating_tests(own: OwnConditions) -> tuple[ConditionTest, ...]:
    """Test the effect of each condition: slopes within subject, crossed with scenes where there are, and contrasts.

    Returns
    -------
    tuple
        One test for each condition of three or more numbers, otherwise one for each level against the first, corrected
        by Holm's method as one family.
    """
    rows = own.table[~own.table["catch"]]
    planned = planned_tests({"rating": own.log}, own.conditions)
    tests = condition_tests(rows, planned)
    effects = [
        _slope(rows, test, log=own.log) if test.level is None and "scene" in rows else test.effect for test in tests
    ]
    corrected = family([effect for effect in effects if effect is not None])
    return tuple(
        ConditionTest(test.answer, test.factor, test.level, test.against, test.log, effect)
        for test, effect in zip(tests, corrected, strict=True)
    )


def _slope(rows: pd.DataFrame, test: ConditionTest, *, log: bool) -> Effect | NotComputed:
    """Return the mean slope over subjects and scenes."""
    values = np.log(rows["rating"]) if log else rows["rating"]
    means = values.groupby([rows["participant_id"], rows["scene"], rows[test.factor]]).mean()
    slopes: dict[tuple[str, str], float] = {}
    grouped: Any = means.groupby(level=[0, 1])
    for (person, scene), cell in grouped:
        x = cell.index.get_level_values(2).to_numpy(float)
        if len(x) > 1:
            centred = x - x.mean()
            slopes[person, scene] = float(centred @ cell.to_numpy(float) / (centred @ centred))
    if not slopes:
        return NotComputed(f"Nobody rated a scene at two levels of {test.factor}.")
    return crossed_effect(pd.Series(slopes).unstack().to_numpy(float))
