"""Base class of response scales: the interface used by the laboratory, the browser, the files and the report."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Self

import numpy as np

from focalgradient.analyses import Analysis
from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.files.columns import Column
from focalgradient.scales.controls import Control
from focalgradient.words import Words

__all__ = ["AnswerColumn", "ResponseScale", "WholeSteps", "filled"]


ROUNDING = 1e-6
"""Tolerance of answers beyond the ends of a scale: exceeds the error of rounding to four decimals."""


def filled(text: str, what: str, values: Mapping[str, object]) -> str:
    """Fill values into a text; raise `InputError` for a brace that none of them fills in.

    >>> filled("from {least} to {most}", "the text", {"least": 0, "most": 10})
    'from 0 to 10'
    """
    try:
        return text.format(**values)
    except (LookupError, ValueError, AttributeError) as error:
        known = ", ".join(f"{{{name}}}" for name in values) or "none"
        raise InputError(
            f"{what} has a brace that is not a value's name ({known}): correct it, or double each brace to be shown."
        ) from error


@dataclass(frozen=True, slots=True)
class AnswerColumn:
    """Column `rating` of the tables, with the entries Units, Levels, Minimum and Maximum of its sidecar.

    Parameters
    ----------
    about
        Description.
    units
        Unit in BIDS notation; None for a number without unit.
    levels
        Meaning of each answer, by its text; empty unless answers are categories.
    least, most
        Smallest and largest answer; None: not stated in the sidecar.
    above
        Exclusive lower bound; None if `least` is stated.
    """

    about: str
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict, hash=False)
    least: float | None = None
    most: float | None = None
    above: float | None = None

    def rating(self) -> Column:
        """Return the table column `rating`.

        >>> AnswerColumn("How deep.", "%", least=0.0, most=100.0).rating().described()["Maximum"]
        100.0
        """
        return Column("rating", form="number", **{one.name: getattr(self, one.name) for one in fields(self)})


class ResponseScale(ABC):
    """Response scale, configured by the settings of a design.

    A subclass is a frozen dataclass. Its fields are settings of a design (`steps`, `labels`, `least_rating`,
    `most_rating`, `answer`, `reference`) with defaults, checked in ``__post_init__``; `of` fills them. A scale without
    texts in the translation files defines them in `texts`, by language and entry: "instructions", "example", and those
    of its control. `focalgradient.scales.check_scale` verifies that a class is complete.
    """

    name: ClassVar[str]
    """Value of the setting `scale` of a design."""
    intervals: ClassVar[int] = 1
    """Number of pictures shown in a trial: 2 if a picture and the reference are shown one after the other."""
    standard: ClassVar[float | None] = None
    """Correct answer to the standard; None if it has none, and the standard is not shown."""
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """Texts specific to the scale, by language ("en"), then by entry."""
    again: ClassVar[str] = "depth.practice_again"
    """Text entry of the page shown before practice is repeated."""
    off: ClassVar[str] = "has no such answer"
    """Property of the scale that an invalid number between its ends violates, completing "the scale"."""

    @classmethod
    def settings(cls) -> tuple[str, ...]:
        """Return the names of the settings of a design that configure the scale."""
        return tuple(one.name for one in fields(cls))  # type: ignore[arg-type]

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Self:
        """Create the scale from the settings of a design, a journal or a sidecar.

        Raises
        ------
        InputError
            If a setting is invalid.
        """
        given = {name: settings[name] for name in cls.settings() if name in settings}
        return cls(**{key: tuple(value) if isinstance(value, list) else value for key, value in given.items()})

    @property
    @abstractmethod
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest answer."""

    @property
    @abstractmethod
    def middle(self) -> float:
        """Answer that separates flatter from deeper: clearly flat drawings lie below it, clearly deep ones above."""

    @property
    @abstractmethod
    def analysis(self) -> Analysis:
        """Statistical analysis of the answers."""

    @property
    @abstractmethod
    def column(self) -> AnswerColumn:
        """Table column of the answers, with its sidecar entries."""

    @property
    @abstractmethod
    def answered(self) -> str:
        """Sentence that describes the answers in preregistration and report."""

    @property
    def compares(self) -> bool:
        """True if each answer compares the picture with another, so that all subjects share one mean level."""
        return self.standard is not None or self.intervals > 1

    @property
    def example(self) -> float | None:
        """Answer shown on the example page; None if there is no such page."""
        return None

    def is_answer(self, value: float) -> bool:
        """Return whether a number is a valid answer."""
        least, most = self.bounds
        return math.isfinite(value) and least - ROUNDING <= value <= most + ROUNDING

    @abstractmethod
    def control(self, texts: Words) -> Control:
        """Return the description of the response control, which the window and the browser draw."""

    def instructions(self, texts: Words) -> str:
        """Return the instruction page, with its title in the first line."""
        return self.text(texts, "instructions", **self.ends(texts))

    def example_text(self, texts: Words) -> str:
        """Return the text of the example page."""
        return self.text(texts, "example", **self.ends(texts))

    def ends(self, texts: Words, form: str = "g") -> dict[str, str]:
        """Format the ends and the example for the texts: `least`, `most`, and `example` if there is one."""
        values = dict(zip(("least", "most"), self.bounds, strict=True))
        if self.example is not None:
            values["example"] = self.example
        return {key: texts.number(value, form) for key, value in values.items()}

    def text(self, texts: Words, entry: str, **values: object) -> str:
        """Return a text of this scale, from its section in the translation file, else from `texts`.

        Raises
        ------
        InputError
            If there is none in the session's language.
        """
        key = f"{self.name}.{entry}"
        if key in texts.entries:
            return texts(key, **values)
        own = self.texts.get(texts.language, {})
        if entry not in own:
            raise InputError(
                f"the scale {self.name!r} has no text {entry!r} in {texts.language!r}: write it into the section "
                f"[{self.name}] of a file of words."
            )
        return filled(own[entry], f"the text {entry!r} of the scale {self.name!r}", values)

    def answer_in(self, given: float, interval: int) -> float:
        """Convert the value set on the control to an answer, given the interval (1 or 2) that showed the picture."""
        return given

    @abstractmethod
    def simulated(self, log_ratio: float, largest: float) -> float:
        """Return a simulated observer's answer.

        Parameters
        ----------
        log_ratio
            Natural logarithm of the picture's perceived depth relative to the reference, within +-`largest`.
        largest
            Natural logarithm of the design's largest ratio.
        """

    def latent(self, log_odds: FloatArray) -> FloatArray:
        """Return the answers to latent depths (log odds), as simulated for the power of tests.

        By default the logistic function, scaled to the range of a continuous scale.
        """
        least, most = self.bounds
        return least + (most - least) / (1 + np.exp(-log_odds))


class WholeSteps(ResponseScale):
    """Response scale whose answers are whole numbers."""

    off: ClassVar[str] = "has whole steps"

    def is_answer(self, value: float) -> bool:
        return super().is_answer(value) and value % 1 == 0
