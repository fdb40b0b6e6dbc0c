"""The scales that an answer is given on, in the laboratory's window and in a browser."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["Scale", "Steps"]


@dataclass(frozen=True, slots=True)
class Scale:
    """A scale without steps that an answer is given on.

    Parameters
    ----------
    question, below
        What is asked, and what it is to be compared with.
    least, most
        Its ends.
    ratios
        Whether equal ratios are equally far apart; else equal differences are.
    ends
        What the ends mean, in a word or two.
    typed
        Whether the answer is typed, not set on a slider.
    """

    question: str
    below: str
    least: float
    most: float
    ratios: bool = True
    ends: tuple[str, str] = ("", "")
    typed: bool = False

    def value(self, share: float) -> float:
        """What lies at that share of the way from `least` to `most`."""
        if self.ratios:
            return self.least * (self.most / self.least) ** share
        return self.least + (self.most - self.least) * share

    def share(self, value: float) -> float:
        """Where a value lies, from 0 to 1."""
        if self.ratios:
            return math.log(value / self.least) / math.log(self.most / self.least)
        return (value - self.least) / (self.most - self.least)

    def ticks(self) -> list[float]:
        """Values that are marked: doublings from 1 within the range, or five evenly spaced."""
        if not self.ratios:
            return [self.value(number / 4) for number in range(5)]
        first, last = math.ceil(math.log2(self.least) - 1e-9), math.floor(math.log2(self.most) + 1e-9)
        every = max(1, math.ceil((last - first) / 8))
        return [2.0**power for power in range(first, last + 1) if power % every == 0]


@dataclass(frozen=True, slots=True)
class Steps:
    """A scale of steps that an answer is given on.

    Parameters
    ----------
    question, below
        What is asked, and what it is to be compared with.
    least, most
        Its ends, whole numbers.
    labels
        What the steps mean: one each, or one for each end (and one for the middle, where there are three).
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

    def labelled(self) -> list[tuple[int, str]]:
        """Which steps have a label, and which.

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
