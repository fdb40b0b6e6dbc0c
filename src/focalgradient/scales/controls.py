"""Response controls described as data, which the laboratory's window and the browser's page draw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

__all__ = ["Control", "Held", "OwnControl", "Scale", "Steps", "Ways"]


@dataclass(frozen=True, slots=True)
class Scale:
    """Continuous line with a marker, which arrow keys, mouse or touch move.

    Parameters
    ----------
    question, below
        Question, and the reference that the answer is relative to.
    least, most
        Values at the two ends.
    ratios
        True if the line is logarithmic (equal distances are equal ratios); else it is linear.
    ends
        Labels of the ends, one or two words each.
    typed
        True if the answer is typed instead of set with the marker.
    numbered
        True if numbers are shown along the line and at the marker.
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
        """Return the value at a fraction of the way from `least` to `most`."""
        if self.ratios:
            return self.least * (self.most / self.least) ** share
        return self.least + (self.most - self.least) * share

    def share(self, value: float) -> float:
        """Return the position of a value as a fraction (0 to 1) of the way from `least` to `most`."""
        if self.ratios:
            return math.log(value / self.least) / math.log(self.most / self.least)
        return (value - self.least) / (self.most - self.least)

    def ticks(self) -> list[float]:
        """Return the values of tick marks: doublings from 1, or five evenly spaced values; empty if unnumbered.

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
        """Input method: suffix of the text entry ``depth.answer_...``."""
        return "typed" if self.typed else "slider"

    def reached(self) -> list[float]:
        """Return 61 evenly spaced values that keys can set, from end to end."""
        return [self.value(number / 60) for number in range(61)]

    def form(self) -> dict[str, Any]:
        """Return the description of the control for the browser's page."""
        return {
            "kind": self.how,
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
    """Discrete steps, chosen by arrow keys, a digit, mouse or touch.

    Parameters
    ----------
    question, below
        Question, and the reference that the answer is relative to.
    least, most
        First and last step.
    labels
        Labels: one per step, one per end, or three for the ends and the middle.
    size
        Difference between neighbouring steps, such as 0.5.
    """

    question: str
    below: str
    least: float
    most: float
    labels: Sequence[str] = ()
    size: float = 1

    @property
    def values(self) -> list[float]:
        """All steps, in ascending order.

        >>> Steps("", "", 1, 3).values, Steps("", "", -0.5, 0.5, size=0.5).values
        ([1, 2, 3], [-0.5, 0.0, 0.5])
        """
        return [self.least + number * self.size for number in range(round((self.most - self.least) / self.size) + 1)]

    @property
    def has_digits(self) -> bool:
        """True if a digit key chooses each step."""
        return self.least >= 0 and self.most <= 9 and all(value % 1 == 0 for value in self.values)

    @property
    def how(self) -> str:
        """Input method: suffix of the text entry ``depth.answer_...``."""
        return "steps" if self.has_digits else "arrows"

    def labelled(self) -> list[tuple[float, str]]:
        """Return the labelled steps as pairs (step, label).

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
        """Return all values that keys can set, in ascending order."""
        return [float(value) for value in self.values]

    def form(self) -> dict[str, Any]:
        """Return the description of the control for the browser's page."""
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
    """Binary choice: the left arrow key chooses the first interval (1), the right arrow key the second (2).

    Parameters
    ----------
    question
        Question.
    ways
        Labels of the two choices.
    """

    question: str
    ways: tuple[str, str]

    @property
    def how(self) -> str:
        """Input method: suffix of the text entry ``depth.answer_...``."""
        return "choice"

    def reached(self) -> list[float]:
        """Return the values that keys can set: the numbers of the two intervals."""
        return [1.0, 2.0]

    def form(self) -> dict[str, Any]:
        """Return the description of the control for the browser's page."""
        return {"kind": "choice", "question": self.question, "ways": list(self.ways)}


@dataclass(frozen=True, slots=True)
class Held:
    """Keys held while the pictures of a trial are shown; their presses and releases are the answer.

    Parameters
    ----------
    keys
        Names of the keys, from left to right.
    labels
        Meaning of each, shown below the pictures beside its key.
    """

    keys: tuple[str, ...]
    labels: tuple[str, ...]


@runtime_checkable
class OwnControl(Protocol):
    """Control of a user's own, which draws itself in the laboratory's window; a browser cannot show it."""

    @property
    def question(self) -> str:
        """Question."""
        ...

    def ask(self, screen: Any, event: str) -> Any:
        """Ask in a window, and return a `focalgradient.lab.Given`."""
        ...

    def reached(self) -> Sequence[float]:
        """Return values that can be set, from the least to the most."""
        ...


Control = Scale | Steps | Ways
"""Control of a question, which the window and the page draw."""
