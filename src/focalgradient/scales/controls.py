"""What an answer is given on: descriptions that the laboratory's window and the browser's page draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["Control", "Scale", "Steps", "Ways"]


@dataclass(frozen=True, slots=True)
class Scale:
    """A line without steps; arrow keys, mouse or touch move a marker on it.

    Parameters
    ----------
    question, below
        The question, and what the answer is to be compared with.
    least, most
        Its ends.
    ratios
        Whether equal ratios are equally far apart; else equal differences are.
    ends
        Meaning of the ends, in a word or two.
    typed
        Whether the answer is typed, not set with the marker.
    numbered
        Whether numbers stand at the line and at the marker.
    """

    question: str
    below: str
    least: float
    most: float
    ratios: bool = True
    ends: tuple[str, str] = ("", "")
    typed: bool = False
    numbered: bool = True

    def value(self, share: float) -> float:
        """Return what lies at that share of the way from `least` to `most`."""
        if self.ratios:
            return self.least * (self.most / self.least) ** share
        return self.least + (self.most - self.least) * share

    def share(self, value: float) -> float:
        """Return where a value lies, from 0 to 1."""
        if self.ratios:
            return math.log(value / self.least) / math.log(self.most / self.least)
        return (value - self.least) / (self.most - self.least)

    def ticks(self) -> list[float]:
        """Return the values that are marked: doublings from 1 within the range, or five evenly spaced; none unnumbered.

        >>> Scale("", "", 0.5, 4.0).ticks(), Scale("", "", 0.0, 1.0, ratios=False, numbered=False).ticks()
        ([0.5, 1.0, 2.0, 4.0], [])
        """
        if not self.numbered:
            return []
        if not self.ratios:
            return [self.value(number / 4) for number in range(5)]
        first, last = math.ceil(math.log2(self.least) - 1e-9), math.floor(math.log2(self.most) + 1e-9)
        every = max(1, math.ceil((last - first) / 8))
        return [2.0**power for power in range(first, last + 1) if power % every == 0]

    @property
    def how(self) -> str:
        """How it is answered, as the entries ``depth.answer_...`` of the words name it."""
        return "typed" if self.typed else "slider"

    def reached(self) -> list[float]:
        """Return values that keys set, from one end to the other."""
        return [self.value(number / 60) for number in range(61)]

    def form(self) -> dict[str, Any]:
        """Describe it for the browser's page."""
        return {
            "kind": "slider",
            "question": self.question,
            "below": self.below,
            "ends": list(self.ends),
            "ticks": self.ticks(),
            "least": self.least,
            "most": self.most,
            "ratios": self.ratios,
            "numbered": self.numbered,
        }


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps of which arrow keys, a digit, mouse or touch choose one.

    Parameters
    ----------
    question, below
        The question, and what the answer is to be compared with.
    least, most
        Its ends, whole numbers.
    labels
        Meaning of the steps: one each, or one for each end (and one for the middle, where there are three).
    """

    question: str
    below: str
    least: int
    most: int
    labels: Sequence[str] = ()

    @property
    def values(self) -> list[int]:
        """All steps, from the least to the most."""
        return list(range(self.least, self.most + 1))

    @property
    def has_digits(self) -> bool:
        """Whether a digit key chooses each step."""
        return self.least >= 0 and self.most <= 9

    @property
    def how(self) -> str:
        """How it is answered, as the entries ``depth.answer_...`` of the words name it."""
        return "steps" if self.has_digits else "arrows"

    def labelled(self) -> list[tuple[int, str]]:
        """Return the steps that have a label, each with it.

        >>> Steps("", "", 1, 7, ("flat", "deep")).labelled()
        [(1, 'flat'), (7, 'deep')]
        >>> Steps("", "", -2, 2, ("flatter", "alike", "deeper")).labelled()
        [(-2, 'flatter'), (0, 'alike'), (2, 'deeper')]
        """
        values = self.values
        if len(self.labels) == len(values):
            return list(zip(values, self.labels, strict=True))
        places = {2: [0, -1], 3: [0, len(values) // 2, -1]}.get(len(self.labels), [])
        return [(values[place], label) for place, label in zip(places, self.labels, strict=False)]

    def reached(self) -> list[float]:
        """Return values that keys set, from one end to the other."""
        return [float(value) for value in self.values]

    def form(self) -> dict[str, Any]:
        """Describe it for the browser's page."""
        named = dict(self.labelled())
        return {
            "kind": "steps",
            "question": self.question,
            "below": self.below,
            "digits": self.has_digits,
            "steps": [{"value": step, "label": named.get(step, "")} for step in self.values],
        }


@dataclass(frozen=True, slots=True)
class Ways:
    """Two ways: the left arrow key chooses the first interval (1), the right one the second (2).

    Parameters
    ----------
    question
        The question.
    ways
        Labels of the two.
    """

    question: str
    ways: tuple[str, str]

    @property
    def how(self) -> str:
        """How it is answered, as the entries ``depth.answer_...`` of the words name it."""
        return "choice"

    def reached(self) -> list[float]:
        """Return values that keys set: the two intervals."""
        return [1.0, 2.0]

    def form(self) -> dict[str, Any]:
        """Describe it for the browser's page."""
        return {"kind": "choice", "question": self.question, "ways": list(self.ways)}


Control = Scale | Steps | Ways
