"""Validation of a journal's events before they are used."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from datetime import datetime
from functools import cache
from itertools import pairwise
from typing import Any

from focalgradient.dataset.columns import columns_of
from focalgradient.files.columns import MOST, Column, cell_test
from focalgradient.tasks import is_task, task_named
from focalgradient.tasks.noted import EXTRA, is_noted

__all__ = ["SHA256", "Event", "Tests", "trial_tests", "wrong_event"]

Event = dict[str, Any]
"""Content of a journal line; its kind is under "event"."""

Tests = tuple[tuple[str, Callable[[Any], bool], str], ...]
"""Name, test and expected value of each field of a task's trials."""

LABEL = re.compile(r"[A-Za-z0-9]+")
SHA256 = re.compile(r"[0-9a-f]{64}")

FOCUS = "gazefocus"
"""Task name of gaze-contingent focus, whose sessions have neither design nor trials."""

DERIVED = {"sitting", "trial_onset"}
"""Table columns that are not fields of events."""

OF_PERCEPTS = {"onset", "duration", "percept", "censored"}
"""Columns of the Necker cube's table that are derived from the key presses."""


def trial_tests(head: Event) -> Tests:
    """Return tests of the fields of a journal's trials, given its first event; none for gaze-contingent focus."""
    if head.get("task") == FOCUS:
        return ()
    return _cells(columns_of(head["design"]["task"], head["design"]))


def wrong_event(event: Event, head: Event, tests: Tests | None = None) -> str | None:
    """Return why an event is invalid; None if it is valid. `head` is the journal's first event.

    `tests` are the `trial_tests` of `head`; passing them avoids a look-up for each event.

    >>> wrong_event({"event": "note"}, {})
    >>> wrong_event({"event": "trial", "phase": "main", "trial": 0}, {"design": {"task": "pinhole"}})
    'trial is 0, but must be a whole number of 1 or more'
    """
    kind = event["event"]
    if head.get("task") == FOCUS:
        return _wrong_focus(event)
    if kind == "begun":
        return _wrong_head(event)
    if kind == "resumed":
        return _wrong_sitting(event)
    if kind == "note" and event.get("kind") in ("gaze", "eye tracker"):
        return _wrong_gaze(event)
    if kind == "note" and event.get("kind") == "exposure":
        return _wrong_exposure(event)
    if kind == "note" and event.get("kind") in ("events", "frames"):
        return _wrong_times(event)
    if kind != "trial":
        return None
    if event.get("phase") not in ("practice", "main"):
        return f"phase is {_shown(event, 'phase')}, but must be practice or main"
    levels = event.get("factors", {})
    if not isinstance(levels, dict):
        return f"factors is {_shown(event, 'factors')}, but must be a table"
    for name, allowed, expected in trial_tests(head) if tests is None else tests:
        if not allowed(event.get(name, levels.get(name))):
            if event["phase"] == "practice" and name == "repetition" and event.get(name) == 0:
                continue
            return f"{name} is {_shown(event, name)}, but must be {expected}"
    if EXTRA in event and not is_noted(event[EXTRA]):
        return f"extra is {_shown(event, EXTRA)}, but must be a table of values with their units and descriptions"
    if task_named(head["design"]["task"]).percepts:
        return _wrong_presses(event)
    return "presses are given in a trial in which no keys are held" if "presses" in event else None


def _wrong_focus(event: Event) -> str | None:
    """Return why an event of a gaze-contingent focus session is invalid; None if it is valid."""
    if event["event"] == "begun":
        return None if _label(event.get("participant")) else f"participant is {_shown(event, 'participant')}"
    if event["event"] == "note" and event.get("kind") == "gaze":
        return _wrong_places(event.get("samples"))
    if event["event"] == "note" and event.get("kind") == "eye tracker":
        return _wrong_gaze(event)
    if event["event"] != "note" or event.get("kind") != "focus" or "latency_ms" not in event:
        return None
    names = ("onset", "focus_dioptre", "gaze_x", "gaze_y", "gaze_dioptre", "latency_ms", "latency_frames")
    wrong = [name for name in names if type(event.get(name)) not in (int, float)]
    return f"{wrong[0]} is {_shown(event, wrong[0])}, but must be a number" if wrong else None


def _wrong_places(samples: Any) -> str | None:
    """Return why the gaze samples of a gaze-contingent focus session are invalid; None if they are valid."""
    if not isinstance(samples, list):
        return "samples of the gaze are not a list"
    for one in samples:
        if not (isinstance(one, list) and len(one) == 3 and all(type(each) in (int, float) for each in one)):
            return f"a sample of the gaze is {one!r}"[:90] + ", but must be a time, x and y"
    return None


def _shown(event: Event, name: str) -> str:
    return repr(event[name])[:60] if name in event else "missing"


def _wrong_head(head: Event) -> str | None:
    design = head.get("design")
    task = design.get("task") if isinstance(design, dict) else None
    keys = head.get("keys")
    keyed = isinstance(task, str) and is_task(task) and task_named(task).percepts
    wanted: Mapping[str, tuple[bool, str]] = {
        "participant": (_label(head.get("participant")), "a label of letters and digits"),
        "session": (
            "session" in head and (head["session"] is None or _label(head["session"])),
            "a label of letters and digits, or null",
        ),
        "kind": (head.get("kind") in ("human", "simulated"), "human or simulated"),
        "design": (
            isinstance(design, dict) and is_task(task) and "seed" in design,
            "the settings of a known task, with their seed",
        ),
        "stimuli": (
            head.get("stimuli") is None
            or (isinstance(head["stimuli"], str) and bool(SHA256.fullmatch(head["stimuli"]))),
            "a SHA-256 in hexadecimal, or null",
        ),
        "keys": (
            isinstance(keys, dict) and set(keys) == {"rigid", "nonrigid"} and all(map(_text, keys.values()))
            if keyed
            else "keys" in head and keys is None,
            "a key for rigid and one for nonrigid" if keyed else "null",
        ),
    }
    for name, (right, expected) in wanted.items():
        if not right:
            return f"{name} is {_shown(head, name)}, but must be {expected}"
    return _wrong_sitting(head)


def _wrong_sitting(event: Event) -> str | None:
    for name in ("apparatus", "versions"):
        if not isinstance(event.get(name), dict):
            return f"{name} is {_shown(event, name)}, but must be a table"
    try:
        zone = datetime.fromisoformat(event["time"]).tzinfo
    except (KeyError, TypeError, ValueError):
        zone = None
    return None if zone else f"time is {_shown(event, 'time')}, but must be a date and time with its zone"


@cache
def _cells(every: tuple[Column, ...]) -> Tests:
    columns = [column for column in every if column.name not in DERIVED]
    if any(column.name == "percept" for column in columns):
        columns = [column for column in columns if column.name not in OF_PERCEPTS]
        columns.append(Column("onset", "", "number", least=0))
    return tuple((column.name, cell_test(column), column.expected) for column in columns)


def _wrong_presses(event: Event) -> str | None:
    presses = event.get("presses")
    if not isinstance(presses, list):
        return f"presses is {_shown(event, 'presses')}, but must be a list"
    for press in presses:
        match press:
            case [float() | int() as time, str(), bool()] if type(time) is not bool and abs(time) < MOST:
                continue
        return f"a press is {press!r}"[:90] + ", but must be a time, a key, and whether it went down"
    if not all(one[0] <= other[0] for one, other in pairwise(presses)):
        return "presses are not in order of time"
    return None


def _wrong_exposure(event: Event) -> str | None:
    """Return why an exposure does not name its trial; None if it does."""
    whole = all(type(event.get(name, 1)) is int and event.get(name, 1) >= 1 for name in ("trial", "round"))
    if event.get("phase") in ("practice", "main") and "trial" in event and whole:
        return None
    return "an exposure does not name its phase, trial and round"


def _wrong_times(event: Event) -> str | None:
    """Return why the times of a trial's events are invalid; None if they are valid."""
    for one in event.get("events", ()):
        match one:
            case [str(), float() | int(), float() | int()]:
                continue
        return f"an event is {one!r}"[:90] + ", but must be a name, a time and a time of the wall clock"
    for one in event.get("shown", ()):
        match one:
            case {"event": str(), "stamps": [float() | int(), *_]}:
                continue
        return f"a display interval is {one!r}"[:90] + ", but must be an event with its time stamps"
    return None


def _wrong_gaze(event: Event) -> str | None:
    """Return why gaze samples, or the metadata of an eye tracker, are invalid; None if they are valid."""

    def number(value: Any) -> bool:
        return type(value) in (int, float) and abs(value) < MOST

    if event["kind"] == "eye tracker":
        right = number(event.get("pixels_per_degree")) and event["pixels_per_degree"] > 0 and _text(event.get("name"))
        return None if right else "an eye tracker has no name or no pixels_per_degree"
    samples = event.get("samples")
    if not (isinstance(samples, list) and event.get("phase") in ("practice", "main") and number(event.get("trial"))):
        return "samples of the gaze do not name their trial"
    for one in samples:
        match one:
            case [time, x, y, pupil] if number(time) and all(each is None or number(each) for each in (x, y, pupil)):
                continue
        return f"a sample of the gaze is {one!r}"[:90] + ", but must be a time, x, y and the pupil's size"
    times = [one[0] for one in samples]
    return None if times == sorted(times) else "samples of the gaze are not in order of time"


def _label(value: Any) -> bool:
    return isinstance(value, str) and bool(LABEL.fullmatch(value))


def _text(value: Any) -> bool:
    return isinstance(value, str) and value != ""
