"""Depth-rating sets from drawn stimuli, each with and without blur."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import plain_name
from focalgradient.progress import Progress, silent
from focalgradient.stimuli.depth_rating import FOCAL_LENGTH
from focalgradient.stimuli.fixated import innermost
from focalgradient.stimuli.folder import Folder
from focalgradient.stimuli.sets import (
    StimulusSet,
    add_picture,
    add_scene,
    begin_set,
    check_size,
    finish_set,
    picture_files,
    stem_of,
    stored_distance,
)
from focalgradient.stimuli.stimulus import (
    PUPIL,
    Stimulus,
)

__all__ = ["make_from_stimuli"]

FOCUS = "focus"
"""Name of the fixated object in such sets: whatever is in focus."""

PIXELS_PERCENT = 1.0
"""Maximum difference (%) in pixels per degree between stimulus and display."""


def make_from_stimuli(
    out: str | Path,
    stimuli: Mapping[str, Stimulus],
    *,
    display: Display | None = None,
    progress: Progress | None = None,
) -> StimulusSet:
    """Make a depth-rating set from drawn stimuli, resume an interrupted one, or verify a finished one.

    Parameters
    ----------
    out
        Output folder of the set.
    stimuli
        Stimuli by scene name. Each is shown through the "pinhole", which is the stimulus without blur, and through the
        f-number of its pupil, 50 mm / pupil. All must have the same size and pupil.
    display
        Display with the pixels per degree for which the stimuli were drawn.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    StimulusSet
        The set, as returned by `read_set`. Its only fixation is "focus", the centre of the region in focus. `controls`
        states mean luminance relative to the picture without blur, and the sharpest place.

    Raises
    ------
    InputError
        If the stimuli differ in size or pupil, or do not fit the display.

    Examples
    --------
    >>> import tempfile
    >>> from focalgradient.stimuli import slanted_plane
    >>> display = Display()
    >>> plane = slanted_plane(width_deg=3, height_deg=2, pixels_per_degree=display.pixels_per_degree)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = make_from_stimuli(folder, {"plane": plane}, display=display)
    ...     [(one.aperture, one.fixation) for one in made.pictures]
    [('pinhole', 'focus'), ('f/8.333', 'focus')]
    """
    out, display, say = Path(out), display or Display(), progress or silent
    shape, pupil_mm = _checked(stimuli, display)
    aperture = f"f/{1e3 * FOCAL_LENGTH / pupil_mm:.4g}"
    parameters = {
        "kind": "drawn",
        "scenes": len(stimuli),
        "apertures": ["pinhole", aperture],
        "focal_length_mm": FOCAL_LENGTH * 1e3,
        "pixel_angle_rad": next(iter(stimuli.values())).pixel_angle,
        "stimuli": {name: _about(one) for name, one in stimuli.items()},
    }
    folder = begin_set(out, display, shape, parameters)
    if not folder.complete:
        for number, (name, one) in enumerate(stimuli.items()):
            say(number / len(stimuli), name)
            _scene(folder, name, one, aperture, pupil_mm, display)
    return finish_set(folder, say)


def _checked(stimuli: Mapping[str, Stimulus], display: Display) -> tuple[tuple[int, int], float]:
    """Return the common height and width, and the pupil in millimetres."""
    if not stimuli:
        raise InputError("stimuli is empty, but must have a stimulus by the name of its scene: give one.")
    first = next(iter(stimuli.values()))
    for name, one in stimuli.items():
        plain_name(name, "the name of a scene")
        if not isinstance(one, Stimulus):
            raise InputError(f"{name} is not a Stimulus: give the result of a function such as slanted_plane.")
        PUPIL.check(f"pupil_mm of {name}", one.parameters.get("pupil_mm", math.nan))
        pupils = [each.parameters.get("pupil_mm") for each in (first, one)]
        if one.shape != first.shape or pupils[0] != pupils[1]:
            raise InputError(
                f"{name} has {one.shape[1]} x {one.shape[0]} pixels and a pupil of {pupils[1]} mm, but the first has "
                f"{first.shape[1]} x {first.shape[0]} and {pupils[0]} mm: draw all of one size and with one pupil."
            )
        drawn = 1 / np.degrees(one.pixel_angle)
        if abs(drawn / display.pixels_per_degree - 1) > PIXELS_PERCENT / 100:
            raise InputError(
                f"{name} is drawn for {drawn:.4g} pixels per degree, but the display has "
                f"{display.pixels_per_degree:.4g}: draw it with pixels_per_degree={display.pixels_per_degree:.4g}."
            )
    return check_size(next(iter(stimuli)), first.shape, display), float(first.parameters["pupil_mm"])


def _about(one: Stimulus) -> dict[str, Any]:
    """Return the name, source, parameters and checksum that identify a stimulus, as plain JSON."""
    plain = {
        key: list(value) if isinstance(value, tuple) else value
        for key, value in one.parameters.items()
        if value is None or isinstance(value, bool | int | float | str | tuple | list | dict)
    }
    arrays = b"".join(np.ascontiguousarray(array).tobytes() for array in (one.picture, one.sharp, one.depth_m))
    return {
        "name": one.name,
        "source": list(one.source),
        "parameters": plain,
        "sha256": hashlib.sha256(arrays).hexdigest(),
    }


def _scene(folder: Folder, name: str, one: Stimulus, aperture: str, pupil_mm: float, display: Display) -> None:
    """Make the two pictures of a stimulus, and their entries in the folder's content."""
    depth = np.where(np.isnan(one.depth_m), np.inf, one.depth_m)
    known = np.isfinite(depth)
    least = float(one.blur_arcmin[known].min())
    region = known & (one.blur_arcmin <= least + 0.02 * (float(one.blur_arcmin[known].max()) - least))
    place = innermost(region)
    focus_m = float(depth[int(place[1]), int(place[0])])
    add_scene(folder, name, {FOCUS: (place, focus_m)}, stored_distance(depth, name))
    blur = [2 * 2 * float(end) for end in (one.blur_arcmin.min(), one.blur_arcmin.max())]  # a disc's diameter
    per_px = np.degrees(one.pixel_angle) * 60
    sharpest = {key: one.controlled[key] for key in ("sharpest", "sharpest_px")}
    for shown, light, diameters in (("pinhole", one.sharp, [0.0, 0.0]), (aperture, one.picture, blur)):
        stem, is_pinhole = stem_of(shown, FOCUS), shown == "pinhole"
        folder.put(picture_files(f"{name}/{stem}", np.repeat(light.astype(np.float32)[..., None], 3, axis=2), display))
        measured = {"mean_luminance": float(light.mean()), "clipped": 0.0} | ({} if is_pinhole else sharpest)
        folder.content["controls"]["scenes"][name]["pictures"][stem] = measured
        add_picture(
            *(folder, f"{name}/{stem}", shown, FOCUS),
            focus_m=focus_m,
            aperture_mm=0.0 if is_pinhole else pupil_mm,
            blur_px=[diameter / per_px for diameter in diameters],
            blur_arcmin=diameters,
        )
