"""The pages of a design: those of its task."""

from __future__ import annotations

from typing import Any

from focalgradient.design.sequence import Pages
from focalgradient.design.words import Words
from focalgradient.tasks import task_named

__all__ = ["pages_of"]


def pages_of(design: Any, words: Words, participant: str, *, browser: bool = False) -> Pages:
    """Make the pages of a design for one participant.

    Parameters
    ----------
    design, words, participant
        Of the session.
    browser
        Whether they are shown in a browser: there a button stops the session, and nobody is there to be asked.
    """
    return task_named(design.task).pages(design, words, participant, browser)
