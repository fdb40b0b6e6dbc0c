"""Validated schema of a set's manifest, which is read from disk."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from focalgradient.tables import Table

__all__ = ["Fixation", "Manifest", "Picture", "StimulusRecord", "StoredDisplay", "Target"]

Fixation = str
"""Fixated object, which is in focus: "nearest", "farthest", or another name from the set's table."""


Known = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A number; null, NaN once read, if unknown, as in imported sets."""
Pair = Annotated[
    tuple[Known, Known], BeforeValidator(lambda values: tuple(values) if isinstance(values, list) else values)
]


class _Entry(Table):
    """A part of a manifest; unknown keys are ignored."""

    model_config = ConfigDict(extra="ignore")


class Target(_Entry):
    """A fixated object.

    Parameters
    ----------
    name
        ``"nearest"``, ``"farthest"``, or a name from the table of the pictures.
    distance_m
        Distance along the camera's axis; NaN if unknown, as in imported sets.
    position_px
        Position in pixels from the picture's upper left corner, to the right and down.
    """

    name: str = Field(description="the name of the fixated object")
    distance_m: Known = Field(description="a distance in metres, or null")
    position_px: Pair = Field(description="two numbers of pixels")


class _Scene(_Entry):
    seed: int | None = Field(description="a whole number, or null")
    depth: str | None = Field(description="the name of a file, or null")
    nearest: Target | None = Field(None, description="a table of the fixated object")
    farthest: Target | None = Field(None, description="a table of the fixated object")
    targets: dict[str, Target] = Field({}, description="a table of the fixated object, by its name")


class Picture(_Entry):
    """A picture of the set.

    Parameters
    ----------
    scene, aperture, fixation
        Name of the scene, aperture ("pinhole" or an f-number such as "f/11"), and object in focus.
    png, linear
        Paths of its files relative to the set's folder: 8-bit values for the display, and linear radiance (white = 1).
    focus_m, aperture_mm
        Focus distance; aperture diameter, 0 for the pinhole.
    blur_px, blur_arcmin
        Smallest and largest diameter of the blur disc in the picture: in pixels, and on the display. Values unknown for
        imported pictures are NaN.
    others
        Other columns of the table from which it was imported.
    """

    scene: str = Field(description="the name of a scene")
    aperture: str = Field(description='the name of an aperture: "pinhole", or an f-number as "f/11"')
    fixation: Fixation = Field(description='the name of the fixated object, as "nearest"')
    png: str = Field(description="the name of a file")
    linear: str = Field(description="the name of a file")
    focus_m: Known = Field(description="a distance in metres, or null")
    aperture_mm: Known = Field(description="a diameter in millimetres, or null")
    blur_px: Pair = Field(description="two numbers of pixels")
    blur_arcmin: Pair = Field(description="two numbers of minutes of arc")
    others: dict[str, str] = Field({}, alias="further", description="a table of texts")

    def agrees(self, levels: Mapping[str, str]) -> bool:
        """Return whether no column of the picture contradicts the given factor levels."""
        return all(self.others.get(name, level) == level for name, level in levels.items())


class StoredDisplay(_Entry):
    """Display for which pictures are made."""

    size_px: Annotated[list[int], Field(min_length=2, max_length=2)] = Field(description="two whole numbers of pixels")
    pixel_pitch_mm: float = Field(description="a number of millimetres")
    distance_m: float = Field(description="a number of metres")
    gamma: float | list[float] | Literal["sRGB"] = Field(description='a number, three of them, or "sRGB"')
    white_cd_m2: float = Field(description="a luminance in cd/m2")
    dither: bool = Field(description="true or false")


class Manifest(_Entry):
    """Manifest of a depth-rating set."""

    set: Literal["depth-rating"] = Field(description='"depth-rating"')
    display: StoredDisplay = Field(description="a table of the display")
    scenes: dict[str, _Scene] = Field(description="a table of scenes, by their names")
    pictures: list[Picture] = Field(description="a list of pictures")
    files: dict[str, str] = Field(description="each file's SHA-256, by its name")
    parameters: dict[str, Any] = Field({}, description="a table of parameters")
    controls: dict[str, Any] = Field({}, description="a table of measurements")


class _Controlled(Table):
    model_config = ConfigDict(extra="allow")

    sharpest: float = Field(ge=0, description="a number of 0 or more")
    sharpest_px: Annotated[list[int], Field(min_length=2, max_length=2)] = Field(description="two whole numbers")


class StimulusRecord(_Entry):
    """Record of a drawn stimulus, stored beside its arrays."""

    name: str = Field(description="the name of the function that drew it")
    source: list[str] = Field(description="a list of keys of the bibliography")
    pixel_angle_arcmin: float = Field(gt=0, description="a positive number of arcmin")
    controlled: _Controlled = Field(description="a table of measurements")
    parameters: dict[str, Any] = Field(description="a table of parameters")
    masks: list[str] = Field(description="a list of names")
    display: StoredDisplay = Field(description="a table of the display")
    sha256: dict[str, str] = Field(description="each file's SHA-256, by its name")
