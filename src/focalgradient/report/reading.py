"""Kinds of the user's tables: how the columns of each are read, and its section of the report."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import Any, NamedTuple

from focalgradient.errors import InputError
from focalgradient.report.analysed import analyse_report_table, analyse_table
from focalgradient.report.conditions import conditions_of_table
from focalgradient.report.cube import cube_part
from focalgradient.report.detection import detection_part
from focalgradient.report.parts import Asked, Part
from focalgradient.report.ratings import rating_part
from focalgradient.report.thresholds import thresholds_of_table
from focalgradient.scales import Choices
from focalgradient.statistics import OwnRatings, read_detection, read_ratings, read_reports, read_thresholds
from focalgradient.user_tables.conditions import holds_conditions, read_conditions
from focalgradient.user_tables.files import Paths, UserTable, chosen_rows, read_table
from focalgradient.user_tables.names import few
from focalgradient.user_tables.numbers import factor_of
from focalgradient.user_tables.reports import holds_reports
from focalgradient.user_tables.schema import CUBE, DETECTION, GIVEN_AS, THRESHOLDS, Schema
from focalgradient.user_tables.schema import RATINGS as RATING_TABLE
from focalgradient.user_tables.source import Source, Where, columns_like, holds
from focalgradient.user_tables.wide import long_columns

__all__ = ["RATINGS", "Kind", "explained_table", "kind_of", "refuse_unused"]

LEVELS, RATINGS, BY = "answers at levels", "depth ratings", "ratings"
"""Descriptions of the content of tables."""

SHOWN = 60
"""Maximum number of characters of the cells of a column in an explanation."""


class Kind(NamedTuple):
    """Kind of table: content, test for it, schema, reader, section of the report, and settings of the analysis."""

    what: str
    holds: Callable[[Paths, Mapping[str, str] | None], bool]
    schema: Schema
    reader: Callable[..., Any]
    part: Callable[[Any, Asked], Part]
    further: frozenset[str] = frozenset()

    def read(self, paths: Paths, given: Mapping[str, Any]) -> Any:
        """Read a table by those of the given options that its reader has."""
        return self.reader(paths, **{name: given[name] for name in signature(self.reader).parameters if name in given})

    @property
    def settings(self) -> Collection[str]:
        """Settings of `make_report` that apply."""
        return {*signature(self.reader).parameters, *self.further}


def _of_ratings(own: OwnRatings, asked: Asked) -> Part:
    """Analyse ratings by aperture and fixation of the user's own table."""
    asked = replace(asked, scale=Choices() if asked.scale is None and own.choices else asked.scale)
    bound, scale, rules, progress = asked.used_bound, asked.scale, asked.rules, asked.progress
    analysed = analyse_table(own.table, bound=bound, scale=scale, rules=rules, progress=progress)
    return rating_part(analysed, asked, own.exported)


KINDS = (
    Kind(
        "reports on the cube",
        holds_reports,
        CUBE,
        read_reports,
        lambda own, asked: cube_part(analyse_report_table(own.table, rules=asked.rules), own.exported),
    ),
    Kind(
        "answers to signal and noise",
        partial(holds, DETECTION),
        DETECTION,
        read_detection,
        lambda own, _: detection_part(own),
    ),
    Kind(
        LEVELS,
        partial(holds, THRESHOLDS),
        THRESHOLDS,
        read_thresholds,
        lambda own, _: thresholds_of_table(own),
        frozenset({"guess_rate"}),
    ),
    Kind(
        BY,
        holds_conditions,
        RATING_TABLE,
        read_conditions,
        lambda own, asked: conditions_of_table(own, asked.rules),
        frozenset({"scale"}),
    ),
    Kind(
        RATINGS,
        lambda *_: True,
        RATING_TABLE,
        read_ratings,
        _of_ratings,
        frozenset({"scale", "bound", "bayes"}),
    ),
)
"""Kinds of tables; each but the last is recognised before the next."""


def kind_of(table: UserTable, columns: Mapping[str, str] | None = None, by: Sequence[str] = ()) -> Kind:
    """Return the kind of a table; `by` conditions, answers at levels or ratings are analysed.

    If a name in `columns` is none of this kind, the kind is that of most of the names.
    """
    found = next(kind for kind in KINDS if kind.holds(table, columns))
    given = {GIVEN_AS.get(name, name) for name in columns or {}}
    if not given <= {*found.schema.columns}:
        found = max((found, *KINDS), key=lambda kind: len(given & {*kind.schema.columns}))
    return next(kind for kind in KINDS if kind.what == BY) if by and found.what != LEVELS else found


NEEDS = {
    **dict.fromkeys(("by", "where"), "tables"),
    "guess_rate": LEVELS,
    "order": "answers in words in a table",
    **dict.fromkeys(("scale", "bound", "bayes", "focal_length_mm"), "depth ratings by aperture and fixation"),
}
"""What settings are for."""


def refuse_unused(name: str, content: str, given: Mapping[str, object], applied: Collection[str]) -> None:
    """Raise `InputError` for a given setting that does not apply to what a table or data set contains."""
    for setting, value in given.items():
        is_given = value is not None and value is not False and value not in ((), {})
        if is_given and setting not in applied:
            raise InputError(f"{setting} is for {NEEDS[setting]}, but {name} {content}: leave it out.")


def explained_table(
    paths: Paths,
    columns: Mapping[str, str] | None = None,
    conditions: Mapping[str, str] | None = None,
    where: Where | None = None,
    by: Sequence[str] = (),
    order: Sequence[str] = (),
    guess_rate: float | None = None,
    *,
    steps: bool = False,
) -> Iterator[str]:
    """Yield lines that say what the table is taken for, and how each column is read.

    Raises
    ------
    InputError
        If the table cannot be read; if its columns can be named, after their lines and those of missing ones.
    """
    table = chosen_rows(read_table(paths), where, (columns or {}).values())
    kind = kind_of(table, columns, by)
    given = {
        "columns": columns,
        "conditions": conditions,
        "by": by,
        "order": order,
        "guess": guess_rate,
        "steps": steps,
    }
    refuse_unused("the table", f"contains {kind.what}", {"order": tuple(order)}, kind.settings)
    is_wide = kind.schema is RATING_TABLE
    source = Source.read(table, kind.schema, long_columns(columns) if is_wide else columns)
    rows = f"{source.name}: {len(source.cells):,} rows, taken for"
    try:
        own = kind.read(table, given)
    except InputError:
        yield f"{rows} {kind.what}"
        yield from _columns(source)
        for role in source.missing():
            also = {"fixation": ", if there is one", "aperture": ', or other conditions with by=["NAME"]'}.get(role, "")
            yield f"  (no column) -> {role}: {columns_like(role)}{also}"
        raise
    varied = [*own.conditions] if kind.what == BY else []
    if "rating" in source.columns:
        source = source.without_pictures(varied)
    yield f"{rows} {len(own.table):,} {kind.what}{' by ' * bool(varied)}{' and '.join(varied)}"
    yield from _columns(source, own.table if is_wide and "rating" not in source.columns else None, varied)
    yield from (*own.problems, *own.notices, *own.notes)


def _columns(source: Source, wide: Any = None, varied: Collection[str] = ()) -> Iterator[str]:
    """Yield a line for each column: its role, the factor to the package's unit, and some cells."""
    roles = {name: role for role, name in source.columns.items()} | dict.fromkeys(varied, "condition (by)")
    ratings = set() if wide is None else {str(label[2]) for label in wide.index if len(label) > 2}
    for column in source.cells:
        name = str(column)
        role = "rating (one column a condition)" if name in ratings else roles.get(name, "not used")
        units = source.schema.columns[role].units if role in source.schema.columns else {}
        factor = factor_of(role, units, name) if name in roles else 1
        times = f", times {factor:g}" if factor != 1 else ""
        cells = [cell.strip() for cell in source.cells[column].unique()]
        yield f"  {name or '(no name)'} -> {role}{times}: {few(cells, '; ', SHOWN)}"
