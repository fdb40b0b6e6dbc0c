"""Conversion of key presses and releases to percepts over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from focalgradient.errors import InputError

__all__ = ["Percept", "Press", "Seen", "percepts"]

Percept = Literal["rigid", "nonrigid", "none", "both"]


class Press(NamedTuple):
    """Key press or release.

    `time` is in s from the start of the trial.
    """

    time: float
    key: str
    down: bool


@dataclass(frozen=True, slots=True)
class Seen:
    """One percept from `onset` to `end`, in s from the start of the trial.

    `censored` if the end of the trial cut it off, so that its duration is a lower bound.
    """

    onset: float
    end: float
    percept: Percept
    censored: bool


def percepts(presses: Sequence[Press], keys: Mapping[str, str], trial_duration: float) -> list[Seen]:
    """Divide a trial into percepts: each ends exactly when the next begins, and together they fill the trial.

    The percept is "none" while neither key is held, and "both" while both are. Repeated presses of a held key (keyboard
    repeat) have no effect; a key released without a press was held from the start. Events before the trial determine
    the keys held at its start. Other keys are ignored.

    Parameters
    ----------
    presses
        Presses and releases in order of time.
    keys
        Keys for "rigid" and "nonrigid".
    trial_duration
        Duration of the trial, in s.

    Raises
    ------
    InputError
        If the times are not in order, or the duration is not positive.

    Examples
    --------
    >>> pressed = [Press(1.5, "f", True), Press(6.0, "j", True), Press(6.25, "f", False)]
    >>> for seen in percepts(pressed, {"rigid": "f", "nonrigid": "j"}, 10.0):
    ...     print(seen.onset, seen.end, seen.percept, seen.censored)
    0.0 1.5 none False
    1.5 6.0 rigid False
    6.0 6.25 both False
    6.25 10.0 nonrigid True
    """
    if not (trial_duration > 0 and math.isfinite(trial_duration)):
        raise InputError(f"trial_duration is {trial_duration!r}, but must be a positive number of seconds.")
    percept_of = {key: percept for percept, key in keys.items()}
    known = [press for press in presses if press.key in percept_of]
    if not all(one.time <= other.time for one, other in pairwise(presses)):
        raise InputError("presses are not in order of time: sort them, and take all times from one clock.")
    held: set[str] = set()
    met: set[str] = set()
    for press in known:
        if press.key not in met and not press.down:
            held.add(press.key)
        met.add(press.key)
    # Percept by onset; of simultaneous events the last counts.
    turns: dict[float, Percept] = {0.0: _percept(held, percept_of)}
    for press in known:
        if press.time >= trial_duration:
            break
        (held.add if press.down else held.discard)(press.key)
        turns[max(press.time, 0.0)] = _percept(held, percept_of)
    changes = [
        (onset, percept)
        for (onset, percept), before in zip(turns.items(), [None, *turns.values()], strict=False)
        if percept != before
    ]
    ends = [onset for onset, _ in changes[1:]] + [trial_duration]
    return [
        Seen(onset, end, percept, censored=end == trial_duration)
        for (onset, percept), end in zip(changes, ends, strict=True)
    ]


def _percept(held: set[str], percept_of: Mapping[str, str]) -> Percept:
    seen = {percept_of[key] for key in held}
    if len(seen) > 1:
        return "both"
    return "rigid" if "rigid" in seen else "nonrigid" if "nonrigid" in seen else "none"
