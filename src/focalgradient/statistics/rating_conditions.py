"""Effects of the conditions of ratings in the user's own table: within subjects, or between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from focalgradient.arrays import FloatArray
from focalgradient.statistics.condition_test import ConditionTest, level_text, planned_interactions, planned_tests
from focalgradient.statistics.conditions import (
    cells_in_r,
    condition_tests,
    corrected,
    effect_in_r,
    in_units,
    interaction,
    levels_in_r,
    show_in_r,
    subject_cells,
    subject_effects,
)
from focalgradient.statistics.criteria import Rules
from focalgradient.statistics.crossed import crossed_effect
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.means import student_effect, welch
from focalgradient.statistics.questions import quoted
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.user_tables.conditions import OwnConditions

__all__ = ["ADJUSTED", "rating_tests"]


ADJUSTED = ", adjusted for "
"""Beginning of the end of a method that names the other conditions between subjects."""

LEAST_SQUARES = "least squares over subjects, errors HC2"
"""Method of several conditions between subjects."""

OTHER_SCENES = ", and over scenes, which differ between the levels (min F' of Clark 1973)"
"""End of a method of levels that were rated in different scenes."""


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
        together, by least squares over subjects; a single factor by Welch's test. Levels shown in different scenes are
        compared by min F'. Then the effect on each effect within subjects of each condition between subjects, and of
        each later condition within subjects (their interaction). Both groups are families by Holm's method.
    """
    rows = own.table[~own.table["catch"]]
    if rules is not None:
        rows = rows[kept_rows(rows, [], rules)]
    planned = in_units(planned_tests({"rating": own.log}, own.conditions), {})
    varied = rows.groupby("participant_id")[[*own.conditions]].nunique().max()
    between = [test for test in planned if varied[test.factor] == 1]
    within = [test for test in planned if varied[test.factor] > 1]
    factors, beside = list(dict.fromkeys(test.factor for test in planned)), ["scene"] * ("scene" in rows)
    done = {test.name: test for test in condition_tests(rows, planned, beside)}
    if between:
        means = done[between[0].name].points.mean(axis=1)  # type: ignore[union-attr]  # of the one level of each
        in_r = f"rowMeans(means({cells_in_r(between[0], [*factors, *beside])}), na.rm = TRUE)"
        done |= {test.name: test for test in _over_people(means, in_r, rows, [done[test.name] for test in between])}
    if beside:
        done |= {test.name: _over_scenes(rows, done[test.name], factors) for test in within}
        done |= {name: _with_other_scenes(rows, test) for name, test in done.items() if test.level is not None}
    moderated = []
    for test in within if between else ():
        cells = done[test.name].points
        assert cells is not None
        in_r = f"{effect_in_r(test)}(means({cells_in_r(test, [*factors, *beside])}))"
        of_effects = (replace(one, answer=f"({test.name})", log=False) for one in between)
        asked = in_units(of_effects, {f"({test.name})": test.unit})
        moderated += _over_people(subject_effects(cells, test), in_r, rows, asked)
    crossed = (interaction(rows, test, factors, scenes=bool(beside)) for test in planned_interactions(within))
    moderated += [test for test in crossed if test.effect is not None]
    return (*corrected([done[test.name] for test in planned]), *corrected(moderated))


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
        effects = _least_squares(np.asarray(values, float), np.column_stack([np.ones(len(values)), *columns]))
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


def _least_squares(values: FloatArray, model: FloatArray) -> list[Effect | NotComputed]:
    """Test the coefficients of a linear model over subjects, except of its first column.

    Errors allow for groups of unequal variance (HC2: MacKinnon and White 1985), as Welch's test does, with the degrees
    of freedom of Bell and McCaffrey (2002).
    """
    subjects, terms = model.shape
    why = ""
    if subjects <= terms:
        why = f"{subjects} subjects are too few for {terms - 1} conditions between them: nothing can be tested."
    elif np.linalg.matrix_rank(model) < terms:
        why = "The conditions between subjects cannot be separated: they vary together."
    else:
        solve = np.linalg.pinv(model)
        left = np.eye(subjects) - model @ solve
        estimates, residuals, free = solve @ values, left @ values, np.diag(left)
        if residuals @ residuals <= 1e-20 * max(float(values @ values), 1e-300):
            why = "The subjects' values lie on one line: there is no variation to test against."
    if why:
        return [NotComputed(why)] * (terms - 1)
    alone = free < 1e-9  # a subject whose value the model fits exactly
    effects: list[Effect | NotComputed] = []
    for estimate, weights in zip(estimates[1:], solve[1:], strict=True):
        if (abs(weights[alone]) > 1e-9 * abs(weights).max()).any():
            effects.append(NotComputed("One of the levels has a single subject: a test needs two or more."))
            continue
        squares = np.where(alone, 0.0, weights**2 / np.where(alone, 1.0, free))
        spread, error = (left * squares) @ left, math.sqrt(squares @ residuals**2)
        df = float(np.trace(spread) ** 2 / (spread**2).sum())
        effects.append(student_effect(float(estimate), error, subjects, LEAST_SQUARES, df=df))
    return effects


def _over_scenes(rows: pd.DataFrame, test: ConditionTest, factors: Sequence[str]) -> ConditionTest:
    """Test the mean slope, or difference of levels within scenes, over subjects and scenes.

    Where no subject rated a scene at two levels, the difference of the subjects' means stays, and there is no slope.
    """
    cells = subject_cells(rows, test, factors, ("participant_id", "scene"))
    if isinstance(test.effect, NotComputed) and test.level is not None:
        return test
    effects = subject_effects(cells, test)
    if effects.empty:
        none = NotComputed(f"Nobody rated a scene at two levels of {test.factor}.")
        return replace(test, effect=none) if test.level is None else test
    what = f"{effect_in_r(test)}(means({cells_in_r(test, factors)}, rows = rows))"
    code = show_in_r(test, f'crossed(at_each("scene", function(rows) {what}))')
    return replace(test, effect=crossed_effect(effects.unstack().to_numpy(float)), r_code=code)


def _with_other_scenes(rows: pd.DataFrame, test: ConditionTest) -> ConditionTest:
    """Add the variance of scenes to the error of a difference between levels that were rated in different scenes.

    This is Clark's (1973) min F': the test over subjects and Welch's test over scenes, together. Scenes of single
    subjects are part of the variance of subjects.
    """
    at = rows[test.factor].map(level_text)
    seen = rows.assign(level=at)[at.isin([test.level, test.against])]
    effect, of_scenes = test.effect, seen.groupby("scene")
    own_scenes = of_scenes["level"].nunique().max() == 1 < of_scenes["participant_id"].nunique().max()
    if not own_scenes or not isinstance(effect, Effect):
        return test
    answers = np.log(seen[test.answer]) if test.log else seen[test.answer]
    means = answers.groupby([seen["scene"], seen["level"], seen["participant_id"]]).mean().groupby(level=[0, 1]).mean()
    groups = [means.xs(level, level=1).to_numpy() for level in (test.level, test.against)]
    scenes = welch(*groups)
    if isinstance(scenes, NotComputed):
        why = f"No scene was rated with both {test.level} and {test.against}, and scenes may differ as they do."
        return replace(test, effect=NotComputed(why))
    parts = effect.standard_error**2, scenes.standard_error**2
    df = sum(parts) ** 2 / (parts[0] ** 2 / effect.df + parts[1] ** 2 / scenes.df)
    method = f"{effect.method}{OTHER_SCENES}"
    both = student_effect(effect.estimate, math.sqrt(sum(parts)), effect.subjects, method, df=df)
    found = test.r_code.removeprefix(show_in_r(test, "").removesuffix(")\n")).removesuffix(")\n")
    of = f"{quoted(test.answer)}, {str(test.log).upper()}, {quoted(test.factor)}, {', '.join(levels_in_r(test))}"
    return replace(test, effect=both, r_code=show_in_r(test, f"with_scenes({found}, {of})"))
