"""Parts of settings files that photographs share: paths of images, and what is fixed in a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo

from focalgradient.photographs.images import Encoding
from focalgradient.tables import Table

__all__ = ["ImagePath", "Sensor"]


def _in_folder(path: Path, info: ValidationInfo) -> Path:
    """Image paths are relative to the settings file, whose folder comes as context."""
    return Path(info.context or "") / path


ImagePath = Annotated[Path, Field(strict=False), AfterValidator(_in_folder)]


# Each description completes "..., but must be " and "... is missing: give ".
class Sensor(Table):
    """What is fixed in a camera: focal length, pixels, and how their values are written."""

    focal_length_mm: Annotated[
        float, Field(ge=1e-3, le=1e6, allow_inf_nan=False, description="a positive number of millimetres, like 25.0")
    ]
    pixel_pitch_um: Annotated[
        float, Field(ge=1e-3, le=1e6, allow_inf_nan=False, description="a positive number of micrometres, like 8.0")
    ]
    """Of the sensor's pixels, also for camera raw files."""
    encoding: Annotated[Encoding | None, Field(description="'linear' or 'srgb'")] = None
    """None: sRGB for 8-bit image files, linear for all others."""
    telecentric: Annotated[bool, Field(description="true or false")] = False
    """Whether magnification stays the same when the focus changes: all views then share the first's pixel angle."""
