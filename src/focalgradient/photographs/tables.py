"""Parts of settings files that photographs share: paths of images, and what is fixed in a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo

from focalgradient.photographs.encodings import Encoding
from focalgradient.photographs.planes import Body, Plane
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
        float, Field(ge=1e-9, le=1e9, allow_inf_nan=False, description="a positive number of millimetres, like 25.0")
    ]
    pixel_pitch_um: Annotated[
        float, Field(ge=1e-9, le=1e9, allow_inf_nan=False, description="a positive number of micrometres, like 8.0")
    ]
    """Of the sensor's pixels, also for camera raw files."""
    encoding: Annotated[Encoding | None, Field(description="'linear' or 'srgb'")] = None
    """None: as the files say, or else sRGB for 8-bit image files, linear for all others."""
    telecentric: Annotated[bool, Field(description="true or false")] = False
    """On the image side: focus does not change magnification, and a pixel's angle is pitch / focal length."""
    distances_from: Annotated[Plane | None, Field(description="'entrance_pupil', 'sensor' or 'lens_front'")] = None
    """The plane that distances count from. None: the entrance pupil, or what a calibration was measured from."""
    focus_from: Annotated[Plane | None, Field(description="'entrance_pupil', 'sensor' or 'lens_front'")] = None
    """The plane that focus distances count from: a lens's scale counts from the sensor. None: as other distances."""
    sensor_to_pupil_mm: Annotated[
        float | None, Field(ge=1, le=1e4, allow_inf_nan=False, description="a number of millimetres from 1, like 70")
    ] = None
    """From the sensor to the entrance pupil; None: as of a thin lens."""
    sensor_to_front_mm: Annotated[
        float | None, Field(ge=1, le=1e4, allow_inf_nan=False, description="a number of millimetres from 1, like 95")
    ] = None
    """From the sensor to the front of the lens, which distances from there need."""

    @property
    def body(self) -> Body:
        """Where the planes of the camera lie."""
        places = (self.sensor_to_pupil_mm, self.sensor_to_front_mm)
        return Body(self.focal_length_mm * 1e-3, self.telecentric, *(place and place * 1e-3 for place in places))

    @property
    def only(self) -> Sensor:
        """The sensor's part alone, of a table that holds more."""
        known: dict[str, Any] = {name: getattr(self, name) for name in Sensor.model_fields}
        return Sensor.model_validate(known)
