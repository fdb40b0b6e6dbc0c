"""Texts of a session in the form that the page shows: pages around trials, and the response scale."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from focalgradient.design import DepthRatingDesign
from focalgradient.design.sequence import Page, Standard
from focalgradient.design.words import Words

__all__ = ["scale", "step"]


def step(one: Page | Standard, standard: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a page, or the standard with its page, in the browser's format; `standard` is the standard's interval."""
    if isinstance(one, Standard):
        return {"event": "ready", "text": one.text, "standard": standard}
    entry: dict[str, Any] = {"event": one.event, "text": one.text}
    if one.at is not None:
        entry["at"] = one.at
    if one.least_s:
        entry["least_s"] = one.least_s
    return entry


def scale(design: DepthRatingDesign, words: Words) -> dict[str, Any]:
    """Return the response scale in the browser's format."""
    return design.response_scale.control(words).form()
