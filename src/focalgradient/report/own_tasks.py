"""Section of the report on a user-defined task (means, tests, figures by factor), and its preregistration."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any, ClassVar

import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.design import check_design
from focalgradient.errors import InputError, described
from focalgradient.plotting.conditions import condition_figure
from focalgradient.plotting.traces import trace_figure
from focalgradient.power import TaskStudy, power, run_here
from focalgradient.power.own_tasks import planned_of, tested_of
from focalgradient.report.choices import OWN
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.export import table_files
from focalgradient.report.parts import Output, Part
from focalgradient.report.preregistered import Planned, Preregistered, enough, power_table
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet, answer_tables
from focalgradient.statistics import ConditionTest, Effect, NotComputed
from focalgradient.statistics.conditions import answers_of_tests
from focalgradient.statistics.means import t_interval
from focalgradient.statistics.questions import Answer
from focalgradient.statistics.wording import many
from focalgradient.tasks import Task
from focalgradient.tasks.check import called

__all__ = ["OwnTask", "analyse_own_task", "preregister_own_task"]

SUBJECTS = (6, 10, 16, 24, 40)
"""Sample sizes of the power analysis."""

TRACE = (
    "Levels that the procedure set, trial by trial, of each participant (open: wrong answers). They are not answers "
    "and are not tested."
)

EXPERIMENTS = 200
"""Number of simulated experiments per sample size; the standard error of a power of .5 is then .035."""


@dataclass(frozen=True, slots=True, eq=False)
class OwnTask(Part):
    """Analysed user-defined task.

    Parameters
    ----------
    task
        Task.
    data, table
        The data set, and all rows of the task.
    simulated
        True for simulated observers.
    tests
        Tests of the task with their effects.
    """

    choices: ClassVar[tuple[str, ...]] = OWN

    task: Task
    data: DataSet
    table: pd.DataFrame
    simulated: bool
    tests: tuple[ConditionTest, ...]

    @property
    def title(self) -> str:
        return self.task.title

    @property
    def name(self) -> str:
        return self.task.name

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings of the first session."""
        first: Mapping[str, Any] = next(iter(self.data.sidecars.values()))["Design"]
        return first

    @property
    def rows(self) -> pd.DataFrame:
        """Trials without catch trials."""
        return self.table[~self.table["catch"]] if "catch" in self.table else self.table

    @property
    def shown(self) -> list[str]:
        """Columns of the conditions."""
        names = {one.name for one in dataclasses.fields(self.task.trial)}
        shared = {"trial", "repetition", "catch"}
        return [one.name for one in self.task.columns(self.settings) if one.name in names - shared]

    @property
    def answered(self) -> list[tuple[str, str]]:
        """Answer columns that have a mean, each with its unit."""
        measures = self.task.measures(self.settings)
        return [*measures.items(), *([("response_time", "s")] if "response_time" in self.table else [])]

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns, as stated by the sidecar."""
        return {one.name: one.units for one in self.task.columns(self.settings) if one.units}

    def findings(self, output: Output) -> Iterator[Block]:
        people = "simulated observer" if self.simulated else "subject"
        subjects = self.rows["participant_id"].nunique()
        yield Paragraph(f"{many(subjects, people)} with {many(len(self.rows), 'trial')}; nobody is left out.")
        yield from map(Paragraph, _sentences(self.task, self.rows))
        for test in self.tests:
            yield (
                Notice(f"{test.name}: {test.effect.reason}")
                if isinstance(test.effect, NotComputed)
                else _in_words(test)
            )
        factors = [*dict.fromkeys(test.factor for test in self.tests)]
        yield from _confounded(self.rows, factors)
        for number, factor in enumerate(factors):
            answers = list(dict.fromkeys((test.answer, test.log) for test in self.tests))
            figure = condition_figure(self.rows, factor, answers, units=self.units, simulated=self.simulated)
            name = self.name if number == 0 else f"{self.name}_{factor}"
            caption = f"Answers by {factor}: each subject thin, mean and its 95 % interval over subjects bold."
            yield output.figure(name, figure, caption)
        for level in self.task.adapted_fields:
            by, ratio = factors[0] if factors else None, level in self.task.ratios
            traced = trace_figure(self.rows, level, by, self.units, ratio=ratio, simulated=self.simulated)
            yield output.figure(f"{self.name}_{level}_trace", traced, TRACE)
        yield from answer_tables(self.answers(), "Tests over subjects; Holm’s correction is over all")
        yield from output.tables([_means(self)])

    def answers(self) -> Iterator[Answer]:
        yield from answers_of_tests(self.tests)

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, _methods(self.task, self.settings, self.tests))
        yield from output.tables(self.design_table())

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.table)


def analyse_own_task(root: str | os.PathLike[str], task: Task) -> OwnTask:
    """Read and test the sessions of a user-defined task; damaged ones are excluded and named in `data`.

    Raises
    ------
    InputError
        If there are no sessions.
    """
    data = read_dataset(root, [task.name], damaged="leave out")
    table = data.tables.get(task.name)
    if table is None or table.empty:
        raise InputError(data.problems[0] if data.problems else f"{root} holds no trials of {task.name}.")
    design = check_design(task.name, next(iter(data.sidecars.values()))["Design"])
    rows = table[~table["catch"]] if "catch" in table else table
    return OwnTask(task, data, table, data.simulated, called(task, "tested", tested_of, task, design, rows))


def _sentences(task: Task, rows: pd.DataFrame) -> list[str]:
    if task.findings is None:
        return []
    found: Any = called(task, "findings", task.findings, rows)
    if isinstance(found, str) or not all(isinstance(one, str) for one in found):
        raise InputError(f"the task {task.name!r} fails: findings is {described(found)}, but must be a list of texts.")
    return list(found)


def _in_words(test: ConditionTest) -> Paragraph:
    assert isinstance(test.effect, Effect)
    return Paragraph(f"Effect “{test.name}”: {test.effect.summary()}.")


def _confounded(rows: pd.DataFrame, factors: Iterable[str]) -> Iterator[Notice]:
    """Yield a notice of each two factors whose levels always change together."""
    for one, other in combinations(factors, 2):
        levels = [rows[name].nunique() for name in (one, other)]
        if levels == [len(rows[[one, other]].drop_duplicates())] * 2:
            yield Notice(f"{one} and {other} always change together: their effects cannot be separated.")


def _means(part: OwnTask) -> Sheet:
    """Return mean answers over subjects for each condition, with 95 % intervals by t."""
    cells: list[list[Any]] = []
    rows = part.rows
    for condition, own in rows.groupby(part.shown, sort=True) if part.shown else [((), rows)]:
        levels = condition if isinstance(condition, tuple) else (condition,)
        for answer, unit in part.answered:
            means = own.groupby("participant_id")[answer].mean().astype(float).dropna()
            if means.empty:
                continue
            found = t_interval(means)
            cells.append([*levels, answer, unit, len(means), found.estimate, found.low, found.high])
    head = [*part.shown, "answer", "unit", "subjects", "mean", "low", "high"]
    return listed(f"{part.name}_means.csv", "Means over subjects, 95 % intervals by t", head, cells)


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _times(settings: Mapping[str, Any], what: str) -> str:
    return many(int(settings.get("repetitions", 1)), what)


def _methods(task: Task, settings: Mapping[str, Any], tests: tuple[ConditionTest, ...]) -> list[str]:
    """Return the methods for a paper, identical in preregistration and report."""
    conditions = " and ".join(dict.fromkeys(test.factor for test in tests)) or "one condition"
    lines = [
        f"{task.title}. Conditions ({conditions}) were shown {_times(settings, 'time')} each, in "
        "random order from the seed that the data set records. Means are over subjects, with 95 % intervals by "
        "Student’s t."
    ]
    if not tests:
        return [*lines, "No hypothesis was tested."]
    logs = " (ratios on their logarithm)" if any(test.log for test in tests) else ""
    return [
        *lines,
        f"Answers{logs} were averaged within subject and condition. The effect of a condition with three or more "
        "levels that are numbers is its least-squares slope within subject; of other conditions each level was "
        "compared with the first. Effects were tested over subjects by Student’s t (levels of different subjects by "
        f"Welch’s), two-sided, with Holm’s correction over {many(len(tests), 'test')}.",
    ]


def preregister_own_task(task: Task, design: Any, asked: Planned) -> Preregistered:
    """Write the preregistration of a user-defined task.

    Raises
    ------
    InputError
        If an effect is given, which only the task's simulated observer defines.
    """
    if asked.effects:
        raise InputError(f"effect cannot go with {task.called}, whose simulated observer has its own: leave it out.")
    tests = planned_of(task, design)
    settings = design.model_dump(mode="json")
    subjects, table = "State the number of subjects and its reason: the task has no simulated observer.", None
    if not tests:
        subjects = "State the number of subjects and its reason: no test is made whose power would give it."
    elif task.simulates:
        study = TaskStudy(task, design, asked.seed)
        found = {one.subjects: one.found for one in power(run_here(study, SUBJECTS, EXPERIMENTS))}
        assumed = (
            f"by {EXPERIMENTS} simulated experiments each with the task’s simulated observers, analysed as above. "
            "Their effect is that of the observer in the task’s class."
        )
        subjects, table = enough(found, assumed), power_table(found, study.tests)
    hypotheses = [
        f"H{number}{' (primary)' if number == 1 else ''}. The {test.name} differs from 0."
        for number, test in enumerate(tests, start=1)
    ]
    levels = "; ".join(f"{name}: {', '.join(map(_text, values))}" for name, values in task.factors(design).items())
    neutral = (
        [f"Catch trials ({settings['catch_trials']}) are answered as their trials ask."]
        if settings.get("catch_trials")
        else ["The design has no catch trials; state which trials show that participants attended."]
    )
    return Preregistered(
        f"Preregistration: {task.title}",
        hypotheses or ["No hypothesis is tested: means are estimated, with their intervals."],
        f"The {tests[0].name}, one value for each subject." if tests else "The means of each condition.",
        f"{levels or 'One condition'}; {_times(settings, 'repetition')}, in random order "
        "from the seed that the data set records.",
        ["Nobody is left out."],
        None,
        _methods(task, settings, tests),
        subjects,
        table,
        neutral=neutral,
        failed=[
            "The tests rest on normally distributed effects of the subjects, and stay those that decide. State here "
            "what else is reported where they are not."
        ],
    )
