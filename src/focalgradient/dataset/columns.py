"""Cells of the long tables, and their columns, which the session's task defines."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from focalgradient.tasks import Column, task_named

__all__ = ["APERTURE", "FORMULA", "NOTED", "TIMES", "Column", "cell", "columns_of", "columns_stated"]

NOTED = "Noted"
"""Sidecar key that lists the columns of additional values."""


def _onset(name: str, about: str) -> Column:
    about = f"When {about}, on the clock of the sitting; n/a where none did."
    return Column(name, about, "number", "s", least=0, optional=True)


TIMES: tuple[Column, ...] = (
    Column("sitting_began", "Date and time (UTC) at which the sitting began.", "text", optional=True),
    _onset("mark_onset", "the mark to be fixated appeared, before the picture"),
    _onset("mask_onset", "the mask appeared, after the picture"),
    _onset("question_onset", "the question appeared"),
)
"""Columns of times, after those of the design; each is present if any trial has a value."""

APERTURE = re.compile(r"pinhole|f/\d+(\.\d+)?")

FORMULA = ("=", "+", "-", "@")
"""Initial characters by which spreadsheets recognise a formula."""


def cell(value: Any) -> str:
    """Format a value as a table cell: numbers with nine decimals, "n/a" if missing.

    A text that a spreadsheet would take for a formula is prefixed with an apostrophe; line breaks become spaces.

    >>> [cell(value) for value in (None, True, 3, 0.1 + 0.2, "f/22", "=1+1")]
    ['n/a', 'true', '3', '0.3', 'f/22', "'=1+1"]
    """
    kind = type(value)  # most frequent types first
    if kind is float:
        return repr(round(value, 9)) if value == value else "n/a"
    if kind is str:
        return _text_cell(value)
    if kind is int:
        return str(value)
    if isinstance(value, str):
        return _text_cell(str(value))
    if value is None or value != value:
        return "n/a"
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(round(value, 9)) if isinstance(value, float) else str(value)


@lru_cache(maxsize=4096)
def _text_cell(text: str) -> str:
    line = text if text.isprintable() else " ".join(text.split())
    return f"'{line}" if line.startswith(FORMULA) else line


def columns_of(task: str, design: Mapping[str, Any] | None) -> tuple[Column, ...]:
    """Return the columns of a session's table, given the design as recorded.

    Raises
    ------
    InputError
        If the task or its scale is unknown.

    Examples
    --------
    >>> names = [column.name for column in columns_of("depthrating", {"scale": "choice", "factors": {}})]
    >>> "interval" in names, "start" in names, len(columns_of("depthrating", {}))
    (True, True, 14)
    """
    return task_named(task).columns(design)


def columns_stated(task: str, sidecar: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns of a session's table by its sidecar: of the design, of times, of additional values.

    >>> stated = {"Noted": ["interest"], "interest": {"Description": "How interesting.", "Format": "number"}}
    >>> columns_stated("depthrating", stated)[-1].name
    'interest'
    """
    names = sidecar.get(NOTED, ())
    noted = [name for name in names if isinstance(sidecar.get(name), dict)] if isinstance(names, list) else []
    timed = (column for column in TIMES if column.name in sidecar and column.name not in noted)
    return (*columns_of(task, sidecar.get("Design")), *timed, *(Column.noted(name, sidecar[name]) for name in noted))
