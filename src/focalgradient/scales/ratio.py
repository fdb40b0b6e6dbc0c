"""Magnitude estimation: ratios to a standard of value 1."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from focalgradient.analyses import Ratios
from focalgradient.errors import InputError
from focalgradient.scales.base import AnswerColumn, ResponseScale
from focalgradient.scales.controls import Scale
from focalgradient.words import Words

__all__ = ["Ratio"]


@dataclass(frozen=True)
class Ratio(ResponseScale):
    """Perceived depth as a ratio to the reference, set on a logarithmic line or typed.

    Parameters
    ----------
    least_rating, most_rating
        Ends of the scale: below 1, and above 1.
    answer
        Input method: "slider" or "typed".
    reference
        Picture of value 1: "standard" or "same-scene".

    Examples
    --------
    >>> Ratio().bounds, Ratio().example, Ratio(most_rating=1.21).example
    ((0.25, 4.0), 1.5, 1.1)
    """

    least_rating: float = 0.25
    most_rating: float = 4.0
    answer: Literal["slider", "typed"] = "slider"
    reference: Literal["standard", "same-scene"] = "standard"

    name: ClassVar[str] = "ratio"
    standard: ClassVar[float | None] = 1.0
    off: ClassVar[str] = "has ratios"
    middle = 1.0
    analysis = Ratios()
    column = AnswerColumn("Three-dimensionality as a ratio to the standard, a pinhole picture, which is 1.", above=0)

    def __post_init__(self) -> None:
        if not 0 < self.least_rating < 1 < self.most_rating < math.inf:
            raise InputError(
                f"least_rating and most_rating are {self.least_rating:g} and {self.most_rating:g}, but must be "
                "positive with 1 between them: give ratios like 0.25 and 4.0."
            )

    @property
    def bounds(self) -> tuple[float, float]:
        return self.least_rating, self.most_rating

    @property
    def answered(self) -> str:
        if self.reference == "same-scene":
            return "Ratings were ratios to the pinhole picture of the same scene, shown just before, as in the paper."
        return (
            "Ratings were ratios to a pinhole picture of another scene that counts as 1, shown now and then; the "
            "paper’s increase is relative to the same scene’s pinhole picture, which here follows from the analysis."
        )

    @property
    def example(self) -> float:
        return 1.5 if self.most_rating >= 1.5 else float(f"{math.sqrt(self.most_rating):.4g}")

    def control(self, texts: Words) -> Scale:
        below = texts("depth.below_standard" if self.reference == "standard" else "depth.below_same")
        ends = (texts("depth.flatter"), texts("depth.deeper"))
        return Scale(texts("depth.question"), below, *self.bounds, ends=ends, typed=self.answer == "typed")

    def instructions(self, texts: Words) -> str:
        reference = texts("depth.reference_standard" if self.reference == "standard" else "depth.reference_same")
        return texts("depth.instructions_ratio", reference=reference, ratios=self.doubled(texts))

    def doubled(self, texts: Words) -> str:
        """Return the text about ratios 2 and 0.5; empty if the scale does not include both."""
        both = self.least_rating <= 0.5 and self.most_rating >= 2
        return texts("depth.ratios", half=texts.number(0.5, "g")) if both else ""

    def example_text(self, texts: Words) -> str:
        return texts("depth.example_ratio", **self.ends(texts))

    def simulated(self, log_ratio: float, largest: float) -> float:
        return round(math.exp(log_ratio), 3)
