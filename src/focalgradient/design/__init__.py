"""Designs of the experiments: conditions, trial order, catch trials, practice and breaks, determined by one seed.

A design is read from a TOML file; its trial list for a participant is the same on every machine. No window is needed.
The package contains settings files for the paper's designs and for blur thresholds, as templates (`design_text`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from focalgradient.design.adaptive import ConstantStimuli, Quest, Staircase, answers_of, weighted_staircase
from focalgradient.design.blur_threshold import BlurThresholdDesign, BlurTrial, Judged
from focalgradient.design.counterbalanced import Counterbalanced, balanced_latin_square
from focalgradient.design.depth_rating import DepthRatingDesign, DepthTrial, Fixation
from focalgradient.design.factors import Factor
from focalgradient.design.necker import Direction, Gradient, NeckerDesign, NeckerTrial, Shape
from focalgradient.design.order import Place, check_label
from focalgradient.design.pinhole import Form, Pinhole, PinholeTrial, Viewing
from focalgradient.design.plan import Phase, Plan, Trial
from focalgradient.design.procedure import Procedure
from focalgradient.errors import InputError, suggestion
from focalgradient.files import read_toml
from focalgradient.tables import check_table, shown
from focalgradient.tasks import is_task, task_named, task_names

__all__ = [
    "BlurThresholdDesign",
    "BlurTrial",
    "ConstantStimuli",
    "Counterbalanced",
    "DepthRatingDesign",
    "DepthTrial",
    "Design",
    "Direction",
    "Factor",
    "Fixation",
    "Form",
    "Gradient",
    "Judged",
    "NeckerDesign",
    "NeckerTrial",
    "Phase",
    "Pinhole",
    "PinholeTrial",
    "Place",
    "Plan",
    "Procedure",
    "Quest",
    "Shape",
    "Staircase",
    "Trial",
    "Viewing",
    "answers_of",
    "balanced_latin_square",
    "check_design",
    "check_label",
    "design_of",
    "design_text",
    "load_design",
    "weighted_staircase",
]

Design = DepthRatingDesign | NeckerDesign | Pinhole | BlurThresholdDesign | Plan
"""Built-in designs, and those of user-defined tasks."""


def design_text(name: str) -> str:
    """Return the text of a design's settings file: all settings of the paper's design, with comments.

    Parameters
    ----------
    name
        Name of a task on the command line: "depth-rating", "necker", "pinhole", "blur-threshold", or a user-defined
        task.

    Raises
    ------
    InputError
        If there is no task of that name.

    Examples
    --------
    >>> design_text("necker").splitlines()[0]
    '# Experiment 2: does the rotating Necker cube look rigid, or does it wobble, by its focal gradient?'
    """
    task = task_named(name)
    if task.settings_file:
        return (files(__name__) / "files" / f"{task.settings_file}.toml").read_text(encoding="utf-8")
    settings = task.design().model_dump(mode="json")
    lines = [f"{key} = {_toml(value)}" for key, value in settings.items() if not isinstance(value, dict)]
    return "\n".join([f"# {task.title}", *lines]) + "\n"


def _toml(value: Any) -> str:
    """Format a value for a settings file.

    >>> _toml(["a", 1.5, True])
    '["a", 1.5, true]'
    """
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"' if isinstance(value, str) else repr(value)


def load_design(path: str | os.PathLike[str]) -> Design:
    """Read a design from its TOML file.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, has unknown or invalid keys, or cannot be run.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "own.toml").write_text(design_text("depth-rating"))
    ...     design = load_design(Path(folder, "own.toml"))
    >>> design.task, len(design.trials("01", "1"))
    ('depthrating', 204)
    """
    if (name := str(path)) in {task_named(label).called for label in task_names()} and not Path(path).exists():
        raise InputError(
            f"{name} is the name of a task, not of a design's file: write its design to a file, with "
            "'focalgradient run TASK --print-design'."
        )
    return check_design(str(path), read_toml(Path(path)))


def design_of(task: str, path: str | os.PathLike[str] | None) -> Design:
    """Read a design of one task from its TOML file; without a file, return the paper's design of that task.

    Raises
    ------
    InputError
        As for `load_design`, and if the file is a design of another task.

    Examples
    --------
    >>> design_of("necker", None).task
    'necker'
    """
    if path is None:
        default: Design = task_named(task).design()
        return default
    found = load_design(path)
    if found.task != task:
        raise InputError(
            f"{path} is a design of {task_named(found.task).called}, but must be one of {task_named(task).called}: "
            "give another design."
        )
    return found


def check_design(name: str, data: Mapping[str, Any]) -> Design:
    """Create a design from a table of settings, which messages refer to as `name`.

    Raises
    ------
    InputError
        As for `load_design`.

    Examples
    --------
    >>> check_design("mine", {"task": "necker", "repetitions": 3}).repetitions
    3
    """
    task = data.get("task")
    if not is_task(task):
        known = ", ".join(map(repr, task_names()))
        given = f"task is {shown(task)}, but must be" if "task" in data else "task is missing: give"
        raise InputError(f"{name}: {given} one of {known}{suggestion(task, task_names())}")
    made: Design = check_table(name, dict(data), task_named(str(task)).design)
    return made
