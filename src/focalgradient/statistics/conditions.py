"""Effects of the conditions of any task: slopes on numeric factors, differences between levels of other factors."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files.cells import name_and_unit
from focalgradient.statistics.condition_test import ConditionTest, level_text
from focalgradient.statistics.crossed import additive_means, crossed_effect
from focalgradient.statistics.means import between_levels, family, paired_effect
from focalgradient.statistics.questions import Analysis, Answers, Question, quoted
from focalgradient.statistics.records import Effect, NotComputed
from focalgradient.statistics.wording import many

__all__ = [
    "cells_in_r",
    "condition_analysis",
    "condition_method",
    "condition_questions",
    "condition_tests",
    "corrected",
    "effect_in_r",
    "in_units",
    "interaction",
    "levels_in_r",
    "shared_conditions",
    "show_in_r",
    "subject_cells",
    "subject_effects",
]


def condition_tests(
    table: pd.DataFrame, planned: Sequence[ConditionTest], beside: Sequence[str] = ()
) -> tuple[ConditionTest, ...]:
    """Test the effects of conditions over subjects, corrected by Holm's method; interactions are a family of their own.

    Answers are averaged within each subject and condition, then over the levels of the other factors. Slopes are
    least-squares slopes within subject. Levels varied within subjects are compared by a paired t-test, levels varied
    between subjects by Welch's test.

    Parameters
    ----------
    table
        One row per trial, with `participant_id` and the columns of the tests; no catch trials.
    planned
        Tests, from `planned_tests` and `planned_interactions`.
    beside
        Other columns over whose levels answers are averaged, such as scene.

    Returns
    -------
    tuple
        The same tests with `effect`, `points` (none of interactions) and `r_code`, interactions last.

    Raises
    ------
    InputError
        If a column is missing, or a ratio is not above 0.

    Examples
    --------
    >>> from focalgradient.statistics.condition_test import planned_tests
    >>> rows = [{"participant_id": who, "sigma": sigma, "blur": who + sigma * (1 + 0.1 * who)}
    ...         for who in range(4) for sigma in (1.0, 2.0, 4.0)]
    >>> [found] = condition_tests(pd.DataFrame(rows), planned_tests({"blur": False}, {"sigma": [1.0, 2.0, 4.0]}))
    >>> round(found.effect.estimate, 3)
    1.15
    """
    factors = list(dict.fromkeys([*(test.factor for test in planned), *beside]))
    main = [test for test in planned if test.of is None]
    answers = list(dict.fromkeys(test.answer for test in main))
    if missing := [name for name in ("participant_id", *factors, *answers) if name not in table]:
        raise InputError(f"the table has no column {missing[0]}: add it.")
    rows = table.astype(dict.fromkeys(answers, float))
    for answer in {test.answer for test in main if test.log}:
        if not (rows[answer].dropna() > 0).all():
            raise InputError(f"{answer} is a ratio, but has values of 0 or less: correct them.")
    shown = [replace(test, points=subject_cells(rows, test, factors)) for test in _with_r(main, factors)]
    tested = [replace(test, effect=_effect(test)) for test in shown]
    others = [interaction(rows, test, factors) for test in planned if test.of is not None]
    return (*corrected(tested), *corrected(others))


def corrected(tests: Sequence[ConditionTest]) -> list[ConditionTest]:
    """Return the tests with p values corrected as one family."""
    effects = iter(family(test.effect for test in tests if test.effect is not None))
    return [test if test.effect is None else replace(test, effect=next(effects)) for test in tests]


def interaction(
    rows: pd.DataFrame, test: ConditionTest, factors: Sequence[str], *, scenes: bool = False
) -> ConditionTest:
    """Test whether an effect differs between the levels of a condition, over subjects, or subjects and scenes.

    The test has no effect where nobody has answers at two levels of either condition.

    Parameters
    ----------
    rows
        One row per trial.
    test
        Test from `planned_interactions`.
    factors
        All factors: see `subject_cells`.
    scenes
        True for scenes as random, crossed with subjects.

    Examples
    --------
    >>> from focalgradient.statistics.condition_test import planned_interactions, planned_tests
    >>> rows = pd.DataFrame([
    ...     {"participant_id": who, "mm": mm, "eye": eye, "depth": mm * (1 + (2 + 0.1 * who) * (eye == "R"))}
    ...     for who in range(4) for mm in (1, 2, 4) for eye in "LR"
    ... ])
    >>> [test] = planned_interactions(planned_tests({"depth": False}, {"mm": [1, 2, 4], "eye": ["L", "R"]}))
    >>> round(interaction(rows, test, ["mm", "eye"]).effect.estimate, 3)
    2.15
    """
    assert test.of is not None
    of, test = test.of, replace(test, r_code=_in_r(test, factors, scenes=scenes))
    by = ("participant_id", *["scene"] * scenes)
    shown = {name: rows[name].unique() for name in shared_conditions(rows, factors)}
    names = {name: {None, *map(level_text, levels)} for name, levels in shown.items()}
    if any(not {one.level, one.against} <= names.get(one.factor, set()) for one in (test, of)):
        return test
    cells = subject_cells(rows, of, factors, (*by, test.factor))
    effects = subject_effects(cells, of).unstack(test.factor).reindex(columns=shown[test.factor])
    values = subject_effects(effects, test)
    if values.empty:
        return test
    if scenes:
        return replace(test, effect=crossed_effect(values.unstack().to_numpy(float)))
    return replace(test, effect=paired_effect(values, "effects within subject, t over subjects"))


def condition_questions(tests: Sequence[ConditionTest], *, scenes: bool = False, adjusted: bool = False) -> Analysis:
    """Return a question for each test, asked of the tests with their effects; tests without effects have no answer.

    Parameters
    ----------
    tests
        Tests.
    scenes, adjusted
        As in `condition_method`.

    Examples
    --------
    >>> tests = [ConditionTest("blur", "sigma", effect=NotComputed("no answers"))]
    >>> [answer.name for answer in condition_questions(tests).answers(tests)]
    ['slope of blur on sigma']
    """
    outcome = f"“{tests[0].name}”, one value for each subject" if tests else "the means of each condition"
    return Analysis(
        [_question(*asked) for asked in enumerate(tests)],
        f"The primary outcome is {outcome}. Means are over subjects, with 95 % intervals by Student’s t.",
        condition_method(tests, scenes=scenes, adjusted=adjusted) if tests else "No hypothesis was tested.",
        choices=("over-subjects", "holm"),
    )


def condition_analysis(
    planned: Sequence[ConditionTest],
    tested: Callable[[pd.DataFrame], Sequence[ConditionTest]] | None = None,
    units: Mapping[str, str] = MappingProxyType({}),
) -> Analysis:
    """Return a question for each planned test, asked of a table of all trials except catch trials.

    Parameters
    ----------
    planned
        Tests before data exist.
    tested
        Function of the table that returns these tests with their effects; None: `condition_tests`.
    units
        Unit of each column that has one.
    """
    planned = in_units(planned, units)

    def prepare(table: pd.DataFrame) -> tuple[ConditionTest, ...]:
        if tested is None:
            return condition_tests(table, planned)
        tests = in_units(tested(table), units)
        factors = list(dict.fromkeys(test.factor for test in tests))
        if not {*factors, *(test.answer for test in tests)} <= {*table}:
            return tests
        return tuple(replace(test, points=subject_cells(table, test, factors)) for test in tests)

    factors = list(dict.fromkeys(test.factor for test in planned))
    return replace(condition_questions(_with_r(planned, factors) if tested is None else planned), prepare=prepare)


def in_units(tests: Iterable[ConditionTest], units: Mapping[str, str]) -> tuple[ConditionTest, ...]:
    """Return tests with the units of their effects; a factor without a unit may state it in its heading.

    >>> [test] = in_units([ConditionTest("seen", "blur_D")], {"seen": "m"})
    >>> test.unit
    'm per D'
    """
    return tuple(replace(test, unit=_unit(test, units)) for test in tests)


def _unit(test: ConditionTest, units: Mapping[str, str]) -> str:
    answer = "log ratio" if test.log else units.get(test.answer, "") if test.of is None else _unit(test.of, units)
    if test.level is not None:
        return answer
    unit = name_and_unit(test.factor)[1]
    written = [part for part in re.split(r"[\W_]+", test.factor) if part.casefold() == unit]
    return f"{answer} per {units.get(test.factor) or (written or [unit or test.factor])[-1]}".strip()


def _with_r(planned: Sequence[ConditionTest], factors: Sequence[str]) -> list[ConditionTest]:
    return [replace(test, r_code=_in_r(test, factors)) for test in planned]


def cells_in_r(test: ConditionTest, factors: Sequence[str]) -> str:
    """Return the arguments of `means` in R, which computes `subject_cells`; parameters as there.

    >>> cells_in_r(ConditionTest("blur", "eye", "left", "right"), ["eye"])
    '"blur", FALSE, "eye", c("eye")'
    """
    names = ", ".join(map(quoted, factors))
    return f"{quoted(test.answer)}, {str(test.log).upper()}, {quoted(test.factor)}, c({names})"


def levels_in_r(test: ConditionTest) -> list[str]:
    """Return the levels of a test as texts of R, which writes truth values in capitals.

    >>> levels_in_r(ConditionTest("blur", "expert", "True", "False"))
    ['"TRUE"', '"FALSE"']
    """
    return [quoted({"True": "TRUE", "False": "FALSE"}.get(name, name)) for name in (str(test.level), str(test.against))]


def show_in_r(test: ConditionTest, found: str) -> str:
    r"""Return R code that prints a result under the name of a test.

    >>> show_in_r(ConditionTest("blur", "sigma"), "over_people(own)")
    'show("slope of blur on sigma", "", over_people(own))\n'
    """
    return f'show({quoted(test.name)}, "", {found})\n'


def effect_in_r(test: ConditionTest) -> str:
    """Return the R function of values at the levels of a condition that gives the effect of a test.

    >>> effect_in_r(ConditionTest("blur", "eye", "left", "right"))
    '(function(of) difference(of, "left", "right"))'
    """
    return "slopes" if test.level is None else f"(function(of) difference(of, {', '.join(levels_in_r(test))}))"


def _in_r(test: ConditionTest, factors: Sequence[str], *, scenes: bool = False) -> str:
    if test.of is not None:
        of = f"{effect_in_r(test.of)}(means({cells_in_r(test.of, factors)}, rows = rows))"
        values = f"{effect_in_r(test)}(at_each({quoted(test.factor)}, function(rows) {of}, rows))"
        over = 'crossed(at_each("scene", function(rows) {}))' if scenes else "over_people((function(rows) {})(d))"
        return show_in_r(test, over.format(values))
    of = f"means({cells_in_r(test, factors)})"
    if test.level is None:
        return show_in_r(test, f"over_people(slopes({of}))")
    one, other = (f"level({of}, {name})" for name in levels_in_r(test))
    return show_in_r(test, f"compared({one}, {other})")


def _question(place: int, test: ConditionTest) -> Question:
    def fit(tests: Sequence[ConditionTest]) -> dict[str, Effect | NotComputed]:
        effect = tests[place].effect
        return {} if effect is None else {"": effect}

    def sentence(level: str, answers: Answers) -> str:
        return replace(test, effect=answers.to(test.name)[level]).sentence

    hypothesis = (f"The {test.name} differs from 0.",)
    described = {"headline": test.name, "sentence": sentence, "hypothesis": hypothesis}
    return Question(test.name, fit, "main", test.unit, r_code=test.r_code, **described)  # type: ignore[arg-type]


def condition_method(tests: Sequence[ConditionTest], *, scenes: bool = False, adjusted: bool = False) -> str:
    """Describe the tests for a paper, identical in preregistration and report.

    Parameters
    ----------
    tests
        Tests, of which those of effects (`adjusted`) are a family of their own.
    scenes
        True if answers are of scenes.
    adjusted
        True if conditions between subjects are adjusted for one another.

    Examples
    --------
    >>> condition_method([ConditionTest("blur", "sigma")])[-67:]
    'Tests are two-sided, with Holm’s correction over 1 test of answers.'
    """
    logs = " (ratios on their logarithm)" if any(test.log for test in tests) else ""
    crossed, apart = ", paired", ""
    if scenes:
        crossed = " and scenes, as slopes are, crossed with scenes as random where there are five or more"
        apart = "; of different scenes by Clark’s min F′"
    together = (
        "Several conditions that vary between subjects were estimated together by least squares over subjects (each "
        "adjusted for the others; errors HC2, which allow for unequal variances, with the degrees of freedom of Bell "
        "and McCaffrey, 2002), on the subjects’ means and on their effects. "
    )
    of_effects = [test for test in tests if test.answer.startswith("(")]
    compared = "Effects within subjects were compared between the levels of other conditions in the same way. "
    return (
        f"Answers{logs} were averaged within subject and condition. The effect of a condition with three or more "
        "levels that are numbers is its least-squares slope within subject; of other conditions each level was "
        f"compared with the first (within subjects{crossed}; levels of different subjects by Welch’s test{apart}). "
        f"{together * adjusted}{compared * bool(of_effects)}Tests are two-sided, with Holm’s correction over "
        f"{many(len(tests) - len(of_effects), 'test')} of answers{', and over those of effects' * bool(of_effects)}."
    )


def subject_cells(
    rows: pd.DataFrame, test: ConditionTest, factors: Sequence[str], by: Sequence[str] = ("participant_id",)
) -> pd.DataFrame:
    """Return the mean answer of each subject (row) at each level of the factor of a test (column).

    Means over the other conditions (`shared_conditions`) are least-squares means where a subject lacks some of them,
    and plain means where no subject's answers connect the levels.

    Parameters
    ----------
    rows
        One row per trial.
    test
        Test, which names answer and factor.
    factors
        All factors: answers are averaged within each of their combinations first.
    by
        Columns that identify a row of the result.

    Examples
    --------
    >>> rows = pd.DataFrame({"participant_id": "A", "eye": ["L", "L", "R"], "blur": [1.0, 2.0, 4.0]})
    >>> subject_cells(rows, ConditionTest("blur", "eye"), ["eye"]).to_dict("records")
    [{'L': 1.5, 'R': 4.0}]
    """
    values = np.log(rows[test.answer]) if test.log else rows[test.answer]
    cells = values.groupby([rows[name] for name in dict.fromkeys((*by, *factors))]).mean().dropna()
    shown: pd.DataFrame = cells.groupby([*by, test.factor]).mean().unstack(test.factor)
    others = [name for name in shared_conditions(rows, factors) if name not in (test.factor, *by)]
    if not others or shown.empty:
        return shown
    by_other = cells.groupby([*by, test.factor, *others]).mean().unstack(others)
    if shown.notna().sum(axis=1).max() == 1:  # subjects have one level each
        adjusted = _over_columns(by_other).unstack(test.factor) if by_other.isna().any(axis=None) else shown
    else:
        adjusted = shown.copy()
        for unit, own in by_other[by_other.isna().any(axis=1).groupby([*by]).transform("any")].groupby([*by]):
            seen = own.dropna(axis=1, how="all")
            if seen.isna().any(axis=None):
                means = _over_columns(seen)
                levels = means.index.get_level_values(test.factor)
                adjusted.loc[unit if len(by) > 1 else unit[0], levels] = means.to_numpy()
    return adjusted if adjusted.notna().any(axis=None) else shown


def shared_conditions(rows: pd.DataFrame, factors: Sequence[str]) -> list[str]:
    """Return the factors that vary within subjects and of which most levels were shown to at least half of them.

    Levels of others, such as random amounts of blur, cannot be compared between subjects.

    >>> rows = pd.DataFrame({"participant_id": [*"AABBCC"], "eye": [*"LRLRLR"], "sd": range(6)})
    >>> shared_conditions(rows, ["eye", "sd"])
    ['eye']
    """
    people = rows.groupby("participant_id")
    varied = [name for name in factors if people[name].nunique().max() > 1]
    shown_to = {name: rows.groupby(name)["participant_id"].nunique() for name in varied}
    return [name for name in varied if shown_to[name].median() >= len(people) / 2]


def _over_columns(cells: pd.DataFrame) -> pd.Series[float]:
    """Return the mean of each row over all columns: see `additive_means`."""
    return pd.Series(additive_means(cells.to_numpy(float)), cells.index)


def _effect(test: ConditionTest) -> Effect | NotComputed:
    cells = test.points
    assert cells is not None
    if test.level is None:
        return paired_effect(subject_effects(cells, test), "least-squares slope within subject, t over subjects")
    by_text = {level_text(level): cells[level] for level in cells}
    if test.level not in by_text or test.against not in by_text:
        return NotComputed(f"There are no answers with {test.factor} {test.level} or {test.against}.")
    return between_levels(by_text[test.level], by_text[test.against])


def subject_effects(cells: pd.DataFrame, test: ConditionTest) -> pd.Series[float]:
    """Return the slope or the difference of levels of each subject who has two levels.

    Parameters
    ----------
    cells
        Mean answer of each subject (row) at each level of the factor (column).
    test
        Test of the factor.

    Examples
    --------
    >>> cells = pd.DataFrame({0.0: [1.0, 2.0], 1.0: [2.0, 5.0], 2.0: [3.0, None]}, index=["A", "B"])
    >>> subject_effects(cells, ConditionTest("rating", "blur")).to_dict()
    {'A': 1.0, 'B': 3.0}
    """
    if test.level is not None:
        by_text = {level_text(level): cells[level] for level in cells}
        return (by_text[test.level] - by_text[str(test.against)]).dropna()
    cells = cells[cells.notna().sum(axis=1) >= 2]
    x = cells.notna() * [float(str(level)) for level in cells]
    centred = x.sub(x.sum(axis=1) / cells.notna().sum(axis=1), axis=0).where(cells.notna(), 0.0)
    return (centred * cells).sum(axis=1) / (centred**2).sum(axis=1)
