"""Additional values recorded with an answer: each becomes a table column with its sidecar entry."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from focalgradient.errors import InputError, described
from focalgradient.files.columns import Column, Form

__all__ = [
    "AGAIN",
    "AGAIN_ABOUT",
    "EXTRA",
    "NAME",
    "SHOWN",
    "SHOWN_ABOUT",
    "START",
    "START_ABOUT",
    "Noted",
    "OpenRecord",
    "check_noted",
    "noted_columns",
    "noted_start",
    "plain",
    "with_noted",
]

EXTRA = "extra"
"""Name of the answer field, and of the key of a journal's trial, that contains additional values by name."""

SHOWN = "shown_sha256"
"""Column of the hashes of displayed pixels, for trials whose pictures are not files of a picture set."""

SHOWN_ABOUT = (
    "SHA-256 of the pixels of each picture shown, in order: 8-bit values, row by row, three per pixel in colour; of a "
    "film, of those of its frames, in order; after a comma the changes applied when it was drawn, such as contrast=0.5."
)

START = "start"
"""Column of the random initial position of a marker; of a further question, with its name and _ before."""

START_ABOUT = "Random initial position of the marker on the scale; n/a if no key moved it."

AGAIN = "interruptions"
"""Column of the number of restarts of a trial, in sessions with restarted trials."""

AGAIN_ABOUT = (
    "Number of exposures of the trial before the one that was answered, which ESC, an end of the program, a reload or "
    "a step of the computer's clock cut off: its pictures may have been seen before. n/a if there were none."
)

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")

UNDESCRIBED = "Noted by the laboratory's own program."


@dataclass(frozen=True, slots=True)
class Noted:
    """Additional value recorded with an answer, with the sidecar entries of its column.

    Parameters
    ----------
    value
        A number, a text, true or false, or None if missing; NaN and empty text become None.
    unit
        Unit in BIDS notation, such as "s" or "arcmin".
    description
        Meaning of the column.

    Raises
    ------
    InputError
        If the value is of another type, or infinite.

    Examples
    --------
    >>> Noted(3.5, unit="points", description="How interesting it was.").value
    3.5
    """

    value: bool | int | float | str | None
    unit: str | None = None
    description: str = ""

    def __post_init__(self) -> None:
        value = plain(self.value)
        if isinstance(value, float) and math.isnan(value):
            value = None
        if not (value is None or isinstance(value, (bool, int, float, str))) or value in (math.inf, -math.inf):
            raise InputError(
                f"value is {described(self.value)}, but must be a finite number, a text, true or false, or None: "
                "give each of several values its own name."
            )
        for name in ("unit", "description"):
            if not isinstance(getattr(self, name) or "", str):
                raise InputError(f"{name} is {described(getattr(self, name))}, but must be a text.")
        object.__setattr__(self, "value", None if value == "" else value)

    @classmethod
    def of(cls, value: Any) -> Noted:
        """Return a value as a `Noted`; a `Noted` is returned unchanged."""
        return value if isinstance(value, Noted) else cls(value)

    def entry(self) -> dict[str, Any]:
        """Return the journal entry of the value.

        >>> Noted(3.5, unit="points").entry()
        {'value': 3.5, 'unit': 'points'}
        """
        fields = {"unit": self.unit, "description": self.description}
        return {"value": self.value} | {key: text for key, text in fields.items() if text}


def plain(value: Any) -> Any:
    """Convert a NumPy scalar to a Python number; return any other value unchanged.

    >>> import numpy as np
    >>> plain(np.float64(0.5)), plain("left")
    (0.5, 'left')
    """
    scalar = type(value).__module__ == "numpy" and getattr(value, "shape", None) == ()
    return value.item() if scalar else value


class OpenRecord(type):
    """Metaclass of answers with additional fields: keywords that name no field are stored in `extra`.

    Raises
    ------
    InputError
        If a name is not a valid column name: letters, digits and _, starting with a letter.
    """

    def __call__(cls, *values: Any, **named: Any) -> Any:
        """Create an answer."""
        own = cls.__dataclass_fields__  # type: ignore[attr-defined]
        given = named.pop(EXTRA, {})
        if not isinstance(given, Mapping):
            raise InputError(f"{EXTRA} is a {type(given).__name__}, but must be a dict of further fields by name.")
        extra = {**given, **{name: named.pop(name) for name in [*named] if name not in own}}
        for name in extra:
            if not (isinstance(name, str) and NAME.fullmatch(name)):
                raise InputError(
                    f"{name!r} cannot be the name of a column: use letters (a to z), digits and _, a letter first."
                )
        return super().__call__(*values, **named, **{EXTRA: {name: Noted.of(one) for name, one in extra.items()}})


def noted_start(start: float | None, name: str = "") -> dict[str, Noted]:
    """Return the note of a marker's initial position, for the question `name`; empty if no key moved it.

    >>> noted_start(0.5, "interest")["interest_start"].value, noted_start(None)
    (0.5, {})
    """
    column = f"{name}_{START}" if name else START
    return {} if start is None else {column: Noted(start, description=START_ABOUT)}


def with_noted(answer: Any, noted: Mapping[str, Noted], columns: Iterable[Column] | None = None) -> Any:
    """Return an answer with noted values: in its fields that are None, such as `confidence`, else in `extra`.

    `columns`: those of the session's table, without which a field is not used; None: all fields are.
    """
    fields = {one.name for one in dataclasses.fields(answer)}
    if columns is not None:
        fields &= {column.name for column in columns}
    own = {name: one.value for name, one in noted.items() if name in fields and getattr(answer, name) is None}
    extra = {name: one for name, one in noted.items() if name not in own}
    return dataclasses.replace(answer, **own, extra={**extra, **answer.extra})


def noted_columns(trials: Iterable[Mapping[str, Any]]) -> tuple[Column, ...]:
    """Return the columns of the additional values in recorded trials, in order of first occurrence.

    The form of a column is derived from all of its values; unit and description are the last ones given.

    Examples
    --------
    >>> noted_columns([{"extra": {"interest": {"value": 3}}}, {"extra": {"interest": {"value": 2.5}}}])[0].form
    'number'
    """
    found = _gathered(trials)
    return tuple(
        Column(
            name,
            one["description"][-1] if one["description"] else UNDESCRIBED,
            next(iter(one["form"])) if len(one["form"]) == 1 else "text",  # type: ignore[arg-type]
            units=one["unit"][-1] if one["unit"] else None,
            optional=True,
        )
        for name, one in found.items()
    )


def check_noted(trials: Iterable[Mapping[str, Any]]) -> None:
    """Raise `InputError` for additional values of one name that cannot share a column.

    Raises
    ------
    InputError
        If values of one name differ in type (text, number or boolean) or in unit.
    """
    for name, one in _gathered(trials).items():
        if len(one["form"]) > 1:
            kinds = " and as ".join(sorted(WORDS[form] for form in one["form"]))
            raise InputError(f"{name} was noted as {kinds}: give values of one kind, or two names.")
        if len(units := [*dict.fromkeys(one["unit"])]) > 1:
            raise InputError(f"{name} was noted in {units[0]!r} and in {units[1]!r}: give both one unit, or two names.")


FORMS: Mapping[type, Form] = {bool: "bool", int: "integer", float: "number", str: "text"}
WORDS = {"bool": "true or false", "integer": "a number", "number": "a number", "text": "a text"}


def _gathered(trials: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, list[str]]]:
    """Collect forms, units and descriptions by name, in order of occurrence; integers among floats become numbers."""
    found: dict[str, dict[str, list[str]]] = {}
    for trial in trials:
        for name, entry in trial.get(EXTRA, {}).items():
            one = found.setdefault(name, {"form": [], "unit": [], "description": []})
            form = FORMS.get(type(entry["value"]))
            if form is not None and form not in one["form"]:
                one["form"] = ["number"] if {*one["form"], form} == {"integer", "number"} else [*one["form"], form]
            for key in ("unit", "description"):
                if key in entry:
                    one[key].append(entry[key])
    return found
