"""Display of trials that a task describes as data: pictures with a question, or an adjustment."""

from __future__ import annotations

from functools import partial
from inspect import cleandoc
from typing import Any, NamedTuple

import numpy as np

from focalgradient.dataset import Noted
from focalgradient.design.rating_pages import standard_text
from focalgradient.lab.adjusting import adjust
from focalgradient.lab.experiment import GREY, Experiment, Sitting
from focalgradient.lab.forms import pages
from focalgradient.lab.questions import ask
from focalgradient.tasks import Task
from focalgradient.tasks.noted import noted_start, with_noted
from focalgradient.tasks.steps import BLANK_S, Step, pauses

__all__ = ["described_experiment", "show_described"]


def described_experiment(task: Task) -> Experiment:
    """Return the experiment of a task whose trials are described as data, or shown by its own `run`."""
    trial = partial(show_described, task) if type(task).run is Task.run else task.run
    return Experiment(
        task=task.name,
        about=cleandoc(type(task).__doc__ or task.title),
        trial=trial,
        pictures=task.needed,
        background=GREY,
        before=partial(_warm_up, task),
        standard=_show_standard,
        right=lambda sitting, trial, answer: task.right(sitting.design, trial, answer),
    )


def _warm_up(task: Task, sitting: Sitting) -> None:
    """Make the pictures of a trial, so that compiled code is ready before the first, for an adaptive task."""
    if task.adapts and sitting.stimuli is not None:
        sitting.screen.text(sitting.words("common.moment")).draw()
        sitting.screen.frame()
        _shown(task, sitting, task.adapted(sitting.design, sitting.design.trials("01")[0], ()))


def _show_standard(sitting: Sitting) -> None:
    """Show the standard, the picture with which ratings are compared, after its page."""
    screen, design = sitting.screen, sitting.design
    _, image = sitting.picture(design.standard_scene, "pinhole", design.fixations[0])
    pages(screen, [standard_text(design, sitting.words)], "ready")
    screen.play(partial(_draw, image), design.standard_s, "standard")
    screen.on_event("off", screen.blank())


def show_described(task: Task, sitting: Sitting, trial: Any) -> Any:
    """Run one trial as its task describes it, after the standard if it is due; return the answer."""
    if getattr(trial, "standard_before", False):
        _show_standard(sitting)
    return _adjusted(task, sitting, trial) if task.adjusts else _asked(task, sitting, trial)


class _Shown(NamedTuple):
    """Step with its drawable parts; `place` is that of the mark, in px from the screen's centre, x right and y up."""

    step: Step
    image: Any
    place: tuple[float, float] | None
    mark: Any
    mask: Any

    def draw(self, since: float) -> None:
        """Draw the picture."""
        self.image.draw()
        if self.step.mark_kept:
            self.mark.draw()


def _shown(task: Task, sitting: Sitting, trial: Any) -> list[_Shown]:
    """Load the parts of a trial's steps."""
    screen, made = sitting.screen, []
    given = (trial, screen.display.pixels_per_degree, sitting.noise_seed(trial), sitting.stimuli)
    for step in task.steps(sitting.design, *given):
        pixels = step.picture if isinstance(step.picture, np.ndarray) else sitting.pixels(step.picture)
        place = mark = mask = None
        if step.mark is not None:
            height, width = pixels.shape[:2]
            place = (step.mark[0] - width / 2, height / 2 - step.mark[1])
            mark = screen.fixation(*place)
        if step.mask is not None and step.mask_s:
            mask = screen.picture(step.mask, recorded=False)
        made.append(_Shown(step, screen.picture(pixels), place, mark, mask))
    return made


def _asked(task: Task, sitting: Sitting, planned: Any) -> Any:
    screen, design = sitting.screen, sitting.design
    trials, parts = list[Any](), list[_Shown]()

    def prepare() -> None:  # during the pause: making pictures takes longer than a frame
        trials.append(task.adapted(design, planned, sitting.recorded))
        parts.extend(_shown(task, sitting, trials[0]))
        screen.warm(*(one for part in parts for one in (part.image, part.mark, part.mask) if one is not None))

    pause, _ = pauses(design)
    screen.empty(pause, "pause", prepare) if pause else prepare()
    recorder = sitting.recorder
    if recorder is not None:
        recorder.begin()
    try:
        onsets = [_show(sitting, part) for part in parts]
    finally:
        sitting.taken = None if recorder is None else recorder.end()
    given = ask(screen, task.asked(design, sitting.words, trials[0]))
    noted = noted_start(given.start)
    if sitting.taken is not None:
        away = sitting.taken.away
        noted |= {"gaze_away": Noted(away), "gaze_left": Noted(away is None or away > design.gaze_within_deg)}
    onset = next(time for time, part in zip(onsets, parts, strict=True) if part.step.judged)
    times = {"onset": sitting.since_start(onset), "response_time": given.seconds}
    answer = task.answered(design, trials[0], given.value, **times, **task.stimulus(design, trials[0], sitting.stimuli))
    return with_noted(answer, noted)


def _show(sitting: Sitting, part: _Shown) -> float:
    """Show the mark, picture, mask and blank of a step; return the picture's onset on the screen's clock."""
    screen, step = sitting.screen, part.step
    if part.mark is not None and step.mark_s:
        screen.play(partial(_draw, part.mark), step.mark_s, "mark", lit=False)
    onset = screen.play(part.draw, step.seconds, step.event)
    if sitting.recorder is not None and part.place is not None:
        sitting.recorder.shown(onset, onset + step.seconds, part.place)
    if part.mask is not None:
        screen.play(partial(_draw, part.mask), step.mask_s, "mask", lit=False)
    _, blank = pauses(sitting.design)
    screen.empty(blank, "off")
    return onset


def _draw(part: Any, since: float) -> None:
    part.draw()


def _adjusted(task: Task, sitting: Sitting, planned: Any) -> Any:
    screen, design = sitting.screen, sitting.design
    trial = task.adapted(design, planned, sitting.recorded)
    asked = task.adjustment(design, sitting.words, trial, screen.display.pixels_per_degree)
    views = [(screen.refocused(one.series, one.pos), one.focus) for one in asked.views]

    def draw(value: float) -> None:
        for view, focus in views:
            view.focus = value if focus is None else focus
            view.draw()

    try:
        screen.empty(BLANK_S, "pause")
        onset = sitting.since_start(screen.now() + BLANK_S)
        given = adjust(screen, draw, asked.least, asked.most, question=asked.question, ratios=asked.ratios)
    finally:
        for view, _ in views:
            view.close()
    return task.answered(design, trial, given.value, start=given.start, onset=onset, response_time=given.seconds)
