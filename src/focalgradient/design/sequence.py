"""Sequence of pages and trials of a session, for laboratory and browser.

Each task has one class of `Pages`, in its own file, which provides the steps at the beginning of a sitting, between two
trials, and at the end of the session.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
    "sequence",
]


@dataclass(frozen=True, slots=True)
class Page:
    """Page of text.

    Parameters
    ----------
    event
        Name of its event marker.
    text
        Text with the title as first line. Values that are known only when it is shown are in braces: ``{minutes}``
        left, ``{share}`` of the time in %.
    at
        Value on the scale shown by an example below the text; None on other pages.
    least_s
        Minimum display time of the page, in s.
    ends
        Name of the event marker sent when the page is left; empty: none.
    """

    event: str
    text: str
    at: float | None = None
    least_s: float = 0.0
    ends: str = ""


@dataclass(frozen=True, slots=True)
class Standard:
    """The standard, after a page that announces it.

    Parameters
    ----------
    text
        Text of the page.
    form
        "picture", or "real" for a look at the real world.
    """

    text: str
    form: str = "picture"


@dataclass(frozen=True, slots=True)
class Turn:
    """Trial with the steps that always accompany it, also when it is repeated.

    Parameters
    ----------
    trial
        Trial of the design.
    lead, after
        Steps directly before and after it.
    """

    trial: Trial
    lead: tuple[Page | Standard, ...] = ()
    after: tuple[Page, ...] = ()


@dataclass(frozen=True, slots=True)
class Repeat:
    """Point at which practice is evaluated, and repeated until its criterion is met.

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


@dataclass(frozen=True, slots=True)
class Pages:
    """Pages of one task, for one participant; by default none.

    Parameters
    ----------
    design, words, participant
        Design, texts and participant of the session.
    browser
        Whether they are shown in a browser, where a button stops the session and no experimenter is present.
    """

    design: Any
    words: Words
    participant: str
    browser: bool = False

    def opening(self) -> tuple[Page, ...]:
        """Return the pages at the beginning of every sitting."""
        return ()

    def reminder(self, first: Any) -> tuple[Standard, ...]:
        """Return the steps that follow these pages, given the sitting's first trial."""
        return ()

    def lead(self, trial: Any, previous: Any) -> tuple[Page | Standard, ...]:
        """Return the steps directly before a trial; `previous` is the preceding one in the sitting, or None."""
        return ()

    def after(self, trial: Any) -> tuple[Page, ...]:
        """Return the pages directly after a trial."""
        return ()

    def again(self) -> Page | None:
        """Return the page before repeated practice; None for a task without practice."""
        return None

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing."""
        return ()

    def instructions(self, *texts: str) -> tuple[Page, ...]:
        """Return pages of instructions."""
        return tuple(Page("instructions", text.strip()) for text in texts)

    def debriefing(self, entry: str, **values: str) -> tuple[Page, ...]:
        """Return the debriefing of an entry of the texts, which ends with whom participants can ask."""
        asked = self.words("web.questions" if self.browser else "common.questions")
        texts = self.words.pages(entry, questions=asked, **values)
        return tuple(Page("debriefing", text.strip()) for text in texts)

    @property
    def escape(self) -> str:
        """Text on the key that stops the session; empty for a browser, which shows a button instead."""
        return "" if self.browser else self.words("common.escape")


def breaks(
    design: Any, words: Words, pages: Pages, trials: Sequence[Trial], done: int = 0
) -> list[tuple[Turn, tuple[Page | Standard, ...], tuple[Page | Standard, ...]]]:
    """Return the remaining trials, each with its preceding steps as a sitting's first trial and as a later one.

    Parameters
    ----------
    design, words, pages
        Design, texts and pages of the session.
    trials
        All trials of the session.
    done
        Number of trials recorded.
    """
    total = sum(trial.phase == "main" for trial in trials)

    def between(trial: Trial, previous: Trial | None) -> tuple[Page | Standard, ...]:
        """Return the steps between two trials, or between a sitting's opening pages and its first trial."""
        steps: list[Page | Standard] = [] if previous is not None else [*pages.reminder(trial)]
        if previous is not None and (previous.phase, trial.phase) == ("practice", "main"):
            steps.append(Page("break", words("session.practice_over")))
        if trial.break_before:
            text = words("session.rest", done=trial.trial - 1, total=total, minutes="{minutes}")
            steps.append(Page("break", text, least_s=design.least_break_s))
        levels: Mapping[str, str] = getattr(trial, "factors", {})
        before: Mapping[str, str] = getattr(previous, "factors", {})
        for name, factor in getattr(design, "factors", {}).items():
            if factor.order == "blocked" and before.get(name) != levels[name]:
                steps.append(Page("ready", words("session.block", factor=name, level=levels[name])))
        return tuple(steps)

    found = []
    for place in range(done, len(trials)):
        trial, previous = trials[place], trials[place - 1] if place else None
        turn = Turn(trial, pages.lead(trial, previous if place > done else None), pages.after(trial))
        found.append((turn, between(trial, None), between(trial, previous)))
    return found


def sequence(design: Any, words: Words, pages: Pages, trials: Sequence[Trial], done: int = 0) -> tuple[Step, ...]:
    """Return all steps of a sitting in order, from the first page of instructions to the thanks.

    Parameters
    ----------
    design, words, pages
        Design, texts and pages of the session.
    trials
        All trials of the session.
    done
        Number of trials recorded in earlier sittings.

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
