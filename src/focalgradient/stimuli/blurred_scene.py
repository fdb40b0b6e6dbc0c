"""Stimuli of the blur-threshold task: a scene's sharp picture, blurred by a given amount."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focalgradient.design import BlurThresholdDesign
from focalgradient.optics import Aperture
from focalgradient.render import blur_picture

if TYPE_CHECKING:
    from focalgradient.stimuli.sets import StimulusSet

__all__ = ["blurred_scene"]


def blurred_scene(stimuli: StimulusSet, design: BlurThresholdDesign, scene: str, amount: float) -> NDArray[np.uint8]:
    """Return a scene's pinhole picture, blurred for the set's display.

    Parameters
    ----------
    stimuli
        The set of pictures.
    design
        Design whose `judged` is "blur" (the whole picture is defocused) or "depth" (it is blurred by its depth, for a
        lens focused on the fixated object).
    scene
        Name of the scene.
    amount
        Defocus in dioptres for the design's pupil, or aperture diameter in millimetres; 0: no blur.

    Returns
    -------
    ndarray
        8-bit values, H x W x 3.

    Raises
    ------
    InputError
        If the set lacks the picture or, for "depth", its depth.
    """
    picture = stimuli.picture(scene, "pinhole", design.fixation)
    light = stimuli.linear(picture)
    if amount > 0:
        angle = math.radians(1 / stimuli.display.pixels_per_degree)
        if design.judged == "blur":
            lens, distance = Aperture(design.pupil_mm / 1000, amount), np.full(light.shape[:2], math.inf)
        else:
            distance = stimuli.depth(scene).astype(float)
            x, y = stimuli.scene(scene).target(design.fixation).position_px
            lens = Aperture(amount / 1000, 1 / float(distance[int(y), int(x)]))
        light = blur_picture(light, distance, lens, pixel_angle=angle)
    return stimuli.display.encode(light)
