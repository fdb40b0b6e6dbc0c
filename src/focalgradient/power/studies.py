"""Power study of any task."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from focalgradient.errors import InputError
from focalgradient.power.cube import CubeModel
from focalgradient.power.latent import LatentModel
from focalgradient.power.own_tasks import Observers
from focalgradient.power.ratings import Model
from focalgradient.power.study import People, Study
from focalgradient.power.thresholds import ThresholdModel
from focalgradient.statistics.questions import Kind
from focalgradient.tasks import Task

__all__ = ["study_of"]

MODELS: Mapping[Kind, Callable[[Any], type[People]]] = {
    "ratings": lambda design: Model if design.response_scale.analysis.ratios else LatentModel,
    "cube": lambda design: CubeModel,
    "thresholds": lambda design: ThresholdModel,
}
"""Models of people, by the kind of the task's analysis."""


def study_of(task: Task, design: Any, assumed: Mapping[str, Any], seed: int = 1) -> Study:
    """Return the simulated experiment for the power of a task's tests: see `focalgradient.tasks.Task.study`.

    Raises
    ------
    InputError
        If an assumed value does not apply to the task, or is out of range.

    Examples
    --------
    >>> from focalgradient.tasks import task_named
    >>> task = task_named("depthrating")
    >>> study_of(task, task.design(scale="choice"), {"effect": 2.0}).tests["near_rise"]
    'nearest: depth effect'
    """
    study: Study | None = task.study and task.study(design, assumed, seed)
    if study:
        return study
    model = MODELS.get(task.analysis(design).kind)
    if model is None:
        if assumed:
            option = next(iter(assumed))
            raise InputError(
                f"{option} cannot be set for {task.called}, whose method 'simulated' sets the effect: change it there."
            )
        return Study(Observers(task), design, seed=seed)
    kind = model(design)
    bound = {"bound": assumed["bound"]} if kind.bounded and "bound" in assumed else {}
    known = {one.name for one in dataclasses.fields(kind)}  # type: ignore[arg-type]
    if wrong := [name for name in assumed if name not in {*known, *bound}]:
        raise InputError(f"{wrong[0]} cannot be set for {task.called}, whose model does not have it: leave it out.")
    return Study(kind(**{name: value for name, value in assumed.items() if name in known}), design, **bound, seed=seed)
