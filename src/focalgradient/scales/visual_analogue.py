"""Visual analogue scale: a position on a line between two labelled ends, without steps or numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from focalgradient.analyses import Slopes
from focalgradient.scales.base import AnswerColumn, ResponseScale
from focalgradient.scales.controls import Scale
from focalgradient.scales.steps import check_labels
from focalgradient.words import Words

__all__ = ["VisualAnalogue"]


@dataclass(frozen=True)
class VisualAnalogue(ResponseScale):
    """Position on a line from 0 (flat) to 100 (very deep), in per cent of its length from the left end.

    Parameters
    ----------
    labels
        Labels of the two ends; empty: those of the translation.

    Examples
    --------
    >>> VisualAnalogue().bounds, VisualAnalogue().simulated(0.0, 1.4)
    ((0.0, 100.0), 50.0)
    """

    labels: tuple[str, ...] = ()

    name: ClassVar[str] = "visual-analogue"
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "en": {
            "instructions": "How deep does the picture look?\n"
            "You will see pictures of scenes, one after the other. Each time say how three-dimensional the scene looks "
            "to you: how much it seems to extend in depth, in front of you and away from you.\n\n"
            "You answer by a place on a line: the farther to the right, the deeper. Go by how it looks to you.",
            "example": "An example\n"
            "A picture looks deep rather than flat: you answer to the right of the middle, as shown below.\n"
            "Use the whole line. If a picture looks flatter or deeper than all before it, answer with its end.",
        },
        "de": {
            "instructions": "Wie tief sieht das Bild aus?\n"
            "Sie sehen nacheinander Bilder von Szenen. Geben Sie jedes Mal an, wie räumlich die Szene auf Sie wirkt: "
            "wie weit sie sich in die Tiefe zu erstrecken scheint, vor Ihnen und von Ihnen weg.\n\n"
            "Sie antworten mit einer Stelle auf einer Linie: je weiter rechts, desto tiefer. Richten Sie sich danach, "
            "wie es auf Sie wirkt.",
            "example": "Ein Beispiel\n"
            "Ein Bild sieht eher tief als flach aus: Sie antworten rechts von der Mitte, wie unten gezeigt.\n"
            "Nutzen Sie die ganze Linie. Sieht ein Bild flacher oder tiefer aus als alle vor ihm, antworten Sie mit "
            "ihrem Ende.",
        },
    }
    bounds = (0.0, 100.0)
    middle = 50.0
    example = 70.0
    analysis = Slopes(
        name="visual-analogue", middle=50.0, answers="places on a line", unit="per cent of the line", mean="mean place"
    )
    column = AnswerColumn(
        "How three-dimensional it looked: place on a line from flat (0) to very deep (100).",
        units="%",
        least=0.0,
        most=100.0,
    )
    answered = "Answers were places on a line from flat (0) to very deep (100)."

    def __post_init__(self) -> None:
        check_labels(self.name, self.labels, {0, 2})

    def control(self, texts: Words) -> Scale:
        first, last = self.labels or (texts("depth.flat"), texts("depth.very_deep"))
        return Scale(texts("depth.question"), "", *self.bounds, ratios=False, ends=(first, last), numbered=False)

    def simulated(self, log_ratio: float, largest: float) -> float:
        return round(min(max(50 + 50 * log_ratio / largest, 0.0), 100.0), 1)
