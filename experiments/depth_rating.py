"""Experiment 1 (template): rated depth of a picture by aperture and fixated object.

Each trial shows a mark on the object to be fixated, then the picture, then asks how three-dimensional it looked: as a
ratio to the standard, a pinhole picture with the value 1, or on another scale of the design. Each step is a function
below; conditions, order, pages and checks are those of the design (`--print-design`). Unchanged, it is `focalgradient
run depth-rating`.
"""

import sys
from dataclasses import replace
from typing import Any, NamedTuple

from focalgradient.dataset import Rated
from focalgradient.design import DepthTrial
from focalgradient.design.rating_pages import standard_text
from focalgradient.lab import EXPERIMENTS, Given, Sitting, ask, pages, run
from focalgradient.stimuli.drawings import DRAWINGS, example_picture


def trial(sitting: Sitting, trial: DepthTrial) -> Rated:
    """Show one picture and ask for a rating. `sitting.screen` also offers `text`, `play` and `wait`."""
    if trial.standard_before:
        show_standard(sitting)
    onset, file = show_picture(sitting, trial)
    depth = ask_depth(sitting, trial)
    return Rated(
        onset=onset,
        rating=depth.value,
        response_time=depth.seconds,
        stimulus=file,
        start=depth.start,
        **gaze_fields(sitting),
    )


def show_standard(sitting: Sitting) -> None:
    """Show the standard, after a page that defines its rating as 1."""
    design, screen = sitting.design, sitting.screen
    pages(screen, [standard_text(design, sitting.words)], "ready")
    _, image = sitting.picture(design.standard_scene, "pinhole", design.fixations[0])
    screen.warm(image)
    screen.play(lambda since: image.draw(), design.standard_s, "standard")
    screen.empty(0.0, "off")


def show_picture(sitting: Sitting, trial: DepthTrial) -> tuple[float, str | None]:
    """Show all intervals of a trial; return onset of the rated picture (s of the run), and its file."""
    design, screen, recorder = sitting.design, sitting.screen, sitting.recorder
    intervals = [("picture", (trial.scene, trial.aperture, trial.fixation), design.picture_s)]
    two = design.response_scale.intervals > 1  # a choice: picture and reference in random order
    if two:
        intervals.insert(2 - trial.interval, ("reference", design.reference_of(trial), design.picture_s))
    elif design.reference == "same-scene":  # the same scene through a pinhole precedes it
        intervals.insert(0, ("reference", design.reference_of(trial), design.reference_s))
    ready: dict[str, Part] = {}

    def prepare() -> None:  # during the blank screen: loading pictures must not delay a frame
        for number, (event, which, _) in enumerate(intervals):
            ready[event] = prepared(sitting, which, dict(trial.factors), (sitting.noise_seed(trial), number))
        screen.warm(*(one for part in ready.values() for one in part.drawn if one is not None))

    screen.empty(design.pause_s, "pause", prepare)
    if recorder is not None:
        recorder.begin()
    try:
        onsets = {event: interval(sitting, ready[event], seconds, event) for event, _, seconds in intervals}
    finally:
        sitting.taken = None if recorder is None else recorder.end()
    return min(onsets.values()) if two else onsets["picture"], ready["picture"].file


class Part(NamedTuple):
    """Stimulus of an interval, position of its fixation mark (px from the centre), and the picture's file, if any."""

    drawn: tuple[Any, Any, Any]
    """Picture, mark and mask; None without a mask."""
    place: tuple[float, float]
    file: str | None


def prepared(sitting: Sitting, which: tuple[str, str, str], factors: dict[str, str], seed: tuple[int, int]) -> Part:
    """Load a picture; catch drawings of unambiguous depth have the fixation mark of the standard."""
    scene, aperture, fixation = which
    if scene in DRAWINGS:
        picture, _ = sitting.picture(sitting.design.standard_scene, "pinhole", fixation)
        image = sitting.screen.picture(example_picture(scene, sitting.pixels(picture).shape[:2]))
    else:
        picture, image = sitting.picture(scene, aperture, fixation, factors)
    mask = None
    if sitting.design.mask == "noise" and sitting.stimuli is not None:
        mask = sitting.screen.picture(sitting.stimuli.mask(seed), recorded=False)
    file = None if scene in DRAWINGS else picture.png
    return Part((image, sitting.mark(picture), mask), sitting.place(picture), file)


def interval(sitting: Sitting, part: Part, seconds: float, event: str) -> float:
    """Show mark, picture, mask and blank; return the onset of the picture (s of the run)."""
    design, screen = sitting.design, sitting.screen
    image, mark, mask = part.drawn

    def draw(since: float) -> None:
        image.draw()
        if design.mark == "kept":
            mark.draw()

    screen.play(lambda since: mark.draw(), design.mark_s, "mark", lit=False)
    onset = screen.play(draw, seconds, event)
    if sitting.recorder is not None:
        sitting.recorder.shown(onset, onset + seconds, part.place)
    if mask is not None and design.mask_s:
        screen.play(lambda since: mask.draw(), design.mask_s, "mask", lit=False)
    screen.empty(design.blank_s, "off")
    return sitting.since_start(onset)


def ask_depth(sitting: Sitting, trial: DepthTrial) -> Given:
    """Ask for the perceived depth on the scale of the design."""
    scale = sitting.design.response_scale
    given = ask(sitting.screen, scale.control(sitting.words))
    return replace(given, value=scale.answer_in(given.value, trial.interval))


def gaze_fields(sitting: Sitting) -> dict[str, Any]:
    """Return the distance (degrees) of gaze from the mark, and if it is too large; empty without gaze recording."""
    taken = sitting.taken
    if taken is None:
        return {}
    left = taken.away is None or taken.away > sitting.design.gaze_within_deg
    return {"gaze_away": taken.away, "gaze_left": left}


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["depth-rating"], about=__doc__, trial=trial, standard=show_standard)))
