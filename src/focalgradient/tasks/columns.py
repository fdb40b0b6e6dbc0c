"""Column definitions of the long tables, used for headings, sidecars and validation."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Union

from focalgradient.errors import InputError

__all__ = ["DROPPED", "REPETITION", "SCENE", "SITTING", "STIMULUS", "TRIAL", "Column", "added_columns", "judged"]

Form = Literal["integer", "number", "bool", "text"]

ENTRIES = ("about", "units", "levels", "least", "most", "above")
"""Metadata of fields of trials and answers: entries of the sidecar, and limits."""


@dataclass(frozen=True, slots=True)
class Column:
    """Definition of a table column.

    Parameters
    ----------
    name, about
        Heading, and meaning of the values.
    form
        Type of the cells.
    units
        Unit in BIDS notation.
    levels
        Allowed texts with their meanings; empty if any text is allowed.
    least, most
        Inclusive limits of the numbers.
    above
        Exclusive lower limit of the numbers.
    optional
        True if cells may be missing ("n/a").
    """

    name: str
    about: str
    form: Form
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict, hash=False)
    least: float | None = None
    most: float | None = None
    above: float | None = None
    optional: bool = False

    @property
    def expected(self) -> str:
        """Description of a valid cell, in words."""
        if self.form == "bool":
            return "true or false"
        if self.form == "text":
            if self.name == "aperture":
                return "'pinhole' or an f-number like 'f/5.6'"
            return f"one of {', '.join(self.levels)}" if self.levels else "a text"
        kind = "a whole number" if self.form == "integer" else "a number"
        if self.above is not None:
            return f"{kind} above {self.above:g}"
        if self.least is not None and self.most is not None:
            return f"{kind} from {self.least:g} to {self.most:g}"
        return kind if self.least is None else f"{kind} of {self.least:g} or more"

    @classmethod
    def noted(cls, name: str, entry: Mapping[str, Any]) -> Column:
        """Return the column of an additional value, as described by a sidecar entry."""
        levels = entry.get("Levels", {})
        form: Form = "bool" if set(levels) == {"true", "false"} else "text"
        if entry.get("Format") in ("integer", "number"):
            form = entry["Format"]
        return cls(name, str(entry.get("Description", "")), form, units=entry.get("Units"), optional=True)

    def described(self) -> dict[str, Any]:
        """Return the sidecar entry of the column."""
        levels = {"true": "yes", "false": "no"} if self.form == "bool" else dict(self.levels)
        form = {"integer": "integer", "number": "number"}.get(self.form)
        # BIDS has no exclusive minimum.
        minimum = self.above if self.least is None else self.least
        range_ = {"Minimum": minimum, "Maximum": self.most}
        entries = {"Description": self.about, "Units": self.units, "Levels": levels, "Format": form, **range_}
        return {key: value for key, value in entries.items() if value not in (None, {})}

    @property
    def absent(self) -> Any:
        """Placeholder for the column in rows of sessions without it."""
        if self.optional and self.form != "text":
            return math.nan
        return {"bool": False, "integer": 0, "number": math.nan, "text": None}[self.form]


TRIAL = Column("trial", "Number of the trial, in the order shown.", "integer", least=1)
REPETITION = Column(
    "repetition", "Number of presentations of this condition so far, including this one.", "integer", least=1
)
SITTING = Column(
    "sitting",
    "Number of the sitting, from 1: increases each time an interrupted session is resumed.",
    "integer",
    least=1,
)
DROPPED = Column("dropped_frames", "Number of late display frames during the trial.", "integer", least=0)
SCENE = Column("scene", "Name of the scene.", "text")
STIMULUS = Column("stimulus", "File of the picture, as the manifest of the stimuli names it.", "text", optional=True)


def judged(standard: str) -> tuple[Column, ...]:
    """Return the columns of ratings as ratios to a standard."""
    return (
        Column("onset", "When the picture appeared, on the clock of the sitting.", "number", "s", least=0),
        Column("rating", f"Three-dimensionality as a ratio to {standard}, which is 1.", "number", above=0),
        Column("response_time", "From the question to the answer.", "number", "s", least=0),
        Column("confidence", "How sure the participant was, from 0 to 1.", "number", least=0, optional=True),
        DROPPED,
        STIMULUS,
        SITTING,
    )


def added_columns(record: type[Any], about: str) -> Iterator[Column]:
    """Yield columns of the fields that a record adds to the base class of all trials or answers."""
    hints = typing.get_type_hints(record)
    base = next(each for each in reversed(record.__mro__[:-1]) if dataclasses.is_dataclass(each))
    shared = {one.name for one in dataclasses.fields(base)}
    for one in dataclasses.fields(record):
        if one.name not in shared:
            form, levels, optional = _form(hints[one.name], one.name)
            told = dict(one.metadata)
            if wrong := [key for key in told if key not in ENTRIES]:
                raise InputError(
                    f"{one.name} is a field with the metadata {wrong[0]!r}, but may have {', '.join(ENTRIES)}: correct "
                    "it."
                )
            levels = told.pop("levels", levels)
            yield Column(one.name, told.pop("about", about), form, levels=levels, optional=optional, **told)


def _form(hint: Any, name: str) -> tuple[Form, Mapping[str, str], bool]:
    """Return a column's form, levels and optionality, derived from the type of its field."""
    parts = typing.get_args(hint)
    if typing.get_origin(hint) in (Union, types.UnionType) and type(None) in parts:
        form, levels, _ = _form(next(part for part in parts if part is not type(None)), name)
        return form, levels, True
    if typing.get_origin(hint) is Literal and all(type(part) is int for part in parts):
        return "integer", {}, False
    if typing.get_origin(hint) is Literal:
        return "text", {str(part): str(part) for part in parts}, False
    forms: dict[Any, Form] = {bool: "bool", int: "integer", float: "number", str: "text"}
    if hint not in forms:
        raise InputError(f"{name} is a field of type {hint}, but must be bool, int, float, str or Literal.")
    return forms[hint], {}, False
