"""The pages of depth rating, in a window and in a browser alike."""

from __future__ import annotations

import math
from dataclasses import dataclass

from focalgradient.design.depth_rating import DepthRatingDesign, DepthTrial
from focalgradient.design.scales import Scale, Steps
from focalgradient.design.sequence import Page, Standard, escape_text, questions_text
from focalgradient.design.words import Words

__all__ = ["RatingPages", "instructions", "ratios_text", "scale_of", "standard_text"]


@dataclass(frozen=True, slots=True)
class RatingPages:
    """The pages that one participant reads, in the laboratory or in a browser.

    >>> from focalgradient.design.words import load_words
    >>> RatingPages(DepthRatingDesign(scale="steps", steps=2), load_words("en"), "01").opening()[-1].at
    2.0
    """

    design: DepthRatingDesign
    words: Words
    participant: str
    browser: bool = False

    def opening(self) -> tuple[Page, ...]:
        """Give the instructions, and the scale explained by an example."""
        texts = instructions(self.design, self.words, escape_text(self.words, browser=self.browser))
        read = tuple(Page("instructions", text.strip()) for text in texts)
        return read if self.design.scale == "choice" else (*read, self._example())

    def _example(self) -> Page:
        example = example_of(self.design)
        form = "+g" if self.design.scale == "bipolar" else "g"
        named = zip(("least", "most", "example"), (*self.design.bounds, example), strict=True)
        numbers = {name: self.words.number(one, form) for name, one in named}
        return Page("example", self.words(f"depth.example_{self.design.scale}", **numbers), at=example)

    def reminder(self, first: DepthTrial) -> tuple[Standard, ...]:
        """Give the standard, unless the first trial of the sitting brings it."""
        return self._standard(shown=self.design.has_standard and not first.standard_before)

    def lead(self, trial: DepthTrial, previous: DepthTrial | None) -> tuple[Standard, ...]:
        """Give the standard before the trials of the design that bring it."""
        return self._standard(shown=trial.standard_before)

    def _standard(self, *, shown: bool) -> tuple[Standard, ...]:
        return (Standard(standard_text(self.design, self.words)),) if shown else ()

    def after(self, trial: DepthTrial) -> tuple[Page, ...]:
        """Give nothing."""
        return ()

    def again(self) -> Page:
        """Give the page before repeated practice."""
        choice = self.design.scale == "choice"
        return Page("feedback", self.words("depth.practice_again_choice" if choice else "depth.practice_again"))

    def closing(self) -> tuple[Page, ...]:
        """Give the debriefing, which mentions the fixated object and the drawings only where the design has them."""
        words, design = self.words, self.design
        asked = questions_text(self.words, browser=self.browser)
        drawings = words("depth.about_drawings") if design.shows_drawings else ""
        fixations = words("depth.about_fixation" if len(design.fixations) > 1 else "depth.about_depth")
        texts = words.pages("depth.debriefing", question=fixations, drawings=drawings, questions=asked)
        return tuple(Page("debriefing", text.strip()) for text in texts)


def example_of(design: DepthRatingDesign) -> float:
    """Choose the answer that the example shows: the first step above the middle of the scale, or a ratio above 1.

    >>> [example_of(DepthRatingDesign(scale="steps", steps=steps)) for steps in (2, 3, 4, 7, 21)]
    [2.0, 3.0, 3.0, 5.0, 12.0]
    >>> example_of(DepthRatingDesign()), example_of(DepthRatingDesign(most_rating=1.21))
    (1.5, 1.1)
    """
    if design.scale == "steps":
        return float((design.steps + 1) // 2 + 1)
    if design.scale == "bipolar":
        return 1.0
    return 1.5 if design.most_rating >= 1.5 else float(f"{math.sqrt(design.most_rating):.4g}")


def ratios_text(words: Words, least: float, most: float) -> str:
    """Say which ratio counts as twice and as half as deep, where the scale has both; else nothing."""
    return words("depth.ratios", half=words.number(0.5, "g")) if least <= 0.5 and most >= 2 else ""


def instructions(design: DepthRatingDesign, words: Words, escape: str) -> tuple[str, str]:
    """Give the two pages that the participant reads; `escape` says how to stop."""
    if design.scale == "choice":
        way = "choice"
    else:
        scale = scale_of(design, words)
        way = design.answer if isinstance(scale, Scale) else "steps" if scale.has_digits else "arrows"
    least, most = (words.number(end, "g") for end in design.bounds)
    reference = words("depth.reference_standard" if design.has_standard else "depth.reference_same")
    filled = {
        "ratio": {"reference": reference, "ratios": ratios_text(words, *design.bounds)},
        "steps": {"least": least, "most": most},
        "bipolar": {"reference": reference},
        "choice": {},
    }[design.scale]
    first = words(f"depth.instructions_{design.scale}", **filled)
    mark = words("depth.mark_stays" if design.mark == "kept" else "depth.mark_goes")
    return first, words("depth.trial", mark=mark, answer=words(f"depth.answer_{way}"), escape=escape)


def standard_text(design: DepthRatingDesign, words: Words) -> str:
    """What stands on the page before the standard: which number it counts as."""
    return words("depth.standard", number="1" if design.scale == "ratio" else "0")


def scale_of(design: DepthRatingDesign, words: Words) -> Scale | Steps:
    """Give the scale of a design; a choice between two pictures has none.

    >>> from focalgradient.design.words import load_words
    >>> scale_of(DepthRatingDesign(scale="steps"), load_words("en")).labelled()
    [(1, 'flat'), (7, 'very deep')]
    """
    if design.scale == "ratio":
        below = words("depth.below_standard" if design.has_standard else "depth.below_same")
        ends = (words("depth.flatter"), words("depth.deeper"))
        return Scale(words("depth.question"), below, *design.bounds, ends=ends, typed=design.answer == "typed")
    least, most = map(int, design.bounds)
    if design.scale == "steps":
        labels = design.labels or (words("depth.flat"), words("depth.very_deep"))
        return Steps(words("depth.question"), "", least, most, labels)
    labels = design.labels or tuple(words(f"depth.{name}") for name in ("much_flatter", "alike", "much_deeper"))
    reference = words("depth.the_standard" if design.has_standard else "depth.the_one_before")
    return Steps(words("depth.question_bipolar", reference=reference), "", least, most, labels)
