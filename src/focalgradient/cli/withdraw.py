"""``focalgradient withdraw``: a participant removed from a data set."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from focalgradient.cli.program import json_option, show

__all__ = ["withdraw"]


@click.command(short_help="Remove a participant from a data set.")
@click.argument("folder", metavar="DATASET", type=click.Path(path_type=Path))
@click.argument("participant", metavar="PARTICIPANT")
@click.option("--yes", is_flag=True, help="Do not ask, as a terminal is asked.")
@json_option
def withdraw(folder: Path, participant: str, yes: bool) -> None:
    """Remove all data of PARTICIPANT, as sub-07, from the data set in DATASET; they cannot be brought back.

    Tables, journals, what repairs kept, and rows of participants.tsv are removed. dataset_description.json keeps the
    label and the date. Copies and reports elsewhere are not reached: remove those, and make the reports anew.

    \b
    Example:
      focalgradient withdraw data sub-07
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.dataset import withdraw as remove

    if not yes and sys.stdin.isatty():
        click.confirm(f"Remove all data of {participant} from {folder} for good?", abort=True)
    paths = list(remove(folder, participant))
    show(
        {
            "participant": participant,
            "removed": [str(path) for path in paths if not path.is_file()],
            "removed_from": [str(path) for path in paths if path.is_file()],
        },
        *(f"Removed{' from' if path.is_file() else ''}: {path}" for path in paths),
        f"{participant} is withdrawn.",
    )
