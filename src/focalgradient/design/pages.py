"""The class of pages of each task."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from focalgradient.design.cube_pages import CubePages
from focalgradient.design.pinhole_pages import PinholePages
from focalgradient.design.rating_pages import RatingPages
from focalgradient.design.sequence import Pages
from focalgradient.design.threshold_pages import ThresholdPages
from focalgradient.design.words import Words

__all__ = ["pages_of"]

PAGES: dict[str, Callable[..., Any]] = {
    "depthrating": RatingPages,
    "necker": CubePages,
    "pinhole": PinholePages,
    "blurthreshold": ThresholdPages,
}


def pages_of(design: Any, words: Words, participant: str, *, browser: bool = False) -> Pages:
    """Make the pages of a design for one participant.

    Parameters
    ----------
    design, words, participant
        Of the session.
    browser
        Whether they are shown in a browser: there a button stops the session, and nobody is there to be asked.
    """
    pages: Pages = PAGES[design.task](design, words, participant, browser)
    return pages
