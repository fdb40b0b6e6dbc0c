"""Pages of a task that has only instructions and a debriefing."""

from __future__ import annotations

from focalgradient.design.sequence import Page, Pages
from focalgradient.tasks import task_named

__all__ = ["PlainPages"]


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
