"""What happened in a session besides its answers: exposures, practice, consent, and the display's synchronisation.

The journal's events say it; `focalgradient.dataset.validate` and reports repeat it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Log, parsed_line
from focalgradient.tasks.noted import AGAIN, EXTRA

__all__ = ["EXPOSURE", "asked_for_removal", "conduct", "exposures", "failed_practice", "removals"]

EXPOSURE = "exposure"
"""Kind of the note that a trial is about to be shown."""

UNSYNCHRONISED = "does not report its frames"
"""Part of the clock's description where no vertical synchronisation was measured."""


def exposures(events: Iterable[Event]) -> Counter[tuple[str, int, int]]:
    """Return the number of exposures of each trial: by phase, trial, and round of practice.

    >>> exposures([{"event": "note", "kind": "exposure", "phase": "main", "trial": 1}])
    Counter({('main', 1, 1): 1})
    """
    return Counter(
        (event["phase"], event["trial"], event.get("round", 1)) for event in events if event.get("kind") == EXPOSURE
    )


def failed_practice(log: Log) -> tuple[int, int, int] | None:
    """Return the last round of practice, and its right and judged trials, if the practice ended without passing."""
    rounds = [note for note in log.of("note") if note.get("kind") == "practice"]
    if not rounds or rounds[-1].get("passed") is not False:
        return None
    last, most = rounds[-1], log.head["design"].get("practice_rounds", 1)
    if last.get("round", 0) < most and not any(event["phase"] == "main" for event in log.of("trial")):
        return None  # interrupted before its last round
    return last.get("round", 0), last.get("right", 0), last.get("of", 0)


def asked_for_removal(events: Iterable[Event]) -> bool:
    """Return whether a participant who stopped asked for removal of the answers.

    >>> asked_for_removal([{"event": "note", "kind": "keep", "kept": False}])
    True
    """
    return any(event.get("kind") == "keep" and event.get("kept") is False for event in events)


def removals(paths: Iterable[Path]) -> set[str]:
    """Return the participants whose journals ask for removal; lines that cannot be read are skipped.

    Parameters
    ----------
    paths
        Journals, named as in a data set.
    """
    found = set()
    for path in paths:
        lines = [line for line in path.read_bytes().splitlines() if b'"keep"' in line]
        if asked_for_removal(filter(None, map(parsed_line, lines))):
            found.add(path.name.partition("_")[0])
    return found


def conduct(log: Log) -> Iterator[str]:
    """Yield a sentence for practice not passed, for exposures repeated or not answered, and for no synchronisation."""
    if failed := failed_practice(log):
        number, right, of = failed
        yield f"practice was not passed: {right} of {of} trials right in round {number}, the last."
    again = [event for event in log.of("trial") if event.get(EXTRA, {}).get(AGAIN, {}).get("value")]
    if again:
        some = "1 trial was" if len(again) == 1 else f"{len(again)} trials were"
        yield f"{some} shown more than once (column {AGAIN}); none is excluded."
    answered = {(event["phase"], event["trial"]) for event in log.of("trial")}
    for phase, trial, number in exposures(log.events):
        if number == 1 and (phase, trial) not in answered:
            yield f"{phase} trial {trial} was shown, but not answered; a resumed session shows it again."
    if any(UNSYNCHRONISED in str(event["apparatus"].get("clock")) for event in (log.head, *log.of("resumed"))):
        yield "the display did not report its frames (no vertical synchronisation): durations are not exact to a frame."
