"""Pages of the blur-threshold experiments."""

from __future__ import annotations

from dataclasses import dataclass

from focalgradient.design.blur_threshold import BlurThresholdDesign, BlurTrial
from focalgradient.design.sequence import Page, Standard, escape_text, questions_text
from focalgradient.design.words import Words

__all__ = ["ThresholdPages"]


@dataclass(frozen=True, slots=True)
class ThresholdPages:
    """Pages for one participant, in the laboratory or in a browser."""

    design: BlurThresholdDesign
    words: Words
    participant: str
    browser: bool = False

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        texts = [
            self.words(f"blur.instructions_{self.design.judged}"),
            self.words("blur.trial", escape=escape_text(self.words, browser=self.browser)),
        ]
        return tuple(Page("instructions", text.strip()) for text in texts)

    def reminder(self, first: BlurTrial) -> tuple[Standard, ...]:
        """Return no steps: there is no standard."""
        return ()

    def lead(self, trial: BlurTrial, previous: BlurTrial | None) -> tuple[Page, ...]:
        """Return no pages."""
        return ()

    def after(self, trial: BlurTrial) -> tuple[Page, ...]:
        """Return no pages."""
        return ()

    def again(self) -> Page:
        """Return the page before repeated practice."""
        return Page("feedback", self.words("blur.practice_again"))

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing."""
        asked = questions_text(self.words, browser=self.browser)
        return tuple(Page("debriefing", text) for text in self.words.pages("blur.debriefing", questions=asked))
