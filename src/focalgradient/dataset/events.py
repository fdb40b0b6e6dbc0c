"""Events of a journal, one model for each kind: a line that does not fit its model is damaged."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    StringConstraints,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from focalgradient.dataset.answers import Apparatus
from focalgradient.errors import InputError
from focalgradient.files.columns import MOST, Column, cell_test
from focalgradient.tasks import is_task, task_named
from focalgradient.tasks.noted import NAME

__all__ = ["SHA256", "CellTests", "Event", "cell_tests", "event_error"]

Event = dict[str, Any]
"""Content of a journal line; its kind is under "event"."""

CellTests = tuple[tuple[str, Callable[[Any], bool], str], ...]
"""Name, test and expected value of each field of a task's trials."""

FOCUS = "gazefocus"
"""Task name of gaze-contingent focus, whose sessions have neither design nor trials."""

DERIVED = {"sitting", "trial_onset"}
"""Table columns that are not fields of events."""

OF_PERCEPTS = {"onset", "duration", "percept", "censored"}
"""Columns of the Necker cube's table that are derived from the key presses."""

SHA256 = "[0-9a-f]{64}"

Number = Annotated[float, Field(gt=-MOST, lt=MOST)]
Time = Annotated[float, Field(ge=0, lt=MOST)]
Whole = Annotated[int, Field(ge=1)]
Text = Annotated[str, Field(min_length=1)]
Label = Annotated[str, StringConstraints(pattern="^[A-Za-z0-9]+$")]
Name = Annotated[str, StringConstraints(pattern=f"^{NAME.pattern}$")]
Phase = Annotated[Literal["practice", "main"], Field(description="practice or main")]
Row = Field(strict=False)
"""A tuple, which JSON writes as a list."""


def _with_zone(text: str) -> str:
    if datetime.fromisoformat(text).tzinfo is None:
        raise ValueError("has no zone")
    return text


def _known(design: dict[str, Any]) -> dict[str, Any]:
    if not (is_task(design.get("task")) and "seed" in design):
        raise ValueError("is of no known task")
    return design


def _in_order(rows: list[Any]) -> list[Any]:
    if any(later[0] < sooner[0] for sooner, later in pairwise(rows)):
        raise ValueError("not in order of time")
    return rows


class _Model(BaseModel):
    """Fields that are used of an event; the description of each completes "..., but must be"."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)


class _Sitting(_Model):
    apparatus: dict[str, Any] = Field(description="a table")
    versions: dict[str, Any] = Field(description="a table")
    time: Annotated[str, AfterValidator(_with_zone)] = Field(description="a date and time with its zone")

    @model_validator(mode="after")
    def _has_apparatus(self) -> Self:
        try:
            Apparatus(**self.apparatus, versions=self.versions)
        except (InputError, TypeError) as error:
            raise ValueError(f"apparatus: {str(error).rpartition(':')[0] or error}") from error
        return self


class _Begun(_Sitting):
    participant: Label = Field(description="a label of letters and digits")
    session: Label | None = Field(description="a label of letters and digits, or null")
    kind: Literal["human", "simulated"] = Field(description="human or simulated")
    design: Annotated[dict[str, Any], AfterValidator(_known)] = Field(
        description="the settings of a known task, with their seed"
    )
    stimuli: Annotated[str, StringConstraints(pattern=f"^{SHA256}$")] | None = Field(
        description="a SHA-256 in hexadecimal, or null"
    )
    keys: dict[Literal["rigid", "nonrigid"], Text] | None = Field(
        description="a key for rigid and one for nonrigid, or null in a task without keys"
    )
    about: dict[str, Any] = Field({}, description="a table")

    @model_validator(mode="after")
    def _of_task(self) -> Self:
        if len(self.keys or {}) != (2 if task_named(self.design["task"]).percepts else 0):
            raise ValueError(f"keys is {self.keys}, but must be {type(self).model_fields['keys'].description}")
        return self


class _NotedValue(_Model):
    value: bool | int | float | str | None
    unit: str = ""
    description: str = ""


class _Trial(_Model):
    phase: Phase
    trial: Whole = Field(description="a whole number of 1 or more")
    factors: dict[str, Any] = Field({}, description="a table")
    extra: dict[Name, _NotedValue] = Field({}, description="a table of values with their units and descriptions")

    @model_validator(mode="wrap")
    @classmethod
    def _cells(cls, event: Event, check: ModelWrapValidatorHandler[Self], info: ValidationInfo) -> Self:
        made = check(event)
        for name, allowed, expected in info.context or ():
            value = event.get(name, made.factors.get(name))
            if not allowed(value) and not (name == "repetition" and made.phase == "practice" and value == 0):
                raise ValueError(f"{name} is {_shown(event, name)}, but must be {expected}")
        return made


class _Judged(_Trial):
    presses: None = Field(None, description="absent in a trial in which no keys are held")


class _Watched(_Trial):
    presses: Annotated[list[Annotated[tuple[Number, str, bool], Row]], AfterValidator(_in_order)] = Field(
        description="a list in order of time, each a time, a key, and whether it went down"
    )


class _Tracker(_Model):
    name: Text = Field(description="a text")
    pixels_per_degree: Annotated[float, Field(gt=0, lt=MOST)] = Field(description="a number above 0")


class _Gaze(_Model):
    phase: Phase
    trial: Whole = Field(description="a whole number of 1 or more")
    samples: Annotated[
        list[Annotated[tuple[Number, Number | None, Number | None, Number | None], Row]], AfterValidator(_in_order)
    ] = Field(description="a list in order of time, each a time, x, y and the pupil's size")


class _Exposure(_Model):
    phase: Phase
    trial: Whole = Field(description="a whole number of 1 or more")
    round: Whole = Field(1, description="a whole number of 1 or more")


class _Happened(_Model):
    events: list[Annotated[tuple[str, float, float], Row]] = Field(
        [], description="a list, each a name, a time and a time of the wall clock"
    )
    first: int = Field(0, description="a whole number")
    condition: dict[str, Any] | None = Field(None, description="a table, or null")


class _DisplayInterval(_Model):
    event: str
    stamps: list[float] = Field(min_length=1)


class _Frames(_Model):
    shown: list[_DisplayInterval] = Field([], description="a list, each an event with its time stamps")
    judged: int = Field(0, ge=0, description="a whole number of 0 or more")
    condition: dict[str, Any] = Field({}, description="a table")


class _Triggers(_Model):
    markers: dict[str, Annotated[tuple[int, str, str], Row]] = Field(
        description="a table of names, each with its code, meaning and HED tags"
    )
    conditions: list[Annotated[tuple[str, int, dict[str, Any]], Row]] = Field(
        description="a list, each an event, its code and the levels of a trial"
    )


class _Practice(_Model):
    round: int = Field(0, description="a whole number")
    right: int = Field(0, description="a whole number")
    of: int = Field(0, description="a whole number")
    passed: bool | None = Field(None, description="true or false")


class _BrowserSitting(_Model):
    waited_s: float = Field(0.0, description="a number of seconds")


class _FocusBegun(_Model):
    participant: Label = Field(description="a label of letters and digits")


class _FocusGaze(_Model):
    samples: list[Annotated[tuple[float, float, float], Row]] = Field(description="a list, each a time, x and y")


class _Focus(_Model):
    """Change of focus; a note without latency says when it was asked for."""

    onset: float = Field(description="a number")
    focus_dioptre: float = Field(description="a number")
    gaze_x: float = Field(description="a number")
    gaze_y: float = Field(description="a number")
    gaze_dioptre: float = Field(description="a number")
    latency_ms: float = Field(description="a number")
    latency_frames: float = Field(description="a number")


NOTES: dict[Any, type[_Model]] = {
    "eye tracker": _Tracker,
    "events": _Happened,
    "exposure": _Exposure,
    "frames": _Frames,
    "gaze": _Gaze,
    "practice": _Practice,
    "sitting": _BrowserSitting,
    "triggers": _Triggers,
    "void": _Happened,
}
FOCUS_NOTES: dict[Any, type[_Model]] = {"eye tracker": _Tracker, "focus": _Focus, "gaze": _FocusGaze}
EVENTS: dict[str, type[_Model]] = {"begun": _Begun, "resumed": _Sitting}
WITHOUT_MODEL = ("note", "repaired")
"""Events of any content."""
FOCUS_EVENTS: dict[str, type[_Model]] = {"begun": _FocusBegun}


def cell_tests(head: Event) -> CellTests:
    """Return tests of the fields of a journal's trials, given its first event; none for gaze-contingent focus."""
    return () if head.get("task") == FOCUS else _tests(task_named(head["design"]["task"]).columns(head["design"]))


@cache
def _tests(columns: tuple[Column, ...]) -> CellTests:
    watched = any(column.name == "percept" for column in columns)
    fields = [one for one in columns if one.name not in (DERIVED | OF_PERCEPTS if watched else DERIVED)]
    fields += [Column("onset", "", "number", least=0)] if watched else []
    return tuple((column.name, cell_test(column), column.expected) for column in fields)


def event_error(event: Event, head: Event, tests: CellTests | None = None) -> str | None:
    """Return why an event is invalid; None if it is valid. `head` is the journal's first event.

    `tests` are the `cell_tests` of `head`; passing them avoids a look-up for each event.

    >>> event_error({"event": "note"}, {})
    >>> event_error({"event": "trial", "phase": "main", "trial": 0}, {"design": {"task": "pinhole"}})
    'trial is 0, but must be a whole number of 1 or more'
    """
    model = _model_of(event, head)
    if model is None and event["event"] not in WITHOUT_MODEL:
        return f"event is {_shown(event, 'event')}, but must be one of {', '.join((*EVENTS, 'trial', *WITHOUT_MODEL))}"
    if model is None:
        return None
    if tests is None and issubclass(model, _Trial):
        tests = cell_tests(head)
    try:
        model.model_validate(event, context=tests)
    except ValidationError as error:
        return _sentence(error.errors(include_url=False)[0], event, model)
    return None


def _model_of(event: Event, head: Event) -> type[_Model] | None:
    kind, of_focus = event["event"], head.get("task") == FOCUS
    if kind == "trial" and not of_focus:
        return _Watched if task_named(head["design"]["task"]).percepts else _Judged
    if kind != "note":
        return (FOCUS_EVENTS if of_focus else EVENTS).get(kind)
    model = (FOCUS_NOTES if of_focus else NOTES).get(event.get("kind"))
    return None if model is _Focus and "latency_ms" not in event else model


def _sentence(problem: Any, event: Event, model: type[_Model]) -> str:
    name, *inner = problem["loc"] or ("",)
    if not name:
        return str(problem["ctx"]["error"])
    expected = model.model_fields[name].description
    if inner and isinstance(event[name], list) and isinstance(inner[0], int):
        return f"{name} has {event[name][inner[0]]!r}"[:90] + f", but must be {expected}"
    return f"{name} is {_shown(event, name)}, but must be {expected}"


def _shown(event: Event, name: str) -> str:
    return repr(event[name])[:60] if name in event else "missing"
