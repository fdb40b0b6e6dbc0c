"""Pages of a design, which its task defines; by default its instructions and its debriefing."""

from __future__ import annotations

from typing import Any

from focalgradient.design.sequence import Page, Pages
from focalgradient.design.words import Words
from focalgradient.tasks import task_named

__all__ = ["PlainPages", "pages_of"]


class PlainPages(Pages):
    """Pages from a task's texts "instructions" and "debriefing", in which ``---`` separates pages."""

    def _read(self, entry: str, event: str) -> tuple[Page, ...]:
        task = task_named(self.design.task)
        if not any(entry in texts for texts in task.texts.values()):
            return ()
        return tuple(Page(event, text.strip()) for text in task.text(self.words, entry).split("\n---\n"))

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        return self._read("instructions", "instructions")

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing."""
        return self._read("debriefing", "debriefing")


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
