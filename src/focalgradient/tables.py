"""Validation of tables of settings files, with messages in one sentence."""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic.fields import FieldInfo

from focalgradient.errors import InputError, described

__all__ = ["Table", "check_table", "load_table", "shown"]


class Table(BaseModel):
    """Base class of the tables of settings files; rejects unknown keys.

    The description of each field completes "..., but must be " and "... is missing: give "; without one it follows from
    the field's type and bounds. A table's own validator raises ValueError with the rest of the sentence.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _lists(cls, data: Any) -> Any:
        """Convert lists of a settings file or journal to tuples, where fields declare them."""
        if not isinstance(data, dict):
            return data
        tuples = {field.alias or name for name, field in cls.model_fields.items() if _is_tuple(field.annotation)}
        return {key: tuple(one) if key in tuples and isinstance(one, list) else one for key, one in data.items()}

    @classmethod
    def nested(cls) -> dict[str, type[Table]]:
        """Return the classes of nested tables, also within lists and dictionaries, by key."""
        within = {field.alias or name: _table_in(field.annotation) for name, field in cls.model_fields.items()}
        return {key: kind for key, kind in within.items() if kind is not None}


BOUNDS = ("ge", "le")
"""Names of the bounds of a whole number in pydantic's metadata."""


def _is_tuple(annotation: Any) -> bool:
    """Return whether a type is a tuple, or one of its alternatives is."""
    return get_origin(annotation) is tuple or any(get_origin(part) is tuple for part in get_args(annotation))


def _expected(field: FieldInfo) -> str | None:
    """Return what a field must be: its description, or what follows from its type and bounds."""
    kind, parts = field.annotation, get_args(field.annotation)
    if field.description is not None:
        return field.description
    if kind is bool:
        return "true or false"
    if kind is int:
        least, most = (
            next((getattr(one, name) for one in field.metadata if hasattr(one, name)), None) for name in BOUNDS
        )
        return f"a whole number of {least or 0} or more" if most is None else f"a whole number from {least} to {most}"
    if get_origin(kind) is Literal:
        return _listed(parts, "or")
    if get_origin(kind) is tuple and get_origin(parts[0]) is Literal:
        return f"a list of {_listed(get_args(parts[0]), 'and')}"
    return None


def _listed(names: tuple[Any, ...], last: str) -> str:
    *first, end = map(repr, names)
    return f"{', '.join(first)} {last} {end}" if first else end


def _table_in(annotation: Any) -> type[Table] | None:
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation
    return next(filter(None, map(_table_in, get_args(annotation))), None)


Kind = TypeVar("Kind", bound=Table)


def load_table(path: Path, data: dict[str, Any], kind: type[Kind]) -> Kind:
    """Validate the `data` read from `path`; relative paths in them refer to the folder of that file.

    Raises
    ------
    InputError
        If keys are unknown, missing or invalid: the first is named.
    """
    return check_table(str(path), data, kind, path.parent)


def check_table(name: str, data: dict[str, Any], kind: type[Kind], context: Any = None) -> Kind:
    """Validate `data`; `name` identifies their source in messages.

    Raises
    ------
    InputError
        If keys are unknown, missing or invalid: the first is named.
    """
    try:
        return kind.model_validate(data, context=context)
    except ValidationError as error:
        raise InputError(f"{name}: {_sentence(error, kind)}") from error


def _sentence(error: ValidationError, kind: type[Table]) -> str:
    """Return one sentence for the first problem that pydantic reports."""
    # A misspelt key is also a missing one: report the misspelling.
    problem = min(error.errors(), key=lambda found: found["type"] != "extra_forbidden")
    place = loc = problem["loc"]
    if problem["type"] == "value_error":
        return ": ".join([*map(str, place), str(problem["ctx"]["error"])])
    table = kind
    for part in place[:-1]:
        table = table.nested().get(str(part), table)
    fields = {field.alias or name: _expected(field) for name, field in table.model_fields.items()}
    if len(place) > 1 and str(place[0]) in kind.nested() and isinstance(place[1], int):
        place = (f"{place[0]} {place[1] + 1}", *place[2:])
    if problem["type"] != "extra_forbidden" and place[-1] not in fields:  # an item of a list, or a member of a union
        place = next((place[:at] for at in range(len(place) - 1, 0, -1) if place[at - 1] in fields), place)
    key = place[-1]
    where = ": ".join(str(part) for part in place)
    if problem["type"] == "extra_forbidden":
        near = difflib.get_close_matches(str(key), fields, 1)
        return f"{where} is not a known key: " + (f"did you mean {near[0]}?" if near else f"use {', '.join(fields)}.")
    expected = fields.get(str(key), "a table")
    if problem["type"] == "missing":
        lacking = [found for found in error.errors() if found["type"] == "missing" and found["loc"][:-1] == loc[:-1]]
        wanted = [f"{found['loc'][-1]} ({fields.get(str(found['loc'][-1]), 'a table')})" for found in lacking]
        if len(wanted) > 1:  # all at once
            within = ": ".join(str(part) for part in place[:-1])
            return f"{within + ': ' if within else ''}{', '.join(wanted)} are missing: give them."
        return f"{where} is missing: give {expected}."
    if problem["type"] == "too_short":
        return f"no {key} is given, but there must be {expected}: add the missing ones."
    return f"{where} is {shown(problem['input'])}, but must be {expected}."


def shown(value: Any) -> str:
    """Return `value` as quoted in a message.

    >>> shown(True), shown("f/22"), shown([1, 2]), shown("x" * 99)
    ('true', "'f/22'", 'a list', 'a text of 99 letters')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, (list, tuple)):
        return "a list"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return described(value)
