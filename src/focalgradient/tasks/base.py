"""The base class of tasks: design, trial, answer, columns, texts, check and report of one experiment."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Union

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError, check_fields
from focalgradient.scales import Control
from focalgradient.tasks.adjustment import Adjustment
from focalgradient.tasks.columns import DROPPED, REPETITION, SITTING, TRIAL, Column, Form
from focalgradient.tasks.noted import Noted, OpenRecord, plain

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from pathlib import Path

__all__ = ["Response", "Rows", "Task", "paper_settings"]

BLANK_S = 0.3
"""Seconds without a picture before the question, of tasks whose trials are described as data: our choice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Response(metaclass=OpenRecord):
    """The answer of a trial; that of a task of one's own is a subclass, whose fields become columns.

    A field may say in its metadata what the sidecar states: "about", "units", "levels", "least", "most". Keywords that
    name no field are noted in `extra`, and become columns, too.

    Parameters
    ----------
    onset
        When the stimulus appeared, in seconds of the sitting's clock.
    response_time
        From the question to the answer, in seconds.
    dropped_frames
        Frames that came late during the trial.
    extra
        Values noted beside it, by name: each a `Noted`, or its value alone.

    Raises
    ------
    InputError
        If a value is of another type than its field, or a time is negative or not finite.
    """

    onset: float
    response_time: float
    dropped_frames: int = 0
    extra: Mapping[str, Noted] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        for one in dataclasses.fields(self):
            object.__setattr__(self, one.name, plain(getattr(self, one.name)))
        check_fields(self)
        for name in ("onset", "response_time"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"{name} is {value!r}, but must be a finite number of 0 or more.")


Interval = tuple[NDArray[np.uint8], float]
"""A picture (H x W x 3, 8 bits), and for how many seconds it is shown."""


@dataclass(frozen=True, slots=True)
class Rows:
    """The table of a session while it is checked.

    Parameters
    ----------
    columns
        Values of all rows, by column.
    shown
        Those of the first row of each trial.
    design
        Of the session.
    planned
        Its main trials, by number.
    pictures
        File of each picture of the manifest, by scene, aperture and fixation.
    """

    columns: Mapping[str, Any]
    shown: Mapping[str, Any]
    design: Any
    planned: Mapping[int, Any]
    pictures: Mapping[tuple[str, ...], str]


class Task(ABC):
    """One experiment, by which laboratory, browser, files, simulation and report know what to do.

    A task of one's own states `name`, `title`, `design`, `trial` and `answer`, its texts, what its laboratory trial
    does (`run`), and, where observers are to be simulated, how they answer (`simulated`). Columns, pages, check and
    report follow; each can be replaced.
    """

    name: ClassVar[str]
    """Label of the task in the names of files: letters and digits."""
    title: ClassVar[str]
    """What the task is, in a few words, for sidecars and report."""
    command: ClassVar[str] = ""
    """Name on the command line; empty: that of the task."""
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """Texts by language ("en"), then by entry: "instructions" (pages apart by ``---``), "debriefing", and one's own."""
    onset: ClassVar[str] = "onset"
    """Column of the time at which a trial began."""
    percepts: ClassVar[bool] = False
    """Whether keys are held during a trial, and the table has a row for each percept."""
    ratios: ClassVar[frozenset[str]] = frozenset()
    """Columns of answers that are ratios, analysed on their logarithm."""
    settings_of_report: ClassVar[frozenset[str]] = frozenset()
    """Settings of a preregistration that only some tasks have: "bound", "ordinal", "far_effect"."""
    observer_s: ClassVar[float] = 0.1
    """Seconds of one core that a simulated observer's session takes about."""
    no_pictures: ClassVar[str] = "whose observers look at none"
    """Why simulated observers need no pictures from a folder; empty where they look at some."""
    earlier: ClassVar[Mapping[str, Any]] = {}
    """Meaning of settings that designs of earlier versions do not state."""

    @property
    @abstractmethod
    def design(self) -> type[Any]:
        """Class of the design, a `focalgradient.design.Plan`."""

    @property
    def trial(self) -> type[Any]:
        """Class of a trial, a `focalgradient.design.Trial`."""
        raise NotImplementedError

    @property
    @abstractmethod
    def answer(self) -> type[Any]:
        """Class of an answer, a `Response`."""

    @property
    def called(self) -> str:
        """Name on the command line."""
        return self.command or self.name

    def columns(self, settings: Mapping[str, Any] | None = None) -> tuple[Column, ...]:
        """Return the columns of a session's table, by its design as it was recorded; None: those of every design.

        Here those of the trial's fields, then those of the answer's.
        """
        answered = [*_own_columns(self.answer, "Answer.")]
        chosen = {column.name for column in answered}
        shown = [one for one in _own_columns(self.trial, "Condition of the trial.") if one.name not in chosen]
        catch = Column("catch", "Whether the trial only checks attention.", "bool")
        onset = Column("onset", "When the stimulus appeared, on the clock of the sitting.", "number", "s", least=0)
        time = Column("response_time", "From the question to the answer.", "number", "s", least=0)
        return (TRIAL, *shown, REPETITION, catch, onset, *answered, time, DROPPED, SITTING)

    def settings(self) -> str:
        """Return the settings file (TOML) of the task's default design, to be copied and changed."""
        lines = [f"# {self.title}"]
        for name, value in self.design().model_dump(mode="json").items():
            if isinstance(value, dict):
                continue
            lines.append(f"{name} = {_toml(value)}")
        return "\n".join(lines) + "\n"

    def pages(self, design: Any, words: Any, participant: str, browser: bool) -> Any:
        """Return the pages that a participant reads: here `texts`' "instructions" before, "debriefing" after."""
        from focalgradient.design.plain_pages import PlainPages

        return PlainPages(self, words)

    def text(self, words: Any, entry: str, **values: object) -> str:
        """Return a text in the session's language.

        Raises
        ------
        InputError
            If the task has no such text in it.
        """
        own = self.texts.get(words.language, {})
        if entry not in own:
            raise InputError(
                f"the task {self.name!r} has no text {entry!r} in {words.language!r}: add it to its texts."
            )
        return own[entry].format(**values)

    def adapted(self, design: Any, trial: Any, recorded: Sequence[Mapping[str, Any]]) -> Any:
        """Return a trial as it is shown, with what depends on the answers so far: here as it is planned.

        A procedure (`focalgradient.design.Staircase` and others) chooses a field that trial and answer both have, like
        ``level``: ``dataclasses.replace(trial, level=procedure.level(answers_of(recorded)))``. In a browser the server
        chooses after each answer; a study that is exported has no server, and is refused.
        """
        return trial

    def shown(self, design: Any, trial: Any, pixels_per_degree: float) -> Interval | Sequence[Interval]:
        """Return the picture of a trial (H x W x 3, 8 bits) and for how many seconds it is shown.

        Or a list of these, one an interval. With `control` it describes a trial as data: the window and the browser
        both show it so.
        """
        raise InputError(f"the task {self.name!r} has no trial to show: define shown and control, or run.")

    def adjustment(self, design: Any, words: Any, trial: Any, pixels_per_degree: float) -> Adjustment:
        """Return what a trial asks to be set by a knob, instead of `shown` and `control`.

        The answer is made by `answered`, which then has the keyword `start` as well: the value at the start.
        """
        raise InputError(f"the task {self.name!r} has nothing to adjust: define adjustment, or shown and control.")

    def intervals(self, design: Any, trial: Any, pixels_per_degree: float) -> list[Interval]:
        """Return the pictures of a trial as `shown` gives them, always as a list."""
        shown: Any = self.shown(design, trial, pixels_per_degree)
        return [shown] if isinstance(shown, tuple) and not isinstance(shown[0], tuple) else [*shown]

    def pictures(
        self, design: Any, trial: Any, stimuli: Any, pixels_per_degree: float | None
    ) -> dict[str, str | NDArray[np.uint8]]:
        """Return what a trial shows, for other programs: a file of the set of pictures, or pixels, by column.

        Parameters
        ----------
        design, trial
            Of the session.
        stimuli
            The set of pictures; None where none was given.
        pixels_per_degree
            Of the screen; None where pixels are not asked for.

        Returns
        -------
        dict
            "picture", and further intervals as "picture_2"; or "reference", what it is compared with.
        """
        if pixels_per_degree is None or not self.described or self.adapts or self.adjusts:
            return {}
        shown = self.intervals(design, trial, pixels_per_degree)
        return {f"picture_{n}" if n > 1 else "picture": pixels for n, (pixels, _) in enumerate(shown, start=1)}

    def control(self, words: Any, trial: Any) -> Control:
        """Describe what a trial is answered on."""
        raise InputError(f"the task {self.name!r} has no trial to show: define shown and control, or run.")

    def further(self, design: Any, words: Any, trial: Any) -> Mapping[str, tuple[Control, Noted]]:
        """Describe what is asked after a trial's own question, by column: here what the design's `also` asks.

        Each is what it is answered on, and a note without a value, with unit and description of the column.
        """
        return {name: (one.control(), Noted(None, one.unit or None, one.about)) for name, one in design.also.items()}

    def answered(self, design: Any, trial: Any, value: float, **times: Any) -> Any:
        """Return the answer of what was given on the control: here the one field that the answer adds to `Response`.

        Parameters
        ----------
        design, trial
            Of the session.
        value
            What was given on the control; of two ways 1 or 2.
        times
            `onset`, `response_time` and `dropped_frames` of `Response`; of an adjustment also `start`, where the knob
            stood at first.
        """
        name, *more = (column.name for column in _own_columns(self.answer, ""))
        if more:
            raise InputError(f"an answer of the task {self.name!r} has more than one field: define answered.")
        kind = typing.get_type_hints(self.answer)[name]
        return self.answer(**{name: int(value) if kind is int else value}, **times)

    @property
    def described(self) -> bool:
        """Whether trials are described as data, so that a browser can show them."""
        own = type(self)
        return self.adjusts or (own.shown is not Task.shown and own.control is not Task.control)

    @property
    def adapts(self) -> bool:
        """Whether what a trial shows depends on the answers so far."""
        return type(self).adapted is not Task.adapted

    @property
    def adjusts(self) -> bool:
        """Whether a trial is an adjustment, described as data."""
        return type(self).adjustment is not Task.adjustment

    def run(self, sitting: Any, trial: Any) -> Any:
        """Show a trial in the laboratory's window and return its answer: here as the task describes it."""
        from focalgradient.lab.described import show_described

        return show_described(self, sitting, trial)

    def experiment(self) -> Any:
        """Return what the laboratory runs."""
        from focalgradient.lab.experiment import GREY, Experiment

        return Experiment(task=self.name, about=type(self).__doc__ or self.title, trial=self.run, background=GREY)

    def simulated(self, design: Any, trial: Any, observer: Any, chance: Any) -> Any:
        """Return a simulated observer's answer, without its `onset` in time: `chance` is a NumPy generator."""
        raise InputError(f"the task {self.name!r} has no simulated observer: define simulated.")

    def seen(self, design: Any, folder: Path | None, executor: Executor | None, progress: Any) -> dict[str, Any]:
        """Return what simulated observers look at: `encoded` and `stimuli` of `focalgradient.observers.simulate`.

        Parameters
        ----------
        design
            That they take part in.
        folder
            Of the pictures; None: small ones are made where there are any.
        executor
            What encodes them; None: this process.
        progress
            Takes the share that is done, and what is done.
        """
        return {}

    def observe(self, design: Any, observer: Any, participant: str, seed: int, encoded: Any = None) -> tuple[Any, ...]:
        """Return a simulated observer's answers to all trials, one after the other in time."""
        from focalgradient.observers.answers import PAUSE, random_stream

        person = observer.person(random_stream(seed, self.name, participant))
        clock, answers, recorded = 0.0, [], list[dict[str, Any]]()
        for number, trial in enumerate(design.trials(participant), start=1):
            shown = self.adapted(design, trial, recorded)
            answer = self.simulated(design, shown, person, random_stream(seed, self.name, participant, number))
            answers.append(dataclasses.replace(answer, onset=round(clock, 4)))
            recorded.append({**dataclasses.asdict(trial), **dataclasses.asdict(answers[-1])})
            clock += design.least_s(trial) + answer.response_time + PAUSE
        return tuple(answers)

    @property
    def simulates(self) -> bool:
        """Whether there are simulated observers."""
        return type(self).observe is not Task.observe or type(self).simulated is not Task.simulated

    def check_answer(self, design: Any, trial: Any, answer: Any) -> None:
        """Raise InputError where an answer contradicts the design or its trial, beyond what its columns allow."""
        return

    def problems(self, rows: Rows) -> Iterator[str]:
        """Say where a session's table contradicts its design, beyond what is true of all tasks."""
        return iter(())

    def factors(self, design: Any) -> Mapping[str, tuple[Any, ...]]:
        """Return the conditions that the report compares, with their levels: here the fields that a trial adds."""
        main = [trial for trial in design.trials("01") if trial.phase == "main" and not trial.catch]
        names = [column.name for column in _own_columns(self.trial, "")]
        levels = {name: sorted({getattr(trial, name) for trial in main}, key=_order) for name in names}
        return {name: tuple(found) for name, found in levels.items() if len(found) > 1}

    def measures(self, settings: Mapping[str, Any]) -> Mapping[str, str]:
        """Return the answers whose means and tests the report gives, with their units: those the answer adds."""
        columns = [one for one in self.columns(settings) if one.form != "text"]
        names = {one.name for one in _own_columns(self.answer, "")}
        return {one.name: one.units or ("share" if one.form == "bool" else "") for one in columns if one.name in names}

    def planned(self, design: Any) -> tuple[Any, ...]:
        """Return the tests of the report before there are data: `focalgradient.statistics.ConditionTest` each.

        Here of each measure and factor: see `focalgradient.statistics.planned_tests`.
        """
        from focalgradient.statistics.conditions import planned_tests

        measures = self.measures(design.model_dump(mode="json"))
        return planned_tests({name: name in self.ratios for name in measures}, self.factors(design))

    def tested(self, design: Any, table: Any) -> tuple[Any, ...]:
        """Return the tests of the report with their effects; `table` has all trials that are not catch trials."""
        from focalgradient.statistics.conditions import condition_tests

        return condition_tests(table, self.planned(design))

    def findings(self, table: Any) -> list[str]:
        """Return sentences of the report about all answers (a table with `participant_id`, without catch trials)."""
        return []

    def reported(self, root: Any, asked: Any) -> Any:
        """Return the task's part of a report (`focalgradient.report.parts.Part`) of the data set in the folder `root`.

        Here the means of each condition, the tests of `tested`, a figure by factor, and every trial as CSV.
        """
        from focalgradient.report.own_tasks import analyse_own_task

        return analyse_own_task(root, self)

    def preregistered(self, design: Any, asked: Any) -> Any:
        """Return the text of a preregistration (`focalgradient.report.preregistered.Preregistered`), before data.

        Here the tests of `planned`, with their power where there are simulated observers.
        """
        from focalgradient.report.own_tasks import preregister_own_task

        return preregister_own_task(self, design, asked)

    def study(self, design: Any, assumed: Mapping[str, float], seed: int) -> Any:
        """Return what is simulated for the power of the report's tests: a `focalgradient.power.Study`.

        Parameters
        ----------
        design
            What subjects are shown.
        assumed
            Effects and standard deviations that were given, by the name of their option; the task's own for others.
        seed
            Of all chance.

        Raises
        ------
        InputError
            If the task has no such number, or no simulated observer.
        """
        from focalgradient.power.own_tasks import TaskStudy

        return TaskStudy.of(self, design, assumed, seed)


def _order(value: Any) -> tuple[str, Any]:
    """Order of levels, also of different types."""
    return (type(value).__name__, value)


def paper_settings(name: str) -> str:
    """Return a settings file that comes with the package."""
    return (files("focalgradient.design") / "files" / f"{name}.toml").read_text(encoding="utf-8")


def _own_columns(record: type[Any], about: str) -> Iterator[Column]:
    """Columns of the fields that a record adds to the base of all trials or answers."""
    hints = typing.get_type_hints(record)
    base = next(each for each in reversed(record.__mro__[:-1]) if dataclasses.is_dataclass(each))
    shared = {one.name for one in dataclasses.fields(base)}
    for one in dataclasses.fields(record):
        if one.name not in shared:
            form, levels, optional = _form(hints[one.name], one.name)
            told = dict(one.metadata)
            levels = told.pop("levels", levels)
            yield Column(one.name, told.pop("about", about), form, levels=levels, optional=optional, **told)


def _form(hint: Any, name: str) -> tuple[Form, Mapping[str, str], bool]:
    """Form of a column, its levels, and whether it may be empty, by the type of its field."""
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
        raise InputError(f"{name} is a field of type {hint}, but a column holds bool, int, float, str or Literal.")
    return forms[hint], {}, False


def _toml(value: Any) -> str:
    """A value of a settings file.

    >>> _toml(["a", 1.5, True])
    '["a", 1.5, true]'
    """
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"' if isinstance(value, str) else repr(value)
