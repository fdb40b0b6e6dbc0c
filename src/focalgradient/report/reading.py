"""How the columns of a user's table are read, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from focalgradient.errors import InputError
from focalgradient.statistics import own_detection, own_ratings, own_reports, own_thresholds
from focalgradient.statistics.own_conditions import holds_conditions, read_conditions
from focalgradient.statistics.own_files import Paths
from focalgradient.statistics.own_names import few
from focalgradient.statistics.own_numbers import factor_of
from focalgradient.statistics.own_tables import Source, Where

__all__ = ["CUBE", "LEVELS", "RATINGS", "SIGNALS", "content_of", "explained_table"]

CUBE, SIGNALS, LEVELS = "reports on the cube", "answers to signal and noise", "answers at levels"
RATINGS = "depth ratings"
"""Descriptions of the content of tables."""

Roles = Mapping[str, tuple[str, ...]]

KINDS: tuple[tuple[str, Callable[[Paths, Mapping[str, str] | None], bool], Roles, Any], ...] = (
    (CUBE, own_reports.holds_reports, own_reports.ROLES, own_reports.read_reports),
    (SIGNALS, own_detection.holds_detection, own_detection.ROLES, own_detection.read_detection),
    (LEVELS, own_thresholds.holds_thresholds, own_thresholds.ROLES, own_thresholds.read_thresholds),
    (RATINGS, lambda path, columns: True, own_ratings.ROLES, own_ratings.read_ratings),
)
"""Kinds of tables: description, test, roles of the columns, and reader."""


def content_of(paths: Paths, columns: Mapping[str, str] | None = None) -> str:
    """Return the description of what a table contains."""
    return next(kind[0] for kind in KINDS if kind[1](paths, columns))


def explained_table(
    paths: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    where: Where | None = None,
    by: Sequence[str] = (),
    order: Sequence[str] = (),
    guess_rate: float | None = None,
) -> list[str]:
    """Return lines that say what the table is taken for, and how each column is read.

    Raises
    ------
    InputError
        If the table cannot be read.
    """
    what = content_of(paths, columns)
    if order and what in (CUBE, LEVELS):
        raise InputError(f"order is for answers in words, but the table contains {what}: leave it out.")
    if by or (what == RATINGS and holds_conditions(paths, columns)):
        own = Source.read(paths, own_ratings.ROLES, columns, where)
        by_condition = read_conditions(paths, columns, by, where, order=order)
        return [
            f"{own.name}: {len(own.cells):,} rows, taken for {len(by_condition.table):,} ratings by "
            f"{' and '.join(by_condition.conditions)}",
            *_columns(own, None),
            *by_condition.notices,
            *by_condition.notes,
        ]
    _, _, roles, read = next(kind for kind in KINDS if kind[0] == what)
    wide = what == RATINGS
    options = {"guess": guess_rate} if what == LEVELS else {"order": order} if what != CUBE else {}
    given = own_ratings.long_columns(columns) if wide else columns
    own = Source.read(paths, roles, given, where)
    found = read(paths, columns, conditions, where=where, **options)
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
