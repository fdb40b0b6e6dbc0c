"""Conformance check of a task with its design: raises an error that names the first failure."""

from __future__ import annotations

import dataclasses
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from focalgradient.errors import InputError, described
from focalgradient.scales import Control, Scale, Steps, Ways
from focalgradient.tasks.base import Task
from focalgradient.tasks.noted import NAME, Noted
from focalgradient.tasks.registry import task_named

__all__ = ["PIXELS_PER_DEGREE", "called", "check_task"]

PIXELS_PER_DEGREE = 37.5
"""Resolution at which a trial is drawn if the screen is unknown: a screen 53.1 cm and 1920 pixels wide, 57 cm away."""

Result = TypeVar("Result")


def check_task(
    design: Any,
    words: Any = None,
    *,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
    room: tuple[int, int] | None = None,
) -> None:
    """Check that the task of a design can be shown and answered.

    Every page has its texts. If trials are described as data, the first main trial has a picture of 8 bits that fits
    the screen, and a valid control; each end of the control, and each further question, gives an answer that can be
    recorded.

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

    Raises
    ------
    InputError
        If a check fails, or a method of the task raises another error; the message names the method.

    Examples
    --------
    >>> from focalgradient.design import NeckerDesign
    >>> check_task(NeckerDesign())
    """
    from focalgradient.design.words import LANGUAGES, load_words

    language = design.language if design.language in LANGUAGES else "en"
    checked = _Checked(task_named(design.task), design, words or load_words(language))
    checked.columns()
    trial = checked.pages()
    if checked.task.described and not checked.task.adjusts:
        checked.pictures(trial, pixels_per_degree, room)
        checked.answers(trial)
    checked.further(trial)


def called(task: Task, name: str, function: Callable[..., Result], *given: Any, **named: Any) -> Result:
    """Call a method of a task; any error that is not an `InputError` becomes one that names the method and the line."""
    try:
        return function(*given, **named)
    except InputError:
        raise
    except Exception as error:
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
        from focalgradient.dataset.session import RESERVED

        names = [column.name for column in self.task.columns(self.design.model_dump(mode="json"))]
        taken = RESERVED - {"simulated"}  # earlier tasks have such a field
        wrong = [name for number, name in enumerate(names) if name in names[:number] or name in taken]
        self.need(
            not wrong, f"{(wrong or [''])[0]!r} is the name of another column: rename the field of trial or answer"
        )

    def pages(self) -> Any:
        """Check the pages; return the first main trial, as it is shown."""
        trials = self.call("trials", self.design.trials, "01")
        main = [trial for trial in trials if trial.phase == "main"]
        self.need(main, "trials has no main trial")
        pages = self.call("pages", self.task.pages, self.design, self.words, "01", False)
        for name in ("opening", "again", "closing"):
            self.call(name, getattr(pages, name))
        return self.call("adapted", self.task.adapted, self.design, main[0], ())

    def pictures(self, trial: Any, pixels_per_degree: float, room: tuple[int, int] | None) -> None:
        """Check the pictures of a trial, and their durations."""
        intervals = self.call("shown", self.task.intervals, self.design, trial, pixels_per_degree)
        self.need(intervals, "shown has no interval")
        for interval in intervals:
            self.need(isinstance(interval, tuple) and len(interval) == 2, "shown must give a picture and its duration")
            pixels, seconds = interval
            whole = isinstance(pixels, np.ndarray) and pixels.dtype == np.uint8
            what = f"{pixels.dtype} of shape {pixels.shape}" if isinstance(pixels, np.ndarray) else described(pixels)
            self.need(
                whole and (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)),
                f"the picture of shown is {what}, but must be an array H x W or H x W x 3 of 8 bits (uint8)",
            )
            self.need(
                isinstance(seconds, int | float) and 0 < seconds < np.inf,
                f"the duration of shown is {described(seconds)}, but must be a number of seconds above 0",
            )
            height, width = pixels.shape[:2]
            if room is not None and (width > room[0] or height > room[1]):
                raise InputError(
                    f"the pictures of the task {self.task.name!r} have {width} x {height} pixels, but the window has "
                    f"only {room[0]} x {room[1]}: use the whole screen or a larger one, or make smaller pictures."
                )

    def control(self, name: str, control: Any) -> Control:
        """Check a response control."""
        self.need(isinstance(control, Scale | Steps | Ways), f"{name} is {described(control)}, not a control")
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

    def answers(self, trial: Any) -> None:
        """Check that the control's ends give answers within the limits of their columns."""
        from focalgradient.dataset.events import cell_test

        control = self.control("control", self.call("control", self.task.control, self.words, trial))
        for value in (control.reached()[0], control.reached()[-1]):
            times = {"onset": 0.0, "response_time": 1.0, "dropped_frames": 0}
            answer = self.call("answered", self.task.answered, self.design, trial, value, **times)
            right = isinstance(answer, self.task.answer)
            self.need(right, f"answered gives {described(answer)}, not {self.task.answer.__name__}")
            for column in self.task.columns(None):
                given = getattr(answer, column.name, None)
                if column.name in {one.name for one in dataclasses.fields(answer)}:
                    self.need(cell_test(column)(given), f"{column.name} is {given!r}, but must be {column.expected}")
            self.call("check_answer", self.task.check_answer, self.design, trial, answer)

    def further(self, trial: Any) -> None:
        """Check the additional questions: their names, controls and notes."""
        taken = {column.name for column in self.task.columns(self.design.model_dump(mode="json"))}
        for name, one in self.call("further", self.task.further, self.design, self.words, trial).items():
            self.need(
                isinstance(name, str) and NAME.fullmatch(name) and name not in taken,
                f"further names {name!r}: use letters, digits and _, and no name of another column",
            )
            whole = isinstance(one, tuple) and len(one) == 2 and isinstance(one[1], Noted)
            self.need(whole, f"further[{name!r}] must be a control and a Noted")
            self.control(f"further[{name!r}]", one[0])
