"""Ordinal scale of steps from flat to very deep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from focalgradient.analyses import Analysis, OrdinalSteps
from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.scales.base import AnswerColumn, WholeSteps
from focalgradient.scales.controls import Steps
from focalgradient.words import Words

__all__ = ["REACH", "OrdinalScale", "check_labels"]

REACH = 3.0
"""Log odds between the middle of an ordinal scale and its outer thresholds: our choice, as in
benchmarks/simulated_experiments.py.
"""


def check_labels(scale: str, labels: tuple[str, ...], allowed: set[int]) -> None:
    """Raise `InputError` unless the number of labels is allowed for a scale."""
    if len(labels) not in allowed:
        counts = " or ".join(map(str, sorted(allowed)))
        raise InputError(f"labels has {len(labels)} texts, but scale {scale!r} takes {counts}: change their number.")


@dataclass(frozen=True)
class OrdinalScale(WholeSteps):
    """Ordinal step from 1 to `steps`.

    Parameters
    ----------
    steps
        Number of steps, at least 2.
    labels
        Labels: one per step or one per end; empty: those of the translation.

    Examples
    --------
    >>> OrdinalScale().bounds, OrdinalScale().middle, OrdinalScale(steps=2).example
    ((1.0, 7.0), 4.0, 2.0)
    """

    steps: int = 7
    labels: tuple[str, ...] = ()

    name: ClassVar[str] = "steps"
    column = AnswerColumn("How three-dimensional it looked, in steps of the scale of the design.", least=1.0)

    def __post_init__(self) -> None:
        if self.steps < 2:
            raise InputError(f"steps is {self.steps}, but must be 2 or more: give a whole number like 7.")
        check_labels(self.name, self.labels, {0, 2, self.steps})

    @property
    def bounds(self) -> tuple[float, float]:
        return 1.0, float(self.steps)

    @property
    def middle(self) -> float:
        return (1 + self.steps) / 2

    @property
    def analysis(self) -> Analysis:
        return OrdinalSteps(middle=self.middle)

    @property
    def answered(self) -> str:
        return f"Answers were steps from 1 to {self.steps}."

    @property
    def example(self) -> float:
        return float((self.steps + 1) // 2 + 1)

    def control(self, texts: Words) -> Steps:
        labels = self.labels or (texts("depth.flat"), texts("depth.very_deep"))
        return Steps(texts("depth.question"), "", 1, self.steps, labels)

    def instructions(self, texts: Words) -> str:
        least, most = (texts.number(end, "g") for end in self.bounds)
        return texts("depth.instructions_steps", least=least, most=most)

    def example_text(self, texts: Words) -> str:
        return texts("depth.example_steps", **self.ends(texts))

    def simulated(self, log_ratio: float, largest: float) -> float:
        """Return step 2 for the reference and the last step for the largest ratio, at equal log intervals.

        With two steps, return the second for every picture that looks deeper than the reference.

        >>> OrdinalScale().simulated(0.0, 1.4), OrdinalScale().simulated(1.4, 1.4)
        (2.0, 7.0)
        >>> OrdinalScale(steps=2).simulated(-0.1, 1.4), OrdinalScale(steps=2).simulated(0.1, 1.4)
        (1.0, 2.0)
        """
        if self.steps == 2:
            return 1.0 + (log_ratio > 0)
        step = round(2 + (self.steps - 2) * log_ratio / largest)
        return float(min(max(step, 1), self.steps))

    def latent(self, log_odds: FloatArray) -> FloatArray:
        cuts = np.linspace(-REACH, REACH, self.steps - 1) if self.steps > 2 else np.zeros(1)
        return np.asarray(1.0 + np.digitize(log_odds, cuts), float)
