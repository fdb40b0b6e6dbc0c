"""``focalgradient trials``: the trial list of one participant, as a table for other programs."""

from __future__ import annotations

import csv
import io
from typing import Annotated, Any

import click

from focalgradient.cli.design_options import TASK_FILE
from focalgradient.cli.generate import Folder, command
from focalgradient.errors import InputError
from focalgradient.files import printable, write_whole

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
    from focalgradient.design.given_list import trial_row
    from focalgradient.stimuli import read_set
    from focalgradient.stimuli.sets import png
    from focalgradient.tasks import task_named

    made = _design(design)
    task = task_named(made.task)
    pictures = None if stimuli is None else read_set(stimuli)
    if files is not None and files.exists() and any(files.iterdir()):
        raise InputError(f"{printable(files)} contains files already: give a new folder.")
    contents: dict[str, bytes] = {}
    rows = []
    for trial in made.trials(participant, session):
        row = trial_row(trial)
        drawn = f"{trial.phase}-{trial.trial:03}"
        for column, shown in task.pictures(
            made, trial, pictures, pixels_per_degree if files is not None else None
        ).items():
            if isinstance(shown, str):
                row[column] = shown
            elif files is not None:
                row[column] = f"{drawn}{'' if column == 'picture' else '-' + column}.png"
                contents[row[column]] = png(shown)
        rows.append(row)
    columns = [*dict.fromkeys(name for row in rows for name in row)]
    if files is not None:
        for name, phase in (("practice", "practice"), ("conditions", "main")):
            contents[f"{name}.csv"] = _csv(columns, [row for row in rows if row["phase"] == phase]).encode()
        files.mkdir(parents=True, exist_ok=True)
        for name, content in contents.items():
            write_whole(files / name, content)
    click.echo(_csv(columns, rows), nl=False)


def _design(given: str) -> Any:
    """Return the design of a settings file, or the default one of a task."""
    from focalgradient.design import load_design
    from focalgradient.tasks import task_named

    return load_design(given) if given.endswith(".toml") else task_named(given).design()


def _csv(columns: list[str], rows: list[dict[str, Any]]) -> str:
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([_cell(row.get(name)) for name in columns])
    return written.getvalue()


def _cell(value: Any) -> str:
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
