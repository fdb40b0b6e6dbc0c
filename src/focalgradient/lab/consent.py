"""Informed consent in the window: the participant reads the text page by page, and agrees or stops."""

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
    """Show the consent text page by page; return the time of agreement (ISO 8601), or raise `Quit` if refused."""
    words = window.words
    *first, last = consent.texts
    pages(window, first, "consent")
    foot = words("consent.keys", yes=words.yes.upper(), no=words.no.upper())
    if pages(window, [last], "consent", keys=(words.yes, words.no), foot=foot) == words.no:
        raise Quit
    return datetime.now(UTC).isoformat(timespec="seconds")
