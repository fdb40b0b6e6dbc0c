"""Depth-rating sets from photographs with known depth, blurred as by a lens."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError, checked
from focalgradient.files import plain_name
from focalgradient.progress import Progress
from focalgradient.quantities import Range
from focalgradient.render.blurred import blur_picture, check_radius, checked_picture
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli.controls import SMOOTH, against_discs
from focalgradient.stimuli.fixated import target_of
from focalgradient.stimuli.making import (
    F_NUMBERS,
    FOCAL_LENGTH,
    Series,
    make_set,
    named_apertures,
)
from focalgradient.stimuli.sets import (
    FIXATIONS,
    Fixation,
    StimulusSet,
    check_size,
    stored_distance,
)
from focalgradient.stimuli.sharpness import sharpest

__all__ = ["make_from_photographs"]

Photograph = tuple[NDArray[np.floating], NDArray[np.floating]]
"""Sharp linear radiance, H x W or H x W x 3, and distance of each pixel in metres, H x W."""


@checked
def make_from_photographs(
    out: str | Path,
    photographs: Mapping[str, Photograph],
    *,
    pixel_angle: Annotated[float, Range("radians", positive=True)],
    apertures: Sequence[float] = F_NUMBERS,
    display: Display | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> StimulusSet:
    """Make a depth-rating set from photographs, resume an interrupted one, or verify a finished one.

    Parameters
    ----------
    out
        Output folder of the set.
    photographs
        Sharp picture in *linear* radiance and its depth in metres, by scene name, all of one size. 1 is the display's
        white; brighter pictures are scaled to a maximum of 1.
    pixel_angle
        Angle in radians subtended by a pixel of the camera.
    apertures
        f-numbers of a 50 mm lens; the pinhole (the photograph itself) is added.
    display
        Display for which the pictures are made.
    executor
        Executor that blurs the pictures; the files do not depend on it. None: this process.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    StimulusSet
        The set, as returned by `read_set`. The nearest and the farthest parts are found from the depth; each is in
        focus in turn.

    Raises
    ------
    InputError
        If a picture and its depth do not match, do not fit the display, or the display cannot resolve the blur.
    """
    display = display or Display()
    lenses = named_apertures(apertures)
    shape = _checked(photographs, display)
    targets = {
        name: {end: target_of(distance, end) for end in FIXATIONS} for name, (_, distance) in photographs.items()
    }
    widest = FOCAL_LENGTH / min(lenses.values()) / pixel_angle
    for name, ends in targets.items():
        vergences = 1 / photographs[name][1]
        for _, metres in ends.values():  # before the first picture is written
            check_radius(0.5 * widest * float(np.abs(vergences - 1 / metres).max()))
        depth_range = 1 / ends["nearest"][1] - 1 / ends["farthest"][1]
        display.check_f_numbers(list(lenses.values()), FOCAL_LENGTH * depth_range / pixel_angle)
    parameters = {
        "kind": "photographs",
        "scenes": len(photographs),
        "apertures": list(lenses),
        "focal_length_mm": FOCAL_LENGTH * 1e3,
        "pixel_angle_rad": pixel_angle,
        "natural_viewing_distance_m": display.pixel_pitch / pixel_angle,
        "sources_sha256": {name: [_sha256(array) for array in pair] for name, pair in photographs.items()},
    }
    recipes = [
        PhotographRecipe(name, display, None, targets[name], distance, lenses, pixel_angle, light)
        for name, (light, distance) in photographs.items()
    ]
    return make_set(out, display, shape, parameters, recipes, progress, executor=executor, sheet=True, remedy=SMOOTH)


def _checked(photographs: Mapping[str, Photograph], display: Display) -> tuple[int, int]:
    """Return the common height and width of the pictures."""
    if not photographs:
        raise InputError("photographs is empty, but must have a picture with its depth: give one.")
    first: tuple[int, int] | None = None
    for name, (light, distance) in photographs.items():
        plain_name(name, "the name of a scene")
        checked_picture(light, distance, (f"the picture of {name}", f"the depth of {name}"), channels=3)
        first = check_size(name, distance.shape, display, first)
        if light.min() < 0 or light.max() <= 0:
            raise InputError(f"{name} contains radiance that is negative or zero everywhere: correct the picture.")
        stored_distance(distance, name)
    assert first is not None
    return first


@dataclass(eq=False)
class PhotographRecipe(Series):
    """A photograph, its depth (m) and the objects that are in focus in turn."""

    targets: Mapping[Fixation, tuple[tuple[float, float], float]]
    depth: NDArray[np.floating]
    light: NDArray[np.floating]

    def picture(self, stem: str, progress: Progress) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Blur the photograph as seen through an aperture, and measure the picture."""
        colours = self.light if self.light.ndim == 3 else np.repeat(self.light[..., None], 3, axis=2)
        light = sharp = np.asarray(colours / max(1.0, float(colours.max())), np.float32)
        (aperture, end), weights = self.conditions[stem], np.array(LUMINANCE)
        (lens,) = self.optics(aperture, 1 / self.targets[end][1])
        if aperture != "pinhole":
            light = np.maximum(blur_picture(sharp, self.depth, lens, pixel_angle=self.pixel_angle), 0)
        shown, clipped = light @ weights, float(np.mean(light > 1))
        measured: dict[str, Any] = {"mean_luminance": float(shown.mean()), "clipped": clipped}
        if aperture != "pinhole":
            measured |= against_discs(shown, sharp @ weights, self.depth, lens, self.pixel_angle)
            measured |= sharpest(shown, sharp @ weights, self.depth, [lens], self.pixel_angle)
        return light.astype(np.float32), measured


def _sha256(array: NDArray[Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()
