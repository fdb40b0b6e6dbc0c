"""Ratings by any condition from the user's own table: no fixation, scene, catch trial or repetition is needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number, is_date
from focalgradient.statistics.conditions import (
    ConditionTest,
    condition_tests,
    level_text,
    planned_tests,
    subject_effects,
)
from focalgradient.statistics.criteria import Rules
from focalgradient.statistics.crossed import crossed_effect
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.means import family, student_effect, welch
from focalgradient.statistics.own_files import Paths, read_table
from focalgradient.statistics.own_names import clean, few
from focalgradient.statistics.own_ratings import NUMERIC, ROLES, check_rating, numbered, rated
from focalgradient.statistics.own_rows import without_codes
from focalgradient.statistics.own_tables import Source, Where, answered, catch_trials, completed, found_columns
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["RULES", "OwnConditions", "holds_conditions", "rating_tests", "read_conditions"]

KEPT = (
    *("participant_id", "rating", "scene", "catch", "kind", "session", "trial", "repetition"),
    *("response_time", "dropped_frames"),
)
"""Roles that are read besides the conditions."""

MOST_LEVELS = 50
"""Maximum number of levels of a condition that is not numeric."""


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
    order: Sequence[str] = (),
) -> OwnConditions:
    r"""Read ratings by condition from a CSV, TSV, XLSX or JSON file with one row per trial.

    Parameters
    ----------
    path
        The file, or several of one data set.
    columns
        Name in the file of each column: participant and rating; optionally scene, catch and aperture_mm.
    by
        Columns of the conditions; none: that of the apertures. Numbers are amounts, whose slope is tested; those of
        "NAME=factor" are names of levels.
    where
        Values by column: only rows that have one of them are read.
    steps
        True if the ratings are steps of a scale, which are not analysed on their logarithm.
    order
        Words of the answers, from the least to the most: see `focalgradient.statistics.read_ratings`.

    Raises
    ------
    InputError
        If a column is missing or a cell is invalid; the message names it.

    Examples
    --------
    >>> from focalgradient.statistics.own_files import text_table
    >>> own = read_conditions(text_table("subject,aperture_mm,rating\nA,2,1.1\nA,8,1.4\nB,2,1.0\nB,8,1.3\n"))
    >>> dict(own.conditions), own.log
    ({'aperture_mm': [2.0, 8.0]}, True)
    """
    own = Source.read(path, ROLES, columns, where)
    check_rating(own)
    own.require("participant_id", "rating")
    if not by:
        by = [own.columns[role] for role in ("aperture_mm", "aperture") if role in own.columns][:1]
    by_name = {clean(str(name)).casefold(): str(name) for name in own.cells}
    theirs = [by_name.get(clean(name.removesuffix("=factor")).casefold(), "") for name in by]
    factors = {column for column, name in zip(theirs, by, strict=True) if name.endswith("=factor")}
    if not by or not all(theirs):
        missing = f"no column {by[theirs.index('')].removesuffix('=factor')}" if by else "no column of conditions"
        raise InputError(f"{own.name} has {missing}: give by, one or more of {few([*map(str, own.cells)])}.")
    for role in [role for role in own.columns if role not in KEPT or own.columns[role] in theirs]:
        if role in ("participant_id", "rating"):
            raise InputError(f"by names {own.columns[role]}, which is the column of the {role}: give a condition.")
        del own.columns[role]
    own.columns.update({name: name for name in theirs})
    numeric = [name for name in theirs if name not in factors and _is_numeric(own.cells[name])]
    table = own.rows([*(role for role in NUMERIC if role not in theirs), *numeric], theirs)
    table = rated(own, table, order)
    levels: dict[str, Sequence[Any]] = {}
    for name in theirs:
        if name in numeric:
            table = without_codes(table, name, own.notices, signed=True)
        table = answered(own, table, name, "condition", frozenset({"", "na", "n/a", "nan", "null"}))
        if name in numeric:
            table[name] = own.numbers(table, name)
            levels[name] = sorted(table[name].unique().tolist())
            if len(levels[name]) > 2 and levels[name] in (
                [*range(len(levels[name]))],
                [*range(1, len(levels[name]) + 1)],
            ):
                own.notices.append(
                    f"The levels of {name} are {few([f'{level:g}' for level in levels[name]])}, which were taken for "
                    f'amounts: if they are codes, give by=["{name}=factor"].'
                )
        else:
            names = levels[name] = list(map(str, table[name].unique()))
            if any(map(is_date, names)) and any(as_number(level) is not None for level in names):
                own.numbers(table, name)  # names the first date
            if name not in factors and any(level[:1].isdigit() for level in names):
                own.notices.append(
                    f"The levels of {name} are not all numbers ({few(names)}), and were taken for names: give "
                    f'by=["{name}=factor"] if they are, or numbers with the unit in the heading.'
                )
            if len(names) > MOST_LEVELS:
                raise InputError(f"{printable(name)} has {len(names)} levels that are not numbers: give a condition.")
        if len(levels[name]) < 2:
            raise InputError(f"{printable(name)} has the one level {levels[name][0]}: give a condition that varies.")
    sharp = {"pinhole", "ph", "sharp", "0", "f/inf"}
    for name, found in levels.items():
        levels[name] = (
            sorted(found, key=lambda level: str(level).casefold() not in sharp) if name not in numeric else found
        )
    silent: list[str] = []
    table = catch_trials(table, own.notes if "catch" in table else silent)
    table = numbered(own, table, [*(["scene"] if "scene" in table else []), *theirs])
    table = completed(table, "kind")
    log = bool((table["rating"] > 0).all()) and not (steps or order)
    return OwnConditions(table, levels, log, tuple(own.notes), tuple(own.notices))


def _is_numeric(cells: pd.Series[str]) -> bool:
    """Return whether all cells are numbers with either decimal mark, or empty."""
    texts = [cell.strip() for cell in cells.unique() if cell.strip() and cell.strip().casefold() not in ("na", "n/a")]
    return bool(texts) and all(as_number(clean(text).replace(",", ".")) is not None for text in texts)


RULES = ("response_time", "dropped_frames")
"""Exclusion rules that apply to ratings by condition: of single trials, whatever the conditions."""


def rating_tests(own: OwnConditions, rules: Rules | None = None) -> tuple[ConditionTest, ...]:
    """Test the effect of each condition: within subjects, crossed with scenes where there are; and between subjects.

    Parameters
    ----------
    own
        Imported ratings.
    rules
        Exclusion rules, of which those of `RULES` apply; None: no trial is excluded.

    Returns
    -------
    tuple
        One test for each condition of three or more numbers, otherwise one for each level against the first. Conditions
        that vary between subjects are covariates of one another: their effects on the subjects' means are estimated
        together, by least squares over subjects; a single factor by Welch's test. Then the effect of each of these on
        each effect within subjects. Both groups are families by Holm's method.
    """
    rows = own.table[~own.table["catch"]]
    if rules is not None:
        rows = rows[kept_rows(rows, [], rules)]
    planned = planned_tests({"rating": own.log}, own.conditions)
    varied = rows.groupby("participant_id")[[*own.conditions]].nunique().max()
    between = [test for test in planned if varied[test.factor] == 1]
    within = [test for test in planned if varied[test.factor] > 1]
    answers = np.log(rows["rating"]) if own.log else rows["rating"]
    done = {test.name: test for test in condition_tests(rows, planned)}
    levels = [rows[name] for name in own.conditions if varied[name] > 1]
    means = answers.groupby([rows["participant_id"], *levels]).mean().groupby("participant_id").mean()
    done |= {test.name: test for test in _over_people(means, rows, between)}
    if "scene" in rows:
        done |= {test.name: _slope(rows, test, answers) for test in within if test.level is None}
    moderated = []
    for test in within if between else ():
        cells = answers.groupby([rows["participant_id"], rows[test.factor]]).mean().unstack()
        asked = [replace(one, answer=f"({test.name})", log=False) for one in between]
        moderated += _over_people(subject_effects(cells, test), rows, asked)
    return (*_corrected([done[test.name] for test in planned]), *_corrected(moderated))


def _corrected(tests: Sequence[ConditionTest]) -> list[ConditionTest]:
    """Return the tests with p values corrected as one family."""
    effects = family(test.effect for test in tests if test.effect is not None)
    return [replace(test, effect=effect) for test, effect in zip(tests, effects, strict=True)]


def _over_people(values: pd.Series[float], rows: pd.DataFrame, tests: Sequence[ConditionTest]) -> list[ConditionTest]:
    """Test effects of conditions between subjects, together by least squares, or of one factor by Welch's test.

    Parameters
    ----------
    values
        One value per subject.
    rows
        Ratings with the conditions.
    tests
        Tests between subjects.
    """
    factors = list(dict.fromkeys(test.factor for test in tests))
    people = rows.groupby("participant_id")[factors].first().loc[values.index]
    effects: list[Effect | NotComputed]
    if len(factors) == 1 and all(test.level is not None for test in tests):
        groups = people[factors[0]].map(level_text)
        effects = [
            welch(*(values[groups == level].to_numpy(float) for level in (test.level, test.against))) for test in tests
        ]
    else:
        columns = [
            people[test.factor].astype(float) - people[test.factor].mean()
            if test.level is None
            else (people[test.factor].map(level_text) == test.level).astype(float)
            for test in tests
        ]
        effects = _least_squares(values.to_numpy(float), np.column_stack([np.ones(len(values)), *columns]))
        for at, (test, effect) in enumerate(zip(tests, effects, strict=True)):
            others = " and ".join(name for name in factors if name != test.factor)
            if others and isinstance(effect, Effect):
                effects[at] = replace(effect, method=f"{effect.method}, adjusted for {others}")
    return [replace(test, effect=effect) for test, effect in zip(tests, effects, strict=True)]


def _least_squares(values: np.ndarray, model: np.ndarray) -> list[Effect | NotComputed]:
    """Test the coefficients of a linear model over subjects, except of its first column."""
    from statsmodels.api import OLS  # type: ignore[import-untyped]

    subjects, terms = model.shape
    why = ""
    if subjects <= terms:
        why = f"{subjects} subjects are too few for {terms - 1} conditions between them: nothing can be tested."
    elif np.linalg.matrix_rank(model) < terms:
        why = "The conditions between subjects cannot be separated: they vary together."
    else:
        fit = OLS(values, model).fit()
        if fit.ssr <= 1e-20 * max(float(values @ values), 1e-300):
            why = "The subjects' values lie on one line: there is no variation to test against."
    if why:
        return [NotComputed(why)] * (terms - 1)
    return [
        student_effect(float(estimate), float(error), subjects, "least squares over subjects", df=float(fit.df_resid))
        for estimate, error in zip(fit.params[1:], fit.bse[1:], strict=True)
    ]


def _slope(rows: pd.DataFrame, test: ConditionTest, answers: pd.Series[float]) -> ConditionTest:
    """Test the mean slope over subjects and scenes."""
    cells = answers.groupby([rows["participant_id"], rows["scene"], rows[test.factor]]).mean().unstack()
    slopes = subject_effects(cells, test)
    if slopes.empty:
        return replace(test, effect=NotComputed(f"Nobody rated a scene at two levels of {test.factor}."))
    return replace(test, effect=crossed_effect(slopes.unstack().to_numpy(float)))
