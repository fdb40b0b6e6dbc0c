"""Display of trials that a task describes as data: pictures with a question, or an adjustment."""

from __future__ import annotations

from functools import partial
from typing import Any

from focalgradient.lab.adjusting import adjust
from focalgradient.lab.experiment import GREY, Experiment, Sitting
from focalgradient.lab.questions import ask
from focalgradient.tasks import Task
from focalgradient.tasks.base import BLANK_S
from focalgradient.tasks.noted import noted_start

__all__ = ["described_experiment", "show_described"]


def described_experiment(task: Task) -> Experiment:
    """Return the experiment of a task whose trials are described as data, or shown by its own `run`."""
    trial = partial(show_described, task) if type(task).run is Task.run else task.run
    return Experiment(
        task=task.name,
        about=type(task).__doc__ or task.title,
        trial=trial,
        pictures=task.needed,
        background=GREY,
        before=partial(_warm_up, task),
        right=lambda sitting, trial, answer: task.right(sitting.design, trial, answer),
    )


def _warm_up(task: Task, sitting: Sitting) -> None:
    """Make the pictures of a trial, so that compiled code is ready before the first, for a task that uses a set."""
    if sitting.stimuli is not None:
        sitting.screen.text(sitting.words("common.moment")).draw()
        sitting.screen.frame()
        _steps(task, sitting, task.adapted(sitting.design, sitting.design.trials("01")[0], ()))


def show_described(task: Task, sitting: Sitting, trial: Any) -> Any:
    """Run one trial as its task describes it; return the answer."""
    return _adjusted(task, sitting, trial) if task.adjusts else _asked(task, sitting, trial)


def _steps(task: Task, sitting: Sitting, trial: Any) -> list[Any]:
    """Return the steps of a trial, each with its mark and image."""
    screen, made = sitting.screen, []
    shown = (trial, screen.display.pixels_per_degree, sitting.noise_seed(trial), sitting.stimuli)
    for step in task.steps(sitting.design, *shown):
        mark = None
        if step.mark is not None:
            height, width = step.picture.shape[:2]
            mark = screen.fixation(step.mark[0] - width / 2, height / 2 - step.mark[1])
        made.append((step, mark, screen.picture(step.picture)))
    return made


def _asked(task: Task, sitting: Sitting, planned: Any) -> Any:
    screen, design = sitting.screen, sitting.design
    trials, steps = list[Any](), list[Any]()

    def prepare() -> None:  # during the pause: making pictures takes longer than a frame
        trials.append(task.adapted(design, planned, sitting.recorded))
        steps.extend(_steps(task, sitting, trials[0]))
        screen.warm(*(part for _, mark, image in steps for part in (mark, image) if part is not None))

    pause = getattr(design, "pause_s", 0.0)
    screen.empty(pause, "pause", prepare) if pause else prepare()
    onsets = []
    for step, mark, image in steps:
        if mark is not None and step.mark_s:
            screen.play(partial(_draw, mark), step.mark_s, "mark", lit=False)
        onsets.append(screen.play(partial(_draw, image), step.seconds, step.event))
        screen.empty(getattr(design, "blank_s", BLANK_S), "off")
    given = ask(screen, task.asked(design, sitting.words, trials[0]))
    sitting.noted |= noted_start(given.start)
    times = {"onset": sitting.since_start(onsets[0]), "response_time": given.seconds}
    return task.answered(design, trials[0], given.value, **times, **task.stimulus(design, trials[0], sitting.stimuli))


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
