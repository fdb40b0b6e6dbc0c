"""Power of a user-defined task, from its simulated observers and its own analysis."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.power.study import Claim, People
from focalgradient.statistics import ConditionTest, condition_tests, planned_tests
from focalgradient.statistics.conditions import condition_questions, subject_cells
from focalgradient.statistics.questions import Analysis
from focalgradient.tasks import Task

__all__ = ["Observers", "planned_of", "task_questions", "tested_of"]


def planned_of(task: Task, design: Any) -> tuple[ConditionTest, ...]:
    """Return the tests of a task's report before data exist: by default one for each measure and factor."""
    if task.planned is not None:
        return tuple(task.planned(design))
    measures = task.measures(design.model_dump(mode="json"))
    return planned_tests({name: name in task.ratios for name in measures}, task.factors(design))


def tested_of(task: Task, design: Any, table: pd.DataFrame) -> tuple[ConditionTest, ...]:
    """Return these tests with their effects; `table` contains all trials except catch trials."""
    if task.tested is None:
        return condition_tests(table, planned_of(task, design))
    tests = tuple(task.tested(design, table))
    factors = list(dict.fromkeys(test.factor for test in tests))
    if not {*factors, *(test.answer for test in tests)} <= {*table}:
        return tests
    return tuple(replace(test, points=subject_cells(table, test, factors)) for test in tests)


def task_questions(task: Task, design: Any) -> Analysis:
    """Return a question for each test of a task's report, asked of a table of all trials except catch trials."""
    return replace(condition_questions(planned_of(task, design)), prepare=lambda table: tested_of(task, design, table))


@dataclass(frozen=True, slots=True)
class Observers(People):
    """Simulated observers of a task, whose effects cannot be assumed.

    Parameters
    ----------
    task
        Task.
    """

    task: Task

    kind: ClassVar[str] = "observers of the task"
    width_label: ClassVar[str] = "95 % interval of the effect: width"

    def check(self, design: Any) -> None:
        if not self.task.simulates:
            raise InputError(f"the task {self.task.name!r} has no simulated observer: define simulated.")
        if not planned_of(self.task, design):
            raise InputError(
                f"the task {self.task.name!r} has no test: give its design two conditions, or define planned and "
                "tested."
            )

    def analysis(self, design: Any, bound: float, seed: int) -> Analysis:
        return replace(
            task_questions(self.task, design),
            generator=lambda subjects, rng: pd.DataFrame(self._rows(design, subjects, rng)),
        )

    def claims(self, design: Any, bound: float) -> Mapping[str, Claim]:
        tests = enumerate(planned_of(self.task, design), start=1)
        return {f"test_{number}": Claim(test.name, test.name, ("",), sign=0) for number, test in tests}

    def measured(self, design: Any) -> tuple[tuple[str, str, str], ...]:
        return tuple((test.name, test.name, "") for test in planned_of(self.task, design)[:2])

    def settings(self, design: Any) -> dict[str, object]:
        return {"task": self.task.name, "tests": [test.name for test in planned_of(self.task, design)]}

    def _rows(self, design: Any, subjects: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
        from focalgradient.observers.observer import observer_named
        from focalgradient.observers.sessions import observe

        observer, seed = observer_named("default"), int(rng.integers(2**31))
        for name in (f"{number:02}" for number in range(1, subjects + 1)):
            answers = observe(self.task, design, observer, name, seed)
            for trial, answer in zip(design.trials(name), answers, strict=True):
                if trial.phase == "main" and not trial.catch:
                    yield {"participant_id": f"sub-{name}"} | _fields(trial) | _fields(answer)


def _fields(record: Any) -> dict[str, Any]:
    return {one.name: getattr(record, one.name) for one in dataclasses.fields(record)}
