"""How the columns of a user's table are read, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from focalgradient.statistics import own_detection, own_ratings, own_reports, own_thresholds
from focalgradient.statistics.own_conditions import holds_conditions, read_conditions
from focalgradient.statistics.own_files import Paths
from focalgradient.statistics.own_names import few
from focalgradient.statistics.own_numbers import factor_of
from focalgradient.statistics.own_tables import Source, Where

__all__ = ["explained_table"]

Roles = Mapping[str, tuple[str, ...]]

KINDS: tuple[tuple[str, Callable[[Paths, Mapping[str, str] | None], bool], Roles, Any], ...] = (
    ("reports on the cube", own_reports.holds_reports, own_reports.ROLES, own_reports.read_reports),
    ("answers to signal and noise", own_detection.holds_detection, own_detection.ROLES, own_detection.read_detection),
    ("answers at levels", own_thresholds.holds_thresholds, own_thresholds.ROLES, own_thresholds.read_thresholds),
    ("depth ratings", lambda path, columns: True, own_ratings.ROLES, own_ratings.read_ratings),
)
"""Kinds of tables: description, test, roles of the columns, and reader."""


def explained_table(
    paths: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    where: Where | None = None,
    by: Sequence[str] = (),
    order: Sequence[str] = (),
) -> list[str]:
    """Return lines that say what the table is taken for, and how each column is read.

    Raises
    ------
    InputError
        If the table cannot be read.
    """
    if by or (not any(kind[1](paths, columns) for kind in KINDS[:-1]) and holds_conditions(paths, columns)):
        own = Source.read(paths, own_ratings.ROLES, columns, where)
        by_condition = read_conditions(paths, columns, by, where, order=order)
        return [
            f"{own.name}: {len(own.cells):,} rows, taken for {len(by_condition.table):,} ratings by "
            f"{' and '.join(by_condition.conditions)}",
            *_columns(own, None),
            *by_condition.notices,
            *by_condition.notes,
        ]
    what, _, roles, read = next(kind for kind in KINDS if kind[1](paths, columns))
    wide = what == "depth ratings"
    given = own_ratings.long_columns(columns) if wide else columns
    own = Source.read(paths, roles, given, where)
    found = read(paths, columns, conditions, where=where, **({"order": order} if order else {}))
    said = [*getattr(found, "problems", ()), *found.notices, *found.notes]
    return [
        f"{own.name}: {len(own.cells):,} rows, taken for {len(found.table):,} {what}",
        *_columns(own, found.table if wide and "rating" not in own.columns else None),
        *said,
    ]


def _columns(own: Source, wide: Any) -> list[str]:
    """Return a line for each column: its role, the factor to the package's unit, and some cells."""
    roles = {name: role for role, name in own.columns.items()}
    ratings = set() if wide is None else {str(label[2]) for label in wide.index if len(label) > 2}
    lines = []
    for column in own.cells:
        name = str(column)
        role = "rating (one column a condition)" if name in ratings else roles.get(name, "not used")
        factor = factor_of(role, name) if name in roles else 1
        times = f", times {factor:g}" if factor != 1 else ""
        cells = few([cell for cell in own.cells[column].head(100) if cell.strip()][:60])
        lines.append(f"  {name or '(no name)'} -> {role}{times}: {cells[:80]}")
    return lines
