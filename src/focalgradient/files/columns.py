"""Columns of the long tables: definition, the cell of a value, and the values of cells."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOST", "Column", "Form", "cell", "cell_test", "converted"]

Form = Literal["integer", "number", "bool", "text"]

MOST = 1e9
"""Upper limit of any number in a session: 30 years in s, and more frames or trials than occur."""

APERTURE = re.compile(r"pinhole|f/\d+(\.\d+)?")

WRONG = object()
"""Value of a cell that may not stand in its column."""

FORMULA = ("=", "+", "-", "@")
"""Initial characters by which spreadsheets recognise a formula."""


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


def cell_test(column: Column) -> Callable[[Any], bool]:
    """Return the test of whether a value may stand in a column.

    >>> cell_test(Column("distance", "How far.", "number", "m", above=0))(-1.0)
    False
    """
    least = -math.inf if column.least is None else column.least
    above = -math.inf if column.above is None else column.above
    most = MOST if column.most is None else column.most
    levels, optional = frozenset(column.levels), column.optional

    def number(value: Any) -> bool:
        if type(value) is float or type(value) is int:
            return value >= least and value > above and value <= most and value < MOST
        return value is None and optional

    def integer(value: Any) -> bool:
        return type(value) is int and number(value)

    def text(value: Any) -> bool:
        if value is None:
            return optional
        if type(value) is not str or not value:
            return False
        return value in levels if levels else column.name != "aperture" or bool(APERTURE.fullmatch(value))

    def truth(value: Any) -> bool:
        return type(value) is bool or (value is None and optional)

    tests = {"number": number, "integer": integer, "text": text, "bool": truth}
    return tests[column.form]


def converted(column: Column, texts: Sequence[str]) -> tuple[NDArray[Any], int | None]:
    """Convert a column's texts to values; also return the index of the first invalid one."""
    means = {text: _meaning(column, text) for text in dict.fromkeys(texts)}
    wrong = next((texts.index(text) for text, value in means.items() if value is WRONG), None)
    values = [means[text] for text in texts]
    kind: type = {"bool": bool, "integer": np.int64, "number": float, "text": object}[column.form]
    if column.form != "text" and None in means.values():
        kind = float  # NaN where cells are missing
    return np.array(values if wrong is None else [], kind), wrong


def _meaning(column: Column, text: str) -> Any:
    """Return the value of a cell: None if it is missing, `WRONG` if it may not stand in the column."""
    if text == "n/a" and column.optional:
        return None
    if column.form == "bool":
        return {"true": True, "false": False}.get(text, WRONG)
    if column.form == "text":
        is_valid = text in column.levels if column.levels else text not in ("", "n/a")
        if column.name == "aperture":
            is_valid = bool(APERTURE.fullmatch(text))
        is_kept = text.startswith("'") and text[1:].startswith(FORMULA)
        return WRONG if not is_valid else text[1:] if is_kept else text
    try:
        value = float(text) if "_" not in text else math.nan
    except ValueError:
        return WRONG
    least, above = (-math.inf if limit is None else limit for limit in (column.least, column.above))
    most = math.inf if column.most is None else column.most
    is_whole = column.form != "integer" or (value % 1 == 0 and abs(value) < 2.0**63)
    return value if math.isfinite(value) and least <= value <= most and value > above and is_whole else WRONG
