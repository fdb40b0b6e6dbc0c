"""Base class of tasks: design, trial, answer, columns, texts, checks and report of one experiment."""

from __future__ import annotations

import typing
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol

from typing_extensions import TypeVar

from focalgradient.errors import InputError
from focalgradient.files.columns import Column
from focalgradient.scales import Control, Held, OwnControl
from focalgradient.scales.base import filled
from focalgradient.tasks.adaptive import adapted_analysis, compared_answers, compared_factors
from focalgradient.tasks.adjustment import Adjustment
from focalgradient.tasks.columns import DROPPED, REPETITION, SITTING, TRIAL, added_columns
from focalgradient.tasks.noted import Noted
from focalgradient.tasks.response import Response
from focalgradient.tasks.steps import Interval, Pictured, Step
from focalgradient.words import Words

if TYPE_CHECKING:
    import pandas as pd

    from focalgradient.statistics.criteria import AnalysisOptions
    from focalgradient.statistics.questions import Analysis

__all__ = ["Response", "Task"]


class Plans(Protocol):
    """Design of a session, as `focalgradient.design.Plan`."""

    @property
    def also(self) -> Mapping[str, Any]:
        """Additional questions by column."""
        ...

    def trials(self, participant: str, session: str | None = None) -> Sequence[Any]:
        """Return the trials of one participant."""
        ...

    def model_dump(self, *, mode: str = "python") -> dict[str, Any]:
        """Return the settings."""
        ...


Design = TypeVar("Design", bound=Plans, default=Any)
Trial = TypeVar("Trial", default=Any)
Answer = TypeVar("Answer", default=Any)


class Task(Generic[Design, Trial, Answer]):
    """An experiment, as the laboratory, browser, files, simulation and report need to know it.

    A custom task defines `name`, `title`, `design`, `trial` and `answer`, its texts, what a trial shows (`shown` with
    `control`, `adjustment`, or `run`) and, if observers are to be simulated, their answers (`simulated`). Columns,
    pages, checks and report are derived from these. Functions that are None here are optional: a task that needs one
    defines a method of that name.
    """

    name: ClassVar[str]
    """Label of the task in file names: letters and digits."""
    title: ClassVar[str]
    """Short description of the task, for sidecars and report."""
    design: type[Design]
    """Class of the design, a subclass of `focalgradient.design.Plan`."""
    trial: type[Trial]
    """Class of a trial, a subclass of `focalgradient.design.Trial`."""
    answer: type[Answer]
    """Class of an answer, a subclass of `Response`."""
    command: ClassVar[str] = ""
    """Name on the command line; empty: `name`."""
    texts: ClassVar[Mapping[str, Mapping[str, str]]] = {}
    """Texts by language ("en"), then by entry: "instructions" (pages separated by ``---``), "debriefing", and custom
    entries.
    """
    settings_file: ClassVar[str] = ""
    """Name of a settings file in `focalgradient.design`, the template of a design; empty: made of the defaults."""
    table: ClassVar[tuple[Column, ...]] = ()
    """Columns of every session's table; empty: derived from trial and answer."""
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

    pages: Callable[..., Any] | None = None
    """Make the pages for the participant (`focalgradient.design.sequence.Pages`) from design, words, participant and
    whether they are shown in a browser; None: "instructions" before the task and "debriefing" after it.
    """
    shown: Callable[..., Interval | Step | Sequence[Interval | Step]] | None = None
    """Return the picture of a trial (H x W x 3, 8 bits) and its duration in seconds, from design, trial and
    pixels_per_degree.

    Trials with several intervals return a list, one pair per interval, or a `Step` with a mark and an event of its
    own. Together with `control` this describes a trial as data, which the window and the browser both show, after
    `pause_s` of the design and with `blank_s` after each picture. It may have the parameters `seed`, the seed of the
    trial's noise (`focalgradient.design.Plan.noise_seed`), which differs between any two trials; `stimuli`, the set of
    pictures (`needed`); `words`, the texts of the session; and `display` and `refresh_hz`, those of the screen.
    """
    control: Callable[..., Control | Held | OwnControl] | None = None
    """Return the description of a trial's response control, from words and trial; it may have the parameters `design`
    and `participant` (a label).
    """
    adjustment: Callable[..., Adjustment] | None = None
    """Return the description of an adjustment trial, which replaces `shown` and `control`, from design, words, trial
    and pixels_per_degree. `answered` then also receives `start`, the initial value of the knob.
    """
    run: Callable[..., Answer] | None = None
    """Show a trial in the laboratory's window and return its answer, from sitting and trial; trials that are described
    as data need none.
    """
    standard: Callable[..., Step] | None = None
    """Return the step that shows the standard with which trials are compared, for a `Standard` of the pages, from
    design, form, pixels_per_degree, stimuli and words.
    """
    pictured: Callable[..., Mapping[str, Pictured]] | None = None
    """Return the pictures of a set that a trial shows, from design and trial, by column: "picture", and "reference" for
    the one with which it is compared.
    """
    right: Callable[..., float | None] | None = None
    """Return whether a practice answer is correct, from design, trial and answer; None if it has no correct answer.

    For held keys, the share of the trial for which the right one was held, at least one half if correct. It may have
    the parameter `participant`.
    """
    right_key: Callable[..., Mapping[str, Any] | None] | None = None
    """Return by what a page without a server judges a practice answer, from design, trial and participant: the number
    that a correct one is "below" or "above", or the "key" to be held and its least "share" of the time; None if there
    is no correct answer.
    """
    simulated: Callable[..., Answer] | None = None
    """Return a simulated observer's answer with an arbitrary `onset`, from design, trial, observer and a generator."""
    check_answer: Callable[..., None] | None = None
    """Raise `InputError` if an answer contradicts the design or its trial, beyond the limits of its columns."""
    check_devices: Callable[..., None] | None = None
    """Raise `InputError` before the window opens if a device of the design does not respond."""
    planned: Callable[..., Sequence[Any]] | None = None
    """Return the tests of the report before data exist, from the design (`focalgradient.statistics.ConditionTest`);
    None: one for each measure and factor (`focalgradient.statistics.planned_tests`), and the interactions of factors.
    """
    tested: Callable[..., Sequence[Any]] | None = None
    """Return these tests with their effects, from the design and a table of all trials except catch trials."""
    findings: Callable[..., Sequence[str]] | None = None
    """Return sentences about all answers for the report, from a table with participants and no catch trials."""
    reported: Callable[..., Any] | None = None
    """Return the task's part of a report (`focalgradient.report.parts.Part`) on the data set in a folder, from root and
    asked; None: the means of each condition, the tests, a figure by factor, and all trials as CSV.
    """
    preregistered: Callable[..., Any] | None = None
    """Return the text of a preregistration (`focalgradient.report.preregister.Preregistered`), from design and asked;
    None: the planned tests, with their power if the task has simulated observers.
    """
    study: Callable[..., Any] | None = None
    """Return the simulated experiment for the power of the report's tests (`focalgradient.power.Study`), from
    design, assumed effects and standard deviations by option name, and seed; None: answers of the default observer,
    tested as in the report (`focalgradient.power.Observers`).
    """

    def analysis(
        self, design: Design, options: AnalysisOptions | None = None, table: pd.DataFrame | None = None
    ) -> Analysis:
        """Return the questions of the task, of which report, preregistration and power are made.

        By default the thresholds if a procedure sets the level (`adapted`) and answers are correct or not, else a
        question for each planned test: each answer on each condition. Further questions:
        ``dataclasses.replace(super().analysis(design), also=[Analysis([Question(...)])])``.

        Parameters
        ----------
        design
            Design.
        options
            Settings of the report.
        table
            Recorded trials, whose conditions are compared; None: those of the design.
        """
        from focalgradient.statistics.condition_test import planned_interactions, planned_tests  # with pandas and SciPy
        from focalgradient.statistics.conditions import condition_analysis

        if self.planned is None and self.tested is None and (thresholds := adapted_analysis(self, design)):
            return thresholds
        settings = design.model_dump(mode="json")
        measures = self.measures(settings)
        units = {column.name: column.units or "" for column in self.columns(settings)} | dict(measures)
        if self.planned is not None:
            planned = tuple(self.planned(design))
        else:
            answers = compared_answers(self, design)
            planned = planned_tests({name: name in self.ratios for name in answers}, compared_factors(self, design))
            planned += planned_interactions(planned) if self.tested is None else ()
        return condition_analysis(planned, None if self.tested is None else partial(self.tested, design), units)

    @property
    def called(self) -> str:
        """Name on the command line."""
        return self.command or self.name

    def columns(self, settings: Mapping[str, object] | None = None) -> tuple[Column, ...]:
        """Return the columns of a session's table for the recorded design settings; None: those of every design.

        By default `table`, else the fields of the trial, then those of the answer.

        Raises
        ------
        InputError
            If a field of the answer has the name of a trial's field, which it would overwrite; only tasks that adapt or
            adjust set such a field.
        """
        if self.table:
            return self.table
        answered = [*added_columns(self.answer, "Answer.")]
        chosen = {column.name for column in answered}
        shown = [*added_columns(self.trial, "Condition of the trial.")]
        both = [column.name for column in shown if column.name in chosen]
        if both and not (self.adapts or self.adjusts):
            raise InputError(
                f"the task {self.name!r} fails: {both[0]!r} is a field of the trial and of the answer, which would "
                "overwrite the condition that was shown: rename the field of the answer; or, for thresholds by "
                f"{both[0]}, add adapted(design, trial, recorded), which chooses it, or returns the trial as it is."
            )
        shown = [column for column in shown if column.name not in chosen]
        catch = Column("catch", "Whether the trial only checks attention.", "bool")
        onset = Column("onset", "When the stimulus appeared, on the clock of the sitting.", "number", "s", least=0)
        time = Column("response_time", "From the question to the answer.", "number", "s", least=0)
        return (TRIAL, *shown, REPETITION, catch, onset, *answered, time, DROPPED, SITTING)

    def text(self, words: Words, entry: str, **values: object) -> str:
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

    def adapted(self, design: Design, trial: Trial, recorded: Sequence[Mapping[str, Any]]) -> Trial:
        """Return the trial to be shown, given the answers so far: by default the planned trial.

        A procedure (such as `focalgradient.design.Staircase`) sets a field that trial and answer share, like
        ``level``: ``dataclasses.replace(trial, level=procedure.level(answers_of(recorded)))``. In a browser the server
        applies the procedure after each answer; an exported study has no server, so its export is refused.
        """
        return trial

    def needed(self, design: Design) -> Sequence[Pictured]:
        """Return the pictures of a set that a design requires; by default none."""
        return ()

    def further(self, design: Design, words: Any, trial: Trial) -> Mapping[str, tuple[Control, Noted]]:
        """Return the additional questions of a trial, by column: by default those of the design's `also`.

        Each consists of its response control and a note without a value, with the unit and description of the column.
        """
        return {
            name: (asked.control(), Noted(None, asked.unit or None, asked.about)) for name, asked in design.also.items()
        }

    def answered(self, design: Design, trial: Trial, value: Any, **times: Any) -> Answer:
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

    @property
    def described(self) -> bool:
        """True if trials are described as data, so that a browser can show them."""
        return self.adjusts or None not in (self.shown, self.control)

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
        return self.adjustment is not None

    @property
    def simulates(self) -> bool:
        """True if the task has simulated observers."""
        return self.modelled or self.simulated is not None

    def factors(self, design: Design) -> Mapping[str, tuple[object, ...]]:
        """Return the conditions compared in the report, with their levels: by default the fields that a trial adds.

        Levels of text are in the order of their field's `Literal` or `levels`.
        """
        main = [trial for trial in design.trials("01") if trial.phase == "main" and not trial.catch]
        columns = [column for column in added_columns(self.trial, "") if column.name not in self.adapted_fields]
        levels = {
            column.name: sorted({getattr(trial, column.name) for trial in main}, key=partial(_order, [*column.levels]))
            for column in columns
        }
        return {name: tuple(found) for name, found in levels.items() if len(found) > 1}

    def measures(self, settings: Mapping[str, object]) -> Mapping[str, str]:
        """Return the answers analysed in the report, with their units: by default the fields that the answer adds.

        Not among them are the levels that a procedure sets and the initial values of a knob (`start`): no answers.
        """
        columns = [column for column in self.columns(settings) if column.form != "text"]
        names = {column.name for column in added_columns(self.answer, "")} - {*self.adapted_fields}
        names -= {"start"} if self.adjusts else set()
        return {
            column.name: column.units or ("share" if column.form == "bool" else "")
            for column in columns
            if column.name in names
        }


def _order(stated: Sequence[str], value: object) -> tuple[int, str, Any]:
    """Return a sort key for levels, which may be of different types: the place among those stated, then the value."""
    return (stated.index(str(value)) if str(value) in stated else len(stated), type(value).__name__, value)
