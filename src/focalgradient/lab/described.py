"""Display of trials that a task describes as data: pictures with a question, or an adjustment."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from functools import partial
from inspect import cleandoc
from typing import Any, NamedTuple

import numpy as np

from focalgradient.dataset import Press
from focalgradient.design.sequence import Page
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.adjusting import adjust
from focalgradient.lab.devices.sound import tone
from focalgradient.lab.experiment import Experiment, Sitting
from focalgradient.lab.forms import draw_all, pages
from focalgradient.lab.questions import ask
from focalgradient.scales import Held
from focalgradient.tasks import Task
from focalgradient.tasks.noted import noted_start, with_noted
from focalgradient.tasks.steps import BLANK_S, Look, Step, control_of, judged, pauses, steps_of, stimulus_of

__all__ = ["described_experiment", "show_described"]

WHITE_S = 0.5
"""Duration of the white screen after a look at the real world, in s (our choice)."""


def described_experiment(task: Task) -> Experiment:
    """Return the experiment of a task whose trials are described as data, or shown by its own `run`."""
    trial = partial(show_described, task) if task.run is None else task.run
    return Experiment(
        task=task.name,
        about=cleandoc(type(task).__doc__ or task.title),
        trial=trial,
        pictures=task.needed,
        check=partial(_check, task),
        background=task.background,
        before=partial(_warm_up, task),
        standard=partial(_lead, task),
        right=lambda sitting, trial, answer: judged(task, sitting.design, trial, answer, sitting.participant)[0],
    )


def _check(task: Task, design: Any, display: Display, room: tuple[int, int]) -> None:
    """Raise `InputError` if a key of the design is unknown, or a device does not respond."""
    from focalgradient.lab.screen import key_names

    if task.check_devices is not None:
        task.check_devices(design)
    for key in getattr(design, "keys", ()):
        if key not in key_names():
            raise InputError(f"keys has {key!r}, but must name keys of a keyboard, such as 'f', 'left' or 'space'.")


def _warm_up(task: Task, sitting: Sitting) -> None:
    """Make the pictures of a trial, so that compiled code is ready before the first, for an adaptive task."""
    if task.adapts and sitting.stimuli is not None:
        sitting.screen.text(sitting.words("common.moment")).draw()
        sitting.screen.frame()
        _shown(task, sitting, task.adapted(sitting.design, sitting.design.trials("01")[0], ()))


def show_described(task: Task, sitting: Sitting, trial: Any) -> Any:
    """Run one trial as its task describes it, between the pages that belong to it; return the answer."""
    answer = _adjusted(task, sitting, trial) if task.adjusts else _asked(task, sitting, trial)
    share = judged(task, sitting.design, trial, answer, sitting.participant)[1] if sitting.after else None
    for page in sitting.after:
        text = page.text if share is None else page.text.replace("{share}", f"{100 * share:.0f}")
        pages(sitting.screen, [text], page.event)
    return answer


def _lead(task: Task, sitting: Sitting, labels: Sequence[Any] = ()) -> None:
    """Show the pages directly before a trial, and the standard if it is due; `labels`: those of held keys."""
    screen, design = sitting.screen, sitting.design
    for step in sitting.lead:
        if isinstance(step, Page) and labels:
            _wait_ready(sitting, step, labels)
        else:
            pages(screen, [step.text], step.event if isinstance(step, Page) else "ready")
        if isinstance(step, Page):
            if step.ends:
                screen.on_event(step.ends, screen.blank())
            continue
        degree = screen.display.pixels_per_degree
        assert task.standard is not None
        part = _loaded(sitting, task.standard(design, step.form, degree, sitting.stimuli, sitting.words))
        _warm(sitting, [part])
        _show(sitting, part, 0.0)


def _wait_ready(sitting: Sitting, page: Page, labels: Sequence[Any]) -> None:
    """Show a page above the labels of held keys, as they are during the trial, until the space bar is pressed."""
    screen = sitting.screen
    title, *lines = page.text.split("\n")
    parts = [screen.text(title, height=0.05, y=0.1, bold=True)]
    parts += [screen.text(line, y=-0.1 * number) for number, line in enumerate(lines)]
    screen.wait(lambda: draw_all((*parts, *labels)), ["space"], page.event)


def _labels(sitting: Sitting, control: Any) -> list[Any]:
    """Return the labels of held keys, each on the side of its key; empty for other controls."""
    if not isinstance(control, Held):
        return []
    step = 0.6 / max(len(control.keys) - 1, 1)
    return [
        sitting.screen.text(f"{sitting.words.key(key)}   {label}", height=0.028, x=-0.3 + step * number, y=-0.46)
        for number, (key, label) in enumerate(zip(control.keys, control.labels, strict=True))
    ]


class _Shown(NamedTuple):
    """Step with its drawable parts, and its film's SHA-256.

    `place` is that of the mark, in px from the screen's centre, x right and y up.
    """

    step: Step
    images: Sequence[Any]
    place: tuple[float, float] | None
    mark: Any
    mask: Any
    sha256: str = ""

    def draw(self, frame_s: float, labels: Sequence[Any], since: float) -> None:
        """Draw the picture, or the frame of a film, with the labels of held keys."""
        self.images[round(since / frame_s) % len(self.images)].draw()
        draw_all((*([self.mark] if self.step.mark_kept else []), *labels))


def _film(sitting: Sitting, frames: Iterator[Any]) -> tuple[list[Any], str]:
    """Upload the frames of a film to the graphics card; return them, and the SHA-256 of their pixels."""
    screen, film, digest = sitting.screen, list[Any](), hashlib.sha256()
    moment = screen.text(sitting.words("common.moment"), height=0.026, y=-0.42)
    for number, pixels in enumerate(frames):
        if number % 10 == 0:  # redraw the screen and respond to ESC
            moment.draw()
            screen.frame()
            screen.stop_if_asked(screen.keys.events())
        film.append(screen.picture(pixels, recorded=False))
        digest.update(pixels.tobytes())
        screen.warm(film[-1])
    return film, digest.hexdigest()


def _shown(task: Task, sitting: Sitting, trial: Any) -> list[_Shown]:
    """Load the parts of a trial's steps."""
    screen = sitting.screen
    known: dict[str, Any] = {"seed": sitting.noise_seed(trial), "stimuli": sitting.stimuli, "words": sitting.words}
    known |= {"display": screen.display, "refresh_hz": 1 / screen.frame_s}
    steps = steps_of(task, sitting.design, trial, screen.display.pixels_per_degree, **known)
    return [_loaded(sitting, step) for step in steps]


def _loaded(sitting: Sitting, step: Step) -> _Shown:
    """Load the parts of a step."""
    screen = sitting.screen
    if isinstance(step.picture, Look):
        return _Shown(step, (), None, None, None)
    if isinstance(step.picture, Iterator):
        film, sha256 = _film(sitting, step.picture)
        return _Shown(step, film, None, None, None, sha256)
    pixels = step.picture if isinstance(step.picture, np.ndarray) else sitting.pixels(step.picture)
    place = mark = mask = None
    if step.mark is not None:
        height, width = pixels.shape[:2]
        place = (step.mark[0] - width / 2, height / 2 - step.mark[1])
        mark = screen.fixation(*place)
    if step.mask is not None and step.mask_s:
        mask = screen.picture(step.mask, recorded=False)
    return _Shown(step, [screen.picture(pixels)], place, mark, mask)


def _warm(sitting: Sitting, parts: Sequence[_Shown]) -> None:
    """Draw pictures, marks and masks off screen once; films are drawn as they are loaded."""
    still = [part for part in parts if not isinstance(part.step.picture, Iterator | Look)]
    if still:
        drawn = (one for part in still for one in (*part.images, part.mark, part.mask))
        sitting.screen.warm(*(one for one in drawn if one is not None))


def _asked(task: Task, sitting: Sitting, planned: Any) -> Any:
    screen, design = sitting.screen, sitting.design
    control = control_of(task, design, sitting.words, planned, sitting.participant)
    labels = _labels(sitting, control)
    trials, parts = list[Any](), list[_Shown]()

    def prepare() -> None:  # during the pause: making pictures takes longer than a frame
        if trials:
            return
        trials.append(task.adapted(design, planned, sitting.recorded))
        parts.extend(_shown(task, sitting, trials[0]))
        _warm(sitting, parts)

    pause, blank = pauses(design)
    if labels:  # their page is shown once the film is ready
        prepare()
    _lead(task, sitting, labels)
    if pause:
        screen.empty(pause, "pause", prepare)
    prepare()
    presses: list[Press] | None = [] if isinstance(control, Held) else None
    value: Any
    with sitting.gaze():
        times = [_show(sitting, part, blank, labels, presses) for part in parts]
    onset = next(time for (time, _), part in zip(times, parts, strict=True) if part.step.judged)
    if isinstance(control, Held) and presses is not None:
        presses += screen.keys.events()  # those of the last frame
        mine = sorted(Press(time - onset, key, down) for time, key, down in presses if key in control.keys)
        value, seconds, start = mine, times[-1][1] - onset, None
    else:
        question = control_of(task, design, sitting.words, trials[0], sitting.participant)
        assert not isinstance(question, Held)
        given = ask(screen, question)
        value, seconds, start = given.value, given.seconds, given.start
    when = {"onset": sitting.since_start(onset), "response_time": seconds}
    answer = task.answered(design, trials[0], value, **when, **stimulus_of(task, design, trials[0], sitting.stimuli))
    return with_noted(answer, noted_start(start), task.columns(design.model_dump(mode="json")))


def _show(
    sitting: Sitting, part: _Shown, blank: float, labels: Sequence[Any] = (), presses: list[Press] | None = None
) -> tuple[float, float]:
    """Show the mark, picture, mask and blank of a step; return the picture's onset and end on the screen's clock."""
    screen, step = sitting.screen, part.step
    if isinstance(step.picture, Look):
        return _look(sitting, step, step.picture)
    if part.mark is not None and step.mark_s:
        screen.play(partial(_draw, part.mark), step.mark_s, "mark", lit=False)
    if part.sha256:
        screen.drawn.setdefault(part.sha256)
    pressed: dict[str, Any] = {} if presses is None else {"presses": presses}
    onset = screen.play(partial(part.draw, screen.frame_s, labels), step.seconds, step.event, **pressed)
    if sitting.recorder is not None and part.place is not None:
        sitting.recorder.shown(onset, onset + step.seconds, part.place)
    if part.mask is not None:
        screen.play(partial(_draw, part.mask), step.mask_s, "mask", lit=False)
    return onset, screen.empty(blank, "off")


def _look(sitting: Sitting, step: Step, look: Look) -> tuple[float, float]:
    """Guide a look at the real world, which a tone and a white screen end; return its onset and end."""
    screen = sitting.screen
    pages(screen, [look.page], "ready", foot=look.foot)
    text, white = screen.text(look.text, height=0.04), screen.whole(1.0)
    onset = screen.play(partial(_draw, text), step.seconds, step.event)
    if not tone():
        sitting.failures.append(("tone", "no audio player was found"))
    return onset, screen.play(partial(_draw, white), WHITE_S, "off", lit=False)


def _draw(part: Any, since: float) -> None:
    part.draw()


def _adjusted(task: Task, sitting: Sitting, planned: Any) -> Any:
    screen, design = sitting.screen, sitting.design
    _lead(task, sitting)
    trial = task.adapted(design, planned, sitting.recorded)
    assert task.adjustment is not None
    asked = task.adjustment(design, sitting.words, trial, screen.display.pixels_per_degree)
    views = [(screen.refocused(one.series, one.pos), one.focus) for one in asked.views]

    def draw(value: float) -> None:
        for view, focus in views:
            view.focus = value if focus is None else focus
            view.draw()

    try:
        screen.empty(BLANK_S, "pause")
        onset = sitting.since_start(screen.now() + BLANK_S)
        with sitting.gaze():
            given = adjust(screen, draw, asked.least, asked.most, question=asked.question, ratios=asked.ratios)
    finally:
        for view, _ in views:
            view.close()
    return task.answered(design, trial, given.value, start=given.start, onset=onset, response_time=given.seconds)
