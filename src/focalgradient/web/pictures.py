"""Content of trials for the page: addresses of pictures, marks, durations, response scale, sizes of the cube."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from focalgradient.design import NeckerDesign, NeckerTrial
from focalgradient.design.words import Words
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.live import FocusSeries, packed, page_script, page_shaders
from focalgradient.psf import DISC_K
from focalgradient.render.wireframe import WIDTH
from focalgradient.scales import Control, Held, OwnControl
from focalgradient.stimuli import StimulusSet
from focalgradient.stimuli.cube_frames import LEVEL, SHRINK, TWIST, cube_of, shape_of
from focalgradient.stimuli.sets import png_of
from focalgradient.tasks import Task
from focalgradient.tasks.steps import Look, Step, control_of, pauses, steps_of

__all__ = [
    "CONTENT",
    "PNG",
    "REFOCUSING",
    "Described",
    "cube_session",
    "cube_trial",
    "drawn",
    "form_of",
    "own_session",
    "own_trial",
    "parts",
    "refocusing",
    "standard",
]

CONTENT = "content"
"""Key of a picture's PNG (file or bytes) in a trial's entry, where the page gets an address."""

PNG = b"\x89PNG"
"""First bytes of a picture's file; that of a focus series is JSON."""

MARK_DEG = 0.3
"""Radius of the fixation mark, in degrees on the pictures' display."""


def parts(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the parts of a trial's entry that show a picture: its intervals, or the views of its knob."""
    shown = [*entry.get("intervals", ()), *entry.get("knob", {}).get("views", ())]
    return [part for part in shown if "look" not in part]


def standard(
    task: Task, design: Any, form: str, words: Words, display: Display, stimuli: StimulusSet | None
) -> dict[str, Any]:
    """Return the interval that shows the standard."""
    assert task.standard is not None
    step = task.standard(design, form, display.pixels_per_degree, stimuli, words)
    return _intervals(step, stimuli, "standard")[0]


REFOCUSING = "focus.js"
"""File name of the script with which the page refocuses pictures."""


def refocusing() -> bytes:
    """Return the source of the module with `FocusView` and its shaders, which windows and plugins also use."""
    return f"{page_script()}\nexport {{ FocusView }};\nexport const SHADERS = {json.dumps(page_shaders())};\n".encode()


def own_session(design: Any, display: Display) -> dict[str, Any]:
    """Return the settings that all trials of a described task share."""
    radius = MARK_DEG * display.pixels_per_degree
    pause, blank = pauses(design)
    return {"blank_s": blank, "pause_s": pause, "mark_radius_px": radius}


@dataclass(frozen=True, slots=True)
class Described:
    """Described trial, of which `key` identifies what is shown."""

    key: tuple[Hashable, ...]
    task: Task = field(compare=False)
    design: Any = field(compare=False)
    trial: Any
    seed: int
    words: Words = field(compare=False)
    display: Display
    stimuli: Any = field(compare=False)

    @classmethod
    def of(
        cls, task: Task, design: Any, trial: Any, seed: int, words: Words, display: Display, stimuli: Any = None
    ) -> Described:
        """Return a trial of a design, with its texts, display and set of pictures."""
        key = (task.name, design.model_dump_json(), None if stimuli is None else stimuli.folder)
        return cls(key, task, design, trial, seed, words, display, stimuli)


class Drawn(NamedTuple):
    """SHA-256 of each picture that no file holds, separated by spaces; duration in s; names of the pictures."""

    sha256: str
    seconds: float
    events: tuple[str, ...]


@lru_cache(maxsize=16)  # for the page and its digest
def _steps(shown: Described) -> list[Step]:
    known = {"seed": shown.seed, "stimuli": shown.stimuli, "words": shown.words, "display": shown.display}
    return steps_of(shown.task, shown.design, shown.trial, shown.display.pixels_per_degree, **known)


@lru_cache(maxsize=20_000)  # ten times the maximum number of trials per participant
def drawn(shown: Described) -> Drawn:
    """Return what a described trial has shown."""
    steps = _steps(shown)
    arrays = [step.picture for step in steps if isinstance(step.picture, np.ndarray)]
    digests = [hashlib.sha256(np.ascontiguousarray(pixels).tobytes()).hexdigest() for pixels in arrays]
    seconds, events = sum(step.seconds for step in steps), tuple(step.event for step in steps)
    return Drawn(" ".join(dict.fromkeys(digests)), seconds, events)


def own_trial(shown: Described) -> dict[str, Any]:
    """Return the stimuli of a described task's trial; the page calls all pictures alike."""
    if shown.task.adjusts:
        return _adjusted(shown.task, shown.design, shown.trial, shown.words, shown.display)
    drawn(shown)
    intervals = [part for step in _steps(shown) for part in _intervals(step, shown.stimuli, "picture")]
    control = control_of(shown.task, shown.design, shown.words, shown.trial, "01")
    return {"intervals": intervals, "scale": form_of(control)}


def form_of(control: Control | Held | OwnControl) -> dict[str, Any]:
    """Return the description of a control for the page; raise `InputError` for one that the page cannot show."""
    if isinstance(control, OwnControl | Held):
        raise InputError("a question has a control of its own, which a browser cannot show: use one of Scale or Steps.")
    return control.form()


def _intervals(step: Step, stimuli: Any, event: str) -> list[dict[str, Any]]:
    """Return a step as the page shows it: a picture, and its mask; or a look at the real world."""
    if isinstance(step.picture, Look):
        return [
            {"look": {"page": step.picture.page, "text": step.picture.text}, "seconds": step.seconds, "event": event}
        ]
    x, y = step.mark or (0.0, 0.0)
    mark = {"mark": {"x": x, "y": y}, "mark_seconds": step.mark_s, "mark_kept": step.mark_kept}
    made = isinstance(step.picture, np.ndarray)
    content = png_of(step.picture) if made else stimuli.folder / step.picture.png
    shown = [{CONTENT: content, "seconds": step.seconds, "event": event, **mark}]
    if step.mask is not None and step.mask_s:
        shown.append({CONTENT: png_of(step.mask), "seconds": step.mask_s, "event": "mask", "follows": True})
    return shown


def _adjusted(task: Task, design: Any, trial: Any, words: Words, display: Display) -> dict[str, Any]:
    """Return an adjustment trial's knob and focus series; of a view with a fixed focus, that picture alone."""
    assert task.adjustment is not None
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
