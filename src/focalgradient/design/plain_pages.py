"""The pages of a task that has instructions, a debriefing and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

from focalgradient.design.plan import Trial
from focalgradient.design.sequence import Page, Standard
from focalgradient.design.words import Words
from focalgradient.tasks import Task

__all__ = ["PlainPages"]


@dataclass(frozen=True, slots=True)
class PlainPages:
    """The pages of a task by its texts "instructions" and "debriefing", each page apart from the next by ``---``.

    Parameters
    ----------
    task, words
        Whose texts, in which language.
    """

    task: Task
    words: Words

    def _read(self, entry: str, event: str) -> tuple[Page, ...]:
        if not any(entry in texts for texts in self.task.texts.values()):
            return ()
        return tuple(Page(event, text.strip()) for text in self.task.text(self.words, entry).split("\n---\n"))

    def opening(self) -> tuple[Page, ...]:
        """Give the instructions."""
        return self._read("instructions", "instructions")

    def reminder(self, first: Trial) -> tuple[Standard, ...]:
        """Give nothing."""
        return ()

    def lead(self, trial: Trial, previous: Trial | None) -> tuple[Page | Standard, ...]:
        """Give nothing."""
        return ()

    def after(self, trial: Trial) -> tuple[Page, ...]:
        """Give nothing."""
        return ()

    def again(self) -> None:
        """Give nothing: practice is not judged."""
        return

    def closing(self) -> tuple[Page, ...]:
        """Give the debriefing."""
        return self._read("debriefing", "debriefing")
