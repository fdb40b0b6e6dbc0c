"""Options of designs: files of user-defined tasks, and lists of trials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from focalgradient.errors import InputError, check_one_of
from focalgradient.tasks import task_named, task_names
from focalgradient.tasks.registry import load_file

__all__ = ["TASK_FILE", "simulated_task", "with_trials"]


def _load(_: click.Context, __: click.Parameter, files: tuple[Path, ...]) -> None:
    """Load task files, before other options are parsed that may name their tasks."""
    for file in files:
        load_file(file)


def simulated_task(argument: str, given: str) -> str:
    """Return the name of a task with simulated observers, by its name or Python file."""
    name = task_named(given).called if given.endswith(".py") else given
    tasks = [task_named(each) for each in task_names()]
    name = next((task.called for task in tasks if task.name == name), name)
    known = [task.called for task in tasks if task.simulates]
    if name not in known and any(task.called == name for task in tasks):
        raise InputError(
            f"{argument} is {name!r}, a task without simulated observers: give one of {', '.join(known)}, or define "
            "simulated in the class of a task of your own."
        )
    check_one_of(argument, name, known)
    return name


TASK_FILE = click.Option(
    ["--task-file"],
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_load,
    help="Python file of a user-defined task to which data or design belong. Repeatable.",
)
"""Option that makes user-defined tasks known to a command."""


def with_trials(design: Any, trials: Path | None) -> Any:
    """Return a design with the trials of a table instead of its own, if one is given."""
    from focalgradient.design.given_list import read_trials

    return design if trials is None else design.with_trials(str(trials), read_trials(trials))
