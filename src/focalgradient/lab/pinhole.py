"""Demonstration of the pinhole effect: monocular depth through a pinhole, without it, and through a tube.

The tube has the same field as the pinhole. In the real world the program names the eye to use, what to hold
before it, and for how long. On the screen, pinhole and tube conditions show the same circular field, which contains the
object that was marked before; the one shows the pinhole picture, the other the natural one. Each block begins with a
page and the standard, the view through the pinhole; a tone ends each look at the real world.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset import Rated
from focalgradient.design import Pinhole, PinholeTrial
from focalgradient.design.pinhole_pages import BLOCKS
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.experiment import Experiment, Sitting
from focalgradient.lab.forms import pages
from focalgradient.lab.questions import Given, ask
from focalgradient.lab.sound import tone
from focalgradient.scales import Scale
from focalgradient.stimuli import StimulusSet
from focalgradient.tasks.noted import noted_start

__all__ = [
    "PINHOLE",
    "ask_depth",
    "begin_block",
    "look",
    "show_picture",
    "show_standard",
    "through_tube",
    "whole_field",
]

FIXATION = "nearest"  # object that is in focus, and marked before each picture
MARK_S = 1.0

WAYS = {"pinhole": "pinhole.through_pinhole", "natural": "pinhole.freely", "tube": "pinhole.through_tube"}


def _pictures(design: Pinhole) -> Sequence[tuple[str, str, str, dict[str, str]]]:
    """List the pictures that the design requires."""
    if "picture" not in design.forms:
        return ()
    return [(*pair, FIXATION, {}) for pair in product(design.scenes, ("pinhole", design.natural_aperture))]


def _check(design: Pinhole, display: Display, room: tuple[int, int]) -> None:
    """Raise `InputError` if the field does not fit in a window of `room` pixels."""
    wide = _field_px(design, display)
    if "picture" in design.forms and wide > min(room):
        raise InputError(
            f"field_deg is {design.field_deg:g}, which takes {wide:.0f} pixels of a window of {room[0]} x {room[1]}: "
            "make it smaller, leave out --windowed, or sit farther away."
        )


def _check_pictures(design: Pinhole, display: Display, stimuli: StimulusSet | None) -> None:
    """Raise `InputError` for pictures smaller than the field, whose border would cut it off."""
    if stimuli is None:
        return
    wide = _field_px(design, display)
    for scene, aperture, fixation, _ in _pictures(design):
        height, width = stimuli.pixels(stimuli.picture(scene, aperture, fixation)).shape[:2]
        if wide > min(width, height):
            raise InputError(
                f"field_deg is {design.field_deg:g}, which takes {wide:.0f} pixels, but the pictures of {scene} have "
                "only "
                f"{width} x {height}, and would cut it off: make it smaller, or the pictures larger."
            )


def _field_px(design: Pinhole, display: Display) -> float:
    """Return the diameter of the tube's field in pixels."""
    return 2 * display.distance * math.tan(math.radians(design.field_deg) / 2) / display.pixel_pitch


def through_tube(pixels: NDArray[np.uint8], middle: tuple[float, float], wide: float) -> NDArray[np.uint8]:
    """Return a picture, H x W x 3, that is black outside a circle of diameter `wide` px around (x, y)."""
    y, x = (np.arange(side) + 0.5 for side in pixels.shape[:2])
    field = np.hypot(y[:, None] - middle[1], x - middle[0]) <= wide / 2
    return np.where(field[..., None], pixels, 0).astype(np.uint8)


def whole_field(about: tuple[float, float], shape: tuple[int, ...], wide: float) -> tuple[float, float]:
    """Return the centre (x, y), nearest to `about`, of a field of `wide` px that lies entirely in a picture of H x W.

    >>> whole_field((40.0, 90.0), (400, 300), 100.0), whole_field((290.0, 200.0), (400, 300), 100.0)
    ((50.0, 90.0), (250.0, 200.0))
    """
    x, y = (
        min(max(place, wide / 2), side - wide / 2) if wide <= side else side / 2
        for place, side in zip(about, (shape[1], shape[0]), strict=True)
    )
    return x, y


def look(sitting: Sitting, viewing: str, event: str = "look") -> float:
    """Guide a look at the real world; return its onset in s from the start of the sitting."""
    screen = sitting.screen
    pages(screen, [sitting.words(WAYS[viewing])], "ready", foot=sitting.words("pinhole.ready"))
    text = screen.text(sitting.words("pinhole.look"), height=0.04)
    onset = screen.play(lambda seconds: text.draw(), sitting.design.look_s, event)
    if not tone():
        sitting.failures.append(("tone", "no audio player was found"))
    white = screen.whole(1.0)
    screen.play(lambda seconds: white.draw(), 0.5, "off", lit=False)
    return sitting.since_start(onset)


def show_picture(sitting: Sitting, viewing: str, scene: str, event: str = "picture") -> tuple[float, str]:
    """Show the picture of a viewing condition; return its onset in s from the start of the sitting, and its file."""
    design, screen = sitting.design, sitting.screen
    picture, image = sitting.picture(scene, "pinhole" if viewing == "pinhole" else design.natural_aperture, FIXATION)
    if viewing != "natural":
        pixels, wide = sitting.pixels(picture), _field_px(design, screen.display)
        image = screen.picture(through_tube(pixels, whole_field(sitting.fixated(picture), pixels.shape, wide), wide))
    mark = sitting.mark(picture)
    screen.warm(image, mark)
    screen.play(lambda seconds: mark.draw(), MARK_S, "mark", lit=False)
    onset = screen.play(lambda seconds: image.draw(), design.picture_s, event)
    screen.on_event("off", screen.blank())
    return sitting.since_start(onset), picture.png


def show_standard(sitting: Sitting, form: str) -> None:
    """Show the standard, whose depth has the value 1, in the real world or as a picture."""
    pages(sitting.screen, [sitting.words("pinhole.standard")], "ready")
    if form == "real":
        look(sitting, "pinhole", "standard")
    else:
        show_picture(sitting, "pinhole", sitting.design.scenes[0], "standard")


def begin_block(sitting: Sitting, trial: PinholeTrial) -> None:
    """Begin a block, also at the start of a sitting: show its page, send its marker, show the standard."""
    block = {"form": trial.form, "repetition": str(trial.repetition)}
    if sitting.levels == block:
        return
    pages(sitting.screen, [sitting.words(BLOCKS[trial.form])], "ready")
    sitting.screen.on_event("block", sitting.screen.blank())
    show_standard(sitting, trial.form)
    sitting.levels = block


def ask_depth(sitting: Sitting) -> Given:
    """Ask for depth as a ratio to the view through the pinhole."""
    design: Pinhole = sitting.design
    scale = Scale(
        sitting.words("pinhole.question"),
        sitting.words("pinhole.below"),
        design.least_rating,
        design.most_rating,
        ends=(sitting.words("pinhole.flatter"), sitting.words("pinhole.deeper")),
    )
    return ask(sitting.screen, scale)


def _trial(sitting: Sitting, trial: PinholeTrial) -> Rated:
    begin_block(sitting, trial)
    onset, shown = (
        (look(sitting, trial.viewing), None)
        if trial.form == "real"
        else show_picture(sitting, trial.viewing, trial.scene)
    )
    answer = ask_depth(sitting)
    start = noted_start(answer.start)
    return Rated(onset=onset, rating=answer.value, response_time=answer.seconds, stimulus=shown, extra=start)


PINHOLE = Experiment(
    task="pinhole",
    about=__doc__,
    trial=_trial,
    pictures=_pictures,
    check=_check,
    check_pictures=_check_pictures,
)
