"""Effects of conditions, of a user-defined task or of ratings in the user's own table: plan and section."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations, product
from typing import Any

import numpy as np
import pandas as pd

from focalgradient.dataset import DataSet
from focalgradient.errors import InputError, described
from focalgradient.files.columns import Column
from focalgradient.plotting.conditions import condition_figure
from focalgradient.plotting.traces import trace_figure
from focalgradient.report.analysed import design_in, designs_in
from focalgradient.report.exclusions import WITHOUT, always_the_same
from focalgradient.report.export import r_script, table_files
from focalgradient.report.parts import Asked, Drawing, Part, Plan, is_simulated
from focalgradient.report.tables import EFFECTS, Sheet, listed
from focalgradient.report.thresholds import threshold_part
from focalgradient.report.words import times
from focalgradient.statistics import ConditionTest, Effect, Rules, ThresholdResult
from focalgradient.statistics.condition_test import level_text
from focalgradient.statistics.conditions import condition_questions, shared_conditions
from focalgradient.statistics.criteria import OF_TRIALS, WORDING
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.means import share_interval, t_interval
from focalgradient.statistics.questions import Analysis, Answers
from focalgradient.statistics.rating_conditions import ADJUSTED, rating_tests
from focalgradient.statistics.wording import many
from focalgradient.tasks import Task
from focalgradient.tasks.adaptive import compared_answers, compared_factors, constant_levels
from focalgradient.tasks.check import called
from focalgradient.tasks.columns import added_columns
from focalgradient.user_tables.conditions import STEPS, OwnConditions
from focalgradient.user_tables.names import few

__all__ = ["condition_part", "conditions_of_dataset", "conditions_of_table", "task_plan"]

TRACE = (
    "Levels that the procedure set, trial by trial, of each participant (open: wrong answers). They are not answers "
    "and are not tested."
)

NOT_TESTED = "The answer {} is a word and is not tested: the table of means holds the share of each word."

NO_THRESHOLD = (
    "No threshold was fitted: for thresholds of {0}, make {0} a field of the answer as well, and let adapted(design, "
    "trial, recorded) of the task return the trial."
)

Tests = Sequence[ConditionTest]


def task_plan(task: Task, design: Any, questions: Analysis) -> Plan:
    """Return the plan of a user-defined task, with its conditions and their levels, those of constant stimuli last."""
    settings = design.model_dump(mode="json")
    units = {one.name: f" {one.units}" for one in task.columns(settings) if one.units}
    factors = {**called(task, "factors", task.factors, design), **constant_levels(task, design)}
    levels = "; ".join(
        f"{name}: {', '.join(map(level_text, values))}{units.get(name, '')}" for name, values in factors.items()
    )
    conditions = "Combinations of conditions" if len(factors) > 1 else "Conditions"
    conditions = f"{conditions} ({levels}) were" if levels else "One condition was"
    return Plan(
        questions,
        shown=f"{conditions} shown {times(settings)}{' each' if levels else ''}, in random order from the seed that "
        "the data set records.",
        exclusions=["Nobody is left out."] if questions.exclusions is None else [],
    )


def conditions_of_table(own: OwnConditions, criteria: Rules) -> Part:
    """Test the conditions of a table."""
    rules = tuple(rule for rule in OF_TRIALS if rule in own.table)
    applied = "; ".join(WORDING[rule].clause for rule in rules if getattr(criteria, rule) is not None)
    everyone = own.table[~own.table["catch"]]
    rows = everyone[kept_rows(everyone, [], criteria)]
    tests = rating_tests(own, criteria)
    questions = condition_questions(tests, scenes="scene" in own.table, adjusted=True)
    plan = Plan(
        dataclasses.replace(
            questions, outcome="", rules=rules, after=" ".join(filter(None, [questions.after, STEPS * own.steps]))
        ),
        exclusions=[f"By rules that do not look at the effect, {applied}.".format(rules=criteria)] if applied else [],
    )
    left_out = len(everyone) - len(rows)
    names = ("Ratings by condition", "ratings_by_condition", "rating")
    before = rating_tests(own)
    kept, without = (condition_questions(of).answers(of) for of in (tests, before))
    answers = kept if tests == before else Answers((*kept, *without.variant(WITHOUT)))
    part = condition_part(names, plan, own.exported, rows, tests, answers, left_out)
    notices = [*part.notices, *always_the_same(rows)]
    sheets = [*_means_of_ratings(own, tests), *_means_of_combinations(own, rows)]
    return dataclasses.replace(part, notices=notices, sheets=sheets)


def _means_of_ratings(own: OwnConditions, tests: Tests) -> list[Sheet]:
    """Return mean ratings at the levels of each condition, but for levels of single subjects such as ages."""
    of = {test.factor: test for test in tests if test.points is not None and test.answer == "rating"}
    cells = []
    for factor, test in of.items():
        means = dict(zip(test.points, test.means, strict=True))  # type: ignore[arg-type]
        if all(mean.low is not None for mean in means.values()):
            ordered = [level for level in own.conditions[factor] if level in means]
            ends = ((level, means[level]) for level in ordered)
            cells += [[factor, level_text(level), mean.estimate, mean.low, mean.high] for level, mean in ends]
    kind = "Geometric means" if own.log else "Means"
    caption = f"{kind} of the ratings over subjects, 95 % intervals by t"
    head = ["condition", "level", "mean", "low", "high"]
    return [listed("ratings_by_condition_means.csv", caption, head, cells)] if cells else []


def _means_of_combinations(own: OwnConditions, rows: pd.DataFrame) -> list[Sheet]:
    """Return mean ratings at each combination of the conditions, but for those with levels of single subjects."""
    shared = [name for name in own.conditions if rows.groupby(name)["participant_id"].nunique().min() > 1]
    if len(shared) < 2:
        return []
    ratings = np.log(rows["rating"]) if own.log else rows["rating"]
    of_people = ratings.groupby([rows[name] for name in ("participant_id", *shared)]).mean().groupby(shared)
    cells = []
    for levels in product(*(own.conditions[name] for name in shared)):
        if levels in of_people.groups:
            values = of_people.get_group(levels)
            mean = t_interval(values).ratio if own.log else t_interval(values)
            cells.append([*map(level_text, levels), len(values), mean.estimate, mean.low, mean.high])
    caption = f"{'Geometric means' if own.log else 'Means'} of the ratings at each combination, 95 % intervals by t"
    return [listed("ratings_by_condition_cells.csv", caption, [*shared, "subjects", "mean", "low", "high"], cells)]


def conditions_of_dataset(task: Task, data: DataSet, asked: Asked) -> Part:
    """Compare the conditions of a task."""
    table, settings, design = data.tables[task.name], designs_in(data)[0], design_in(data)
    rows = table[~table["catch"]] if "catch" in table else table
    questions = called(task, "analysis", task.analysis, design, asked.options)
    kept, quality = called(task, "exclusions", questions.excluded, rows)
    prepared = called(task, "tested", questions.prepare, kept)
    tests = [one for one in prepared if isinstance(one, ConditionTest)] if isinstance(prepared, tuple) else []
    main = condition_questions(tests) if tests else questions
    answers = [*called(task, "fit", main.answers, prepared), *called(task, "fit", questions.asked_also, kept)]
    if quality is not None and quality.exclusions:
        answers += called(task, "fit", questions.asked, rows, everyone=True).variant(WITHOUT)
    factors = called(task, "factors", task.factors, design)
    plan = task_plan(task, design, questions)
    units = {one.name: one.units for one in task.columns(settings) if one.units}
    names = (task.title, task.name, "trial")
    shown = names, plan, table, kept, tests, Answers(tuple(answers)), len(rows) - len(kept)
    part = condition_part(*shown, units=units, data=data)
    traces = []
    by = tests[0].factor if tests else next(iter(factors), None)
    ordered = rows
    if by is not None and by in factors:
        ordered = rows.assign(**{by: pd.Categorical(rows[by], pd.Index(factors[by]))})
    if questions.estimates == "thresholds":
        part = _of_thresholds(task, part, kept, prepared, questions, units)
    constant = constant_levels(task, design)
    for level in (name for name in task.adapted_fields if name not in constant):
        drawn = partial(trace_figure, ordered, level, by, units, ratio=level in task.ratios)
        traces.append(Drawing(f"{task.name}_{level}_trace", TRACE, drawn))
    return dataclasses.replace(
        part,
        quality=quality,
        said=[
            *_sentences(task, kept),
            *map(NOT_TESTED.format, (one.name for one in _in_words(task, settings))),
            *(NO_THRESHOLD.format(one.factor) for one in tests if one.answer == "correct" and one.level is None),
        ],
        figures=[*part.figures, *traces],
        sheets=[*part.sheets, called(task, "measures", _means, task, design, kept, factors)],
    )


def _of_thresholds(
    task: Task,
    part: Part,
    rows: pd.DataFrame,
    results: Mapping[str, ThresholdResult],
    questions: Analysis,
    units: Mapping[str, str],
) -> Part:
    """Return the section of a task with the thresholds of its procedure instead of tests of answers."""
    [level] = task.adapted_fields
    shown = rows.assign(level=rows[level], kind="simulated" if part.simulated else "human")
    of = threshold_part(shown, results, units.get(level, ""), questions=questions, prefix=f"{task.name}_")
    tables = {file: content for file, content in part.files.items() if file != "conditions.R"}
    scripts = {file: content for file, content in of.files.items() if file.endswith("thresholds.R")}
    return dataclasses.replace(
        part,
        sample=of.sample,
        notices=[*of.notices, *part.notices],
        figures=of.figures,
        captions=of.captions,
        sheets=of.sheets,
        files=tables | scripts,
    )


def condition_part(
    names: tuple[str, str, str],
    plan: Plan,
    table: pd.DataFrame,
    rows: pd.DataFrame,
    tests: Tests,
    answers: Answers,
    left_out: int = 0,
    *,
    units: Mapping[str, str] | None = None,
    data: DataSet | None = None,
) -> Part:
    """Return the section on tests and all `answers`; `names` are heading, prefix of files, and answers."""
    title, name, noun = names
    table = table.assign(included=table.index.isin(rows.index))
    script = r_script("conditions", answers).replace(b"TRIALS", f"{name}_trials".encode())
    factors = [*dict.fromkeys(test.factor for test in tests)]
    simulated = is_simulated(table, data)
    who = "simulated observer" if simulated else "subject"
    people = rows["participant_id"].nunique()
    scenes = f" of {many(rows['scene'].nunique(), 'scene')}" if "scene" in rows else ""
    without = f"{many(left_out, noun)} left out by the rules on trials" if left_out else "nobody is left out"
    shared = shared_conditions(rows, [*factors, *["scene"] * (data is None and "scene" in rows)])
    cells = rows.groupby(["participant_id", *shared]).size().unstack(shared) if shared else None
    gaps = [] if cells is None else [str(name).removeprefix("sub-") for name in cells.index[cells.isna().any(axis=1)]]
    lacking = f"{few(gaps)} ({len(gaps)} of the {people} {who}s): "
    sloped = [test.factor for test in tests if test.level is None and test.factor in shared]
    effects = ", and over those of effects" if any(test.answer.startswith("(") for test in tests) else ""
    return Part(
        title=title,
        name=name,
        plan=plan,
        answers=answers,
        simulated=simulated,
        sample=[f"{many(people, who)} with {many(len(rows), noun)}{scenes}; {without}."],
        data=data,
        notices=[
            f"The test of {test.name} is of {test.effect.subjects} of the {people} {who}s: the others lack "
            "answers at one of its levels."
            for test in tests
            if isinstance(test.effect, Effect) and test.effect.subjects < people
        ]
        + [
            f"Answers at some levels of {few(shared)} are missing for {lacking}means over these are "
            "least-squares means, as if their effects add, or plain means where nobody's answers connect the levels."
        ]
        * (bool(gaps) and shared != factors[:1])
        + [
            f"Answers at some levels of {few(sloped)} are missing for {lacking}their slopes are over "
            "other levels, and differ where the effect is not linear."
        ]
        * (bool(gaps) and bool(sloped))
        + [
            f"{one} and {other} always change together: their effects cannot be separated."
            for one, other in combinations(factors, 2)
            if [rows[factor].nunique() for factor in (one, other)] == [len(rows[[one, other]].drop_duplicates())] * 2
        ],
        figures=[
            _drawing(factor, name if data and not place else "", names, rows, tests, units or {})
            for place, factor in enumerate(factors)
        ],
        captions={EFFECTS: f"Tests of the conditions; Holm’s correction is over those of answers{effects}"},
        files=table_files(f"{name}_trials", table) | ({"conditions.R": script} if answers.r_code else {}),
    )


def _drawing(
    factor: str,
    file: str,
    names: tuple[str, str, str],
    rows: pd.DataFrame,
    tests: Tests,
    units: Mapping[str, str],
) -> Drawing:
    """Return the figure of answers by a factor."""
    of = {test.answer: _in_order(test, tests) for test in tests if test.factor == factor and test.points is not None}
    alike = rows.groupby("participant_id")[factor].nunique().max() == 1
    drawn = "a point for each subject" if alike else "each subject thin"
    drawn = f"{drawn}, mean and its 95 % interval over subjects bold"
    if alike and any(test.factor == factor and test.level is None for test in tests):
        drawn = "a point for each subject, and the line of the tested slope"
    adjusted = {
        effect.method.partition(ADJUSTED)[2]
        for test in tests
        if test.factor == factor and isinstance(effect := test.effect, Effect) and ADJUSTED in effect.method
    }
    for others in sorted(adjusted):
        drawn += f"; these means are not adjusted for {others}, as the tested effects are, which may differ in sign"
    noun = "Ratings" if names[2] == "rating" else "Answers"
    draw = partial(condition_figure, [*of.values()], units=units)
    file = file or f"{names[1]}_{factor}".replace(" ", "_").replace("/", "_")
    return Drawing(file, f"{noun} by {factor}: {drawn}.", draw)


def _in_order(test: ConditionTest, tests: Tests) -> ConditionTest:
    """Return a test with its points in the order of comparison: the reference first, then the levels as tested."""
    compared = [pair for one in tests if one.factor == test.factor for pair in (one.against, one.level) if pair]
    assert test.points is not None
    levels = sorted(test.points, key=lambda level: [*compared, level_text(level)].index(level_text(level)))
    return dataclasses.replace(test, points=test.points.reindex(columns=levels))


def _sentences(task: Task, rows: pd.DataFrame) -> list[str]:
    if task.findings is None:
        return []
    found: Any = called(task, "findings", task.findings, rows)
    if isinstance(found, str) or not all(isinstance(one, str) for one in found):
        raise InputError(f"the task {task.name!r} fails: findings is {described(found)}, but must be a list of texts.")
    return list(found)


def _in_words(task: Task, settings: Mapping[str, Any]) -> list[Column]:
    """Return the columns of answers that are one of several words."""
    added = {column.name for column in added_columns(task.answer, "")}
    return [one for one in task.columns(settings) if one.name in added and one.form == "text" and one.levels]


def _means(task: Task, design: Any, rows: pd.DataFrame, factors: Mapping[str, Sequence[object]]) -> Sheet:
    """Return mean answers over subjects for each condition that is compared, with 95 % intervals by t.

    `factors` are all conditions, and order the levels.
    """
    settings = design.model_dump(mode="json")
    fields = {one.name for one in dataclasses.fields(task.trial)} - {"trial", "repetition", "catch"}
    fields -= {*task.adapted_fields, *factors} - {*compared_factors(task, design)}
    shown = [one.name for one in task.columns(settings) if one.name in fields]
    units = task.measures(settings)
    measures = {name: units[name] for name in compared_answers(task, design)}
    if "response_time" in rows and rows["response_time"].nunique() > 1:  # else of simulated observers
        measures["response_time"] = "s"
    shares = {
        f"{column.name}: {level}": (rows[column.name] == level).where(rows[column.name].isin(column.levels))
        for column in _in_words(task, settings)
        for level in column.levels
    }
    rows, measures = rows.assign(**shares), measures | dict.fromkeys(shares, "share")
    ordered = {
        name: pd.Categorical(rows[name], [*dict.fromkeys([*factors[name], *sorted(rows[name].dropna().unique())])])
        for name in shown
        if name in factors
    }
    cells: list[list[Any]] = []
    for condition, own in rows.assign(**ordered).groupby(shown, sort=True, observed=True) if shown else [((), rows)]:
        levels = condition if isinstance(condition, tuple) else (condition,)
        for answer, unit in measures.items():
            means = own.groupby("participant_id")[answer].mean().astype(float).dropna()
            if not means.empty:
                found = share_interval(means) if unit == "share" else t_interval(means)
                ends = (found.estimate, found.low, found.high)
                cells.append([*map(level_text, levels), answer, unit, len(means), *ends])
    head = [*shown, "answer", "unit", "subjects", "mean", "low", "high"]
    caption = "Means over subjects, 95 % intervals by t" + ", of shares on the log odds" * (
        "share" in measures.values()
    )
    return listed(f"{task.name}_means.csv", caption, head, cells)
