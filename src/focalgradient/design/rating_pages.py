"""Pages of the depth-rating experiment, for window and browser."""

from __future__ import annotations

from focalgradient.design.depth_rating import DepthRatingDesign, DepthTrial
from focalgradient.design.sequence import Page, Pages, Standard
from focalgradient.design.words import Words

__all__ = ["RatingPages", "instructions", "standard_text"]


class RatingPages(Pages):
    """Pages for one participant, in the laboratory or in a browser.

    >>> from focalgradient.design.words import load_words
    >>> RatingPages(DepthRatingDesign(scale="steps", steps=2), load_words("en"), "01").opening()[-1].at
    2.0
    """

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions, and an example that explains the scale."""
        read = self.instructions(*instructions(self.design, self.words, self.escape))
        scale = self.design.response_scale
        if scale.example is None:
            return read
        return *read, Page("example", scale.example_text(self.words), at=scale.example)

    def reminder(self, first: DepthTrial) -> tuple[Standard, ...]:
        """Return the standard, unless the first trial of the sitting is preceded by it."""
        return self._standard(shown=self.design.has_standard and not first.standard_before)

    def lead(self, trial: DepthTrial, previous: DepthTrial | None) -> tuple[Standard, ...]:
        """Return the standard, if the design shows it before the trial."""
        return self._standard(shown=trial.standard_before)

    def _standard(self, *, shown: bool) -> tuple[Standard, ...]:
        return (Standard(standard_text(self.design, self.words)),) if shown else ()

    def again(self) -> Page:
        """Return the page before repeated practice."""
        return Page("feedback", self.words(self.design.response_scale.again))

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing, which mentions the fixated object and the drawings only if the design has them."""
        words, design = self.words, self.design
        drawings = words("depth.about_drawings") if design.shows_drawings else ""
        fixations = words("depth.about_fixation" if len(design.fixations) > 1 else "depth.about_depth")
        return self.debriefing("depth.debriefing", question=fixations, drawings=drawings)


def instructions(design: DepthRatingDesign, words: Words, escape: str) -> tuple[str, str]:
    """Return the two pages of instructions; `escape` states how to stop."""
    scale = design.response_scale
    mark = words("depth.mark_stays" if design.mark == "kept" else "depth.mark_goes")
    answer = words(f"depth.answer_{scale.control(words).how}")
    return scale.instructions(words), words("depth.trial", mark=mark, answer=answer, escape=escape)


def standard_text(design: DepthRatingDesign, words: Words) -> str:
    """Return the page before the standard, which states the standard's value."""
    return words("depth.standard", number=f"{design.response_scale.standard:g}")
