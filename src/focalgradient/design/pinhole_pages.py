"""Pages of the pinhole demonstration."""

from __future__ import annotations

from dataclasses import dataclass

from focalgradient.design.pinhole import Pinhole, PinholeTrial
from focalgradient.design.sequence import Page, Standard, escape_text, questions_text
from focalgradient.design.words import Words

__all__ = ["PinholePages"]

BLOCKS = {"real": "pinhole.block_real", "picture": "pinhole.block_picture"}


@dataclass(frozen=True, slots=True)
class PinholePages:
    """Pages for one participant, in the laboratory or in a browser."""

    design: Pinhole
    words: Words
    participant: str
    browser: bool = False

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        words = self.words
        ratios = self.design.response_scale.doubled(words)
        texts = [words("pinhole.instructions", ratios=ratios, escape=escape_text(self.words, browser=self.browser))]
        if "real" in self.design.forms:
            tube = words("pinhole.needed_tube") if "tube" in self.design.viewings else ""
            texts.append(words("pinhole.needed", tube=tube, seconds=words.number(self.design.look_s, "g")))
        return tuple(Page("instructions", text.strip()) for text in texts)

    def reminder(self, first: PinholeTrial) -> tuple[Standard, ...]:
        """Return no steps: each block and each sitting begins with the standard."""
        return ()

    def lead(self, trial: PinholeTrial, previous: PinholeTrial | None) -> tuple[Page | Standard, ...]:
        """Return the page and the standard at the beginning of a block or sitting."""
        if previous is not None and (previous.form, previous.repetition) == (trial.form, trial.repetition):
            return ()
        block = Page("ready", self.words(BLOCKS[trial.form]), ends="block")
        return block, Standard(self.words("pinhole.standard"), trial.form)

    def after(self, trial: PinholeTrial) -> tuple[Page, ...]:
        """Return no pages."""
        return ()

    def again(self) -> None:
        """Return None: the demonstration has no practice."""
        return

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing, which mentions the tube only if it was used."""
        tube = self.words("pinhole.about_tube") if "tube" in self.design.viewings else ""
        asked = questions_text(self.words, browser=self.browser)
        texts = self.words.pages("pinhole.debriefing", tube=tube, questions=asked)
        return tuple(Page("debriefing", text) for text in texts)
