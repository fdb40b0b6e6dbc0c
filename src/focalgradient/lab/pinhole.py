"""The demonstration: depth with one eye through a pinhole, without it, and through a tube of the same field.

In the real world the participant is guided: which eye, what is held before it, for how long. In pictures, the pinhole
and the tube show the same round field, whole, with the object that is marked before in it: the one of the pinhole's
picture, the other of the natural one. Each block begins with a page and the standard, the view through the pinhole; a
tone ends each look at the real world.
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

FIXATION = "nearest"  # in focus in the pictures, and marked before them
MARK_S = 1.0

WAYS = {"pinhole": "pinhole.through_pinhole", "natural": "pinhole.freely", "tube": "pinhole.through_tube"}


def _pictures(design: Pinhole) -> Sequence[tuple[str, str, str, dict[str, str]]]:
    """All that the design can show."""
    if "picture" not in design.forms:
        return ()
    return [(*pair, FIXATION, {}) for pair in product(design.scenes, ("pinhole", design.natural_aperture))]


def _check(design: Pinhole, display: Display, room: tuple[int, int]) -> None:
    """Refuse a field that does not fit in a window of `room` pixels."""
    wide = _field_px(design, display)
    if "picture" in design.forms and wide > min(room):
        raise InputError(
            f"field_deg is {design.field_deg:g}, which takes {wide:.0f} pixels of a window of {room[0]} x {room[1]}: "
            "make it smaller, leave out --windowed, or sit farther away."
        )


def _check_pictures(design: Pinhole, display: Display, stimuli: StimulusSet | None) -> None:
    """Refuse pictures that are smaller than the field: their border would cut it."""
    if stimuli is None:
        return
    wide = _field_px(design, display)
    for scene, aperture, fixation, _ in _pictures(design):
        height, width = stimuli.pixels(stimuli.picture(scene, aperture, fixation)).shape[:2]
        if wide > min(width, height):
            raise InputError(
                f"field_deg is {design.field_deg:g}, which takes {wide:.0f} pixels, but the pictures of {scene} have "
                f"{width} x {height}, whose border would cut the field: make it smaller, or the pictures larger."
            )


def _field_px(design: Pinhole, display: Display) -> float:
    """Diameter in pixels of the field that the tube leaves."""
    return 2 * display.distance * math.tan(math.radians(design.field_deg) / 2) / display.pixel_pitch


def through_tube(pixels: NDArray[np.uint8], middle: tuple[float, float], wide: float) -> NDArray[np.uint8]:
    """A picture, H x W x 3, black outside a circle of `wide` pixels about (x, y) from its upper left corner."""
    y, x = (np.arange(side) + 0.5 for side in pixels.shape[:2])
    field = np.hypot(y[:, None] - middle[1], x - middle[0]) <= wide / 2
    return np.where(field[..., None], pixels, 0).astype(np.uint8)


def whole_field(about: tuple[float, float], shape: tuple[int, ...], wide: float) -> tuple[float, float]:
    """The middle, (x, y), of a field of `wide` pixels that lies whole in a picture of H x W, as near `about` as can be.

    >>> whole_field((40.0, 90.0), (400, 300), 100.0), whole_field((290.0, 200.0), (400, 300), 100.0)
    ((50.0, 90.0), (250.0, 200.0))
    """
    x, y = (
        min(max(place, wide / 2), side - wide / 2) if wide <= side else side / 2
        for place, side in zip(about, (shape[1], shape[0]), strict=True)
    )
    return x, y


def look(sitting: Sitting, viewing: str, event: str = "look") -> float:
    """Guide a look at the real world: when it began (s of the sitting)."""
    screen = sitting.screen
    pages(screen, [sitting.words(WAYS[viewing])], "ready", foot=sitting.words("pinhole.ready"))
    text = screen.text(sitting.words("pinhole.look"), height=0.04)
    onset = screen.play(lambda seconds: text.draw(), sitting.design.look_s, event)
    if not tone():
        sitting.failures.append(("tone", "no program that plays a sound was found"))
    white = screen.whole(1.0)
    screen.play(lambda seconds: white.draw(), 0.5, "off", lit=False)
    return sitting.since_start(onset)


def show_picture(sitting: Sitting, viewing: str, scene: str, event: str = "picture") -> tuple[float, str]:
    """Show the picture that stands for a look: when it appeared (s of the sitting), and its file."""
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
    """Let the participant see what counts as 1, in the real world or as a picture."""
    pages(sitting.screen, [sitting.words("pinhole.standard")], "ready")
    if form == "real":
        look(sitting, "pinhole", "standard")
    else:
        show_picture(sitting, "pinhole", sitting.design.scenes[0], "standard")


def begin_block(sitting: Sitting, trial: PinholeTrial) -> None:
    """Where a block begins, and at the start of a sitting: its page, its marker and the standard."""
    block = {"form": trial.form, "repetition": str(trial.repetition)}
    if sitting.levels == block:
        return
    pages(sitting.screen, [sitting.words(BLOCKS[trial.form])], "ready")
    sitting.screen.on_event("block", sitting.screen.blank())
    show_standard(sitting, trial.form)
    sitting.levels = block


def ask_depth(sitting: Sitting) -> Given:
    """Ask how three-dimensional it looked, as a ratio to the view through the pinhole."""
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
    return Rated(onset=onset, rating=answer.value, response_time=answer.seconds, stimulus=shown)


PINHOLE = Experiment(
    task="pinhole",
    about=__doc__,
    trial=_trial,
    pictures=_pictures,
    check=_check,
    check_pictures=_check_pictures,
)
