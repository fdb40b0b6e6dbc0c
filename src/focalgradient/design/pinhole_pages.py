"""Pages of the pinhole demonstration."""

from __future__ import annotations

from focalgradient.design.pinhole import PinholeTrial
from focalgradient.design.sequence import Page, Pages, Standard

__all__ = ["PinholePages"]

BLOCKS = {"real": "pinhole.block_real", "picture": "pinhole.block_picture"}


class PinholePages(Pages):
    """Pages for one participant, in the laboratory or in a browser."""

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        words = self.words
        ratios = self.design.response_scale.doubled(words)
        texts = [words("pinhole.instructions", ratios=ratios, escape=self.escape)]
        if "real" in self.design.forms:
            tube = words("pinhole.needed_tube") if "tube" in self.design.viewings else ""
            texts.append(words("pinhole.needed", tube=tube, seconds=words.number(self.design.look_s, "g")))
        return self.instructions(*texts)

    def lead(self, trial: PinholeTrial, previous: PinholeTrial | None) -> tuple[Page | Standard, ...]:
        """Return the page and the standard at the beginning of a block or sitting."""
        if previous is not None and (previous.form, previous.repetition) == (trial.form, trial.repetition):
            return ()
        block = Page("ready", self.words(BLOCKS[trial.form]), ends="block")
        return block, Standard(self.words("pinhole.standard"), trial.form)

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing, which mentions the tube only if it was used."""
        tube = self.words("pinhole.about_tube") if "tube" in self.design.viewings else ""
        return self.debriefing("pinhole.debriefing", tube=tube)
