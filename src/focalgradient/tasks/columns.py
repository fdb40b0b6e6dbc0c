"""The columns of the long tables: what stands in them, for readers, for the sidecars, and for checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

__all__ = ["DROPPED", "REPETITION", "SCENE", "SITTING", "STIMULUS", "TRIAL", "Column", "judged"]

Form = Literal["integer", "number", "bool", "text"]


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Parameters
    ----------
    name, about
        Its heading, and what it means.
    form
        What its cells are.
    units
        As BIDS writes them.
    levels
        The texts that there are, each with its meaning; empty where any text may stand.
    least, most
        No number is smaller, or larger.
    above
        Every number is greater.
    optional
        Whether a cell may be without a value ("n/a").
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
        """What a cell must be, in words."""
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
        """Return the column of a value noted beside the answers, by what a sidecar says of it."""
        levels = entry.get("Levels", {})
        form: Form = "bool" if set(levels) == {"true", "false"} else "text"
        if entry.get("Format") in ("integer", "number"):
            form = entry["Format"]
        return cls(name, str(entry.get("Description", "")), form, units=entry.get("Units"), optional=True)

    def described(self) -> dict[str, Any]:
        """What a sidecar says of it."""
        levels = {"true": "yes", "false": "no"} if self.form == "bool" else dict(self.levels)
        form = {"integer": "integer", "number": "number"}.get(self.form)
        # Of what must be greater, BIDS can say only that it is no smaller.
        minimum = self.above if self.least is None else self.least
        range_ = {"Minimum": minimum, "Maximum": self.most}
        entries = {"Description": self.about, "Units": self.units, "Levels": levels, "Format": form, **range_}
        return {key: value for key, value in entries.items() if value not in (None, {})}

    @property
    def absent(self) -> Any:
        """What stands for the column in the rows of sessions that do not have it."""
        if self.optional and self.form != "text":
            return math.nan
        return {"bool": False, "integer": 0, "number": math.nan, "text": None}[self.form]


TRIAL = Column("trial", "Number of the trial, in the order shown.", "integer", least=1)
REPETITION = Column(
    "repetition", "How many times this condition has been shown, this time included.", "integer", least=1
)
SITTING = Column("sitting", "1; one more after each time that the session was cut off and resumed.", "integer", least=1)
DROPPED = Column("dropped_frames", "Frames of the display that came late during the trial.", "integer", least=0)
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
