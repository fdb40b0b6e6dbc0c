"""What the pages of depth rating show, in the session's words, in a window and in a browser alike."""

from __future__ import annotations

from focalgradient.design.depth_rating import DepthRatingDesign
from focalgradient.design.scales import Scale, Steps
from focalgradient.design.words import Words

__all__ = ["instructions", "scale_of", "standard_text"]


def instructions(design: DepthRatingDesign, words: Words, escape: str) -> tuple[str, str]:
    """Give the two pages that the participant reads; `escape` says how to stop."""
    way = design.answer if design.scale == "ratio" else {"bipolar": "steps"}.get(design.scale, design.scale)
    least, most = (words.number(end, "g") for end in design.bounds)
    reference = words("depth.reference_standard" if design.has_standard else "depth.reference_same")
    filled = {
        "ratio": {"reference": reference},
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
