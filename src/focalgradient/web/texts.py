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
    raise NotImplementedError


def necker(design: NeckerDesign, words: Words, participant: str) -> dict[str, Any]:
    """Instructions and keys of the cube."""
    keys = design.keys_of(participant)
    told = {f"{name}_key": key.upper() for name, key in keys.items()}
    pages = words.pages("necker.instructions", escape="", **told)
    return {"instructions": pages, "keys": keys}


def rest(words: Words, trial: Trial, total: int) -> str:
    """What stands on the page of a break."""
    return words("session.rest", done=trial.trial - 1, total=total, minutes="?")
