"""Replay of a journal: its events are recorded again by `Session.record`, and compared with what the journal holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

from focalgradient.dataset.alike import same_json
from focalgradient.dataset.bids import Files, is_of_this_version
from focalgradient.dataset.conduct import EXPOSURE
from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Journal, Log
from focalgradient.dataset.percepts import Press
from focalgradient.dataset.session import Session
from focalgradient.design import Design, Trial
from focalgradient.errors import InputError
from focalgradient.tasks.noted import AGAIN, EXTRA, Noted

__all__ = ["Contradiction", "replay"]

RESTORE = "restore the journal from a copy, or leave the session out."
REPAIR = "use 'focalgradient repair'."


class Contradiction(NamedTuple):
    """Event that the recorder refuses, or would have written with other values.

    `line` is its number in the journal, `trial` its phase and number, `why` the reason; `placed` is false for a
    second record of a trial, and for a trial that the design does not have.
    """

    line: int
    trial: str
    why: str
    placed: bool = True

    @property
    def sentence(self) -> str:
        """Return the sentence with line, trial, contradiction and remedy."""
        return f"line {self.line}, {self.trial}: {self.why}: {RESTORE if self.placed else REPAIR}"


class _Unwritten(Journal):
    """Journal that keeps the event written last, and has no file."""

    def __init__(self) -> None:
        super().__init__(Path(), -1, False, "")
        self.event: Event | None = None

    def write(self, *events: Mapping[str, Any]) -> None:
        self.event = dict(events[-1])


class _Replayed(Session):
    """Session that is recorded again from its events."""

    def misplaced(self, trial: Trial, event: Event) -> str | None:
        """Return how an event differs from what the procedure sets after the answers before, such as its level."""
        adapted = self.task.adapted(self.design, trial, self.recorded)
        return _difference(event, {name: getattr(adapted, name) for name in self.task.adapted_fields})

    def again(self, trial: Trial, event: Event) -> str | None:
        """Record the next trial again; return why it is refused."""
        try:
            self.record(trial, self._answer(trial, event))
        except (InputError, TypeError) as error:
            self._recorded.append(event)  # so that the trials after it are taken
            what = str(error).rstrip(".")
            return what.rpartition(": ")[0] or what
        return None

    def _answer(self, trial: Trial, event: Event) -> Any:
        given = {one.name: event[one.name] for one in fields(self.task.answer) if one.name in event}
        if "presses" in given:
            given["presses"] = [Press(*press) for press in given["presses"]]
        # The number of interruptions is counted anew, unless the program did not note the exposures.
        counted = {AGAIN} if self._exposures[trial.phase, trial.trial, 1] else set()
        given[EXTRA] = {
            name: Noted(noted["value"], noted.get("unit"), noted.get("description", ""))
            for name, noted in event.get(EXTRA, {}).items()
            if name not in counted
        }
        return self.task.answer(**given)


def replay(log: Log, design: Design, planned: Sequence[Trial]) -> Iterator[Contradiction]:
    """Record the exposures and trials of a journal again; yield the contradictions, in order of the lines.

    Trials are taken in the order of their first records, so that one lost line does not refuse all that follow.

    Parameters
    ----------
    log
        Journal without damaged lines.
    design, planned
        Design and trials of the session, including practice.
    """
    trials = {(trial.phase, trial.trial): trial for trial in planned}
    turns = dict.fromkeys((event["phase"], event["trial"]) for event in log.of("trial"))
    journal = _Unwritten()
    files = Files(Path(), design.task, log.head["participant"], log.head["session"])
    session = _Replayed(files, design, journal, trials=[trials[turn] for turn in turns if turn in trials])
    met = set[tuple[str, int]]()
    # Levels follow from the answers before, so those after a wrong or missing answer are not checked.
    follows = is_of_this_version(log) and [*turns] == [*trials][: len(turns)]
    for line, event in zip(log.lines, log.events, strict=True):
        exposed = event.get("kind") == EXPOSURE
        if not (exposed or event["event"] == "trial"):
            continue
        turn = (event["phase"], event["trial"])
        trial, journal.event, why, placed = trials.get(turn), None, None, True
        if trial is None:
            why, placed = "it is not in the design", exposed
        elif exposed:
            session.expose(trial, event.get("round", 1), exposure=event.get(EXPOSURE))
            why = None if journal.event else f"the exposure {event[EXPOSURE]!r} occurs more than once"
        elif turn in met:
            why, placed = "it occurs more than once", False
        else:
            met.add(turn)
            misplaced = session.misplaced(trial, event) if follows else None
            why = session.again(trial, event) or _difference(_values(event), _values(journal.event)) or misplaced
            follows &= why is None
        if why is not None:
            yield Contradiction(line, f"{turn[0]} trial {turn[1]}", why, placed)


def _difference(recorded: Mapping[str, Any], made: Mapping[str, Any]) -> str | None:
    """Return the first of the values made again that differs from that recorded."""
    for name, value in made.items():
        if recorded.get(name) != value and not same_json(recorded.get(name), value):
            return f"{name} is {recorded.get(name)!r}, but {value!r} by the design and the lines before"
    return None


def _values(event: Event | None) -> dict[str, Any]:
    event = event or {}
    extra = event.get(EXTRA, {})
    noted = {name: one["value"] for name, one in extra.items()}
    return {**event, AGAIN: None, **noted, EXTRA: None, "presses": None}  # presses are as they were read
