"""Power of a user-defined task, from its simulated observers and its own analysis."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.power.study import AnyStudy
from focalgradient.statistics import ConditionTest, Effect, condition_tests, planned_tests
from focalgradient.tasks import Task

__all__ = ["TaskStudy", "planned_of", "tested_of"]


def planned_of(task: Task, design: Any) -> tuple[ConditionTest, ...]:
    """Return the tests of a task's report before data exist: by default one for each measure and factor."""
    if task.planned is not None:
        return tuple(task.planned(design))
    measures = task.measures(design.model_dump(mode="json"))
    return planned_tests({name: name in task.ratios for name in measures}, task.factors(design))


def tested_of(task: Task, design: Any, table: pd.DataFrame) -> tuple[ConditionTest, ...]:
    """Return these tests with their effects; `table` contains all trials except catch trials."""
    if task.tested is not None:
        return tuple(task.tested(design, table))
    return condition_tests(table, planned_of(task, design))


@dataclass(frozen=True, slots=True)
class TaskStudy(AnyStudy):
    """Power study of a task, with the observers of `simulate` and the tests of the task's report.

    Parameters
    ----------
    task
        Task.
    design
        Design of the experiment.
    seed
        Seed of all random draws.

    Raises
    ------
    InputError
        If the task has no simulated observer, or no tests.
    """

    task: Task
    design: Any
    seed: int = 1

    seconds: ClassVar[float] = 0.01
    people: ClassVar[str] = "observers of the task"
    width_label: ClassVar[str] = "95 % interval of the effect: width"

    @classmethod
    def of(cls, task: Task, design: Any, assumed: Mapping[str, float], seed: int) -> TaskStudy:
        """Create the study; effects cannot be assumed, because the simulated observer determines them."""
        if assumed:
            option = next(iter(assumed))
            raise InputError(
                f"{option} cannot be set for {task.called}, whose simulated observer has its own effect: leave it out."
            )
        return cls(task, design, seed)

    def __post_init__(self) -> None:
        if not self.task.simulates:
            raise InputError(f"the task {self.task.name!r} has no simulated observer: define simulated.")
        if not planned_of(self.task, self.design):
            raise InputError(
                f"the task {self.task.name!r} has no test: give its design two conditions, or define planned and "
                "tested."
            )

    def settings(self) -> dict[str, object]:
        """Return all settings in the form stored in the file of experiments."""
        return AnyStudy.settings(self) | {"task": self.task.name, "tests": [*self.tests.values()]}

    @property
    def tests(self) -> Mapping[str, str]:
        return {f"test_{number}": test.name for number, test in enumerate(planned_of(self.task, self.design), start=1)}

    @property
    def widths(self) -> tuple[str, str]:
        first, *others = self.tests.values()
        return first, others[0] if others else ""

    def table(self, subjects: int, rng: np.random.Generator) -> pd.DataFrame:
        from focalgradient.observers.observer import observer_named
        from focalgradient.observers.sessions import observe

        observer, seed = observer_named("default"), int(rng.integers(2**31))
        names = [f"{number:02}" for number in range(1, subjects + 1)]
        answers = [(name, observe(self.task, self.design, observer, name, seed)) for name in names]
        return pd.DataFrame([row for name, given in answers for row in self._rows(name, given)])

    def _rows(self, name: str, given: Any) -> Iterator[dict[str, Any]]:
        for trial, answer in zip(self.design.trials(name), given, strict=True):
            if trial.phase == "main" and not trial.catch:
                yield {"participant_id": f"sub-{name}"} | _fields(trial) | _fields(answer)

    def outcome(self, table: pd.DataFrame) -> dict[str, float | None]:
        found = [test.effect for test in tested_of(self.task, self.design, table)]
        outcome: dict[str, float | None] = {
            name: float(isinstance(effect, Effect) and effect.significant)
            for name, effect in zip(self.tests, found, strict=True)
        }
        outcome |= {"width": None, "far_width": None, "left_out": 0.0}
        for name, effect in zip(("width", "far_width"), found, strict=False):
            if isinstance(effect, Effect):
                outcome[name] = effect.high - effect.low
        return outcome


def _fields(record: Any) -> dict[str, Any]:
    return {one.name: getattr(record, one.name) for one in dataclasses.fields(record)}
