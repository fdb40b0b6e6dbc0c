"""The words that the page shows, of the session's language: instructions, scale, breaks."""

from __future__ import annotations

from typing import Any

from focalgradient.design import DepthRatingDesign, NeckerDesign, Trial
from focalgradient.design.words import Words
from focalgradient.errors import InputError

__all__ = ["check", "depth", "necker", "rest"]


def check(design: DepthRatingDesign) -> None:
    """Refuse what the page cannot do.

    Raises
    ------
    InputError
        If the design asks for it: the first setting is named.
    """
    for name, allowed in (
        ("answer", "slider"),
        ("confidence", False),
        ("mask", "none"),
    ):
        if getattr(design, name) != allowed:
            raise InputError(f"{name} is {getattr(design, name)!r}, which the browser cannot do yet: leave it out.")


def depth(design: DepthRatingDesign, words: Words) -> dict[str, Any]:
    """Instructions and scale of depth rating."""
    least, most = (words.number(end, "g") for end in design.bounds)
    reference = words("depth.reference_standard" if design.has_standard else "depth.reference_same")
    first = words(f"depth.instructions_{design.scale}", reference=reference, least=least, most=most)
    mark = words("depth.mark_stays" if design.mark == "kept" else "depth.mark_goes")
    way = {"ratio": "slider", "bipolar": "steps"}.get(design.scale, design.scale)
    trial = words("depth.trial", mark=mark, answer=words(f"depth.answer_{way}"), escape="").strip()
    content: dict[str, Any] = {"instructions": [first, trial], "scale": _scale(design, words)}
    if design.has_standard:
        content["standard_text"] = words("depth.standard", number="1" if design.scale == "ratio" else "0")
    return content


def _scale(design: DepthRatingDesign, words: Words) -> dict[str, Any]:
    least, most = design.bounds
    question = words("depth.question")
    if design.scale == "choice":
        ways = [words("depth.first"), words("depth.second")]
        return {"kind": "choice", "question": words("depth.question_choice"), "ways": ways}
    if design.scale == "ratio":
        below = words("depth.below_standard" if design.has_standard else "depth.below_same")
        ends = [words("depth.flatter"), words("depth.deeper")]
        ticks = [2.0**power for power in range(-10, 11) if least <= 2.0**power <= most]
        return {"kind": "ratio", "question": question, "below": below, "ends": ends, "ticks": ticks} | {
            "least": least,
            "most": most,
        }
    steps = range(int(least), int(most) + 1)
    if design.scale == "bipolar":
        labels = design.labels or tuple(words(f"depth.{name}") for name in ("much_flatter", "alike", "much_deeper"))
        reference = words("depth.the_standard" if design.has_standard else "depth.the_one_before")
        question = words("depth.question_bipolar", reference=reference)
    else:
        labels = design.labels or (words("depth.flat"), words("depth.very_deep"))
    places = {2: [0, -1], 3: [0, len(steps) // 2, -1]}.get(len(labels), list(range(len(steps))))
    named = {steps[place]: label for place, label in zip(places, labels, strict=False)}
    return {
        "kind": "steps",
        "question": question,
        "below": "",
        "steps": [{"value": step, "label": named.get(step, "")} for step in steps],
    }


def necker(design: NeckerDesign, words: Words, participant: str) -> dict[str, Any]:
    """Instructions and keys of the cube."""
    keys = design.keys_of(participant)
    content = {f"{name}_key": key.upper() for name, key in keys.items()}
    pages = words.pages("necker.instructions", escape="", **content)
    return {"instructions": pages, "keys": keys}


def rest(words: Words, trial: Trial, total: int) -> str:
    """What stands on the page of a break; the page fills in the {minutes} that are left, by its own clock."""
    return words("session.rest", done=trial.trial - 1, total=total, minutes="{minutes}")
