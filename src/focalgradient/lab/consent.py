"""Consent in the window: the text is read page by page, and agreed to."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING

from focalgradient.design.consent import Consent
from focalgradient.lab.experiment import Quit
from focalgradient.lab.forms import pages

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["agree"]


def agree(window: Screen, consent: Consent) -> str:
    """Let the participant read, page by page, and agree: when that was (ISO 8601); who does not does not take part."""
    words = window.words
    *first, last = consent.texts
    pages(window, first, "consent")
    foot = words("consent.keys", yes=words.yes.upper(), no=words.no.upper())
    if pages(window, [last], "consent", keys=(words.yes, words.no), foot=foot) == words.no:
        raise Quit
    return datetime.now(UTC).isoformat(timespec="seconds")
