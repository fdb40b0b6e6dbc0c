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
from focalgradient.statistics.questions import Analysis
from focalgradient.tasks import Task

__all__ = ["Observers"]


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
        if not self._tests(design):
            raise InputError(
                f"the task {self.task.name!r} has no test: give its design two conditions, or define planned and "
                "tested."
            )

    def analysis(self, design: Any, bound: float, seed: int) -> Analysis:
        return replace(
            self.task.analysis(design),
            generator=lambda subjects, rng: self.simulated(design, subjects, rng, seed),
        )

    def claims(self, design: Any, bound: float) -> Mapping[str, Claim]:
        return {f"test_{number}": Claim(name, name, (), 0) for number, name in enumerate(self._tests(design), start=1)}

    def measured(self, design: Any) -> tuple[tuple[str, str, str], ...]:
        return tuple((name, name, "") for name in self._tests(design)[:2])

    def settings(self, design: Any) -> dict[str, object]:
        return {"task": self.task.name, "tests": self._tests(design)}

    def simulated(self, design: Any, subjects: int, rng: np.random.Generator, seed: int) -> pd.DataFrame:
        return pd.DataFrame(self._rows(design, subjects, rng))

    def _tests(self, design: Any) -> list[str]:
        return [one.name for one in self.task.analysis(design).every if one.role in ("primary", "main")]

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
