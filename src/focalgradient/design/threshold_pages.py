"""Pages of the blur-threshold experiments."""

from __future__ import annotations

from focalgradient.design.sequence import Page, Pages

__all__ = ["ThresholdPages"]


class ThresholdPages(Pages):
    """Pages for one participant, in the laboratory or in a browser."""

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        judged = self.words(f"blur.instructions_{self.design.judged}")
        return self.instructions(judged, self.words("blur.trial", escape=self.escape))

    def again(self) -> Page:
        """Return the page before repeated practice."""
        return Page("feedback", self.words("blur.practice_again"))

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing."""
        return self.debriefing("blur.debriefing")
