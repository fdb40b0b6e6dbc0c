"""Columns that the tables of several tasks share."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Any, Literal, Union

from focalgradient.errors import InputError
from focalgradient.files.columns import Column, Form

__all__ = [
    *("AWAY_ABOUT", "DROPPED", "REPETITION", "RESERVED", "SCENE", "SITTING", "STIMULUS", "TIMES", "TRIAL"),
    *("added_columns", "judged"),
]

ENTRIES = ("about", "units", "levels", "least", "most", "above")
"""Metadata of fields of trials and answers: entries of the sidecar, and limits."""

TRIAL = Column("trial", "Number of the trial, in the order shown.", "integer", least=1)
REPETITION = Column(
    "repetition", "Number of presentations of this condition so far, including this one.", "integer", least=1
)
SITTING = Column(
    "sitting",
    "Number of the sitting, from 1: increases each time an interrupted session is resumed.",
    "integer",
    least=1,
)
DROPPED = Column("dropped_frames", "Number of late display frames during the trial.", "integer", least=0)
SCENE = Column("scene", "Name of the scene.", "text")
STIMULUS = Column("stimulus", "File of the picture, as the manifest of the stimuli names it.", "text", optional=True)


AWAY_ABOUT = (
    "Largest distance of a gaze fixation from the object to be fixated, while pictures were shown; n/a if the eyes "
    "were lost for half of the time, or made no fixation."
)


def judged(standard: str) -> tuple[Column, ...]:
    """Return the columns of ratings as ratios to a standard."""
    return (
        Column("onset", "When the picture appeared, on the clock of the sitting.", "number", "s", least=0),
        Column("rating", f"Three-dimensionality as a ratio to {standard}, which is 1.", "number", above=0),
        Column("response_time", "From the question to the answer.", "number", "s", least=0),
        Column("confidence", "How sure the participant was, from 0 to 1.", "number", least=0, optional=True),
        DROPPED,
        STIMULUS,
        SITTING,
    )


def _onset(name: str, about: str) -> Column:
    about = f"When {about}, on the clock of the sitting; n/a where none did."
    return Column(name, about, "number", "s", least=0, optional=True)


TIMES: tuple[Column, ...] = (
    Column("sitting_began", "Date and time (UTC) at which the sitting began.", "text", optional=True),
    _onset("mark_onset", "the mark to be fixated appeared, before the picture"),
    _onset("mask_onset", "the mask appeared, after the picture"),
    _onset("question_onset", "the question appeared"),
)
"""Columns of times, after those of the design; each is present if any trial has a value."""

RESERVED = frozenset(
    {
        *("participant_id", "session", "simulated", "file", "row", "event", "phase", "presses", "received"),
        *("TaskName", "TaskDescription", "Simulated", "Seed", "Design", "Keys", "StimuliSHA256", "Sittings"),
        *("Participant", "Journal", "Repaired", "Noted"),
        *(column.name for column in TIMES),
    }
)
"""Names reserved for columns of all tables, fields of events and keys of sidecars."""


def added_columns(record: type[Any], about: str) -> Iterator[Column]:
    """Yield columns of the fields that a record adds to the base class of all trials or answers."""
    hints = typing.get_type_hints(record)
    base = next(each for each in reversed(record.__mro__[:-1]) if dataclasses.is_dataclass(each))
    shared = {one.name for one in dataclasses.fields(base)}
    for one in dataclasses.fields(record):
        if one.name not in shared:
            form, levels, optional = _form(hints[one.name], one.name)
            entries = dict(one.metadata)
            if wrong := [key for key in entries if key not in ENTRIES]:
                raise InputError(
                    f"{one.name} is a field with the metadata {wrong[0]!r}, but may have {', '.join(ENTRIES)}: correct "
                    "it."
                )
            levels = entries.pop("levels", levels)
            yield Column(one.name, entries.pop("about", about), form, levels=levels, optional=optional, **entries)


def _form(hint: Any, name: str) -> tuple[Form, Mapping[str, str], bool]:
    """Return a column's form, levels and optionality, derived from the type of its field."""
    parts = typing.get_args(hint)
    if typing.get_origin(hint) in (Union, types.UnionType) and type(None) in parts:
        form, levels, _ = _form(next(part for part in parts if part is not type(None)), name)
        return form, levels, True
    if typing.get_origin(hint) is Literal and all(type(part) is int for part in parts):
        return "integer", {}, False
    if typing.get_origin(hint) is Literal:
        return "text", {str(part): str(part) for part in parts}, False
    forms: dict[Any, Form] = {bool: "bool", int: "integer", float: "number", str: "text"}
    if hint not in forms:
        raise InputError(f"{name} is a field of type {hint}, but must be bool, int, float, str or Literal.")
    return forms[hint], {}, False
