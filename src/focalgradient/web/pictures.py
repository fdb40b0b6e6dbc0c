"""Content of trials for the page: addresses of pictures, marks, durations, response scale, sizes of the cube."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from focalgradient.design import DepthRatingDesign, DepthTrial, NeckerDesign, NeckerTrial
from focalgradient.design.words import Words
from focalgradient.display import Display
from focalgradient.live import FocusSeries, packed, page_script, page_shaders
from focalgradient.psf import DISC_K
from focalgradient.render.wireframe import WIDTH
from focalgradient.stimuli import StimulusSet
from focalgradient.stimuli.cube_frames import LEVEL, SHRINK, TWIST, cube_of, shape_of
from focalgradient.stimuli.drawings import DRAWINGS, example_picture, noise_mask
from focalgradient.stimuli.sets import png
from focalgradient.tasks import Task
from focalgradient.tasks.base import BLANK_S

__all__ = [
    "CONTENT",
    "PNG",
    "REFOCUSING",
    "cube_session",
    "cube_trial",
    "depth_events",
    "depth_session",
    "depth_trial",
    "drawing_png",
    "drawn",
    "own_session",
    "own_trial",
    "parts",
    "picture_file",
    "refocusing",
    "standard",
]

CONTENT = "content"
"""Key of a picture's PNG (file or bytes) in a trial's entry, where the page gets an address."""

PNG = b"\x89PNG"
"""First bytes of a picture's file; that of a focus series is JSON."""

MARK_DEG = 0.3
"""Radius of the fixation mark, in degrees on the pictures' display."""


def drawing_png(name: str, stimuli: StimulusSet) -> bytes:
    """Return the PNG of one of the two catch-trial drawings of unambiguous depth, in the size of the set's pictures."""
    return _drawn(name, stimuli.pixels(stimuli.pictures[0]).shape[:2])


@lru_cache(maxsize=4)
def _drawn(name: str, shape: tuple[int, int]) -> bytes:
    return png(example_picture(name, shape))


def depth_session(design: DepthRatingDesign, stimuli: StimulusSet) -> dict[str, Any]:
    """Return the settings that all trials of depth rating share."""
    radius = MARK_DEG * stimuli.display.pixels_per_degree
    return {"blank_s": design.blank_s, "pause_s": design.pause_s, "mark_radius_px": radius}


def picture_file(stimuli: StimulusSet, shown: tuple[str, str, str], levels: Mapping[str, str]) -> str | None:
    """Return the file of the picture for a scene, aperture, fixation and factor levels; None for a drawing."""
    return None if shown[0] in DRAWINGS else stimuli.picture(*shown, levels).png


def _interval(
    design: DepthRatingDesign,
    stimuli: StimulusSet,
    shown: tuple[str, str, str],
    levels: Mapping[str, str],
    seconds: float,
    event: str = "picture",
) -> dict[str, Any]:
    file = picture_file(stimuli, shown, levels)
    scene = design.standard_scene if file is None else shown[0]
    x, y = stimuli.scene(scene).target(shown[2]).position_px
    mark = {"mark": {"x": x, "y": y}, "mark_seconds": design.mark_s, "mark_kept": design.mark == "kept"}
    content = stimuli.folder / file if file else drawing_png(shown[0], stimuli)
    return {CONTENT: content, "seconds": seconds, "event": event, **mark}


def depth_trial(design: DepthRatingDesign, stimuli: StimulusSet, trial: DepthTrial, seed: int) -> dict[str, Any]:
    """Return the stimuli of a depth-rating trial; `seed` is that of its masks."""
    levels = trial.factors
    shown = (trial.scene, trial.aperture, trial.fixation)
    picture = _interval(design, stimuli, shown, levels, design.picture_s)
    compared = design.reference_of(trial)
    intervals = [picture]
    if design.response_scale.intervals > 1:
        other = _interval(design, stimuli, compared, levels, design.picture_s)
        intervals = [picture, other] if trial.interval == 1 else [other, picture]
    elif design.reference == "same-scene":
        intervals = [_interval(design, stimuli, compared, levels, design.reference_s), picture]
    if design.mask == "none" or not design.mask_s:
        return {"intervals": intervals}
    masks = [_mask(design, stimuli, (seed, number)) for number in range(len(intervals))]
    return {"intervals": [part for pair in zip(intervals, masks, strict=True) for part in pair]}


def _mask(design: DepthRatingDesign, stimuli: StimulusSet, seed: tuple[int, int]) -> dict[str, Any]:
    """Return the interval that shows a mask of noise, without a gap after a picture."""
    height, width = stimuli.pixels(stimuli.pictures[0]).shape[:2]
    content = png(noise_mask((height, width), stimuli.display.pixels_per_degree, seed))
    return {CONTENT: content, "seconds": design.mask_s, "event": "mask", "follows": True, "mark_seconds": 0.0}


def depth_events(design: DepthRatingDesign, trial: DepthTrial) -> list[str]:
    """Return the names of a trial's pictures in their order, which the page does not know."""
    if design.response_scale.intervals > 1:
        return ["picture", "reference"] if trial.interval == 1 else ["reference", "picture"]
    return ["reference", "picture"] if design.reference == "same-scene" else ["picture"]


def parts(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the parts of a trial's entry that show a picture: its intervals, or the views of its knob."""
    return [*entry.get("intervals", ()), *entry.get("knob", {}).get("views", ())]


def standard(design: DepthRatingDesign, stimuli: StimulusSet) -> dict[str, Any]:
    """Return the interval that shows the standard."""
    shown = (design.standard_scene, "pinhole", design.fixations[0])
    return _interval(design, stimuli, shown, {}, design.standard_s, "standard") | {"mark_seconds": 0.0}


REFOCUSING = "focus.js"
"""File name of the script with which the page refocuses pictures."""


def refocusing() -> bytes:
    """Return the source of the module with `FocusView` and its shaders, which windows and plugins also use."""
    return f"{page_script()}\nexport {{ FocusView }};\nexport const SHADERS = {json.dumps(page_shaders())};\n".encode()


def own_session(design: Any, display: Display) -> dict[str, Any]:
    """Return the settings that all trials of a described task share."""
    radius = MARK_DEG * display.pixels_per_degree
    pauses = {"blank_s": getattr(design, "blank_s", BLANK_S), "pause_s": getattr(design, "pause_s", 0.0)}
    return {**pauses, "mark_radius_px": radius}


class Drawn(NamedTuple):
    """SHA-256 of each picture of a described trial, separated by spaces; its duration in s; names of its pictures."""

    sha256: str
    seconds: float
    events: tuple[str, ...]


DRAWN: dict[tuple[str, str, Any, int], Drawn] = {}
"""Cache of `drawn`, by task, design, trial and seed."""

MOST_DRAWN = 20_000
"""Maximum size of `DRAWN`: ten times the maximum number of trials per participant."""


def drawn(task: Task, design: Any, trial: Any, seed: int, display: Display, stimuli: Any = None) -> Drawn:
    """Return what a described trial has shown."""
    key = (task.name, design.model_dump_json(), trial, seed)
    if key not in DRAWN:
        steps = task.steps(design, trial, display.pixels_per_degree, seed, stimuli)
        while len(DRAWN) >= MOST_DRAWN:
            DRAWN.pop(next(iter(DRAWN)))
        digests = [hashlib.sha256(np.ascontiguousarray(step.picture).tobytes()).hexdigest() for step in steps]
        seconds, events = sum(step.seconds for step in steps), tuple(step.event for step in steps)
        DRAWN[key] = Drawn(" ".join(dict.fromkeys(digests)), seconds, events)
    return DRAWN[key]


def own_trial(
    task: Task, design: Any, trial: Any, seed: int, words: Words, display: Display, stimuli: Any = None
) -> dict[str, Any]:
    """Return the stimuli of a described task's trial; the page calls all pictures alike."""
    if task.adjusts:
        return _adjusted(task, design, trial, words, display)
    intervals = []
    for step in task.steps(design, trial, display.pixels_per_degree, seed, stimuli):
        x, y = step.mark or (0.0, 0.0)
        mark = {"mark": {"x": x, "y": y}, "mark_seconds": step.mark_s, "mark_kept": False}
        intervals.append({CONTENT: png(step.picture), "seconds": step.seconds, "event": "picture", **mark})
    return {"intervals": intervals, "scale": task.asked(design, words, trial).form()}


def _adjusted(task: Task, design: Any, trial: Any, words: Words, display: Display) -> dict[str, Any]:
    """Return an adjustment trial's knob and focus series; of a view with a fixed focus, that picture alone."""
    asked = task.adjustment(design, words, trial, display.pixels_per_degree)
    views = [{CONTENT: _packed(view.series, view.focus), "pos": list(view.pos)} for view in asked.views]
    names = ("least", "most", "question", "ratios")
    return {"knob": {"views": views, **{name: getattr(asked, name) for name in names}}}


@lru_cache(maxsize=64)
def _packed(series: FocusSeries, focus: float | None) -> bytes:
    if focus is not None:
        plane = np.asarray(series.at(focus), np.float16)
        series = FocusSeries((0.0,), (plane,), np.ones_like(series.distance), np.zeros((0, 2)))
    return json.dumps(packed(series)).encode()


def cube_session(design: NeckerDesign, display: Display) -> dict[str, Any]:
    """Return the cube of a design in the form that the page draws; angles are in pixels of the display."""
    cube, pixel_angle = cube_of(design), display.pixel_pitch / display.distance
    height, width = shape_of(design, pixel_angle)
    sizes: Mapping[str, float] = {
        "edge": cube.edge,
        "distance": cube.distance,
        "tilt": cube.tilt,
        "magnification": cube.magnification,
        "nearest": cube.nearest,
        "turns_per_s": cube.speed,
        "blur_k": DISC_K,
        "pixel_angle": pixel_angle,
        "line_px": cube.line_width / WIDTH / pixel_angle,
        "level": LEVEL,
        "shrink": SHRINK,
        "twist": TWIST,
        "gamma": 0.0 if display.gamma == "sRGB" else float(np.mean(display.gamma)),
    }
    return {"cube": {**sizes, "width": width, "height": height}}


def cube_trial(trial: NeckerTrial) -> dict[str, Any]:
    """Return the stimuli of a Necker cube trial."""
    names = ("shape", "gradient", "strength", "direction")
    return {"cube": {**{name: getattr(trial, name) for name in names}, "seconds": trial.trial_s}}
