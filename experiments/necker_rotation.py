"""Experiment 2 (template): whether a rotating Necker cube looks rigid or wobbles.

One key is held while it looks rigid, another while it wobbles; every press and release is recorded with its time. Each
step is a function below; shapes, blur, order and pages are those of the design (`--print-design`). Unchanged, it is
`focalgradient run necker`.
"""

import sys
from dataclasses import replace
from typing import Any

from focalgradient.dataset import Press, Watched, percepts
from focalgradient.design import NeckerTrial
from focalgradient.design.cube_pages import CubePages
from focalgradient.lab import EXPERIMENTS, Sitting, pages, run
from focalgradient.stimuli.cube_frames import frame_count, frames_of, shown


def trial(sitting: Sitting, trial: NeckerTrial) -> Watched:
    """Show one cube, and record the keys; in practice, report how well they were held."""
    loop = cube_pictures(sitting, trial)
    ready(sitting, trial)
    watched = show_cube(sitting, trial, loop)
    if trial.phase == "practice":
        feedback(sitting, trial, watched)
    return watched


def cube_pictures(sitting: Sitting, trial: NeckerTrial) -> list[Any]:
    """Return the drawings of the frames of a quarter turn, after which the cube looks the same again."""
    screen = sitting.screen
    pixel_angle = screen.display.pixel_pitch / screen.display.distance
    moment = screen.text(sitting.words("common.moment"), height=0.026, y=-0.42)
    loop = []
    for number, light in enumerate(
        frames_of(trial, sitting.design, frame_count(sitting.design, 1 / screen.frame_s), pixel_angle)
    ):
        if number % 10 == 0:  # redraw the screen and respond to ESC
            moment.draw()
            screen.frame()
            screen.stop_if_asked(screen.keys.events())
        loop.append(screen.picture(shown(light, screen.display), recorded=False))
        screen.warm(loop[-1])
    return loop


def reminder(sitting: Sitting) -> list[Any]:
    """Return the names of the two percepts with their keys, each on the side of its key."""
    design = sitting.design
    of_key = {key: percept for percept, key in design.keys_of(sitting.participant).items()}
    return [
        sitting.screen.text(
            f"{sitting.words.key(key)}   {sitting.words(f'necker.{of_key[key]}')}", height=0.028, x=side * 0.3, y=-0.46
        )
        for key, side in zip(design.keys, (-1, 1), strict=True)
    ]


def ready(sitting: Sitting, trial: NeckerTrial) -> None:
    """Explain the keys, and wait for the space bar."""
    screen = sitting.screen
    title, hold, start = CubePages(sitting.design, sitting.words, sitting.participant).ready(trial)
    parts = [
        screen.text(title, height=0.05, y=0.1, bold=True),
        screen.text(hold, y=0.0),
        screen.text(start, y=-0.1),
        *reminder(sitting),
    ]
    screen.wait(lambda: [part.draw() for part in parts], ["space"], "ready")


def show_cube(sitting: Sitting, trial: NeckerTrial, loop: list[Any]) -> Watched:
    """Show the cube for the duration of the trial, and record each press and release of the two keys."""
    screen, below = sitting.screen, reminder(sitting)
    keys = sitting.design.keys_of(sitting.participant).values()

    def draw(since: float) -> None:
        loop[round(since / screen.frame_s) % len(loop)].draw()
        for part in below:
            part.draw()

    found: list[Press] = []
    onset = screen.play(draw, trial.trial_s, "cube", presses=found)
    end = screen.empty(0.0, "off")
    found += screen.keys.events()  # key events during the last frame
    presses = sorted(press._replace(time=press.time - onset) for press in found if press.key in keys)
    return Watched(onset=sitting.since_start(onset), presses=presses, trial_duration=end - onset)


def feedback(sitting: Sitting, trial: NeckerTrial, watched: Watched) -> None:
    """Report the proportion of time during which only the correct key was held."""
    held = percepts(watched.presses, sitting.design.keys_of(sitting.participant), watched.trial_duration)
    right = sum(one.end - one.onset for one in held if one.percept == trial.shape)
    share = f"{100 * right / watched.trial_duration:.0f}"
    for page in CubePages(sitting.design, sitting.words, sitting.participant).after(trial):
        pages(sitting.screen, [page.text.replace("{share}", share)], page.event)


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["necker"], about=__doc__, trial=trial)))
