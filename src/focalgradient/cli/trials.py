"""``focalgradient trials``: the trial list of one participant, as a table for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

import focalgradient as fg
from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import Folder, command
from focalgradient.design.words import load_words
from focalgradient.errors import InputError
from focalgradient.files import printable, write_whole
from focalgradient.tasks import task_named

__all__ = ["trials"]


@command("Write a participant's trial list as a table.", TASK_FILE, json=False, force=False)
def trials(
    design: str,
    /,
    *,
    participant: Annotated[str, "LABEL"],
    session: Annotated[str | None, "LABEL"] = None,
    stimuli: Folder | None = None,
    files: Folder | None = None,
    pixels_per_degree: Annotated[float, click.FloatRange(1, 1000)] = 37.5,
) -> None:
    """Print a participant's trials, practice first, as CSV with one row per trial: for PsychoPy Builder, OpenSesame.

    DESIGN is a settings file (TOML), the name of a task for its default design, or the Python file of a task. The
    columns are the fields of a trial; the column picture has the file that is shown, if there is one, and reference the
    file with which it is compared. 'run', 'serve' and 'simulate' accept such a table, as CSV or XLSX, with --trials
    FILE; an additional column participant assigns rows to participants. Takes about a second, with --files a little
    longer.

    \b
    Examples:
      focalgradient trials depth-rating --participant 01 > conditions.csv
      focalgradient trials necker --participant 02

    Parameters
    ----------
    participant
        Label of the participant: letters and digits, such as 01.
    session
        Label of the session, for participants with more than one.
    stimuli
        Folder of the set of pictures, to name their files.
    files
        New folder for conditions.csv, practice.csv, and PNG files of drawings and of user-defined tasks' stimuli.
    pixels_per_degree
        Resolution of the screen, for --files.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    chosen = fg.design.load_design(design) if design.endswith(".toml") else task_named(design).design()
    load_words(chosen.language, Path(design).parent)  # a list is made for a session, which needs all texts
    pictures = None if stimuli is None else fg.stimuli.read_set(stimuli)
    if files is not None and files.exists() and any(files.iterdir()):
        raise InputError(f"{printable(files)} contains files already: give a new folder.")
    resolution = None if files is None else pixels_per_degree
    found = fg.stimuli.trial_list(chosen, participant, session, stimuli=pictures, pixels_per_degree=resolution)
    if files is not None:
        files.mkdir(parents=True, exist_ok=True)
        for name, content in found.files().items():
            write_whole(files / name, content)
    click.echo(found.csv(), nl=False)
