"""What a walk through the steps of a sitting shows, in a list that a window's events and a page's log compare with."""

from __future__ import annotations

from collections.abc import Iterable

from focalgradient.design.sequence import Page, Repeat, Standard, Step, Turn

__all__ = ["walked"]


def walked(steps: Iterable[Step], rounds: int = 1) -> list[tuple[str, str]]:
    """List event and text of all that is shown; practice is repeated until it has been shown `rounds` times."""
    shown: list[tuple[str, str]] = []
    for step in steps:
        if isinstance(step, Page):
            shown.append((step.event, step.text))
        elif isinstance(step, Standard):
            shown += [("ready", step.text), ("standard", "")]
        elif isinstance(step, Turn):
            trial = ("trial", f"{step.trial.phase} {step.trial.trial}")
            shown += [*walked(step.lead), trial, *walked(step.after)]
        elif isinstance(step, Repeat):
            shown += walked([step.again, *step.turns]) * (rounds - 1)
    return shown
