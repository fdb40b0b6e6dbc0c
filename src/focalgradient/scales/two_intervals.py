"""Two-interval forced choice (2IFC): which of two pictures looks deeper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from focalgradient.analyses import Choices
from focalgradient.arrays import FloatArray
from focalgradient.scales.base import AnswerColumn, WholeSteps
from focalgradient.scales.controls import Ways
from focalgradient.words import Words

__all__ = ["TwoIntervals"]


@dataclass(frozen=True)
class TwoIntervals(WholeSteps):
    """Choice of the deeper picture: 1 if the test picture is chosen, 0 if the reference is.

    Examples
    --------
    >>> TwoIntervals().bounds, TwoIntervals().answer_in(2.0, interval=2)
    ((0.0, 1.0), 1.0)
    """

    name: ClassVar[str] = "choice"
    intervals: ClassVar[int] = 2
    again: ClassVar[str] = "depth.practice_again_choice"
    bounds = (0.0, 1.0)
    middle = 0.5
    analysis = Choices()
    column = AnswerColumn(
        "1 where the picture was judged deeper than the reference, 0 where the reference was.", least=0.0
    )
    answered = "The answer was which of two pictures looked deeper."

    def control(self, texts: Words) -> Ways:
        return Ways(texts("depth.question_choice"), (texts("depth.first"), texts("depth.second")))

    def instructions(self, texts: Words) -> str:
        return texts("depth.instructions_choice")

    def answer_in(self, given: float, interval: int) -> float:
        return float(given == interval)

    def simulated(self, log_ratio: float, largest: float) -> float:
        return float(log_ratio > 0)

    def latent(self, log_odds: FloatArray) -> FloatArray:
        return np.asarray(np.digitize(log_odds, np.zeros(1)), float)
