"""A participant's trial list as a table for other programs, with the pictures that are drawn for it."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.design import Design
from focalgradient.design.given_list import trial_row
from focalgradient.stimuli.sets import StimulusSet, png_of
from focalgradient.tasks import Task, task_named
from focalgradient.tasks.steps import files_of, steps_of

__all__ = ["TrialList", "trial_list"]


@dataclass(frozen=True)
class TrialList:
    """Trials of one participant, as rows of a table, and drawn pictures as PNG files, by name.

    Examples
    --------
    >>> print(TrialList(({"trial": 1, "catch": True}, {"trial": 2, "scene": "room"}), {}).csv(), end="")
    trial,catch,scene
    1,true,
    2,,room
    """

    rows: Sequence[Mapping[str, Any]]
    pictures: Mapping[str, bytes]

    def csv(self, phase: str | None = None) -> str:
        """Return the trials, or those of one phase, as comma-separated values, with the columns of all."""
        columns = [*dict.fromkeys(name for row in self.rows for name in row)]
        written = io.StringIO()
        writer = csv.writer(written, lineterminator="\n")
        writer.writerow(columns)
        for row in self.rows:
            if phase is None or row["phase"] == phase:
                writer.writerow([_cell(row.get(name)) for name in columns])
        return written.getvalue()

    def files(self) -> dict[str, bytes]:
        """Return practice.csv, conditions.csv and the pictures, as file contents by name."""
        tables = {"practice.csv": "practice", "conditions.csv": "main"}
        return {**self.pictures, **{name: self.csv(phase).encode() for name, phase in tables.items()}}


def trial_list(
    design: Design,
    participant: str,
    session: str | None = None,
    *,
    stimuli: StimulusSet | None = None,
    pixels_per_degree: float | None = None,
) -> TrialList:
    """Return a participant's trials, practice first, with the pictures that each shows.

    Parameters
    ----------
    design
        Design of the session.
    participant, session
        Labels of letters and digits, such as "01".
    stimuli
        Set of pictures, to name their files.
    pixels_per_degree
        Resolution of the screen for which pictures are drawn; None: none are drawn.

    Returns
    -------
    TrialList
        The fields of each trial (`focalgradient.design.given_list.trial_row`); the column picture has the file that is
        shown, if there is one, and reference the file with which it is compared.

    Examples
    --------
    >>> from focalgradient.design import NeckerDesign
    >>> trial_list(NeckerDesign(), "01").rows[0]["phase"]
    'practice'
    """
    task, rows, drawn = task_named(design.task), [], dict[str, bytes]()
    for trial in design.trials(participant, session):
        row = trial_row(trial)
        seed = design.noise_seed(participant, trial, session)
        for column, shown in _pictures(task, design, trial, stimuli, pixels_per_degree, seed).items():
            if isinstance(shown, str):
                row[column] = shown
            elif pixels_per_degree is not None:
                row[column] = f"{trial.phase}-{trial.trial:03}{'' if column == 'picture' else '-' + column}.png"
                drawn[row[column]] = png_of(shown)
        rows.append(row)
    return TrialList(rows, drawn)


def _pictures(
    task: Task, design: Any, trial: Any, stimuli: StimulusSet | None, pixels_per_degree: float | None, seed: int
) -> dict[str, str | NDArray[np.uint8]]:
    """Return the pictures of a trial by column: files of the set and, at a resolution, drawn pixels."""
    found: dict[str, str | NDArray[np.uint8]] = {**files_of(task, design, trial, stimuli)}
    if pixels_per_degree is None or not task.described or task.adapts or task.adjusts:
        return found
    pictured = None if task.pictured is None else task.pictured(design, trial)
    if pictured is not None and (stimuli is None or not pictured):
        return found
    steps = steps_of(task, design, trial, pixels_per_degree, seed=seed, stimuli=stimuli, words=None)
    drawn = [(step.event, step.picture) for step in steps if isinstance(step.picture, np.ndarray)]
    if pictured is not None:
        return {**found, **dict(drawn)}
    return {f"picture_{n}" if n > 1 else "picture": picture for n, (_, picture) in enumerate(drawn, start=1)}


def _cell(value: Any) -> str:
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
