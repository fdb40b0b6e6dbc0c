"""Rounds of practice: judged, recorded, and repeated until the design's criterion is met."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from focalgradient.dataset import Session
from focalgradient.dataset.events import Event
from focalgradient.design import Trial
from focalgradient.errors import InputError
from focalgradient.tasks.steps import judged, judged_round
from focalgradient.web.answers import Read, round_notes

__all__ = ["PASSED", "judge", "note_round", "practice_numbers", "start_of"]

PASSED = ("practice", 0)
"""Phase and number whose token is that of passed practice; no trial has the number 0."""


def judge(session: Session, practised: Sequence[tuple[Trial, Read]], number: int) -> dict[str, Any]:
    """Judge the responses of a round of practice so far, as the laboratory does.

    Returns
    -------
    dict
        "right" of the responses, "of" those that have a correct one; whether the round is "passed", and to be
        repeated ("again"); "share" of the last trial's time, in %, for which the correct key was held.
    """
    design, who = session.design, session.files.participant
    each = [judged(session.task, design, trial, read.answer, who) for trial, read in practised]
    found, share = judged_round(design, [right for right, _ in each]), each[-1][1]
    again = not found["passed"] and number < getattr(design, "practice_rounds", 1)
    return found | {"again": again, "share": None if share is None else round(100 * share)}


def note_round(
    session: Session,
    practised: Sequence[tuple[Trial, Read]],
    number: int,
    found: Mapping[str, Any],
    events: Sequence[Event],
    elapsed_s: float | None,
) -> None:
    """Record the result `found` for a whole round of practice, once; `events` are those of the journal so far.

    Raises
    ------
    InputError
        If an earlier round was not judged.
    """
    last, _ = _last_round(events)
    if number > last + 1:
        raise InputError(f"round {number} of practice is not the next: send round {last + 1}.")
    if number == last + 1:
        again = practised if number > 1 else []  # the first responses are recorded as such
        session.note_all(round_notes(number, found, again, elapsed_s))


def start_of(session: Session, events: Sequence[Event]) -> tuple[int, int]:
    """Return the index of a sitting's first trial, and the round of practice that it begins with.

    A sitting after a round that is to be repeated begins with that practice again; `events` are those before it.
    """
    done = sum(event["event"] == "trial" for event in events)
    last, passed = _last_round(events)
    phases = [trial.phase for trial in session.trials[max(done - 1, 0) : done + 1]]
    if passed or phases != ["practice", "main"] or last >= getattr(session.design, "practice_rounds", 1):
        return done, 1
    return 0, last + 1


def _last_round(events: Sequence[Event]) -> tuple[int, bool]:
    """Return the last round of practice that was judged, and whether it was passed; 0 and True before the first."""
    rounds = [(int(event["round"]), bool(event["passed"])) for event in events if event.get("kind") == "practice"]
    return rounds[-1] if rounds else (0, True)


def practice_numbers(trials: Sequence[Trial]) -> set[int]:
    """Return the numbers of the practice trials among `trials`."""
    return {trial.trial for trial in trials if trial.phase == "practice"}
