"""Simulated observers of whole sessions of any task: what they look at, and what they answer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, NamedTuple

from focalgradient.dataset import Answer
from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign
from focalgradient.errors import InputError
from focalgradient.observers.answers import PAUSE, random_stream, rate, watch
from focalgradient.observers.intervals import seen_intervals
from focalgradient.observers.observer import Observer
from focalgradient.observers.pictures import seen_pictures
from focalgradient.observers.rotation import encoded_cubes
from focalgradient.observers.thresholds import choose
from focalgradient.progress import Progress
from focalgradient.tasks import Task

__all__ = ["observe", "seen"]


class SessionObserver(NamedTuple):
    """Class of a design, its observer of a whole session, and the stimuli that the observer looks at."""

    design: type[Any]
    answers: Callable[[Any, Observer, str, int, Any], tuple[Answer, ...]]
    seen: Callable[[Any, Path | None, Executor | None, Progress], dict[str, Any]]


def _cubes(design: NeckerDesign, _: Path | None, executor: Executor | None, progress: Progress) -> dict[str, Any]:
    progress(0.0, "encoding the cube")
    return {"encoded": encoded_cubes(design, executor)}


OBSERVERS = (
    SessionObserver(DepthRatingDesign, rate, seen_pictures),
    SessionObserver(NeckerDesign, watch, _cubes),
    SessionObserver(
        BlurThresholdDesign,
        lambda design, observer, who, seed, seen: choose(design, observer, who, seed, seen=seen),
        seen_intervals,
    ),
)
"""Observers of whole sessions; tasks with designs of other classes simulate their answers trial by trial."""


def _of_session(task: Task, design: Any) -> SessionObserver | None:
    return next((observer for observer in OBSERVERS if task.modelled and isinstance(design, observer.design)), None)


def seen(task: Task, design: Any, folder: Path | None, executor: Executor | None, progress: Progress) -> dict[str, Any]:
    """Return the stimuli of simulated observers: `encoded` and `stimuli` of `focalgradient.observers.simulate`.

    Parameters
    ----------
    task, design
        Task and design of the experiment.
    folder
        Folder of the pictures; None: small pictures are rendered, if the task uses any.
    executor
        Executor that encodes the pictures; None: this process.
    progress
        Function called with the completed fraction and a description of the work.
    """
    observer = _of_session(task, design)
    return {} if observer is None else observer.seen(design, folder, executor, progress)


def observe(
    task: Task, design: Any, observer: Observer, participant: str, seed: int, encoded: Any = None
) -> tuple[Any, ...]:
    """Return a simulated observer's answers to all trials of a participant, in chronological order."""
    if whole := _of_session(task, design):
        return whole.answers(design, observer, participant, seed, encoded)
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
