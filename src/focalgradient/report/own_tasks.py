"""The part of the report on a task of a laboratory's own: what was answered in each condition, and every trial."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from focalgradient.dataset import DataSet, read_dataset
from focalgradient.errors import InputError
from focalgradient.report.document import Block, Heading, Paragraph
from focalgradient.report.provenance import listed
from focalgradient.report.tables import Sheet, many
from focalgradient.statistics.means import t_interval
from focalgradient.tasks import Task

__all__ = ["OwnTask", "analyse_own_task", "methods_own_task", "own_task_part"]


@dataclass(frozen=True, slots=True, eq=False)
class OwnTask:
    """A task of a laboratory's own, read.

    Parameters
    ----------
    task
        Which.
    data, table
        Its part of the data set, and all its rows.
    simulated
        Whether observers were simulated.
    """

    task: Task
    data: DataSet
    table: pd.DataFrame
    simulated: bool

    @property
    def design(self) -> Mapping[str, Any]:
        """Settings of the first session."""
        first: Mapping[str, Any] = next(iter(self.data.sidecars.values()))["Design"]
        return first

    @property
    def shown(self) -> list[str]:
        """Columns of the conditions."""
        names = {one.name for one in dataclasses.fields(self.task.trial)}
        shared = {"trial", "repetition", "catch"}
        return [one.name for one in self.task.columns(self.design) if one.name in names - shared]

    @property
    def answered(self) -> list[tuple[str, str]]:
        """Columns of answers that have a mean, each with its unit."""
        names = {one.name for one in dataclasses.fields(self.task.answer)} - {"onset", "dropped_frames"}
        columns = [one for one in self.task.columns(self.design) if one.name in names and one.form != "text"]
        return [(one.name, one.units or ("share" if one.form == "bool" else "")) for one in columns]


def analyse_own_task(root: str | os.PathLike[str], task: Task) -> OwnTask:
    """Read the sessions of a task of one's own; damaged ones are left out, and named in `data`.

    Raises
    ------
    InputError
        If there are none.
    """
    data = read_dataset(root, [task.name], damaged="leave out")
    table = data.tables.get(task.name)
    if table is None or table.empty:
        raise InputError(data.problems[0] if data.problems else f"{root} holds no trials of {task.name}.")
    return OwnTask(task, data, table, data.simulated)


def own_task_part(part: OwnTask, sheets: list[Sheet]) -> Iterator[Block]:
    """What was found: the task's own sentences, and the means of each condition over subjects."""
    rows = part.table[~part.table["catch"]] if "catch" in part.table else part.table
    people = "simulated observer" if part.simulated else "subject"
    yield Heading(part.task.title)
    yield Paragraph(
        f"{many(rows['participant_id'].nunique(), people)} with {many(len(rows), 'trial')}; nobody is left out."
    )
    yield from map(Paragraph, part.task.findings(rows))
    sheet = _means(part, rows)
    sheets.append(sheet)
    if sheet.table:
        yield sheet.table


def _means(part: OwnTask, rows: pd.DataFrame) -> Sheet:
    """Mean answers of each condition over subjects, with 95 % intervals by t over subjects."""
    cells = []
    for condition, own in rows.groupby(part.shown, sort=True) if part.shown else [((), rows)]:
        names = [_text(value) for value in (condition if isinstance(condition, tuple) else (condition,))]
        for answer, unit in part.answered:
            means = own.groupby("participant_id")[answer].mean().astype(float).dropna()
            if means.empty:
                continue
            found = t_interval(means)
            ends = ["" if value is None else f"{value:.4g}" for value in (found.low, found.high)]
            cells.append([*names, answer, unit, str(len(means)), f"{found.estimate:.4g}", *ends])
    head = [*part.shown, "answer", "unit", "subjects", "mean", "low", "high"]
    return listed(f"{part.task.name}_means.csv", "Means over subjects, 95 % intervals by t", head, cells)


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def methods_own_task(part: OwnTask) -> list[str]:
    """Methods, for a paper."""
    conditions = " and ".join(part.shown) or "one condition"
    return [
        f"{part.task.title}. Each subject saw every condition ({conditions}) "
        f"{many(int(part.design.get('repetitions', 1)), 'time')}, in random order from the seed that the data set "
        "records. Answers were averaged within subject and condition; means are over subjects, with 95 % intervals by "
        "Student’s t. No hypothesis was tested."
    ]
