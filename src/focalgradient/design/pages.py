"""Pages of a design, which its task defines."""

from __future__ import annotations

from typing import Any

from focalgradient.design.plain_pages import PlainPages
from focalgradient.design.sequence import Pages
from focalgradient.design.words import Words
from focalgradient.tasks import task_named

__all__ = ["pages_of"]


def pages_of(design: Any, words: Words, participant: str, *, browser: bool = False) -> Pages:
    """Return the pages of a design for one participant.

    Parameters
    ----------
    design, words, participant
        Design, texts and participant of the session.
    browser
        Whether they are shown in a browser, where a button stops the session and no experimenter is present.
    """
    made: Pages = (task_named(design.task).pages or PlainPages)(design, words, participant, browser)
    return made
