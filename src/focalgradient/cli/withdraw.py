"""``focalgradient withdraw``: removal of a participant from a data set."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import File, command
from focalgradient.cli.groups import STORE
from focalgradient.cli.program import show
from focalgradient.errors import check_installed

__all__ = ["withdraw"]


@command("Remove a participant from a data set.", TASK_FILE, force=False)
def withdraw(
    folder: Annotated[Path, "DATASET"],
    participant: str,
    /,
    *,
    yes: bool = False,
    links: File | None = None,
    store: Annotated[str | None, "URL"] = None,
) -> None:
    """Remove all data of PARTICIPANT, such as sub-07, from the data set in DATASET, irrecoverably.

    This removes tables, journals, copies made by repairs, rows of participants.tsv, links and platform identifiers. The
    number of withdrawals is kept, without label or date. A server may be running. Copies and reports elsewhere are not
    affected: remove those, and make the reports again. Do not reuse the label.

    \b
    Examples:
      focalgradient withdraw data sub-07
      focalgradient withdraw data sub-07 --store postgresql://lab@db.example.org/study

    Parameters
    ----------
    yes
        Do not ask for confirmation on a terminal.
    links
        File of links of 'focalgradient serve'. Default: beside the data, DATASET-links.jsonl, if it exists.
    store
        Also remove from this PostgreSQL database of 'focalgradient serve --store'.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.dataset.withdrawal import files_naming

    if not yes and sys.stdin.isatty():
        click.confirm(f"Remove all data of {participant} from {folder} permanently?", abort=True)
    stored = store is not None and _withdraw_from(store, participant)
    paths = fg.dataset.withdraw(folder, participant, links, elsewhere=stored)
    left = files_naming(folder, participant)
    show(
        {
            "participant": participant,
            "removed": [str(path) for path in paths if not path.is_file()],
            "removed_from": [str(path) for path in paths if path.is_file()],
            "removed_from_store": stored,
            "still_naming": [str(path) for path in left],
        },
        *(f"Removed{' from' if path.is_file() else ''}: {path}" for path in paths),
        *(["Removed from the store."] if stored else []),
        *(f"Still names {participant}: {path}: remove it, or make it again." for path in left),
        f"{participant} is withdrawn.",
    )


def _withdraw_from(store: str, participant: str) -> bool:
    check_installed(*STORE)
    from focalgradient.web.postgres import withdraw_from_store

    return withdraw_from_store(store, participant)
