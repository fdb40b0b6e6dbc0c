"""Pages of a task that has only instructions and a debriefing."""

from __future__ import annotations

from dataclasses import dataclass

from focalgradient.design.plan import Trial
from focalgradient.design.sequence import Page, Standard
from focalgradient.design.words import Words
from focalgradient.tasks import Task

__all__ = ["PlainPages"]


@dataclass(frozen=True, slots=True)
class PlainPages:
    """Pages from a task's texts "instructions" and "debriefing", in which ``---`` separates pages.

    Parameters
    ----------
    task, words
        Task, and language of its texts.
    """

    task: Task
    words: Words

    def _read(self, entry: str, event: str) -> tuple[Page, ...]:
        if not any(entry in texts for texts in self.task.texts.values()):
            return ()
        return tuple(Page(event, text.strip()) for text in self.task.text(self.words, entry).split("\n---\n"))

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        return self._read("instructions", "instructions")

    def reminder(self, first: Trial) -> tuple[Standard, ...]:
        """Return no steps."""
        return ()

    def lead(self, trial: Trial, previous: Trial | None) -> tuple[Page | Standard, ...]:
        """Return no steps."""
        return ()

    def after(self, trial: Trial) -> tuple[Page, ...]:
        """Return no pages."""
        return ()

    def again(self) -> None:
        """Return None: practice is not evaluated."""
        return

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing."""
        return self._read("debriefing", "debriefing")
