"""The pictures of a threshold of blur: a scene's sharp picture, blurred further by an amount."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from focalgradient.design import BlurThresholdDesign
from focalgradient.optics import Lens
from focalgradient.render import blur_picture
from focalgradient.stimuli.sets import StimulusSet

__all__ = ["blurred_scene"]


def blurred_scene(stimuli: StimulusSet, design: BlurThresholdDesign, scene: str, amount: float) -> NDArray[np.uint8]:
    """Blur a scene's pinhole picture for the set's display.

    Parameters
    ----------
    stimuli
        The set of pictures.
    design
        Whether the whole picture is defocused (`judged` is "blur"), or seen by its depth through a lens focused on the
        fixated object ("depth").
    scene
        Its name.
    amount
        Dioptres of defocus for the design's pupil, or millimetres of aperture; 0: as it is.

    Returns
    -------
    ndarray
        8-bit values, H x W x 3.

    Raises
    ------
    InputError
        If the set lacks the picture or, to judge depth, its depth.
    """
    picture = stimuli.picture(scene, "pinhole", design.fixation)
    light = stimuli.linear(picture)
    if amount > 0:
        angle = math.radians(1 / stimuli.display.pixels_per_degree)
        if design.judged == "blur":
            # Focused 1 / amount away; what it sees is at infinity.
            lens = _lens(design.pupil_mm, 1 / amount)
            distance = np.full(light.shape[:2], math.inf)
        else:
            distance = stimuli.depth(scene).astype(float)
            x, y = stimuli.scene(scene).target(design.fixation).position_px
            lens = _lens(amount, float(distance[int(y), int(x)]))
        light = blur_picture(light, distance, lens, pixel_angle=angle)
    return stimuli.display.encode(light)


def _lens(aperture_mm: float, focus_distance: float) -> Lens:
    """A lens of that aperture, of a focal length (m) that does not matter to blur as an angle."""
    return Lens(focal_length := min(0.01, focus_distance / 2), 1e3 * focal_length / aperture_mm, focus_distance)
