"""Plausibility limits of a response, which hold for every page: impossible responses are rejected.

The page stores responses while the network is down and then sends them in a burst, so the time between two responses is
uninformative. But a trial takes at least the time for which its design shows it, and it cannot be shown before the page
received it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from focalgradient.errors import InputError
from focalgradient.web.guard import SMALL_BYTES
from focalgradient.web.messages import Held

__all__ = ["check_frames", "check_possible", "check_presses", "most_bytes"]

FRAMES_HZ = 500
"""Maximum rate of frame time stamps, in Hz: the fastest displays on sale."""

STAMP_BYTES = 12
"""Size in bytes of a frame time stamp in a message."""

LONGEST_S = 300.0
"""Duration in s that is assumed for trials of user-defined tasks, to bound their messages."""

MOST_BYTES = 4 << 20
"""Maximum size in bytes of a response to any design."""

KEYS_HZ = 50
"""Maximum rate of key presses and releases, in Hz: keyboards repeat a held key at 30 Hz."""

SLACK_S = 1.0
"""Tolerance in s by which a response may seem longer than the available time: coarse browser clocks (0.1 s), with
margin.
"""

DRIFT = 0.01
"""Tolerated relative rate difference between two clocks: a hundred times that of quartz clocks (100 ppm)."""

FRAMES_S = 0.25
"""Tolerance in s by which pictures may be shown too briefly while keys are held: half a frame at 2 Hz, the slowest
display accepted.
"""

EVENT_STAMPS = 10
"""Tolerance in time stamps per event: marks and questions have two, and a duration ends with the next frame."""

LATE_KEY_S = 1.0
"""Time in s after the offset of pictures within which the page may still register a key."""


def most_bytes(design: Any) -> int:
    """Return the maximum size in bytes of a response, with the responses of repeated practice.

    It has the frame time stamps of a trial at `FRAMES_HZ`, and `SMALL_BYTES` besides.
    """
    trials = () if design.given_trials else design.trials("001")
    seconds = max((design.least_s(trial) for trial in trials), default=0.0) or LONGEST_S
    practised = sum(trial.phase == "practice" for trial in trials) * getattr(design, "practice_rounds", 1)
    return min(MOST_BYTES, (1 + practised) * int(FRAMES_HZ * seconds * STAMP_BYTES) + SMALL_BYTES)


def check_possible(spent_s: float, elapsed_s: float | None) -> None:
    """Raise `InputError` if a trial and its response took longer than the time since the page received its trials.

    >>> check_possible(3.0, 2.5), check_possible(30.0, None)
    (None, None)
    """
    if elapsed_s is not None and spent_s > elapsed_s * (1 + DRIFT) + SLACK_S:
        raise InputError(
            f"the trial and its answer took {spent_s:.6g} s, but the page received its trials {elapsed_s:.3g} s ago: "
            "send the measured times."
        )


def check_frames(shown: Sequence[Mapping[str, Any]], seconds: float) -> None:
    """Raise `InputError` if a trial of the given duration has more frame time stamps than a display shows.

    >>> check_frames([{"event": "picture", "stamps": [0.0] * 600}], 1.0)
    Traceback (most recent call last):
        ...
    focalgradient.errors.InputError: frames has 600 time stamps, but a trial of 1 s has at most 510 ...
    """
    count = sum(len(event["stamps"]) for event in shown)
    most = int(FRAMES_HZ * seconds) + EVENT_STAMPS * len(shown)
    if count > most:
        raise InputError(
            f"frames has {count} time stamps, but a trial of {seconds:.6g} s has at most {most} ({FRAMES_HZ} Hz): "
            "send one for each frame."
        )


def check_presses(given: Held, keys: Sequence[str], seconds: float) -> None:
    """Raise `InputError` for presses that no page can send: of other keys, too many, too late, or of a short trial."""
    most = int(KEYS_HZ * (seconds + LATE_KEY_S))
    if len(given.presses) > most:
        raise InputError(
            f"presses has {len(given.presses)} entries, but a trial of {seconds:g} s has at most {most}: send one for "
            "each key press or release."
        )
    for time, key, _ in given.presses:
        if key not in keys:
            known = " and ".join(sorted(keys))
            raise InputError(f"a press has the key {key[:20]!r}, but the design has {known}: send one of them.")
        if time > given.trial_duration + LATE_KEY_S:
            raise InputError(
                f"a key was pressed at {time:g} s, but the trial lasted {given.trial_duration:g} s: send the measured "
                "times."
            )
    if given.trial_duration < seconds - FRAMES_S:
        raise InputError(
            f"trial_duration is {given.trial_duration:g} s, but the design shows its pictures for {seconds:g} s: send "
            "the measured duration."
        )
