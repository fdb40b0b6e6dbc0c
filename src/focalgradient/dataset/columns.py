"""Columns of the long tables, which the session's task defines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from focalgradient.files.columns import Column
from focalgradient.tasks import task_named
from focalgradient.tasks.columns import TIMES

__all__ = ["NOTED", "columns_of", "columns_stated"]

NOTED = "Noted"
"""Sidecar key that lists the columns of additional values."""


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
