"""Depth-rating sets from photographs with known depth, blurred as by a lens."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError, check_number
from focalgradient.files import plain_name
from focalgradient.optics import Aperture
from focalgradient.parallel import in_order
from focalgradient.progress import Progress, part_of, silent
from focalgradient.render.blurred import blur_picture, check_radius, checked_picture
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli.controls import SMOOTH, against_discs
from focalgradient.stimuli.depth_rating import F_NUMBERS, FOCAL_LENGTH, named_apertures
from focalgradient.stimuli.fixated import target_of
from focalgradient.stimuli.folder import Folder
from focalgradient.stimuli.sets import (
    FIXATIONS,
    Fixation,
    StimulusSet,
    add_picture,
    add_scene,
    begin_set,
    check_size,
    disc_ends,
    finish_set,
    picture_files,
    stem_of,
    stored_distance,
)
from focalgradient.stimuli.sharpness import sharpest

__all__ = ["make_from_photographs"]

Photograph = tuple[NDArray[np.floating], NDArray[np.floating]]
"""Sharp linear radiance, H x W or H x W x 3, and distance of each pixel in metres, H x W."""


def make_from_photographs(
    out: str | Path,
    photographs: Mapping[str, Photograph],
    *,
    pixel_angle: float,
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
    out, display, say = Path(out), display or Display(), progress or silent
    lenses = named_apertures(apertures)
    check_number("pixel_angle", pixel_angle, "radians", positive=True)
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
    folder = begin_set(out, display, shape, parameters)
    if not folder.complete:
        for number, (name, pair) in enumerate(photographs.items()):
            share = part_of(say, number, len(photographs))
            _scene(folder, name, pair, targets[name], lenses, pixel_angle, display, executor, share)
    return finish_set(folder, say, display, SMOOTH)


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


def _blurred(
    sharp: NDArray[np.float32], distance: NDArray[np.floating], pixel_angle: float, optics: Aperture
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """Return a picture seen through an aperture, and its measures."""
    weights = np.array(LUMINANCE)
    blurred = sharp
    if optics.aperture_diameter > 0:
        blurred = blur_picture(sharp, distance, optics, pixel_angle=pixel_angle)
    light = np.maximum(blurred, 0).astype(np.float32)
    measured: dict[str, Any] = {"mean_luminance": float((light @ weights).mean()), "clipped": float(np.mean(light > 1))}
    if optics.aperture_diameter > 0:
        measured |= against_discs(light @ weights, sharp @ weights, distance, optics, pixel_angle)
        measured |= sharpest(light @ weights, sharp @ weights, distance, [optics], pixel_angle)
    return light, measured


def _scene(
    folder: Folder,
    name: str,
    photograph: Photograph,
    targets: Mapping[Fixation, tuple[tuple[float, float], float]],
    lenses: Mapping[str, float],
    pixel_angle: float,
    display: Display,
    executor: Executor | None,
    say: Progress,
) -> None:
    """Make the pictures of one photograph, and their entries in the folder's content."""
    sharp, distance = photograph
    sharp = sharp if sharp.ndim == 3 else np.repeat(sharp[..., None], 3, axis=2)
    sharp = np.asarray(sharp / max(1.0, float(sharp.max())), np.float32)
    add_scene(folder, name, targets, stored_distance(distance, name))
    shown = {
        (end, aperture): (stem_of(aperture, end), Aperture(FOCAL_LENGTH / f_number, 1 / targets[end][1]))
        for end in FIXATIONS
        for aperture, f_number in lenses.items()
    }
    optics_of = dict(shown.values())  # pinhole first
    blurred = partial(_blurred, sharp, distance, pixel_angle)
    known = folder.content["controls"]["scenes"][name]["pictures"]
    for stem, (light, measured) in zip(optics_of, in_order(executor, blurred, [*optics_of.values()]), strict=True):
        known[stem] = measured
        folder.put(picture_files(f"{name}/{stem}", light, display))
        say(len(known) / len(optics_of), f"{name} {stem}")
    for (end, aperture), (stem, optics) in shown.items():
        blur = disc_ends(optics, distance, pixel_angle)
        add_picture(
            *(folder, f"{name}/{stem}", aperture, end),
            focus_m=targets[end][1],
            aperture_mm=1e3 * optics.aperture_diameter,
            blur_px=blur,
            blur_arcmin=[display.arcmin(diameter) for diameter in blur],
        )


def _sha256(array: NDArray[Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()
