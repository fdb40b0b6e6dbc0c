"""Common parts of settings files of photographs: image paths, and fixed properties of a camera."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Generic, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo

from focalgradient.optics import Lens
from focalgradient.photographs.encodings import Encoding
from focalgradient.photographs.images import read_photographs
from focalgradient.photographs.photograph import Photograph
from focalgradient.photographs.planes import Body, Plane
from focalgradient.tables import Table
from focalgradient.view import View

__all__ = ["ImagePath", "Photographs", "Sensor"]


def _in_folder(path: Path, info: ValidationInfo) -> Path:
    """Resolve an image path relative to the folder of the settings file, which is the validation context."""
    return Path(info.context or "") / path


ImagePath = Annotated[Path, Field(strict=False), AfterValidator(_in_folder)]


# Each description completes "..., but must be " and "... is missing: give ".
class Sensor(Table):
    """Fixed properties of a camera: focal length, pixels, encoding and reference planes."""

    focal_length_mm: float = Field(
        ge=1e-9, le=1e9, allow_inf_nan=False, description="a positive number of millimetres, like 25.0"
    )
    pixel_pitch_um: float = Field(
        ge=1e-9, le=1e9, allow_inf_nan=False, description="a positive number of micrometres, like 8.0"
    )
    """Pitch of the sensor's pixels, also for camera raw files."""
    encoding: Encoding | None = Field(None, description="'linear' or 'srgb'")
    """None: as stated by the files, otherwise sRGB for 8-bit pixels, linear for all others."""
    telecentric: bool = Field(False, description="true or false")
    """Whether the lens is image-space telecentric: focus does not change magnification; pixel angle = pitch / focal
    length."""
    distances_from: Plane | None = Field(None, description="'entrance_pupil', 'sensor' or 'lens_front'")
    """Reference plane of distances. None: the entrance pupil, or that of the calibration."""
    focus_from: Plane | None = Field(None, description="'entrance_pupil', 'sensor' or 'lens_front'")
    """Reference plane of focus distances; lens scales refer to the sensor. None: as for other distances."""
    sensor_to_pupil_mm: float | None = Field(
        None, ge=1, le=1e4, allow_inf_nan=False, description="a number of millimetres from 1, like 70"
    )
    """Distance from the sensor to the entrance pupil; None: that of a thin lens."""
    sensor_to_front_mm: float | None = Field(
        None, ge=1, le=1e4, allow_inf_nan=False, description="a number of millimetres from 1, like 95"
    )
    """Distance from the sensor to the front of the lens; required for distances measured from there."""

    @property
    def body(self) -> Body:
        """Positions of the reference planes of the camera."""
        places = (self.sensor_to_pupil_mm, self.sensor_to_front_mm)
        return Body(self.focal_length_mm * 1e-3, self.telecentric, *(place and place * 1e-3 for place in places))

    def pixel_angle(self, lens: Lens) -> float:
        """Return the angle in radians subtended by a pixel on the axis: pixel pitch / sensor distance.

        Focusing moves the sensor and changes the angle, unless the lens is image-space telecentric: then it is pixel
        pitch / focal length.
        """
        throw = self.focal_length_mm * 1e-3 if self.telecentric else lens.sensor_distance
        return self.pixel_pitch_um * 1e-6 / throw

    def lens(self, f_number: float, focus_distance_m: float, **tolerances: float) -> Lens:
        """Return the lens at these marks; focus is marked from `focus_from`."""
        marked_from = self.focus_from or self.distances_from or "entrance_pupil"
        focus = self.body.optical(focus_distance_m, marked_from)
        return Lens(self.focal_length_mm * 1e-3, f_number, focus, **tolerances)

    def view(self, photograph: Photograph, lens: Lens) -> View:
        """Return a photograph through a lens as a view."""
        angle = self.pixel_angle(lens) * photograph.binning
        return View(photograph.luminance, lens, angle, mask=photograph.mask)

    @property
    def only(self) -> Sensor:
        """The same table, reduced to the keys of `Sensor`."""
        return Sensor.model_validate({name: getattr(self, name) for name in Sensor.model_fields})


class ShotFiles(Table):
    """Files of a photograph."""

    image: ImagePath = Field(description="the path of an image, like 'view0.png'")
    flat: ImagePath | None = Field(None, description="the path of an image, like 'flat_f5.6.png'")
    """Flat field: picture of a blank, uniformly lit surface at the same aperture, to correct vignetting."""


CameraTable = TypeVar("CameraTable", bound=Sensor)
ShotTable = TypeVar("ShotTable", bound=ShotFiles)


class Photographs(Table, Generic[CameraTable, ShotTable]):
    """A camera, and its photographs: a settings file."""

    camera: CameraTable = Field(description="a table [camera] with focal_length_mm and pixel_pitch_um")
    shots: list[ShotTable] = Field(
        alias="view", min_length=1, description="one or more [[view]] tables, in double brackets"
    )

    def read_shots(self, shots: Sequence[ShotFiles], *, crop: bool = False) -> list[Photograph]:
        """Read the photographs of some shots, as by `read_photographs`."""
        return read_photographs(
            [shot.image for shot in shots], self.camera.encoding, [shot.flat for shot in shots], crop=crop
        )

    @property
    def files(self) -> list[Path]:
        """All files named by the shots."""
        named = [getattr(shot, name) for shot in self.shots for name in type(shot).model_fields]
        return [value for value in named if isinstance(value, Path)]
