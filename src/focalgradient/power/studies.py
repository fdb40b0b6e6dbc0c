"""Power study of any task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from focalgradient.power.cube import CubeStudy
from focalgradient.power.latent import study_of_ratings
from focalgradient.power.own_tasks import TaskStudy
from focalgradient.power.study import AnyStudy
from focalgradient.power.thresholds import ThresholdStudy
from focalgradient.tasks import Task

__all__ = ["study_of"]

STUDIES: Mapping[str, Callable[[Any, Mapping[str, float], int], AnyStudy]] = {
    "depthrating": study_of_ratings,
    "necker": CubeStudy.of,
    "blurthreshold": ThresholdStudy.of,
}
"""Studies of the built-in tasks, used instead of `Task.study`."""


def study_of(task: Task, design: Any, assumed: Mapping[str, float], seed: int) -> AnyStudy:
    """Return the simulated experiment for the power of a task's tests: see `focalgradient.tasks.Task.study`."""
    study: Callable[..., AnyStudy | None] | None = STUDIES.get(task.name, task.study)
    return (study and study(design, assumed, seed)) or TaskStudy.of(task, design, assumed, seed)
