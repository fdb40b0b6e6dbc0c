"""Onsets of a trial's mark, mask and question, and start of its sitting, derived from the journal's notes of events."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Log

__all__ = ["timed", "times_of_events", "trials_with_times"]


def timed(events: Sequence[Event]) -> Iterator[tuple[int, float, Event]]:
    """Yield each event with its sitting, and the offset in s from that sitting's clock to the first sitting's."""
    sitting, offset = 1, 0.0
    began = datetime.fromisoformat(events[0]["time"])
    for event in events:
        if event["event"] == "resumed":
            sitting += 1
            offset = (datetime.fromisoformat(event["time"]) - began).total_seconds()
        yield sitting, offset, event


BESIDE = ("mark", "mask", "question")
"""Events other than the judged stimulus, which appears at the trial's onset."""


def trials_with_times(log: Log) -> Iterator[tuple[int, Event, dict[str, Any]]]:
    """Yield each main trial: number of its sitting, its event, and its times by column."""
    began = log.head["time"]
    simulated = log.head["kind"] == "simulated"
    note: Mapping[str, Any] = {}
    for sitting, _, event in timed(log.events):
        if event["event"] == "resumed":
            began = event["time"]
        elif event["event"] == "note" and event.get("kind") in ("events", "frames"):
            note = event
        elif event["event"] == "trial":
            if event["phase"] == "main":
                date = {} if simulated else {"sitting_began": _utc(began)}
                yield sitting, event, date | _onsets(event["onset"], note)
            note = {}


def _utc(time: str) -> str:
    return datetime.fromisoformat(time).astimezone(UTC).isoformat(timespec="seconds")


def _onsets(onset: float, note: Mapping[str, Any]) -> dict[str, float]:
    """Return the onset of the last mark before the judged stimulus, and of the first mask and question after it."""
    happened = [*times_of_events(onset, note)]
    found = {"mark": max((seconds for name, seconds in happened if name == "mark" and seconds <= onset), default=None)}
    for name in ("mask", "question"):
        found[name] = min((seconds for one, seconds in happened if one == name and seconds >= onset), default=None)
    return {f"{name}_onset": round(seconds, 6) for name, seconds in found.items() if seconds is not None}


def times_of_events(onset: float, note: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """Yield name and time (s of the sitting) of each event, converting time stamps of a browser's clock.

    The trial's onset is that of its first stimulus or, if a reference precedes it, of the one with the number `judged`.
    """
    for name, seconds, _ in note.get("events", ()):
        yield name, seconds
    shown = note.get("shown", ())
    stimuli = [one["stamps"][0] for one in shown if one["event"] not in BESIDE]
    judged = next(iter(stimuli[note.get("judged", 0) :]), None)
    for one in shown if judged is not None else ():
        yield one["event"], onset + (one["stamps"][0] - judged) / 1e3
