"""Arrival times of a browser's answers at the server, compared with the durations of the trials.

The page stores answers while the network is down and then sends them in a burst, so short intervals between answers are
uninformative. But a trial cannot be shown before the server sent it, so between then and the arrival of an answer there
must have been time for all trials up to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Log
from focalgradient.design import Trial

__all__ = ["late_arrivals", "too_early"]

SLACK_S = 2.0
"""Tolerance in s by which a session's answers may seem to take longer than the available time: the page's first frame
and the server's first response are not timed by one clock (our choice).
"""

BURST_S = 1.0
"""Time in s by which an answer must arrive too soon after the previous one to count as delayed (our choice)."""

DRIFT = 0.01
"""Tolerated relative rate difference between two clocks: a hundred times that of quartz clocks (100 ppm)."""

FRAMES_S = 0.1
"""Tolerance in s by which a trial may be shorter than designed: one frame at 40 Hz at each end of mark and picture."""

SAME_PAGE_S = 1.0
"""Waiting time in s of a resumed page above which its trials may be those that it received before."""


@dataclass(frozen=True, slots=True)
class _Came:
    """Arrival of an answer: its trial, the time spent on trials and answers up to it, and the time elapsed, in s."""

    trial: Event
    answers: int
    spent_s: float
    elapsed_s: float
    since: str

    @property
    def missing_s(self) -> float:
        return self.spent_s - self.elapsed_s * (1 + DRIFT) - SLACK_S


def too_early(log: Log, design: Any, trials: Sequence[Trial]) -> Iterator[str]:
    """Yield a sentence if answers of a session arrived before their trials can have been shown and answered.

    Parameters
    ----------
    log
        Journal of the session.
    design, trials
        Design and trials of the session.
    """
    worst = max(_came(log, design, trials), key=lambda one: one.missing_s, default=None)
    if worst is not None and worst.missing_s > 0:
        yield (
            f"the {worst.answers} answers up to {worst.trial['phase']} trial {worst.trial['trial']} came "
            f"{worst.elapsed_s:.3g} s after the {worst.since} began by the server's clock, but trials and answers take "
            f"{worst.spent_s:.3g} s: a program generated them, or the server's clock was changed; exclude the session."
        )


def late_arrivals(log: Log, design: Any, trials: Sequence[Trial]) -> str | None:
    """Return a sentence on the number of answers that arrived in bursts; None if there are none."""
    late = total = 0
    before: datetime | None = None
    for event, spent in _spent(log, design, trials):
        if event["event"] != "trial":
            continue
        total += 1
        came = datetime.fromisoformat(event["received"])
        if before is not None and spent > (came - before).total_seconds() + BURST_S:
            late += 1
        before = came
    if not late:
        return None
    return (
        f"{late} of {total} answers reached the server in bursts, as after a network failure; a program that waits "
        "and then sends does the same."
    )


def _came(log: Log, design: Any, trials: Sequence[Trial]) -> Iterator[_Came]:
    began = sitting = datetime.fromisoformat(log.head["time"])
    answers = of_sitting = 0
    spent = spent_in_sitting = 0.0
    for event, seconds in _spent(log, design, trials):
        if event["event"] == "resumed":
            # Until its note states its waiting time, it is treated as a reloaded page.
            sitting, of_sitting, spent_in_sitting = datetime.fromisoformat(event["time"]), 0, 0.0
            continue
        if event["event"] == "note" and event.get("kind") == "sitting":
            if float(event.get("waited_s", 0.0)) > SAME_PAGE_S:
                sitting, of_sitting, spent_in_sitting = began, answers, spent
            continue
        spent, spent_in_sitting = spent + seconds, spent_in_sitting + seconds
        if event["event"] != "trial":
            continue
        answers, of_sitting = answers + 1, of_sitting + 1
        came = datetime.fromisoformat(event["received"])
        yield _Came(event, answers, spent, (came - began).total_seconds(), "session")
        yield _Came(event, of_sitting, spent_in_sitting, (came - sitting).total_seconds(), "sitting")


def _spent(log: Log, design: Any, trials: Sequence[Trial]) -> Iterator[tuple[Event, float]]:
    """Yield events relevant to timing, each with the time in s that its trial and answer took."""
    listed = {(trial.phase, trial.trial): trial for trial in trials}
    if not all(_is_time(event.get("received")) for event in log.of("trial")):
        return
    for event in log.events:
        if event["event"] == "trial":
            yield event, _seconds(design, listed.get((event["phase"], event["trial"])), event)
        elif (
            event["event"] == "note" and event.get("kind") == "practice again" and isinstance(event.get("answer"), dict)
        ):
            shown = event.get("trial")
            key = (shown.get("phase"), shown.get("trial")) if isinstance(shown, dict) else None
            yield event, _seconds(design, listed.get(key), event["answer"])  # type: ignore[arg-type]
        elif event["event"] == "resumed" or event.get("kind") == "sitting":
            yield event, 0.0


def _seconds(design: Any, trial: Trial | None, answer: Event) -> float:
    if trial is None:
        return 0.0
    if "trial_duration" in answer:
        return max(float(answer["trial_duration"]) - FRAMES_S, 0.0)
    return max(float(design.least_s(trial)) - FRAMES_S, 0.0) + float(answer.get("response_time") or 0.0)


def _is_time(value: Any) -> bool:
    try:
        return datetime.fromisoformat(value).tzinfo is not None
    except (TypeError, ValueError):
        return False
