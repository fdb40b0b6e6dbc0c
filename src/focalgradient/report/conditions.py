"""Section of the report on effects of conditions, of a user-defined task or of ratings in the user's own table."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, ClassVar

import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.design import check_design
from focalgradient.errors import InputError, described
from focalgradient.plotting.conditions import condition_figure
from focalgradient.plotting.traces import trace_figure
from focalgradient.power.own_tasks import tested_of
from focalgradient.report.choices import OWN
from focalgradient.report.document import Block, Notice, Paragraph
from focalgradient.report.exclusions import TRIALS, WITHOUT, changed
from focalgradient.report.export import table_files
from focalgradient.report.parts import Output, Part
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet, answer_tables
from focalgradient.statistics import ConditionTest, Rules
from focalgradient.statistics.conditions import condition_method, condition_questions
from focalgradient.statistics.exclusions import kept_rows
from focalgradient.statistics.means import t_interval
from focalgradient.statistics.questions import Answers
from focalgradient.statistics.rating_conditions import RULES, rating_tests
from focalgradient.statistics.wording import many
from focalgradient.tasks import Task
from focalgradient.tasks.check import called
from focalgradient.user_tables import OwnConditions

__all__ = ["ConditionPart", "methods_of_task"]

TRACE = (
    "Levels that the procedure set, trial by trial, of each participant (open: wrong answers). They are not answers "
    "and are not tested."
)


@dataclass(frozen=True, slots=True, eq=False)
class ConditionPart(Part):
    """Analysed effects of conditions.

    Parameters
    ----------
    title, name
        Heading, and prefix of the files.
    table, rows
        All trials; and those analysed, without catch trials.
    tests, everyone
        Tests of the conditions with their effects, with and without exclusions.
    method
        Sentences on the tests for a paper.
    simulated, data
        As in every section.
    rules
        Exclusion rules that apply.
    left_out
        Number of trials that the rules exclude.
    task
        User-defined task; None for a table.
    """

    choices: ClassVar[tuple[str, ...]] = OWN

    title: str = field()
    name: str = field()
    table: pd.DataFrame
    rows: pd.DataFrame
    tests: tuple[ConditionTest, ...]
    everyone: tuple[ConditionTest, ...]
    method: tuple[str, ...]
    simulated: bool
    data: DataSet | None = None
    rules: tuple[str, ...] = ()
    left_out: int = 0
    task: Task | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, own: OwnConditions, criteria: Rules) -> ConditionPart:
        """Test the conditions of a table."""
        rules = tuple(rule for rule in RULES if rule in own.table)
        applied = "; ".join(TRIALS[rule] for rule in rules if getattr(criteria, rule) is not None)
        by_rules = f"By rules that do not look at the effect, {applied}.".format(rules=criteria)
        everyone = own.table[~own.table["catch"]]
        rows = everyone[kept_rows(everyone, [], criteria)]
        tests = rating_tests(own, criteria)
        method = condition_method(tests, scenes="scene" in own.table, adjusted=True)
        return cls(
            "Ratings by condition",
            "ratings_by_condition",
            own.table,
            rows,
            tests,
            rating_tests(own),
            (*[by_rules] * bool(applied), method),
            bool((own.table["kind"] == "simulated").any()),
            rules=rules,
            left_out=len(everyone) - len(rows),
        )

    @classmethod
    def of_dataset(cls, root: str | os.PathLike[str], task: Task) -> ConditionPart:
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
        settings = next(iter(data.sidecars.values()))["Design"]
        rows = table[~table["catch"]] if "catch" in table else table
        tests = called(task, "tested", tested_of, task, check_design(task.name, settings), rows)
        method = tuple(methods_of_task(task, settings, tests))
        shown = task.title, task.name, table, rows, tests, tests, method
        return cls(*shown, data.simulated, data, task=task, settings=settings)

    def answers(self) -> Answers:
        kept, everyone = (condition_questions(tests).answers(tests) for tests in (self.tests, self.everyone))
        return kept if self.tests == self.everyone else Answers((*kept, *everyone.variant(WITHOUT)))

    def findings(self, output: Output) -> Iterator[Block]:
        who, noun = "simulated observer" if self.simulated else "subject", "trial" if self.task else "rating"
        scenes = f" of {many(self.rows['scene'].nunique(), 'scene')}" if "scene" in self.rows else ""
        left_out = (
            f"{many(self.left_out, noun)} left out by the rules on trials" if self.left_out else "nobody is left out"
        )
        subjects = many(self.rows["participant_id"].nunique(), who)
        yield Paragraph(f"{subjects} with {many(len(self.rows), noun)}{scenes}; {left_out}.")
        if self.task is not None:
            yield from map(Paragraph, _sentences(self.task, self.rows))
        yield from self.said(self.answers())
        yield from map(
            Notice, changed(*(condition_questions(tests).answers(tests) for tests in (self.tests, self.everyone)))
        )
        factors = [*dict.fromkeys(test.factor for test in self.tests)]
        yield from self._confounded(factors)
        for factor in factors:
            yield self._figure(factor, output, number=factors.index(factor))
        for level in self.task.adapted_fields if self.task else ():
            by, ratio = factors[0] if factors else None, level in self.task.ratios if self.task else False
            traced = trace_figure(self.rows, level, by, self._units, ratio=ratio, simulated=self.simulated)
            yield output.figure(f"{self.name}_{level}_trace", traced, TRACE)
        effects = ", and over those of effects" if any(test.answer.startswith("(") for test in self.tests) else ""
        caption = f"Tests of the conditions; Holm’s correction is over those of answers{effects}"
        yield from answer_tables(self.answers(), caption)
        yield from output.tables([_means(self.task, self)] if self.task else [])

    def _confounded(self, factors: list[str]) -> Iterator[Notice]:
        """Yield a notice of each two factors whose levels always change together."""
        for one, other in combinations(factors, 2):
            levels = [self.rows[name].nunique() for name in (one, other)]
            if levels == [len(self.rows[[one, other]].drop_duplicates())] * 2:
                yield Notice(f"{one} and {other} always change together: their effects cannot be separated.")

    @property
    def _units(self) -> dict[str, str]:
        """Units of the columns, as stated by the sidecar."""
        return {one.name: one.units for one in self.task.columns(self.settings) if one.units} if self.task else {}

    def _figure(self, factor: str, output: Output, number: int) -> Block:
        answers = dict.fromkeys((test.answer, test.log) for test in self.tests if not test.answer.startswith("("))
        figure = condition_figure(self.rows, factor, [*answers], units=self._units, simulated=self.simulated)
        alike = self.rows.groupby("participant_id")[factor].nunique().max() == 1
        drawn = "a point for each subject" if alike else "each subject thin"
        drawn = f"{drawn}, mean and its 95 % interval over subjects bold"
        if alike and any(test.factor == factor and test.level is None for test in self.tests):
            drawn = "a point for each subject, and their least-squares line"
        noun, first = ("Answers", number == 0) if self.task else ("Ratings", False)
        name = self.name if first else f"{self.name}_{factor}".replace(" ", "_").replace("/", "_")
        return output.figure(name, figure, f"{noun} by {factor}: {drawn}.")

    def methods(self, output: Output) -> Iterator[Block]:
        yield from map(Paragraph, self.method)
        yield from output.tables(self.design_table())

    def exports(self) -> Mapping[str, bytes]:
        return table_files(f"{self.name}_trials", self.table)


def _sentences(task: Task, rows: pd.DataFrame) -> list[str]:
    if task.findings is None:
        return []
    found: Any = called(task, "findings", task.findings, rows)
    if isinstance(found, str) or not all(isinstance(one, str) for one in found):
        raise InputError(f"the task {task.name!r} fails: findings is {described(found)}, but must be a list of texts.")
    return list(found)


def _means(task: Task, part: ConditionPart) -> Sheet:
    """Return mean answers over subjects for each condition, with 95 % intervals by t."""
    fields = {one.name for one in dataclasses.fields(task.trial)} - {"trial", "repetition", "catch"}
    shown = [one.name for one in task.columns(part.settings) if one.name in fields]
    measures = {**task.measures(part.settings)} | ({"response_time": "s"} if "response_time" in part.table else {})
    cells: list[list[Any]] = []
    for condition, own in part.rows.groupby(shown, sort=True) if shown else [((), part.rows)]:
        levels = condition if isinstance(condition, tuple) else (condition,)
        for answer, unit in measures.items():
            means = own.groupby("participant_id")[answer].mean().astype(float).dropna()
            if not means.empty:
                found = t_interval(means)
                cells.append([*levels, answer, unit, len(means), found.estimate, found.low, found.high])
    head = [*shown, "answer", "unit", "subjects", "mean", "low", "high"]
    return listed(f"{part.name}_means.csv", "Means over subjects, 95 % intervals by t", head, cells)


def methods_of_task(task: Task, settings: Mapping[str, Any], tests: tuple[ConditionTest, ...]) -> list[str]:
    """Return the methods for a paper, identical in preregistration and report."""
    conditions = " and ".join(dict.fromkeys(test.factor for test in tests)) or "one condition"
    times = many(int(settings.get("repetitions", 1)), "time")
    return [
        f"{task.title}. Conditions ({conditions}) were shown {times} each, in random order from the seed that the data "
        "set records. Means are over subjects, with 95 % intervals by Student’s t.",
        condition_method(tests) if tests else "No hypothesis was tested.",
    ]
