"""Conformance check of a task with its design: raises an error that names the first failure."""

from __future__ import annotations

import dataclasses
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from focalgradient.errors import InputError, described
from focalgradient.files.columns import cell_test
from focalgradient.scales import Control, Held, OwnControl, Scale, Steps, Ways
from focalgradient.tasks.base import Task
from focalgradient.tasks.columns import RESERVED
from focalgradient.tasks.noted import NAME, Noted
from focalgradient.tasks.registry import task_named
from focalgradient.tasks.steps import Step, control_of, intervals_of

__all__ = ["PIXELS_PER_DEGREE", "called", "check_task"]

PIXELS_PER_DEGREE = 37.5
"""Resolution at which a trial is drawn if the screen is unknown: a screen 53.1 cm and 1920 pixels wide, 57 cm away."""

MAX_TRIALS = 10_000
"""Maximum number of trials of a session: at 2 s each, six hours (our choice)."""

MAX_REPETITIONS = 1000
"""Maximum number of repetitions of a design, refused before its trials are made."""

SECONDS = 1.0
"""Time in seconds after which no further trial is tried; the first trial of a participant always is."""

ABOVE_LABELS = 0.88
"""Height of pictures as a fraction of the window's, above the labels of held keys."""

PARTICIPANTS = ("01", "02")
"""Participants whose trials are tried."""

Result = TypeVar("Result")


def check_task(
    design: Any,
    words: Any = None,
    *,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
    room: tuple[int, int] | None = None,
    stimuli: Any = None,
    observer: Any = None,
) -> None:
    """Check that the task of a design can be shown and answered.

    Every page has its texts. The trials of two participants are made twice and must be the same. If they are described
    as data, each has a picture of 8 bits that fits the screen and is the same when it is drawn again, and a valid
    control; each end of the control, and each further question, gives an answer that can be recorded, and after which
    `adapted` gives the next trial. The simulated answers of an `observer` are of the task's class and the same for the
    same seed. Trials are tried for `SECONDS`.

    Parameters
    ----------
    design
        Design of the session, an instance of the task's `design`.
    words
        Texts of the session; None: those of the design's language, or English ones for a file of texts.
    pixels_per_degree
        Resolution of the screen.
    room
        Width and height in pixels that pictures may have; None: not checked.
    stimuli
        Set of pictures; None: trials of a task that uses one are not drawn.
    observer
        `focalgradient.observers.Observer` whose simulated answers are tried; None: they are not.

    Raises
    ------
    InputError
        If a check fails, or a method of the task raises another error; the message names the method.

    Examples
    --------
    >>> from focalgradient.design import NeckerDesign
    >>> check_task(NeckerDesign())
    """
    checked = _Checked(task_named(design.task), design, words or design.words())
    checked.columns()
    checked.pages()
    until = time.monotonic() + SECONDS
    for participant in PARTICIPANTS:
        trials = checked.trials(participant)
        main = [trial for trial in trials if trial.phase == "main"]
        for trial in (main[0], *(one for one in trials if one is not main[0])):
            shown = checked.call("adapted", checked.task.adapted, design, trial, ())
            if checked.task.described and not checked.task.adjusts:
                seed = design.noise_seed(participant, trial)
                control = checked.answers(trial, shown, participant)
                if stimuli is not None or not checked.task.needed(design):
                    above = room and (room[0], int(ABOVE_LABELS * room[1])) if isinstance(control, Held) else room
                    checked.pictures(shown, seed, pixels_per_degree, above, stimuli)
            if trial is main[0]:
                checked.further(shown)
            if time.monotonic() > until:
                break
        if observer is not None:
            checked.simulated(participant, trials, observer)


def called(task: Task, name: str, function: Callable[..., Result], *given: Any, **named: Any) -> Result:
    """Call a method of a task; any error that is not an `InputError` becomes one that names the method and the line."""
    try:
        return function(*given, **named)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        at = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(at.filename).name}, line {at.lineno}"
        raise InputError(f"the task {task.name!r} fails: {name} raises {error!r} ({place}).") from error


class _Checked:
    """A task under test, with a design and the texts of its language."""

    def __init__(self, task: Task, design: Any, words: Any):
        self.task, self.design, self.words = task, design, words

    def need(self, holds: object, what: str) -> None:
        """Raise `InputError` with the message `what` unless a condition holds."""
        if not holds:
            raise InputError(f"the task {self.task.name!r} fails: {what}.")

    def call(self, name: str, function: Callable[..., Result], *given: Any, **named: Any) -> Result:
        """Call a method of the task, as `called` does."""
        return called(self.task, name, function, *given, **named)

    def columns(self) -> None:
        """Check that the names of columns are distinct, and not reserved."""
        settings = self.design.model_dump(mode="json")
        names = [column.name for column in self.call("columns", self.task.columns, settings)]
        taken = RESERVED - {"simulated"}  # earlier tasks have such a field
        wrong = [name for number, name in enumerate(names) if name in names[:number] or name in taken]
        self.need(
            not wrong, f"{(wrong or [''])[0]!r} is the name of another column: rename the field of trial or answer"
        )

    def trials(self, participant: str) -> Sequence[Any]:
        """Check that a participant's trials are the same when they are made again; return them."""
        repetitions = self.design.repetitions
        self.need(repetitions <= MAX_REPETITIONS, f"repetitions is {repetitions:,}, but may be {MAX_REPETITIONS:,}")
        trials, again = (self.call("trials", self.design.trials, participant) for _ in range(2))
        self.need(any(trial.phase == "main" for trial in trials), "trials has no main trial")
        self.need(len(trials) <= MAX_TRIALS, f"trials has {len(trials):,}, but may have {MAX_TRIALS:,}")
        self.need(
            trials == again,
            f"trials gives participant {participant} another list the second time: draw with self.draws, from the seed",
        )
        return trials

    def pages(self) -> None:
        """Check that every page has its texts."""
        if self.task.pages is None:
            for entry in ("instructions", "debriefing"):
                if any(entry in texts for texts in self.task.texts.values()):
                    self.call(entry, self.task.text, self.words, entry)
            return
        pages = self.call("pages", self.task.pages, self.design, self.words, "01", False)
        for name in ("opening", "again", "closing"):
            self.call(name, getattr(pages, name))

    def simulated(self, participant: str, trials: Sequence[Any], observer: Any) -> None:
        """Check the answers of a simulated observer, given by `simulated` alone, to a participant's trials."""
        if self.task.modelled or self.task.simulated is None:
            return
        recorded = list[dict[str, Any]]()
        until = time.monotonic() + SECONDS
        for number, trial in enumerate(trials, start=1):
            shown = self.call("adapted", self.task.adapted, self.design, trial, recorded)
            answer, again = (
                self.call(
                    "simulated",
                    self.task.simulated,
                    self.design,
                    shown,
                    observer.person(np.random.default_rng(1)),
                    np.random.default_rng(number),
                )
                for _ in range(2)
            )
            where = f"for trial {number} of participant {participant}"
            right = isinstance(answer, self.task.answer)
            self.need(right, f"simulated gives {described(answer)} {where}, not {self.task.answer.__name__}")
            self.need(
                answer == again,
                f"simulated gives another answer {where} the second time: draw with the generator given",
            )
            recorded.append({**dataclasses.asdict(trial), **dataclasses.asdict(answer)})
            if time.monotonic() > until:
                return

    def pictures(
        self, trial: Any, seed: int, pixels_per_degree: float, room: tuple[int, int] | None, stimuli: Any
    ) -> None:
        """Check the pictures of a trial, and their durations."""
        known = {"seed": seed, "stimuli": stimuli, "words": self.words}
        intervals, again = (
            [*map(_first, self.call("shown", intervals_of, self.task, self.design, trial, pixels_per_degree, **known))]
            for _ in range(2)
        )
        self.need(intervals, "shown has no interval")
        judged = any(not isinstance(interval, Step) or interval.judged for interval in intervals)
        self.need(judged, "shown has no step that is judged: leave judged at True for the step that is answered")
        for interval in intervals:
            self.interval(interval, room)
        drawn = [[one.picture if isinstance(one, Step) else one[0] for one in shown] for shown in (intervals, again)]
        same = all(np.array_equal(one, other) for one, other in zip(*drawn, strict=True))
        self.need(same, "shown draws another picture the second time: draw from the parameter seed")

    def interval(self, interval: Any, room: tuple[int, int] | None) -> None:
        """Check a picture and its duration."""
        if isinstance(interval, Step):
            if not isinstance(interval.picture, np.ndarray):
                return
            interval = interval.picture, interval.seconds
        self.need(isinstance(interval, tuple) and len(interval) == 2, "shown must give a picture and its duration")
        pixels, seconds = interval
        whole = isinstance(pixels, np.ndarray) and pixels.dtype == np.uint8
        what = f"{pixels.dtype} of shape {pixels.shape}" if isinstance(pixels, np.ndarray) else described(pixels)
        self.need(
            whole and (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)),
            f"the picture of shown is {what}, but must be an array H x W or H x W x 3 of 8 bits (uint8)",
        )
        height, width = pixels.shape[:2]
        self.need(pixels.size, f"the picture of shown is empty ({width} x {height} pixels)")
        self.need(
            isinstance(seconds, int | float) and 0 < seconds < np.inf,
            f"the duration of shown is {described(seconds)}, but must be a number of seconds above 0",
        )
        if room is not None and (width > room[0] or height > room[1]):
            raise InputError(
                f"the pictures of the task {self.task.name!r} have {width} x {height} pixels, but the window has "
                f"only {room[0]} x {room[1]}: use the whole screen or a larger one, or make smaller pictures."
            )

    def control(self, name: str, control: Any) -> Control | OwnControl:
        """Check the response control of a question."""
        self.need(
            isinstance(control, Scale | Steps | Ways | OwnControl), f"{name} is {described(control)}, not a control"
        )
        if isinstance(control, Scale | Steps):
            line = f"{name} goes from {control.least:g} to {control.most:g}"
            self.need(control.least < control.most, f"{line}, but its ends must ascend")
            logarithmic = isinstance(control, Scale) and control.ratios
            self.need(control.least > 0 or not logarithmic, f"{line}, which has no ratios: give ratios=False")
        if isinstance(control, Steps):
            fits = len(control.labels) in {0, 2, 3, len(control.values)}
            self.need(fits, f"{name} has {len(control.labels)} labels, which do not fit {len(control.values)} steps")
        if isinstance(control, Ways):
            self.need(len(control.ways) == 2, f"{name} has {len(control.ways)} ways, but must have 2")
        return control

    def answers(self, planned: Any, trial: Any, participant: str) -> Control | Held | OwnControl:
        """Check that the control's ends give answers within the limits of their columns; return the control.

        After each answer the `planned` trial is adapted again.
        """
        control = self.call("control", control_of, self.task, self.design, self.words, trial, participant)
        if isinstance(control, Held):
            fits = 0 < len({*control.keys}) == len(control.keys) == len(control.labels)
            self.need(fits, f"control holds the keys {control.keys}, but must name different ones, each with a label")
            values: list[Any] = [()]
        else:
            values = [self.control("control", control).reached()[end] for end in (0, -1)]
        for value in values:
            times = {"onset": 0.0, "response_time": 1.0, "dropped_frames": 0}
            answer = self.call("answered", self.task.answered, self.design, trial, value, **times)
            right = isinstance(answer, self.task.answer)
            self.need(right, f"answered gives {described(answer)}, not {self.task.answer.__name__}")
            if getattr(self.design, "gaze", "none") != "none":
                answer = dataclasses.replace(answer, gaze_left=True)  # as the runner adds it
            for column in self.task.columns(self.design.model_dump(mode="json")):
                given = getattr(answer, column.name, None)
                if column.name in {one.name for one in dataclasses.fields(answer)}:
                    self.need(cell_test(column)(given), f"{column.name} is {given!r}, but must be {column.expected}")
            if self.task.check_answer is not None:
                self.call("check_answer", self.task.check_answer, self.design, trial, answer)
            if self.task.adapts:
                recorded = [{**dataclasses.asdict(trial), **dataclasses.asdict(answer)}]
                self.call("adapted", self.task.adapted, self.design, planned, recorded)
        return control

    def further(self, trial: Any) -> None:
        """Check the additional questions: their names, controls and notes."""
        columns = self.task.columns(self.design.model_dump(mode="json"))
        taken = {column.name for column in columns if not column.optional}
        for name, one in self.call("further", self.task.further, self.design, self.words, trial).items():
            self.need(
                isinstance(name, str) and NAME.fullmatch(name) and name not in taken,
                f"further names {name!r}: use letters, digits and _, and no name of another column",
            )
            whole = isinstance(one, tuple) and len(one) == 2 and isinstance(one[1], Noted)
            self.need(whole, f"further[{name!r}] must be a control and a Noted")
            self.control(f"further[{name!r}]", one[0])


def _first(interval: Any) -> Any:
    """Return an interval with the first frame of its film; others unchanged."""
    is_film = isinstance(interval, Step) and isinstance(interval.picture, Iterator)
    return dataclasses.replace(interval, picture=next(interval.picture, None)) if is_film else interval
