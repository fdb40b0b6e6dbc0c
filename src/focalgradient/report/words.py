"""Sentences that sections of a report share: the sample, and settings of the design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from focalgradient.statistics import Quality
from focalgradient.statistics.wording import many

__all__ = ["OF_TABLE", "catches", "counts", "differing", "setting", "times"]

OF_TABLE = "The data are a table, which does not record the display."


def counts(found: Quality) -> str:
    """Describe the sample before and after exclusions."""
    return (
        f"{many(found.subjects_before, 'subject')} with {many(found.trials_before, 'trial')} before exclusions; "
        f"{many(found.subjects_after, 'subject')} with {many(found.trials_after, 'trial')} after (catch trials not "
        "counted)."
    )


def setting(design: Mapping[str, Any], name: str) -> str:
    """Return a setting as text; a question mark if a design does not have it.

    >>> setting({"picture_s": 3.0}, "picture_s"), setting({}, "picture_s")
    ('3', '?')
    """
    value = design.get(name, "?")
    return f"{value:g}" if isinstance(value, float) else str(value)


def times(design: Mapping[str, Any]) -> str:
    """Return how often each condition was shown.

    >>> times({}), times({"repetitions": 2}), times({"repetitions": 3})
    ('once', 'twice', '3 times')
    """
    count = int(design.get("repetitions", 1))
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def catches(design: Mapping[str, Any]) -> str:
    """Describe the catch trials; empty if there are none."""
    count = design.get("catch_trials", 0)
    return f"{many(count, 'catch trial')} checked attention." if count else ""


def differing(designs: Sequence[Mapping[str, Any]]) -> str:
    """Return a warning if sessions had different designs."""
    apart = [{key: value for key, value in design.items() if key != "seed"} for design in designs]
    is_same = all(one == apart[0] for one in apart)
    return "" if is_same else " Sessions differ in their design; the first is given here."
