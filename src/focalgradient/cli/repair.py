"""``focalgradient repair``: repair of damaged sessions of a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import command
from focalgradient.cli.program import show

__all__ = ["repair"]


@command("Make damaged sessions of a data set readable.", TASK_FILE, force=False)
def repair(folder: Annotated[Path, "DATASET"], /) -> None:
    """Make the damaged sessions of the data set in DATASET readable.

    Original files are kept beside the journal, in sourcedata, as FILE.original. Omitted are lines that are invalid or
    were changed after they were written, second records of a trial, and trials that the design does not have; the
    journal, its sidecar and 'focalgradient validate' list them. Exit code 1: a session could not be repaired.

    \b
    Example:
      focalgradient repair data
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    found = fg.dataset.repair(folder)
    lines = []
    for one in found:
        if one.problem:
            lines.append(f"Problem: {one.problem}")
            continue
        lines.append(f"Repaired: {one.journal}")
        lines += [f"  {sentence}" for sentence in one.done]
        lines += [f"  Original: {original}" for original in one.originals]
    sessions = [
        {
            "journal": str(one.journal),
            "problem": one.problem or None,
            "done": list(one.done),
            "originals": [str(original) for original in one.originals],
        }
        for one in found
    ]
    show({"sessions": sessions}, *(lines or ["Nothing needs repair."]))
    if any(one.problem for one in found):
        click.get_current_context().exit(1)
