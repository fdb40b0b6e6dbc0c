"""What the page shows of the session's words: the steps before, between and after trials, and the scale."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from focalgradient.design import DepthRatingDesign
from focalgradient.design.sequence import Page, Standard
from focalgradient.design.words import Words
from focalgradient.errors import InputError

__all__ = ["check", "scale", "step"]


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


def step(one: Page | Standard, standard: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Write a page, or the standard and its page, as the browser reads it; `standard` is the interval that shows it."""
    if isinstance(one, Standard):
        return {"event": "ready", "text": one.text, "standard": standard}
    entry: dict[str, Any] = {"event": one.event, "text": one.text}
    if one.at is not None:
        entry["at"] = one.at
    if one.least_s:
        entry["least_s"] = one.least_s
    return entry


def scale(design: DepthRatingDesign, words: Words) -> dict[str, Any]:
    """Describe what is answered on as the browser draws it."""
    return design.response_scale.control(words).form()
