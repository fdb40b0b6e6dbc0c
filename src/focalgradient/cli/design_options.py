"""Options of designs: files of user-defined tasks, and lists of trials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

__all__ = ["task_file_option", "trials_option", "with_trials"]


def _load(_: click.Context, __: click.Parameter, files: tuple[Path, ...]) -> None:
    """Load task files, before other options are parsed that may name their tasks."""
    from focalgradient.tasks.registry import load_file

    for file in files:
        load_file(file)


task_file_option = click.option(
    "--task-file",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    is_eager=True,
    expose_value=False,
    callback=_load,
    help="Python file of a user-defined task to which data or design belong. Repeatable.",
)
"""Decorator that adds ``--task-file``, which makes user-defined tasks known to a command."""


trials_option = click.option(
    "--trials",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="List of trials instead of the design's own (CSV or XLSX), in the format of 'focalgradient trials'.",
)
"""Decorator that adds ``trials``, a table for `with_trials`."""


def with_trials(design: Any, trials: Path | None) -> Any:
    """Return a design with the trials of a table instead of its own, if one is given."""
    from focalgradient.design.given_list import read_trials

    return design if trials is None else design.with_trials(str(trials), read_trials(trials))
