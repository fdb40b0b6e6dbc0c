"""Columns that the tables of several tasks share."""

from __future__ import annotations

from focalgradient.files.columns import Column

__all__ = ["DROPPED", "REPETITION", "RESERVED", "SCENE", "SITTING", "STIMULUS", "TIMES", "TRIAL", "judged"]

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
