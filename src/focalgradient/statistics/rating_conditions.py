"""Effects of the conditions of ratings in the user's own table: within subjects, or between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from focalgradient.statistics.conditions import (
    ConditionTest,
    cells_in_r,
    condition_tests,
    level_text,
    levels_in_r,
    planned_tests,
    show_in_r,
    subject_cells,
    subject_effects,
)
from focalgradient.statistics.criteria import Rules
from focalgradient.statistics.crossed import crossed_effect
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.means import family, student_effect, welch
from focalgradient.statistics.questions import quoted
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.user_tables.conditions import OwnConditions

__all__ = ["ADJUSTED", "rating_tests"]


ADJUSTED = ", adjusted for "
"""Beginning of the end of a method that names the other conditions between subjects."""


def rating_tests(own: OwnConditions, rules: Rules | None = None) -> tuple[ConditionTest, ...]:
    """Test the effect of each condition: within subjects, crossed with scenes where there are; and between subjects.

    Parameters
    ----------
    own
        Imported ratings.
    rules
        Exclusion rules, of which those of single trials apply; None: no trial is excluded.

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
    factors = list(dict.fromkeys(test.factor for test in planned))
    done = {test.name: test for test in condition_tests(rows, planned)}
    if between:
        means = done[between[0].name].points.mean(axis=1)  # type: ignore[union-attr]  # of the one level of each
        in_r = f"rowMeans(means({cells_in_r(between[0], factors)}), na.rm = TRUE)"
        done |= {test.name: test for test in _over_people(means, in_r, rows, [done[test.name] for test in between])}
    if "scene" in rows:
        done |= {test.name: _slope(rows, done[test.name], factors) for test in within if test.level is None}
    moderated = []
    for test in within if between else ():
        cells = done[test.name].points
        assert cells is not None
        in_r = f"means({cells_in_r(test, factors)})"
        levels = "" if test.level is None else ", ".join(levels_in_r(test))
        in_r = f"difference({in_r}, {levels})" if levels else f"slopes({in_r})"
        asked = [replace(one, answer=f"({test.name})", log=False) for one in between]
        moderated += _over_people(subject_effects(cells, test), in_r, rows, asked)
    return (*_corrected([done[test.name] for test in planned]), *_corrected(moderated))


def _corrected(tests: Sequence[ConditionTest]) -> list[ConditionTest]:
    """Return the tests with p values corrected as one family."""
    effects = family(test.effect for test in tests if test.effect is not None)
    return [replace(test, effect=effect) for test, effect in zip(tests, effects, strict=True)]


def _over_people(
    values: pd.Series[float], in_r: str, rows: pd.DataFrame, tests: Sequence[ConditionTest]
) -> list[ConditionTest]:
    """Test effects of conditions between subjects, together by least squares, or of one factor by Welch's test.

    Parameters
    ----------
    values
        One value per subject.
    in_r
        R code of the values.
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
        codes = [f"compared_groups({in_r}, {quoted(factors[0])}, {', '.join(levels_in_r(test))})" for test in tests]
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
                effects[at] = replace(effect, method=f"{effect.method}{ADJUSTED}{others}")
        terms = [
            f"amount({quoted(test.factor)})"
            if test.level is None
            else f"is_level({quoted(test.factor)}, {levels_in_r(test)[0]})"
            for test in tests
        ]
        codes = [f"regressed({in_r}, {term}, list({', '.join(terms)}))" for term in range(1, len(terms) + 1)]
    return [
        replace(test, effect=effect, r_code=show_in_r(test, code))
        for test, effect, code in zip(tests, effects, codes, strict=True)
    ]


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


def _slope(rows: pd.DataFrame, test: ConditionTest, factors: Sequence[str]) -> ConditionTest:
    """Test the mean slope over subjects and scenes."""
    cells = subject_cells(rows, test, factors, ("participant_id", "scene"))
    slopes = subject_effects(cells, test)
    if slopes.empty:
        return replace(test, effect=NotComputed(f"Nobody rated a scene at two levels of {test.factor}."))
    code = show_in_r(test, f"crossed(scene_slopes({cells_in_r(test, factors)}))")
    return replace(test, effect=crossed_effect(slopes.unstack().to_numpy(float)), r_code=code)
