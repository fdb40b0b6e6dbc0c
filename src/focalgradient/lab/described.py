"""Display of trials that a task describes as data: pictures with a question, or an adjustment."""

from __future__ import annotations

from functools import partial
from typing import Any

from focalgradient.lab.adjusting import adjust
from focalgradient.lab.experiment import GREY, Experiment, Sitting
from focalgradient.lab.questions import ask
from focalgradient.tasks import Task
from focalgradient.tasks.base import BLANK_S

__all__ = ["described_experiment", "show_described"]


def described_experiment(task: Task) -> Experiment:
    """Return the experiment of a task whose trials are described as data, or shown by its own `run`."""
    trial = partial(show_described, task) if type(task).run is Task.run else task.run
    return Experiment(task=task.name, about=type(task).__doc__ or task.title, trial=trial, background=GREY)


def show_described(task: Task, sitting: Sitting, trial: Any) -> Any:
    """Run one trial as its task describes it; return the answer."""
    trial = task.adapted(sitting.design, trial, sitting.recorded)
    return _adjusted(task, sitting, trial) if task.adjusts else _asked(task, sitting, trial)


def _asked(task: Task, sitting: Sitting, trial: Any) -> Any:
    screen, design = sitting.screen, sitting.design
    shown = task.intervals(design, trial, screen.display.pixels_per_degree)
    pictures = [(screen.picture(pixels), seconds) for pixels, seconds in shown]
    screen.warm(*(picture for picture, _ in pictures))
    onsets = []
    for picture, seconds in pictures:
        onsets.append(screen.play(partial(_draw, picture), seconds, "picture"))
        screen.empty(BLANK_S, "off")
    given = ask(screen, task.control(sitting.words, trial))
    times = {"onset": sitting.since_start(onsets[0]), "response_time": given.seconds}
    return task.answered(design, trial, given.value, **times)


def _draw(picture: Any, since: float) -> None:
    picture.draw()


def _adjusted(task: Task, sitting: Sitting, trial: Any) -> Any:
    screen, design = sitting.screen, sitting.design
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
