"""The words that the page shows, of the session's language: instructions, scale, breaks."""

from __future__ import annotations

from typing import Any

from focalgradient.design import DepthRatingDesign, Design, NeckerDesign, Trial
from focalgradient.design.rating_pages import instructions, scale_of, standard_text
from focalgradient.design.scales import Scale
from focalgradient.design.words import Words
from focalgradient.errors import InputError

__all__ = ["block", "check", "depth", "necker", "rest"]


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
    first, trial = instructions(design, words, escape="")
    content: dict[str, Any] = {"instructions": [first, trial.strip()], "scale": _scale(design, words)}
    if design.has_standard:
        content["standard_text"] = standard_text(design, words)
    return content


def _scale(design: DepthRatingDesign, words: Words) -> dict[str, Any]:
    if design.scale == "choice":
        ways = [words("depth.first"), words("depth.second")]
        return {"kind": "choice", "question": words("depth.question_choice"), "ways": ways}
    scale = scale_of(design, words)
    asked = {"question": scale.question, "below": scale.below}
    if isinstance(scale, Scale):
        range_ = {"least": scale.least, "most": scale.most}
        return {"kind": "ratio", **asked, "ends": list(scale.ends), "ticks": scale.ticks(), **range_}
    named = dict(scale.labelled())
    return {"kind": "steps", **asked, "steps": [{"value": step, "label": named.get(step, "")} for step in scale.values]}


def necker(design: NeckerDesign, words: Words, participant: str) -> dict[str, Any]:
    """Instructions and keys of the cube."""
    keys = design.keys_of(participant)
    content = {f"{name}_key": key.upper() for name, key in keys.items()}
    pages = words.pages("necker.instructions", escape="", **content)
    return {"instructions": pages, "keys": keys}


def block(design: Design, words: Words, trial: Trial, before: dict[str, str]) -> str:
    """What stands before a trial that begins a block of a factor; empty elsewhere. `before` keeps the last levels."""
    for name, factor in getattr(design, "factors", {}).items():
        level = trial.factors[name]  # type: ignore[attr-defined]
        if factor.order == "blocked" and before.get(name) != level:
            before[name] = level
            return words("session.block", factor=name, level=level)
    return ""


def rest(words: Words, trial: Trial, total: int) -> str:
    """What stands on the page of a break; the page fills in the {minutes} that are left, by its own clock."""
    return words("session.rest", done=trial.trial - 1, total=total, minutes="{minutes}")
