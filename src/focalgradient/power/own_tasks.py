"""Power of a user-defined task, from its simulated observers and its own analysis."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.power.study import Claim, People
from focalgradient.statistics import ThresholdResult
from focalgradient.statistics.questions import Analysis
from focalgradient.statistics.threshold_questions import MEAN, RATIO
from focalgradient.tasks import Task, task_named

__all__ = ["Observers"]

THRESHOLDS = "thresholds"
"""What an analysis of adaptive trials estimates."""

POOL_SIZE = 50
"""Size of the pool of simulated observers whose thresholds are fitted (0.7 s each and condition), and from which
experiments are drawn.
"""

SAMPLED = 3
"""Number of individuals whose answers are compared with those of the common observer."""


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
                f"the task {self.task.name!r} has no test: give its design two conditions and an answer that is a "
                "number or a bool, or define planned and tested."
            )

    def analysis(self, design: Any, bound: float) -> Analysis:
        asked = self.task.analysis(design)
        if asked.estimates == THRESHOLDS:
            return replace(asked, prepare=lambda results: results, exclusions=None, also=())
        return asked

    def claims(self, design: Any, bound: float) -> Mapping[str, Claim]:
        claims = {}
        for number, (name, level) in enumerate(self._tests(design), start=1):
            meaning, factor = _meaning(name, level), None
            if name == MEAN:
                meaning, factor = f"mean threshold known to a factor of {bound:g}", bound
            claims[f"test_{number}"] = Claim(meaning, name, (level,) if level else (), 0, factor)
        return claims

    def measured(self, design: Any) -> tuple[tuple[str, str, str], ...]:
        return tuple((_meaning(name, level), name, level) for name, level in self._tests(design)[:2])

    def seconds(self, design: Any) -> float:
        return 0.001 if self._thresholds(design) else 0.01

    def settings(self, design: Any) -> dict[str, object]:
        tests = {"task": self.task.name, "tests": [_meaning(*test) for test in self._tests(design)]}
        return tests | ({"people": POOL_SIZE} if self._thresholds(design) else {})

    def are_alike(self, design: Any) -> bool:
        """Return whether the task's answers are the same for different observers: its people do not differ."""
        from focalgradient.observers.observer import observer_named
        from focalgradient.observers.sessions import observe

        common = observer_named("default")
        others = [common.person(np.random.default_rng(seed)) for seed in range(SAMPLED)]
        answers = {repr(observe(self.task, design, observer, "01", 0)) for observer in (common, *others)}
        return len(answers) == 1

    def simulated(self, design: Any, subjects: int, rng: np.random.Generator, seed: int) -> Any:
        if not self._thresholds(design):
            return pd.DataFrame(self._rows(design, subjects, rng))
        pool = _people(self.task.name, design.model_dump_json(), seed)
        return _drawn(pool, rng.choice(POOL_SIZE, subjects))

    def _thresholds(self, design: Any) -> bool:
        return self.task.analysis(design).estimates == THRESHOLDS

    def _tests(self, design: Any) -> list[tuple[str, str]]:
        """Return the tests, by question and level; of thresholds their ratios, or the mean of a single condition."""
        asked = self.task.analysis(design)
        every = asked.questions if asked.estimates == THRESHOLDS else asked.every
        main = [one for one in every if one.role in ("primary", "main")]
        if any(one.levels for one in main):
            main = [one for one in main if one.name != MEAN]
        else:
            main = [one for one in main if one.name != RATIO]
        return [(one.name, level) for one in main for level in one.levels or ("",)]

    def _rows(self, design: Any, subjects: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
        from focalgradient.observers.observer import observer_named
        from focalgradient.observers.sessions import observe

        observer, seed = observer_named("default"), int(rng.integers(2**31))
        for name in (f"{number:02}" for number in range(1, subjects + 1)):
            answers = observe(self.task, design, observer, name, seed)
            for trial, answer in zip(design.trials(name), answers, strict=True):
                if trial.phase == "main" and not trial.catch:
                    yield {"participant_id": f"sub-{name}"} | _fields(trial) | _fields(answer)


@lru_cache(maxsize=4)
def _people(name: str, design_json: str, seed: int) -> Mapping[str, ThresholdResult]:
    """Return the thresholds of the pool of simulated observers, by condition."""
    task = task_named(name)
    design = task.design.model_validate_json(design_json)
    asked = task.analysis(design)
    table = pd.DataFrame(Observers(task)._rows(design, POOL_SIZE, np.random.default_rng(seed)))
    results: Mapping[str, ThresholdResult] = asked.prepare(asked.excluded(table)[0])
    return results


def _drawn(pool: Mapping[str, ThresholdResult], chosen: np.ndarray) -> dict[str, ThresholdResult]:
    """Return the thresholds of chosen people, who are the same in all conditions."""
    drawn = {}
    for name, result in pool.items():
        people = {person.participant: person for person in result.subjects}
        subjects = [
            replace(people[who], participant=f"{number:03}")
            for number, place in enumerate(chosen)
            if (who := f"sub-{place + 1:02}") in people
        ]
        drawn[name] = replace(result, subjects=tuple(subjects))
    return drawn


def _meaning(name: str, level: str) -> str:
    return f"{name}, {level}" if level else name


def _fields(record: Any) -> dict[str, Any]:
    return {one.name: getattr(record, one.name) for one in dataclasses.fields(record)}
