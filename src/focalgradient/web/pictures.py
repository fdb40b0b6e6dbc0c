"""What the page needs to show a trial: addresses of pictures, marks, times, the scale, the cube's sizes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from focalgradient.design import DepthRatingDesign, DepthTrial, NeckerDesign, NeckerTrial
from focalgradient.display import Display
from focalgradient.psf import DISC_K
from focalgradient.render.wireframe import WIDTH
from focalgradient.stimuli import StimulusSet

__all__ = ["cube_session", "cube_trial", "depth_session", "depth_trial"]

MARK_DEG = 0.3
"""Radius of the mark, in degrees of the pictures' display."""


def depth_session(design: DepthRatingDesign, stimuli: StimulusSet) -> dict[str, Any]:
    """What all trials of depth rating share."""
    return {"blank_s": 0.0, "pause_s": 0.0, "mark_radius_px": MARK_DEG * stimuli.display.pixels_per_degree}


def _interval(
    design: DepthRatingDesign, stimuli: StimulusSet, shown: tuple[str, str, str], seconds: float, event: str
) -> dict[str, Any]:
    picture = stimuli.picture(*shown)
    x, y = stimuli.scene(picture.scene).target(picture.fixation).position_px
    mark = {"mark": {"x": x, "y": y}, "mark_seconds": design.mark_s, "mark_kept": design.mark == "kept"}
    return {"url": f"/pictures/{picture.png}", "seconds": seconds, "event": event, **mark}


def depth_trial(design: DepthRatingDesign, stimuli: StimulusSet, trial: DepthTrial) -> dict[str, Any]:
    """What a trial of depth rating shows."""
    shown = (trial.scene, trial.aperture, trial.fixation)
    told: dict[str, Any] = {"intervals": [_interval(design, stimuli, shown, design.picture_s, "picture")]}
    if trial.standard_before:
        standard = (design.standard_scene, "pinhole", design.fixations[0])
        told["standard"] = _interval(design, stimuli, standard, design.standard_s, "standard") | {"mark_seconds": 0.0}
    return told


def cube_session(design: NeckerDesign, display: Display) -> dict[str, Any]:
    """The cube of a design as the page draws it; angles are in pixels of the display."""
    from focalgradient.stimuli.cube_frames import LEVEL, SHRINK, TWIST, cube_of, shape_of

    cube, pixel_angle = cube_of(design), display.pixel_pitch / display.distance
    height, width = shape_of(design, pixel_angle)
    sizes: Mapping[str, float] = {
        **{"edge": cube.edge, "distance": cube.distance, "tilt": cube.tilt, "magnification": cube.magnification},
        **{"nearest": cube.nearest, "turns_per_s": cube.speed, "blur_k": DISC_K, "pixel_angle": pixel_angle},
        **{"line_px": cube.line_width / WIDTH / pixel_angle, "level": LEVEL, "shrink": SHRINK, "twist": TWIST},
        "gamma": 0.0 if display.gamma == "sRGB" else display.gamma,
    }
    return {"cube": {**sizes, "width": width, "height": height}}


def cube_trial(trial: NeckerTrial) -> dict[str, Any]:
    """What a trial with the cube shows."""
    names = ("shape", "gradient", "strength", "direction")
    return {"cube": {**{name: getattr(trial, name) for name in names}, "seconds": trial.trial_s}}


def pixel_angle_of(screen_m: float, pixels: int, distance: float) -> float:
    """Angle in radians of a pixel of a screen."""
    return math.atan(screen_m / pixels / distance)
