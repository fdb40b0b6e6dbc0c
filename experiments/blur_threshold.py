"""Threshold of blur (template): the smallest increase in blur that is noticed, or that makes a picture look deeper.

Each trial shows one scene twice, with additional blur in one of two intervals, and asks in which. The level is selected
by QUEST+ from all answers so far, during the grey screen. Each step is a function below; scenes, levels, order and
pages are those of the design (`--print-design`). Unchanged, it is `focalgradient run blur-threshold`.
"""

import math
import sys
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from focalgradient import Lens
from focalgradient.dataset import Chosen
from focalgradient.design import BlurTrial, Procedure, answers_of
from focalgradient.lab import EXPERIMENTS, Sitting, ask, run
from focalgradient.render import blur_picture
from focalgradient.scales import Ways


def trial(sitting: Sitting, trial: BlurTrial) -> Chosen:
    """Show a scene in two intervals, and ask for the more blurred, or the deeper, one."""
    design, screen, words = sitting.design, sitting.screen, sitting.words
    picture, _ = sitting.picture(trial.scene, "pinhole", design.fixation)
    mark = sitting.mark(picture)
    intervals, level = [], 0.0

    def prepare() -> None:  # while the screen is grey: blurring takes longer than a frame
        nonlocal level
        level = next_level(sitting, trial)
        for number in (1, 2):
            event, added = ("picture", level) if number == trial.interval else ("reference", 0.0)
            intervals.append((event, screen.picture(blurred(sitting, trial.scene, design.pedestal + added))))
        screen.warm(mark, *(image for _, image in intervals))

    screen.empty(design.pause_s, "pause", prepare)
    screen.play(lambda since: mark.draw(), design.mark_s, "mark", lit=False)
    onsets = []
    for event, image in intervals:
        onsets.append(screen.play(partial(draw, image), design.picture_s, event))
        screen.empty(design.blank_s, "off")
    ways = (words("depth.first"), words("depth.second"))
    given = ask(screen, Ways(words(f"blur.question_{design.judged}"), ways))
    chosen = int(given.value)
    return Chosen(
        onset=sitting.since_start(onsets[0]),
        level=level,
        answer=chosen,
        correct=chosen == trial.interval,
        response_time=given.seconds,
        stimulus=picture.png,
    )


def draw(image: Any, since: float) -> None:
    """Draw a frame of a static picture."""
    image.draw()


def next_level(sitting: Sitting, trial: BlurTrial) -> float:
    """Return the level: the maximum in practice and catch trials, else the most informative one by QUEST+."""
    if trial.phase == "practice" or trial.catch:
        return float(sitting.design.levels[-1])
    sitting.procedure.learn(answers_of(sitting.recorded))
    return float(sitting.procedure.level())


def blurred(sitting: Sitting, scene: str, amount: float) -> Any:
    """Blur a scene's pinhole picture, uniformly in dioptres, or by its depth with an aperture of that diameter (mm)."""
    design, stimuli = sitting.design, sitting.stimuli
    assert stimuli is not None, "--stimuli is asked for before the window opens"
    picture = stimuli.picture(scene, "pinhole", design.fixation)
    light = stimuli.linear(picture)
    if amount > 0:
        if design.judged == "blur":  # focused 1 / amount away, with the whole scene at infinity
            eye, distance = lens(design.pupil_mm, 1 / amount), np.full(light.shape[:2], math.inf)
        else:  # focused on the fixated object
            distance = stimuli.depth(scene).astype(float)
            x, y = stimuli.scene(scene).target(design.fixation).position_px
            eye = lens(amount, float(distance[int(y), int(x)]))
        angle = math.radians(1 / stimuli.display.pixels_per_degree)
        light = blur_picture(light, distance, eye, pixel_angle=angle)
    return stimuli.display.encode(light)


def lens(aperture_mm: float, focus_distance: float) -> Lens:
    """Return a lens with that aperture; its focal length does not affect the angular size of blur."""
    focal_length = min(0.01, focus_distance / 2)
    return Lens(focal_length, 1e3 * focal_length / aperture_mm, focus_distance)


def before(sitting: Sitting) -> None:
    """Create the adaptive procedure, and blur one picture, so that compilation does not delay a trial."""
    sitting.screen.text(sitting.words("common.moment")).draw()
    sitting.screen.frame()
    sitting.procedure = Procedure(sitting.design)
    blurred(sitting, sitting.design.scenes[0], sitting.design.levels[-1])


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["blur-threshold"], about=__doc__, trial=trial, before=before)))
