"""Base class of tasks: design, trial, answer, columns, texts, checks and report of one experiment."""

from __future__ import annotations

import typing
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from focalgradient.errors import InputError
from focalgradient.files.columns import Column
from focalgradient.scales import Control, Held
from focalgradient.scales.base import filled
from focalgradient.tasks.adjustment import Adjustment
from focalgradient.tasks.columns import DROPPED, REPETITION, SITTING, TRIAL, added_columns
from focalgradient.tasks.noted import Noted
from focalgradient.tasks.response import Response
from focalgradient.tasks.steps import Interval, Step, steps_of

__all__ = ["Response", "Task", "paper_settings"]


class Task(ABC):
    """An experiment, as the laboratory, browser, files, simulation and report need to know it.

    A custom task defines `name`, `title`, `design`, `trial` and `answer`, its texts, its laboratory trial (`run`) and,
    if observers are to be simulated, their answers (`simulated`). Columns, pages, checks and report are derived from
    these; each can be overridden.
    """

    name: ClassVar[str]
    """Label of the task in file names: letters and digits."""
    title: ClassVar[str]
    """Short description of the task, for sidecars and report."""
    command: ClassVar[str] = ""
    """Name on the command line; empty: `name`."""
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """Texts by language ("en"), then by entry: "instructions" (pages separated by ``---``), "debriefing", and custom
    entries.
    """
    onset: ClassVar[str] = "onset"
    """Column of the onset time of a trial."""
    background: ClassVar[float] = -0.004
    """Grey of the laboratory's screen, from -1 (black) to 1 (white): by default the 8-bit value 127."""
    percepts: ClassVar[bool] = False
    """True if keys are pressed and held during a trial, and the table has one row per percept."""
    ratios: ClassVar[frozenset[str]] = frozenset()
    """Answer columns that are ratios, analysed on their logarithm."""
    settings_of_report: ClassVar[frozenset[str]] = frozenset()
    """Preregistration settings that apply to this task: "bound", "ordinal", "far_effect"."""
    observer_s: ClassVar[float] = 0.1
    """Approximate processor time in seconds (one core) of one simulated observer's session."""
    modelled: ClassVar[bool] = False
    """True if `focalgradient.observers` answers a whole session, instead of `simulated` trial by trial."""
    no_pictures: ClassVar[str] = "whose observers look at none"
    """Reason why simulated observers need no picture folder; empty if they look at pictures."""

    @property
    @abstractmethod
    def design(self) -> type[Any]:
        """Class of the design, a subclass of `focalgradient.design.Plan`."""

    @property
    def trial(self) -> type[Any]:
        """Class of a trial, a subclass of `focalgradient.design.Trial`."""
        raise NotImplementedError

    @property
    @abstractmethod
    def answer(self) -> type[Any]:
        """Class of an answer, a subclass of `Response`."""

    @property
    def called(self) -> str:
        """Name on the command line."""
        return self.command or self.name

    def columns(self, settings: Mapping[str, Any] | None = None) -> tuple[Column, ...]:
        """Return the columns of a session's table for the recorded design settings; None: those of every design.

        By default the fields of the trial, then those of the answer.

        Raises
        ------
        InputError
            If a field of the answer has the name of a trial's field, which it would overwrite; only tasks that adapt or
            adjust set such a field.
        """
        answered = [*added_columns(self.answer, "Answer.")]
        chosen = {column.name for column in answered}
        shown = [*added_columns(self.trial, "Condition of the trial.")]
        both = [one.name for one in shown if one.name in chosen]
        if both and not (self.adapts or self.adjusts):
            raise InputError(
                f"the task {self.name!r} fails: {both[0]!r} is a field of the trial and of the answer, which would "
                "overwrite the condition that was shown: rename the field of the answer."
            )
        shown = [one for one in shown if one.name not in chosen]
        catch = Column("catch", "Whether the trial only checks attention.", "bool")
        onset = Column("onset", "When the stimulus appeared, on the clock of the sitting.", "number", "s", least=0)
        time = Column("response_time", "From the question to the answer.", "number", "s", least=0)
        return (TRIAL, *shown, REPETITION, catch, onset, *answered, time, DROPPED, SITTING)

    def settings(self) -> str:
        """Return the settings file (TOML) of the task's default design, as a template."""
        lines = [f"# {self.title}"]
        for name, value in self.design().model_dump(mode="json").items():
            if isinstance(value, dict):
                continue
            lines.append(f"{name} = {_toml(value)}")
        return "\n".join(lines) + "\n"

    def pages(self, design: Any, words: Any, participant: str, browser: bool) -> Any:
        """Return the pages for the participant: by default "instructions" before the task and "debriefing" after it."""
        from focalgradient.design.plain_pages import PlainPages

        return PlainPages(self, words)

    def text(self, words: Any, entry: str, **values: object) -> str:
        """Return a text of the task in the session's language.

        Raises
        ------
        InputError
            If the task has no such text in that language, or it has a brace that no value fills in.
        """
        own = self.texts.get(words.language, {})
        if entry not in own:
            raise InputError(
                f"the task {self.name!r} has no text {entry!r} in {words.language!r}: add it to its texts."
            )
        return filled(own[entry], f"the text {entry!r} of the task {self.name!r}", values)

    def adapted(self, design: Any, trial: Any, recorded: Sequence[Mapping[str, Any]]) -> Any:
        """Return the trial to be shown, given the answers so far: by default the planned trial.

        A procedure (such as `focalgradient.design.Staircase`) sets a field that trial and answer share, like
        ``level``: ``dataclasses.replace(trial, level=procedure.level(answers_of(recorded)))``. In a browser the server
        applies the procedure after each answer; an exported study has no server, so its export is refused.
        """
        return trial

    def shown(self, design: Any, trial: Any, pixels_per_degree: float) -> Interval | Step | Sequence[Interval | Step]:
        """Return the picture of a trial (H x W x 3, 8 bits) and its duration in seconds.

        Trials with several intervals return a list, one pair per interval, or a `Step` with a mark and an event of its
        own. Together with `control` this describes a trial as data, which the window and the browser both show, after
        `pause_s` of the design and with `blank_s` after each picture. An override may add the parameters `seed`, the
        seed of the trial's noise (`focalgradient.design.Plan.noise_seed`), which differs between any two trials;
        `stimuli`, the set of pictures (`needed`); `words`, the texts of the session; and `display` and `refresh_hz`,
        those of the screen.
        """
        raise InputError(f"the task {self.name!r} has no trial to show: define shown and control, or run.")

    def standard(self, design: Any, form: str, pixels_per_degree: float, stimuli: Any, words: Any) -> Step:
        """Return what is shown as the standard, with which trials are compared, for a `Standard` of the pages."""
        raise InputError(f"the task {self.name!r} has no standard: define standard.")

    def adjustment(self, design: Any, words: Any, trial: Any, pixels_per_degree: float) -> Adjustment:
        """Return the description of an adjustment trial, which replaces `shown` and `control`.

        The answer is created by `answered`, which then also receives `start`, the initial value of the knob.
        """
        raise InputError(f"the task {self.name!r} has nothing to adjust: define adjustment, or shown and control.")

    def needed(self, design: Any) -> Sequence[tuple[str, str, str, Mapping[str, str]]]:
        """Return the pictures of a set that a design requires: scene, aperture, fixation, levels of its factors."""
        return ()

    def right(self, design: Any, trial: Any, answer: Any) -> float | None:
        """Return whether a practice answer is correct; None if it has no correct answer.

        For held keys, the share of the trial for which the right one was held, at least one half if correct. An
        override may add the parameter `participant`.
        """
        return None

    def pictures(
        self, design: Any, trial: Any, stimuli: Any, pixels_per_degree: float | None, seed: int = 0
    ) -> dict[str, str | NDArray[np.uint8]]:
        """Return the pictures of a trial for other programs, by column: a file of the picture set, or pixels.

        Parameters
        ----------
        design, trial
            Design of the session, and one of its trials.
        stimuli
            The set of pictures; None if none was given.
        pixels_per_degree
            Angular resolution of the screen; None: return no pixels.
        seed
            Seed of the trial's noise.

        Returns
        -------
        dict
            "picture", with further intervals as "picture_2", or with the picture to compare it with as "reference".
        """
        if pixels_per_degree is None or not self.described or self.adapts or self.adjusts:
            return {}
        shown = [step.picture for step in steps_of(self, design, trial, pixels_per_degree, seed=seed)]
        pixels = [picture for picture in shown if isinstance(picture, np.ndarray)]
        return {f"picture_{n}" if n > 1 else "picture": picture for n, picture in enumerate(pixels, start=1)}

    def control(self, words: Any, trial: Any) -> Control | Held:
        """Return the description of a trial's response control.

        An override may add the parameters `design` and `participant` (a label).
        """
        raise InputError(f"the task {self.name!r} has no trial to show: define shown and control, or run.")

    def further(self, design: Any, words: Any, trial: Any) -> Mapping[str, tuple[Control, Noted]]:
        """Return the additional questions of a trial, by column: by default those of the design's `also`.

        Each consists of its response control and a note without a value, with the unit and description of the column.
        """
        return {name: (one.control(), Noted(None, one.unit or None, one.about)) for name, one in design.also.items()}

    def answered(self, design: Any, trial: Any, value: Any, **times: Any) -> Any:
        """Return the answer for a value set on the control: by default in the one field that the answer class adds.

        Parameters
        ----------
        design, trial
            Design of the session, and the trial answered.
        value
            Value set on the control; 1 or 2 for a binary choice; for held keys the presses and releases
            (`focalgradient.dataset.Press`), in s from the onset.
        times
            `onset`, `response_time` (for held keys, the duration of the trial) and `dropped_frames` of `Response`; for
            an adjustment also `start`, the initial value of the knob; for a task with pictures of a set also
            `stimulus`, the file of the trial's picture.
        """
        name, *more = (column.name for column in added_columns(self.answer, ""))
        if more:
            raise InputError(f"an answer of the task {self.name!r} has more than one field: define answered.")
        kind = typing.get_type_hints(self.answer)[name]
        return self.answer(**{name: int(value) if kind is int else value}, **times)

    def stimulus(self, design: Any, trial: Any, stimuli: Any) -> dict[str, str]:
        """Return the keyword `stimulus` of `answered`: the file of the trial's picture; empty without a set."""
        file = None if stimuli is None else self.pictures(design, trial, stimuli, None).get("picture")
        return {"stimulus": file} if isinstance(file, str) else {}

    @property
    def described(self) -> bool:
        """True if trials are described as data, so that a browser can show them."""
        own = type(self)
        return self.adjusts or (own.shown is not Task.shown and own.control is not Task.control)

    @property
    def adapts(self) -> bool:
        """True if the content of a trial depends on earlier answers."""
        return type(self).adapted is not Task.adapted

    @property
    def adapted_fields(self) -> tuple[str, ...]:
        """Fields that a procedure sets by earlier answers: those of trial and answer both, if the task adapts."""
        if not self.adapts:
            return ()
        answered = {column.name for column in added_columns(self.answer, "")}
        return tuple(column.name for column in added_columns(self.trial, "") if column.name in answered)

    @property
    def adjusts(self) -> bool:
        """True if a trial is an adjustment described as data."""
        return type(self).adjustment is not Task.adjustment

    def run(self, sitting: Any, trial: Any) -> Any:
        """Show a trial in the laboratory's window and return its answer.

        Trials that are described as data need none: the laboratory shows them (`focalgradient.lab.show_described`).
        """
        raise InputError(f"the task {self.name!r} has no trial to show: define shown and control, or run.")

    def check_devices(self, design: Any) -> None:  # noqa: B027 - most tasks have none
        """Raise `InputError` before the window opens if a device of the design does not respond; none by default."""

    def simulated(self, design: Any, trial: Any, observer: Any, chance: Any) -> Any:
        """Return a simulated observer's answer with an arbitrary `onset`; `chance` is a NumPy generator."""
        raise InputError(f"the task {self.name!r} has no simulated observer: define simulated.")

    @property
    def simulates(self) -> bool:
        """True if the task has simulated observers."""
        return self.modelled or type(self).simulated is not Task.simulated

    def check_answer(self, design: Any, trial: Any, answer: Any) -> None:
        """Raise `InputError` if an answer contradicts the design or its trial, beyond the limits of its columns."""
        return

    def picture_file(
        self, design: Any, shown: Mapping[str, Any], pictures: Mapping[tuple[str, ...], str]
    ) -> str | None:
        """Return the file of the picture that a trial must have shown; None: it shows none of the set.

        Parameters
        ----------
        design
            Design of the session.
        shown
            Condition and answer of the trial, as recorded.
        pictures
            Files of the set by scene, aperture and fixation, and by those followed by levels such as "light=dim".
        """
        name: str | None = shown.get("stimulus")
        return name

    def factors(self, design: Any) -> Mapping[str, tuple[Any, ...]]:
        """Return the conditions compared in the report, with their levels: by default the fields that a trial adds."""
        main = [trial for trial in design.trials("01") if trial.phase == "main" and not trial.catch]
        names = [name for column in added_columns(self.trial, "") if (name := column.name) not in self.adapted_fields]
        levels = {name: sorted({getattr(trial, name) for trial in main}, key=_order) for name in names}
        return {name: tuple(found) for name, found in levels.items() if len(found) > 1}

    def measures(self, settings: Mapping[str, Any]) -> Mapping[str, str]:
        """Return the answers analysed in the report, with their units: by default the fields that the answer adds.

        Not among them are the levels that a procedure sets, as they are not answers.
        """
        columns = [one for one in self.columns(settings) if one.form != "text"]
        names = {one.name for one in added_columns(self.answer, "")} - {*self.adapted_fields}
        return {one.name: one.units or ("share" if one.form == "bool" else "") for one in columns if one.name in names}

    def planned(self, design: Any) -> tuple[Any, ...]:
        """Return the tests of the report before data exist, as `focalgradient.statistics.ConditionTest` objects.

        By default one for each measure and factor: see `focalgradient.statistics.planned_tests`.
        """
        from focalgradient.statistics.conditions import planned_tests

        measures = self.measures(design.model_dump(mode="json"))
        return planned_tests({name: name in self.ratios for name in measures}, self.factors(design))

    def tested(self, design: Any, table: Any) -> tuple[Any, ...]:
        """Return the tests of the report with their effects; `table` contains all trials except catch trials."""
        from focalgradient.statistics.conditions import condition_tests

        return condition_tests(table, self.planned(design))

    def findings(self, table: Any) -> list[str]:
        """Return sentences about all answers for the report; `table` has `participant_id` and no catch trials."""
        return []

    def reported(self, root: Any, asked: Any) -> Any:
        """Return the task's part of a report (`focalgradient.report.parts.Part`) on the data set in the folder `root`.

        None, the default: the means of each condition, the tests of `tested`, a figure by factor, and all trials as
        CSV.
        """
        return None

    def preregistered(self, design: Any, asked: Any) -> Any:
        """Return the text of a preregistration (`focalgradient.report.preregistered.Preregistered`).

        None, the default: the tests of `planned`, with their power if the task has simulated observers.
        """
        return None

    def study(self, design: Any, assumed: Mapping[str, float], seed: int) -> Any:
        """Return the simulated experiment for the power of the report's tests: a `focalgradient.power.Study`.

        None, the default: answers of the default observer, tested by `tested` (`focalgradient.power.TaskStudy`).

        Parameters
        ----------
        design
            Design of the experiment.
        assumed
            Assumed effects and standard deviations, by option name; the task's defaults for others.
        seed
            Seed of all random numbers.

        Raises
        ------
        InputError
            If the task has no such option, or no simulated observer.
        """
        return None


def _order(value: Any) -> tuple[str, Any]:
    """Return a sort key for levels, which may be of different types."""
    return (type(value).__name__, value)


def paper_settings(name: str) -> str:
    """Return the text of a settings file that comes with the package."""
    return (files("focalgradient.design") / "files" / f"{name}.toml").read_text(encoding="utf-8")


def _toml(value: Any) -> str:
    """Format a value for a settings file.

    >>> _toml(["a", 1.5, True])
    '["a", 1.5, true]'
    """
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"' if isinstance(value, str) else repr(value)
