"""What cannot be true of one answer, whoever sends it: such an answer is refused.

The page keeps answers while the network is away and sends them in a burst, so the time between two answers proves
nothing. What holds for every page: a trial takes the time that its design shows it, and it was not shown before the
page got it.
"""

from __future__ import annotations

from typing import Any

from focalgradient.dataset import Rated, Response, Watched
from focalgradient.design import Trial
from focalgradient.errors import InputError

__all__ = ["check_possible"]

SLACK_S = 1.0
"""Seconds by which an answer may seem longer than the time there was: coarse clocks of browsers, 0.1 s, with margin."""

DRIFT = 0.01
"""Share by which two clocks may go at different rates: a hundred times what quartz does (100 parts in a million)."""

FRAMES_S = 0.25
"""Seconds by which a cube may be shown shorter: half a frame at 2 Hz, the slowest display that the page accepts."""

AFTER_S = 1.0
"""Seconds after a cube's end in which the page may still hear a key."""

NEAR = 1e-6
"""Share of the scale by which rounding may carry its start over the end."""


def check_possible(design: Any, trial: Trial, answer: Rated | Watched | Response, elapsed_s: float | None) -> None:
    """Refuse an answer that no page can send.

    Parameters
    ----------
    design, trial, answer
        What was answered; `answer` is one of the design's already.
    elapsed_s
        Seconds since the page got its trials; None where that is not known.

    Raises
    ------
    InputError
        If it is on no place of the scale, names keys that the design does not, or took longer than there was time.
    """
    spent = _watched(design, trial, answer) if isinstance(answer, Watched) else _rated(design, trial, answer)
    if elapsed_s is not None and spent > elapsed_s * (1 + DRIFT) + SLACK_S:
        raise InputError(
            f"the trial and its answer took {spent:.6g} s, but the page has had its trials for {elapsed_s:.3g} s: send "
            "the times that were measured."
        )


def _rated(design: Any, trial: Trial, answer: Rated | Response) -> float:
    shown: float = design.least_s(trial)
    if not isinstance(answer, Rated):
        return shown + answer.response_time
    least, most = design.bounds
    if answer.start is not None and not least - NEAR * (most - least) <= answer.start <= most + NEAR * (most - least):
        raise InputError(
            f"start is {answer.start:g}, but the scale goes from {least:g} to {most:g}: give one of its places."
        )
    return shown + answer.response_time


def _watched(design: Any, trial: Any, answer: Watched) -> float:
    keys = set(design.keys)
    for time, key, _ in answer.presses:
        if key not in keys:
            known = " and ".join(sorted(keys))
            raise InputError(f"a press names the key {key[:20]!r}, but the design has {known}: give one of them.")
        if time > answer.trial_duration + AFTER_S:
            raise InputError(f"a key was pressed at {time:g} s, but the trial lasted {answer.trial_duration:g} s.")
    if answer.trial_duration < trial.trial_s - FRAMES_S:
        raise InputError(
            f"trial_duration is {answer.trial_duration:g} s, but the design shows the cube for {trial.trial_s:g} s."
        )
    return answer.trial_duration
