"""Texts of a session in the form that the page shows: pages around trials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from focalgradient.design.sequence import Page, Standard

__all__ = ["step"]


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
