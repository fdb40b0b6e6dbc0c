"""Experiment 1: rated depth of pictures, by aperture and fixated object.

Each trial shows a mark on the object to be fixated, then the picture, then asks how three-dimensional it looked: as a
ratio to the standard (a pinhole picture with the value 1, shown at intervals), or on another scale of the design.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from focalgradient.dataset import Rated
from focalgradient.design import DepthRatingDesign, DepthTrial
from focalgradient.design.rating_pages import standard_text
from focalgradient.lab.experiment import GREY, Experiment, Sitting
from focalgradient.lab.forms import pages
from focalgradient.lab.questions import Given, ask
from focalgradient.stimuli.drawings import DRAWINGS, example_picture, noise_mask

__all__ = ["DEPTH_RATING", "ask_depth", "gaze_fields", "show_picture", "show_standard"]

Shown = tuple[str, str, str]


def show_standard(sitting: Sitting) -> None:
    """Show the standard: the picture whose depth has the value 1."""
    design: DepthRatingDesign = sitting.design
    screen = sitting.screen
    _, image = sitting.picture(design.standard_scene, "pinhole", design.fixations[0])
    pages(screen, [standard_text(design, sitting.words)], "ready")
    screen.play(lambda seconds: image.draw(), design.standard_s, "standard")
    screen.on_event("off", screen.blank())


class _Part(NamedTuple):
    """Stimuli of one interval: picture, mark and its position (px from the centre), mask; and the picture's file."""

    image: Any
    mark: Any
    place: tuple[float, float]
    mask: Any
    file: str | None


def _prepared(sitting: Sitting, shown: Shown, factors: dict[str, str], seed: tuple[int, int]) -> _Part:
    """Load a picture with its mark and mask; a drawing has no file, and the standard's mark."""
    scene, aperture, fixation = shown
    if scene in DRAWINGS:
        picture, _ = sitting.picture(sitting.design.standard_scene, "pinhole", fixation)
        image = sitting.screen.picture(example_picture(scene, sitting.pixels(picture).shape[:2]), recorded=False)
    else:
        picture, image = sitting.picture(scene, aperture, fixation, factors)
    mask = None
    if sitting.design.mask == "noise":
        wide, high = map(int, image.size)
        noise = noise_mask((high, wide), sitting.screen.display.pixels_per_degree, seed)
        mask = sitting.screen.picture(noise, recorded=False)
    file = None if scene in DRAWINGS else picture.png
    return _Part(image, sitting.mark(picture), sitting.place(picture), mask, file)


def _interval(sitting: Sitting, part: _Part, seconds: float, event: str) -> float:
    """Show mark, picture, mask and blank; return the picture's onset in s from the start of the sitting."""
    design: DepthRatingDesign = sitting.design
    screen = sitting.screen

    def draw(since: float) -> None:
        part.image.draw()
        if design.mark == "kept":
            part.mark.draw()

    screen.play(lambda since: part.mark.draw(), design.mark_s, "mark", lit=False)
    onset = screen.play(draw, seconds, event)
    if sitting.recorder is not None:
        sitting.recorder.shown(onset, onset + seconds, part.place)
    if part.mask is not None and design.mask_s:
        screen.play(lambda since: part.mask.draw(), design.mask_s, "mask", lit=False)
    screen.empty(design.blank_s, "off")
    return sitting.since_start(onset)


def show_picture(sitting: Sitting, trial: DepthTrial) -> tuple[float, str | None]:
    """Show the stimuli of a trial, up to the question.

    Returns
    -------
    tuple
        Onset of the picture (with two intervals, of the first) in s from the start of the sitting, and its file name;
        None for a drawing.
    """
    design: DepthRatingDesign = sitting.design
    shown = [("picture", (trial.scene, trial.aperture, trial.fixation), design.picture_s)]
    two = design.response_scale.intervals > 1
    if two:
        shown.insert(2 - trial.interval, ("reference", design.reference_of(trial), design.picture_s))
    elif design.reference == "same-scene":
        shown.insert(0, ("reference", design.reference_of(trial), design.reference_s))
    ready: dict[str, _Part] = {}

    def prepare() -> None:
        for number, (event, which, _) in enumerate(shown):
            seed = sitting.noise_seed(trial), number
            ready[event] = part = _prepared(sitting, which, dict(trial.factors), seed)
            sitting.screen.warm(*(one for one in (part.image, part.mark, part.mask) if one is not None))

    sitting.screen.empty(design.pause_s, "pause", prepare)
    recorder = sitting.recorder
    if recorder is not None:
        recorder.begin()
    try:
        onsets = {event: _interval(sitting, ready[event], seconds, event) for event, _, seconds in shown}
    finally:
        sitting.taken = None if recorder is None else recorder.end()
    return (min(onsets.values()) if two else onsets["picture"]), ready["picture"].file


def ask_depth(sitting: Sitting, trial: DepthTrial) -> Given:
    """Ask for a rating of depth on the design's scale."""
    scale = sitting.design.response_scale
    given = ask(sitting.screen, scale.control(sitting.words))
    return replace(given, value=scale.answer_in(given.value, trial.interval))


def gaze_fields(sitting: Sitting) -> dict[str, Any]:
    """Return the fields `gaze_away` (degrees) and `gaze_left` of an answer; empty if gaze was not recorded."""
    taken = sitting.taken
    if taken is None:
        return {}
    left = taken.away is None or taken.away > sitting.design.gaze_within_deg
    return {"gaze_away": taken.away, "gaze_left": left}


def _trial(sitting: Sitting, trial: DepthTrial) -> Rated:
    if trial.standard_before:
        show_standard(sitting)
    onset, file = show_picture(sitting, trial)
    answer = ask_depth(sitting, trial)
    return Rated(
        onset=onset,
        rating=answer.value,
        response_time=answer.seconds,
        stimulus=file,
        start=answer.start,
        **gaze_fields(sitting),
    )


DEPTH_RATING = Experiment(
    task="depthrating",
    about=__doc__,
    trial=_trial,
    pictures=DepthRatingDesign.pictures,
    background=GREY,
    standard=show_standard,
    right=lambda sitting, trial, answer: sitting.design.right(trial, answer.rating),
)
