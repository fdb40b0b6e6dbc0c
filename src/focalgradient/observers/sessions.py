"""Answers of simulated observers to whole sessions of any task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from typing import Any

from focalgradient.dataset import Answer
from focalgradient.errors import InputError
from focalgradient.observers.answers import PAUSE, random_stream, rate, watch
from focalgradient.observers.observer import Observer
from focalgradient.observers.thresholds import choose
from focalgradient.tasks import Task

__all__ = ["observe"]

SESSIONS: Mapping[str, Callable[..., tuple[Answer, ...]]] = {
    "depthrating": rate,
    "necker": watch,
    "blurthreshold": lambda design, observer, who, seed, seen: choose(design, observer, who, seed, seen=seen),
}
"""Observer of a whole session, by task: design, observer, participant, seed, encoded stimuli -> answers."""


def observe(
    task: Task, design: Any, observer: Observer, participant: str, seed: int, encoded: Any = None
) -> tuple[Any, ...]:
    """Return a simulated observer's answers to all trials of a participant, in chronological order."""
    if task.name in SESSIONS:
        return SESSIONS[task.name](design, observer, participant, seed, encoded)
    if task.simulated is None:
        raise InputError(f"the task {task.name!r} has no simulated observer: define simulated.")
    person = observer.person(random_stream(seed, task.name, participant))
    clock, answers, recorded = 0.0, [], list[dict[str, Any]]()
    for number, trial in enumerate(design.trials(participant), start=1):
        shown = task.adapted(design, trial, recorded)
        answer = task.simulated(design, shown, person, random_stream(seed, task.name, participant, number))
        answers.append(replace(answer, onset=round(clock, 4)))
        recorded.append({**asdict(trial), **asdict(answers[-1])})
        clock += design.least_s(trial) + answer.response_time + PAUSE
    return tuple(answers)
