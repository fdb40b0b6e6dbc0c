"""Demonstration (template): depth with one eye through a pinhole, without it, and through a tube.

Each block begins with a page and the standard. With a real scene the participant is guided; with pictures, pinhole and
tube show the same round field. Each step is a function below; forms, scenes, order and pages are those of the design
(`--print-design`). Unchanged, it is `focalgradient run pinhole`.
"""

import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from focalgradient.dataset import Rated
from focalgradient.design import PinholeTrial
from focalgradient.lab import EXPERIMENTS, Given, Scale, Sitting, ask, pages, run
from focalgradient.lab.sound import tone
from focalgradient.tasks.noted import noted_start

BLOCKS = {"real": "pinhole.block_real", "picture": "pinhole.block_picture"}
WAYS = {"pinhole": "pinhole.through_pinhole", "natural": "pinhole.freely", "tube": "pinhole.through_tube"}
MARK_S = 1.0  # duration of the mark on the object in focus


def trial(sitting: Sitting, trial: PinholeTrial) -> Rated:
    """Let the participant look once, and ask for a rating."""
    begin_block(sitting, trial)
    if trial.form == "real":
        onset, picture = look(sitting, trial.viewing), None
    else:
        onset, picture = show_picture(sitting, trial.viewing, trial.scene)
    depth = ask_depth(sitting)
    start = noted_start(depth.start)
    return Rated(onset=onset, rating=depth.value, response_time=depth.seconds, stimulus=picture, extra=start)


def begin_block(sitting: Sitting, trial: PinholeTrial) -> None:
    """Show page, marker and standard at the beginning of a block or run."""
    block = {"form": trial.form, "repetition": str(trial.repetition)}
    if sitting.levels == block:
        return
    pages(sitting.screen, [sitting.words(BLOCKS[trial.form])], "ready")
    sitting.screen.on_event("block", sitting.screen.blank())
    pages(sitting.screen, [sitting.words("pinhole.standard")], "ready")
    if trial.form == "real":
        look(sitting, "pinhole", "standard")
    else:
        show_picture(sitting, "pinhole", sitting.design.scenes[0], "standard")
    sitting.levels = block


def look(sitting: Sitting, viewing: str, event: str = "look") -> float:
    """Guide a look at the real scene, ended by a tone; return its onset (s of the run)."""
    screen = sitting.screen
    pages(screen, [sitting.words(WAYS[viewing])], "ready", foot=sitting.words("pinhole.ready"))
    text, white = screen.text(sitting.words("pinhole.look"), height=0.04), screen.whole(1.0)
    onset = screen.play(lambda since: text.draw(), sitting.design.look_s, event)
    if not tone():
        sitting.failures.append(("tone", "no program that plays a sound was found"))
    screen.play(lambda since: white.draw(), 0.5, "off", lit=False)
    return sitting.since_start(onset)


def show_picture(sitting: Sitting, viewing: str, scene: str, event: str = "picture") -> tuple[float, str]:
    """Show the picture that replaces a look; return its onset (s of the run), and its file."""
    design, screen = sitting.design, sitting.screen
    aperture = "pinhole" if viewing == "pinhole" else design.natural_aperture
    picture, image = sitting.picture(scene, aperture, "nearest")
    if viewing != "natural":
        image = screen.picture(through_tube(sitting, picture))
    mark = sitting.mark(picture)
    screen.warm(image, mark)
    screen.play(lambda since: mark.draw(), MARK_S, "mark", lit=False)
    onset = screen.play(lambda since: image.draw(), design.picture_s, event)
    screen.empty(0.0, "off")
    return sitting.since_start(onset), picture.png


def through_tube(sitting: Sitting, picture: Any) -> Any:
    """Return a picture that is black outside the round field of the tube, placed near the object in focus."""
    pixels, display = sitting.pixels(picture), sitting.screen.display
    wide = 2 * display.distance * math.tan(math.radians(sitting.design.field_deg) / 2) / display.pixel_pitch
    sides = (pixels.shape[1], pixels.shape[0])
    x, y = (
        min(max(place, wide / 2), side - wide / 2) for place, side in zip(sitting.fixated(picture), sides, strict=True)
    )
    rows, columns = (np.arange(side) + 0.5 for side in pixels.shape[:2])
    field = np.hypot(rows[:, None] - y, columns - x) <= wide / 2
    return np.where(field[..., None], pixels, 0).astype(np.uint8)


def ask_depth(sitting: Sitting) -> Given:
    """Ask for the perceived depth as a ratio to the view through the pinhole."""
    design, words = sitting.design, sitting.words
    ends = (words("pinhole.flatter"), words("pinhole.deeper"))
    question, below = words("pinhole.question"), words("pinhole.below")
    return ask(sitting.screen, Scale(question, below, design.least_rating, design.most_rating, ends=ends))


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["pinhole"], about=__doc__, trial=trial)))
