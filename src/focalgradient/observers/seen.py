"""Stimuli that simulated observers of any task look at."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from focalgradient.observers.intervals import seen_intervals
from focalgradient.observers.pictures import seen_pictures
from focalgradient.observers.rotation import encoded_cubes
from focalgradient.progress import Progress
from focalgradient.tasks import Task

__all__ = ["seen"]


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
    if task.name == "depthrating":
        return seen_pictures(design, folder, executor, progress)
    if task.name == "blurthreshold":
        return seen_intervals(design, folder, executor, progress)
    if task.name == "necker":
        progress(0.0, "encoding the cube")
        return {"encoded": encoded_cubes(design, executor)}
    return {}
