"""Additional questions that a design asks after each trial; the answers become columns of the table."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Annotated

from pydantic import Field, model_validator

from focalgradient.scales import Control, Scale, Steps
from focalgradient.tables import Table

__all__ = ["Also", "check_names"]

NAME = re.compile(r"[a-z][a-z0-9_]*")


class Also(Table):
    """Additional question: a continuous scale from `least` to `most`, or whole-number steps between them.

    Examples
    --------
    >>> Also(question="How interesting was it?", ends=["dull", "gripping"]).control().most
    10.0
    """

    question: Annotated[str, Field(min_length=1, description="a text")]
    below: Annotated[str, Field(description="a text")] = ""
    least: Annotated[float, Field(ge=-1e6, le=1e6, description="a number")] = 0.0
    most: Annotated[float, Field(ge=-1e6, le=1e6, description="a number")] = 10.0
    ends: Annotated[tuple[str, ...], Field(max_length=101, description="a list of texts, one for each end")] = ("", "")
    steps: Annotated[bool, Field(description="true (whole numbers) or false (a line)")] = False
    unit: Annotated[str, Field(description="a text, like 'points'")] = ""
    description: Annotated[str, Field(description="a text")] = ""

    @model_validator(mode="after")
    def _check(self) -> Also:
        if self.most <= self.least:
            raise ValueError(f"most is {self.most:g}, but must be above least, which is {self.least:g}.")
        if self.steps and (self.least % 1 or self.most % 1 or self.most - self.least > 100):
            raise ValueError("steps are whole numbers, at most 100: give whole numbers for least and most.")
        if not self.steps and len(self.ends) != 2:
            raise ValueError(f"ends has {len(self.ends)} texts, but a line has two ends.")
        return self

    def control(self) -> Control:
        """Return the control on which the question is answered."""
        if self.steps:
            return Steps(self.question, self.below, int(self.least), int(self.most), self.ends)
        ends = (self.ends[0], self.ends[1])
        return Scale(self.question, self.below, self.least, self.most, ratios=False, ends=ends)

    @property
    def about(self) -> str:
        """Description of the question's column."""
        return self.description or self.question


def check_names(setting: str, names: Iterable[str]) -> None:
    """Raise `ValueError` for names that cannot be columns."""
    for name in names:
        if not NAME.fullmatch(name):
            raise ValueError(
                f"{setting} names {name!r}, but a name must consist of lower-case letters (a to z), digits and _."
            )
