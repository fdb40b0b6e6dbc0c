"""The base class of response scales: what the laboratory, the browser, the files and the report ask of one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.scales.analyses import Analysis
from focalgradient.scales.controls import Control

__all__ = ["AnswerColumn", "ResponseScale", "Texts"]

FloatArray = NDArray[np.float64]

ROUNDING = 1e-6
"""Answers may lie this far beyond the ends of a scale: what is left of rounding to four decimals is smaller."""


class Texts(Protocol):
    """The texts of a session's language: `focalgradient.design.words.Words`."""

    @property
    def language(self) -> str:
        """Code of the language, or name of a file of words."""
        ...

    @property
    def entries(self) -> Mapping[str, Any]:
        """Texts by section and name."""
        ...

    def __call__(self, entry: str, **values: object) -> str:
        """Return the text of an entry with its values filled in."""
        ...

    def number(self, value: float, form: str = ".2f") -> str:
        """Write a number as the language does."""
        ...


@dataclass(frozen=True, slots=True)
class AnswerColumn:
    """The column `rating` of the tables, with the entries Units, Levels, Minimum and Maximum of its sidecar.

    Parameters
    ----------
    about
        Description.
    units
        Unit as BIDS writes it; None for a number without unit.
    levels
        Meaning of each answer, by its text; empty where answers are not a few.
    least, most
        Smallest and largest answer; None where the sidecar states none.
    above
        Number that every answer exceeds; None where `least` is stated.
    """

    about: str
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict, hash=False)
    least: float | None = None
    most: float | None = None
    above: float | None = None


class ResponseScale(ABC):
    """A response scale, made of the settings of a design.

    A subclass is a frozen dataclass. Its fields are settings of a design (`steps`, `labels`, `least_rating`,
    `most_rating`, `answer`, `reference`) with defaults, checked in ``__post_init__``; `of` fills them. A scale without
    texts in the files of words has its own in `texts`, by language and entry: "instructions", "example", and what its
    control shows. `focalgradient.scales.check_scale` states whether a class is complete.
    """

    name: ClassVar[str]
    """Value of the setting `scale` of a design."""
    intervals: ClassVar[int] = 1
    """Pictures shown in a trial: 2 where a picture and the reference are shown one after the other."""
    standard: ClassVar[float | None] = None
    """Answer that the standard counts as; None where no answer to it is right, and it is not shown."""
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """Texts of the scale's own by language ("en"), then by entry."""
    again: ClassVar[str] = "depth.practice_again"
    """Entry of the page before repeated practice."""
    off: ClassVar[str] = "has no such answer"
    """What the scale has that a number between its ends violates, to complete "the scale"."""

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Self:
        """Make the scale of a design's settings, also as a journal or a sidecar states them.

        Raises
        ------
        InputError
            If a setting cannot be used.
        """
        given = {one.name: settings[one.name] for one in fields(cls) if one.name in settings}  # type: ignore[arg-type]
        return cls(**{key: tuple(value) if isinstance(value, list) else value for key, value in given.items()})

    @property
    @abstractmethod
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest answer."""

    @property
    @abstractmethod
    def middle(self) -> float:
        """Answer between flatter and deeper: a clearly flat drawing is answered below it, a clearly deep one above."""

    @property
    @abstractmethod
    def analysis(self) -> Analysis:
        """The statistic of the answers."""

    @property
    @abstractmethod
    def column(self) -> AnswerColumn:
        """The column of the answers, with its sidecar."""

    @property
    @abstractmethod
    def answered(self) -> str:
        """What is answered, in a sentence of a preregistration."""

    @property
    def reported(self) -> str:
        """What was answered, in a sentence of the report's methods; empty where the analysis states it."""
        return ""

    @property
    def compares(self) -> bool:
        """Whether each answer compares the picture with another one, so that subjects share one level of answers."""
        return self.standard is not None or self.intervals > 1

    @property
    def example(self) -> float | None:
        """Answer that the page of the example shows; None where there is no such page."""
        return None

    def is_answer(self, value: float) -> bool:
        """Return whether a number can be an answer."""
        least, most = self.bounds
        return math.isfinite(value) and least - ROUNDING <= value <= most + ROUNDING

    @abstractmethod
    def control(self, texts: Texts) -> Control:
        """Describe what is answered on: the window and the browser draw it."""

    def instructions(self, texts: Texts) -> str:
        """Return the page that explains the task, the first line its title."""
        return self.text(texts, "instructions", **self.ends(texts))

    def example_text(self, texts: Texts) -> str:
        """Return the page above the example."""
        return self.text(texts, "example", **self.ends(texts))

    def ends(self, texts: Texts, form: str = "g") -> dict[str, str]:
        """Write the ends and the example as texts fill them in: `least`, `most`, and `example` where there is one."""
        values = dict(zip(("least", "most"), self.bounds, strict=True))
        if self.example is not None:
            values["example"] = self.example
        return {key: texts.number(value, form) for key, value in values.items()}

    def text(self, texts: Texts, entry: str, **values: object) -> str:
        """Return a text of the scale's own: of the section of its name in the file of words, else of `texts`.

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
        return own[entry].format(**values)

    def answer_in(self, given: float, interval: int) -> float:
        """Return the answer of what was chosen on the control, by the interval (1 or 2) that showed the picture."""
        return given

    @abstractmethod
    def simulated(self, log_ratio: float, largest: float) -> float:
        """Return a simulated observer's answer.

        Parameters
        ----------
        log_ratio
            Natural logarithm of how many times as deep as the reference the picture looks, within +-`largest`.
        largest
            Logarithm of the greatest ratio of the design.
        """

    def latent(self, log_odds: FloatArray) -> FloatArray:
        """Return the answers to latent depths in log odds, by which the power of tests is simulated.

        Here the logistic function over the range of a continuous scale.
        """
        least, most = self.bounds
        return least + (most - least) / (1 + np.exp(-log_odds))
