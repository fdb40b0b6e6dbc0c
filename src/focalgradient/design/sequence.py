"""The sequence of pages and trials of a session: the laboratory and the browser both walk through it.

Each task has one class of pages (`rating_pages`, `cube_pages`, `pinhole_pages`, `threshold_pages`). It gives what a
sitting begins with, what comes between two trials, and what the session ends with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from focalgradient.design.plan import Trial
from focalgradient.design.words import Words

__all__ = [
    "Page",
    "Pages",
    "Repeat",
    "Standard",
    "Step",
    "Turn",
    "breaks",
    "escape_text",
    "questions_text",
    "sequence",
]


@dataclass(frozen=True, slots=True)
class Page:
    """A page of text.

    Parameters
    ----------
    event
        Name of its marker.
    text
        The first line is the title. What is known only when it is shown stands in braces: ``{minutes}`` that are left,
        ``{share}`` of the time (%).
    at
        Value on the scale that an example shows below the text; None elsewhere.
    least_s
        Shortest time in seconds that the page stays.
    """

    event: str
    text: str
    at: float | None = None
    least_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Standard:
    """The standard, after a page that announces it.

    Parameters
    ----------
    text
        Of the page.
    form
        "picture", or "real" for a look at the real world.
    """

    text: str
    form: str = "picture"


@dataclass(frozen=True, slots=True)
class Turn:
    """A trial, with what always comes right before and after it, also where it is repeated.

    Parameters
    ----------
    trial
        Of the design.
    lead, after
        What comes right before it and right after it.
    """

    trial: Trial
    lead: tuple[Page | Standard, ...] = ()
    after: tuple[Page, ...] = ()


@dataclass(frozen=True, slots=True)
class Repeat:
    """Practice is judged here, and repeated until it is right.

    Parameters
    ----------
    turns
        Trials of a round.
    again
        Page before each further round.
    """

    turns: tuple[Turn, ...]
    again: Page


Step = Page | Standard | Turn | Repeat


class Pages(Protocol):
    """The pages of one task, for one participant."""

    def opening(self) -> tuple[Page, ...]:
        """Give the pages that every sitting begins with."""
        ...

    def reminder(self, first: Trial) -> tuple[Standard, ...]:
        """Give what comes after these pages, by the trial that is first in the sitting."""
        ...

    def lead(self, trial: Trial, previous: Trial | None) -> tuple[Page | Standard, ...]:
        """Give what comes right before a trial; `previous` is the one before it in the sitting."""
        ...

    def after(self, trial: Trial) -> tuple[Page, ...]:
        """Give what comes right after a trial."""
        ...

    def again(self) -> Page | None:
        """Give the page before repeated practice; None where no task has practice."""
        ...

    def closing(self) -> tuple[Page, ...]:
        """Give the debriefing."""
        ...


@dataclass(frozen=True, slots=True)
class _Session:
    design: Any
    words: Words
    pages: Pages
    total: int

    def turn(self, trial: Trial, previous: Trial | None) -> Turn:
        return Turn(trial, self.pages.lead(trial, previous), self.pages.after(trial))

    def between(self, trial: Trial, previous: Trial | None) -> tuple[Page | Standard, ...]:
        """What comes between two trials of a sitting, or between its opening pages and its first trial."""
        steps: list[Page | Standard] = [] if previous is not None else [*self.pages.reminder(trial)]
        if previous is not None and (previous.phase, trial.phase) == ("practice", "main"):
            steps.append(Page("break", self.words("session.practice_over")))
        if trial.break_before:
            text = self.words("session.rest", done=trial.trial - 1, total=self.total, minutes="{minutes}")
            steps.append(Page("break", text, least_s=self.design.least_break_s))
        levels: Mapping[str, str] = getattr(trial, "factors", {})
        before: Mapping[str, str] = getattr(previous, "factors", {})
        for name, factor in getattr(self.design, "factors", {}).items():
            if factor.order == "blocked" and before.get(name) != levels[name]:
                steps.append(Page("ready", self.words("session.block", factor=name, level=levels[name])))
        return tuple(steps)


def breaks(
    design: Any, words: Words, pages: Pages, trials: Sequence[Trial], done: int = 0
) -> list[tuple[Turn, tuple[Page | Standard, ...], tuple[Page | Standard, ...]]]:
    """Give the remaining trials, each with what comes before it where it is first in a sitting, and where it is not.

    Parameters
    ----------
    design, words, pages
        Of the session.
    trials
        All trials of the session.
    done
        Number of trials that are recorded.
    """
    session = _Session(design, words, pages, sum(trial.phase == "main" for trial in trials))
    found = []
    for place in range(done, len(trials)):
        trial, previous = trials[place], trials[place - 1] if place else None
        turn = session.turn(trial, previous if place > done else None)
        found.append((turn, session.between(trial, None), session.between(trial, previous)))
    return found


def sequence(design: Any, words: Words, pages: Pages, trials: Sequence[Trial], done: int = 0) -> tuple[Step, ...]:
    """Give all that a sitting shows, in order, from its first page of instructions to the thanks.

    Parameters
    ----------
    design, words, pages
        Of the session.
    trials
        All trials of the session.
    done
        Number of trials that earlier sittings have recorded.

    Examples
    --------
    >>> from focalgradient.design import NeckerDesign
    >>> from focalgradient.design.pages import pages_of
    >>> from focalgradient.design.words import load_words
    >>> design, words = NeckerDesign(), load_words("en")
    >>> steps = sequence(design, words, pages_of(design, words, "01"), design.trials("01"))
    >>> [type(step).__name__ for step in steps[:6]]
    ['Page', 'Page', 'Turn', 'Turn', 'Repeat', 'Page']
    """
    steps: list[Step] = []
    listed = breaks(design, words, pages, trials, done)
    practised: list[Turn] = []
    for number, (turn, first, before) in enumerate(listed):
        if number == 0:
            steps += pages.opening()
        if practised and turn.trial.phase == "main" and (again := pages.again()) is not None:
            steps.append(Repeat(tuple(practised), again))
            practised = []
        steps += before if number else first
        steps.append(turn)
        if turn.trial.phase == "practice":
            practised.append(turn)
    return (*steps, *pages.closing(), Page("thanks", words("session.thanks")))


def escape_text(words: Words, *, browser: bool) -> str:
    """Say which key stops the session; a browser shows a button for it instead."""
    return "" if browser else words("common.escape")


def questions_text(words: Words, *, browser: bool) -> str:
    """Say whom a participant can ask."""
    return words("web.questions" if browser else "common.questions")
