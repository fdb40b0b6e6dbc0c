"""Columns of the long tables, which the session's task defines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from focalgradient.files.columns import Column
from focalgradient.tasks import task_named
from focalgradient.tasks.columns import TIMES

__all__ = ["NOTED", "columns_stated"]

NOTED = "Noted"
"""Sidecar key that lists the columns of additional values."""


def columns_stated(task: str, sidecar: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns of a session's table by its sidecar: of the design, of times, of additional values.

    >>> stated = {"Noted": ["interest"], "interest": {"Description": "How interesting.", "Format": "number"}}
    >>> columns_stated("depthrating", stated)[-1].name
    'interest'
    """
    names = sidecar.get(NOTED, ())
    noted = [name for name in names if isinstance(sidecar.get(name), dict)] if isinstance(names, list) else []
    timed = (column for column in TIMES if column.name in sidecar and column.name not in noted)
    return (
        *task_named(task).columns(sidecar.get("Design")),
        *timed,
        *(Column.noted(name, sidecar[name]) for name in noted),
    )
