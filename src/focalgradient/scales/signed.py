"""Signed comparison with a reference: steps from much flatter to much deeper, 0 meaning equal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from focalgradient.analyses import BIPOLAR
from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError
from focalgradient.scales.base import AnswerColumn, WholeSteps
from focalgradient.scales.controls import Steps
from focalgradient.scales.steps import check_labels
from focalgradient.words import Words

__all__ = ["SignedComparison"]


@dataclass(frozen=True)
class SignedComparison(WholeSteps):
    """Signed step from -(`steps` - 1) / 2 (much flatter than the reference) to +(`steps` - 1) / 2 (much deeper).

    Parameters
    ----------
    steps
        Number of steps, odd.
    labels
        Labels: one per step, one per end, or three for ends and middle; empty: those of the translation.
    reference
        Picture of value 0: "standard" or "same-scene".

    Examples
    --------
    >>> SignedComparison().bounds, SignedComparison().middle
    ((-3.0, 3.0), 0.0)
    """

    steps: int = 7
    labels: tuple[str, ...] = ()
    reference: Literal["standard", "same-scene"] = "standard"

    name: ClassVar[str] = "bipolar"
    standard: ClassVar[float | None] = 0.0
    middle = 0.0
    example = 1.0
    analysis = BIPOLAR
    column = AnswerColumn("Whether it looked flatter (below 0) or deeper (above 0) than the reference, in steps.")

    def __post_init__(self) -> None:
        if self.steps % 2 == 0 or self.steps < 3:
            raise InputError(f"steps is {self.steps}, but a bipolar scale has a middle: give an odd number.")
        check_labels(self.name, self.labels, {0, 2, 3, self.steps})

    @property
    def bounds(self) -> tuple[float, float]:
        half = float(self.steps // 2)
        return -half, half

    @property
    def answered(self) -> str:
        return f"Answers were one of {self.steps} steps from much flatter to much deeper."

    def control(self, texts: Words) -> Steps:
        labels = self.labels or tuple(texts(f"depth.{name}") for name in ("much_flatter", "alike", "much_deeper"))
        reference = texts("depth.the_standard" if self.reference == "standard" else "depth.the_one_before")
        half = self.steps // 2
        return Steps(texts("depth.question_bipolar", reference=reference), "", -half, half, labels)

    def instructions(self, texts: Words) -> str:
        reference = texts("depth.reference_standard" if self.reference == "standard" else "depth.reference_same")
        return texts("depth.instructions_bipolar", reference=reference)

    def example_text(self, texts: Words) -> str:
        return texts("depth.example_bipolar", **self.ends(texts, "+g"))

    def simulated(self, log_ratio: float, largest: float) -> float:
        least, most = self.bounds
        return float(min(max(round(most * log_ratio / largest), least), most))

    def latent(self, log_odds: FloatArray) -> FloatArray:
        least, most = self.bounds
        return np.asarray(least + np.digitize(log_odds, np.arange(least, most) + 0.5), float)
