"""Experiment 2: a rotating Necker cube; one key is held while it looks rigid, another while it looks nonrigid.

Each press and release is recorded with its time on the display's clock. The table has separate entries for times in
which neither key, or both keys, were held.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from focalgradient.dataset import Press, Watched, percepts
from focalgradient.design import NeckerDesign, NeckerTrial
from focalgradient.design.cube_pages import CubePages
from focalgradient.design.necker import LEAST_HELD
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.experiment import Experiment, Sitting
from focalgradient.lab.forms import pages
from focalgradient.stimuli.cube_frames import frame_count, frames_of, shape_of, shown

__all__ = ["NECKER", "feedback", "ready", "show_cube"]

LARGEST_HEIGHT = 0.88  # maximum height of the cube as a fraction of the window's; the key labels are below it


def _check(design: NeckerDesign, display: Display, room: tuple[int, int]) -> None:
    """Raise `InputError` if the cube does not fit in a window of `room` px, or if a key of the design is unknown."""
    from focalgradient.lab.screen import key_names

    for key in design.keys:
        if key not in key_names():
            raise InputError(f"keys has {key!r}, but must name keys of a keyboard, such as 'f', 'left' or 'space'.")
    height, width = shape_of(design, _pixel_angle(display))
    if width > room[0] or height > LARGEST_HEIGHT * room[1]:
        raise InputError(
            f"the cube takes {width} x {height} pixels, but the space above the key labels has only {room[0]} x "
            f"{LARGEST_HEIGHT * room[1]:.0f}: leave out --windowed, lower size_deg or strengths_mm, or sit farther "
            "away."
        )
    # Raises `InputError` for lines that are too thin for the pixels.
    cube = next(trial for trial in design.trials("01") if trial.shape == "ambiguous")
    next(frames_of(cube, design, 3, _pixel_angle(display)))


def _pixel_angle(display: Display) -> float:
    return display.pixel_pitch / display.distance


def _loop(sitting: Sitting, trial: NeckerTrial) -> list[Any]:
    """Upload the pictures of a quarter turn to the graphics card."""
    screen, display = sitting.screen, sitting.screen.display
    frames = frame_count(sitting.design, 1 / screen.frame_s)
    said = screen.text(screen.words("common.moment"), height=0.026, y=-0.42)
    loop = []
    for number, light in enumerate(frames_of(trial, sitting.design, frames, _pixel_angle(display))):
        if number % 10 == 0:
            said.draw()
            screen.frame()
            screen.stop_if_asked(screen.keys.events())
        loop.append(screen.picture(shown(light, display), recorded=False))
        screen.warm(loop[-1])
    return loop


def _reminder(sitting: Sitting) -> list[Any]:
    """Return labels of the response keys, each on the side of its key."""
    design: NeckerDesign = sitting.design
    of_key = {key: percept for percept, key in design.keys_of(sitting.participant).items()}
    return [
        sitting.screen.text(
            f"{key.upper()}   {sitting.words(f'necker.{of_key[key]}')}", height=0.028, x=side * 0.3, y=-0.46
        )
        for key, side in zip(design.keys, (-1, 1), strict=True)
    ]


def _pages(sitting: Sitting) -> CubePages:
    return CubePages(sitting.design, sitting.words, sitting.participant)


def ready(sitting: Sitting, trial: NeckerTrial) -> None:
    """Show which key reports which percept, and wait for the space bar."""
    screen = sitting.screen
    title, hold, start = _pages(sitting).ready(trial)
    parts = [
        screen.text(title, height=0.05, y=0.1, bold=True),
        screen.text(hold, y=0.0),
        screen.text(start, y=-0.1),
        *_reminder(sitting),
    ]
    screen.wait(lambda: [part.draw() for part in parts], ["space"], "ready")


def show_cube(sitting: Sitting, trial: NeckerTrial, before: Callable[[], object]) -> Watched:
    """Show the cube of a trial after calling `before`; return the key presses and releases during the trial."""
    screen = sitting.screen
    loop, reminder = _loop(sitting, trial), _reminder(sitting)
    keys = sitting.design.keys_of(sitting.participant)
    before()
    rate = 1 / screen.frame_s

    def draw(seconds: float) -> None:
        loop[round(seconds * rate) % len(loop)].draw()
        for part in reminder:
            part.draw()

    found: list[Press] = []
    onset = screen.play(draw, trial.trial_s, "cube", presses=found)
    end = screen.blank()
    screen.on_event("off", end)
    found += screen.keys.events()
    presses = sorted(Press(time - onset, key, down) for time, key, down in found if key in keys.values())
    return Watched(onset=sitting.since_start(onset), presses=presses, trial_duration=end - onset)


def feedback(sitting: Sitting, trial: NeckerTrial, watched: Watched) -> None:
    """After a practice trial, show the proportion of time for which the correct key was held."""
    for page in _pages(sitting).after(trial):
        text = page.text.replace("{share}", f"{100 * _share(sitting, trial, watched):.0f}")
        pages(sitting.screen, [text], page.event)


def _trial(sitting: Sitting, trial: NeckerTrial) -> Watched:
    watched = show_cube(sitting, trial, before=lambda: ready(sitting, trial))
    if trial.phase == "practice":
        feedback(sitting, trial, watched)
    return watched


def _share(sitting: Sitting, trial: NeckerTrial, watched: Watched) -> float:
    """Return the proportion of time for which only the key of the trial's shape was held."""
    held = percepts(watched.presses, sitting.design.keys_of(sitting.participant), watched.trial_duration)
    return sum(one.end - one.onset for one in held if one.percept == trial.shape) / watched.trial_duration


def _right(sitting: Sitting, trial: NeckerTrial, watched: Watched) -> bool | None:
    """Return whether the key of an unambiguous shape was held for at least half of the time; None if ambiguous."""
    return None if trial.shape == "ambiguous" else _share(sitting, trial, watched) >= LEAST_HELD


NECKER = Experiment(
    task="necker",
    about=__doc__,
    trial=_trial,
    check=_check,
    right=_right,
)
