"""Depth-rating sets from drawn stimuli, each with and without blur."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import plain_name
from focalgradient.progress import Progress
from focalgradient.stimuli.fixated import innermost
from focalgradient.stimuli.making import FOCAL_LENGTH, Depth, Entry, Recipe, make_set
from focalgradient.stimuli.sets import (
    StimulusSet,
    check_size,
    picture_entry,
    stem_of,
)
from focalgradient.stimuli.stimulus import PUPIL, Stimulus

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
    display = display or Display()
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
    recipes = (DrawnRecipe(name, display, None, one, aperture) for name, one in stimuli.items())
    return make_set(out, display, shape, parameters, recipes, progress)


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


@dataclass(eq=False)
class DrawnRecipe(Recipe):
    """A stimulus without blur and with it, through an aperture of this name; the region in focus is fixated."""

    drawn: Stimulus
    aperture: str

    def __post_init__(self) -> None:
        drawn = self.drawn
        depth = np.where(np.isnan(drawn.depth_m), np.inf, drawn.depth_m)
        known = np.isfinite(depth)
        least = float(drawn.blur_arcmin[known].min())
        region = known & (drawn.blur_arcmin <= least + 0.02 * (float(drawn.blur_arcmin[known].max()) - least))
        place = innermost(region)
        self.depth, self.targets = depth, {FOCUS: (place, float(depth[int(place[1]), int(place[0])]))}

    @property
    def stems(self) -> tuple[str, ...]:
        """File stems of the two pictures."""
        return stem_of("pinhole", FOCUS), stem_of(self.aperture, FOCUS)

    def picture(self, stem: str, progress: Progress) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Return a picture, with the measures of the stimulus."""
        is_pinhole = stem == self.stems[0]
        light = self.drawn.sharp if is_pinhole else self.drawn.picture
        sharpest = {} if is_pinhole else {key: self.drawn.controlled[key] for key in ("sharpest", "sharpest_px")}
        colours = np.repeat(light.astype(np.float32)[..., None], 3, axis=2)
        return colours, {"mean_luminance": float(light.mean()), "clipped": 0.0} | sharpest

    def listed(self, scene: Entry, depth: Depth) -> Iterator[Entry]:
        """Return the entry of each picture; a disc's diameter is four times the standard deviation of its light."""
        per_px, pupil_mm = np.degrees(self.drawn.pixel_angle) * 60, float(self.drawn.parameters["pupil_mm"])
        blur = [4 * float(end) for end in (self.drawn.blur_arcmin.min(), self.drawn.blur_arcmin.max())]
        kinds = (("pinhole", [0.0, 0.0], 0.0), (self.aperture, blur, pupil_mm))
        for stem, (aperture, diameters, aperture_mm) in zip(self.stems, kinds, strict=True):
            yield picture_entry(
                *(f"{self.name}/{stem}", aperture, FOCUS),
                focus_m=self.targets[FOCUS][1],
                aperture_mm=aperture_mm,
                blur_px=[diameter / per_px for diameter in diameters],
                blur_arcmin=diameters,
            )
