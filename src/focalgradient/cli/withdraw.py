"""``focalgradient withdraw``: a participant removed from a data set."""

from __future__ import annotations

import sys
from pathlib import Path

import click

__all__ = ["withdraw"]


@click.command(short_help="Remove a participant from a data set.")
@click.argument("folder", metavar="DATASET", type=click.Path(path_type=Path))
@click.argument("participant", metavar="PARTICIPANT")
@click.option("--yes", is_flag=True, help="Do not ask, as a terminal is asked.")
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
    for path in remove(folder, participant):
        click.echo(f"Removed{' from' if path.is_file() else ''}: {path}")
    click.echo(f"{participant} is withdrawn.")
