"""``focalgradient collect``: import of an exported study's results from platforms into a data set."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import Folder, command
from focalgradient.cli.groups import SERVER, STORE
from focalgradient.cli.program import show
from focalgradient.errors import InputError, check_installed

__all__ = ["collect"]


@command("Import answers from JATOS, DataPipe or Pavlovia.", TASK_FILE, force=False)
def collect(
    files: Annotated[tuple[Path, ...], "FILES..."] = (),
    /,
    *,
    data: Folder,
    stimuli: Folder | None = None,
    store: Annotated[str | None, "URL"] = None,
) -> None:
    """Import the answers of a study exported with 'serve --export' into a data set, as journals and tables of 'serve'.

    With --store, import those that 'serve --store' keeps in a PostgreSQL database, also while servers use it. FILES are
    the platform's files, unchanged: JATOS's results as plain text, ZIP or results archive; the CSV or JSON files of
    DataPipe at the OSF, and of Pavlovia, individually or as ZIP. Answers that the data set already has are not added
    twice. An unfinished session is imported as far as it went, and extended by later imports.

    Everything is checked before anything is written: trial lists against the design, answers against their scale. Exit
    code 1: a session, or the end of one, was left out. Takes about 10 s for 40 sessions of 100 trials.

    \b
    Examples:
      focalgradient collect jatos_results.txt --stimuli pictures --data data
      focalgradient collect osf-files.zip --data data
      focalgradient collect data/*.csv --stimuli pictures --data study
      focalgradient collect --store postgresql://lab@db.example.org/study --data data

    Parameters
    ----------
    data
        Folder of the data set.
    stimuli
        Folder of the study's pictures, for depth rating.
    store
        Import from the database of 'focalgradient serve --store' instead of FILES.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    if bool(files) == (store is not None):
        raise InputError("FILES and --store are both given or both missing: give one of them.")
    check_installed(*SERVER)
    if store is not None:
        check_installed(*STORE)
        from focalgradient.web.postgres import collect_store

        added = collect_store(store, data)
        lines = [f"sub-{participant}: {count} new lines" for participant, count in added.items()]
        show({"data": str(data), "added": added}, *lines, f"Sessions in {data}: {len(added)}.")
        return

    sessions, left = fg.web.collect(files, data, stimuli)
    lines = [
        f"sub-{one.participant}: {one.answered} of {one.trials} trials"
        f"{'' if one.answered == one.trials else ' (incomplete)'}, {one.added} new"
        for one in sessions
    ]
    lines += [f"Left out: session {one.session}: {one.why}" for one in left]
    lines.append(f"Sessions in {data}: {len(sessions)}; answers added: {sum(one.added for one in sessions)}.")
    content = {"data": str(data), "sessions": [*map(asdict, sessions)], "left_out": [*map(asdict, left)]}
    show(content, *lines)
    if left:
        click.get_current_context().exit(1)
