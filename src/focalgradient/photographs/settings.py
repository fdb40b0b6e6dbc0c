"""The settings file, VIEWS.toml: which image was taken with which optics."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, InstanceOf, PrivateAttr

from focalgradient.calibration import Calibration
from focalgradient.errors import InputError
from focalgradient.files import read_toml
from focalgradient.optics import DualPixel, Lens
from focalgradient.optics.dual_pixel import ASYMMETRY
from focalgradient.photographs.cameras import Calibrated, load_camera
from focalgradient.photographs.images import Photograph, read_photographs
from focalgradient.photographs.planes import Plane, plane_name
from focalgradient.photographs.tables import ImagePath, Sensor
from focalgradient.photographs.vignetting import even_out
from focalgradient.plausibility import given_as
from focalgradient.tables import Table, load_table, shown
from focalgradient.view import View

__all__ = ["GIVEN", "Camera", "Settings", "Shot", "load_settings", "make_views", "read_views"]


FOCUS_TOLERANCE = 0.1
"""Relative standard deviation of a focus distance that a lens's scale or EXIF states: marks are off by up to a tenth or
two."""

F_NUMBER_TOLERANCE = 0.05
"""Relative standard deviation of a factor of the marked f-numbers: they are rounded to a third of a stop, and no lens
blurs quite as a disc."""

_SHARE = "a share from 0 to below 1, like 0.05"


class Camera(Sensor):
    """What all views share: the table ``[camera]``."""

    blur_k: Annotated[
        float, Field(gt=0, le=2, description="a number above 0 and up to 2, the sd of the blur over the disc's radius")
    ] = 0.5
    """Standard deviation of a Gaussian blur over the radius of the blur disc; it has no effect on disc blur."""
    focus_tolerance: Annotated[float, Field(ge=0, lt=1, description=_SHARE)] = FOCUS_TOLERANCE
    """Relative standard deviation of the focus distances, as marked."""
    f_number_tolerance: Annotated[float, Field(ge=0, lt=1, description=_SHARE)] = F_NUMBER_TOLERANCE
    """Relative standard deviation of a factor of all f-numbers, as marked."""
    dual_pixel_asymmetry: Annotated[float, Field(gt=0, le=1, description="a share above 0 and up to 1, like 0.315")] = (
        ASYMMETRY
    )
    dual_pixel_field: Annotated[
        list[Annotated[float, Field(allow_inf_nan=False)]],
        Field(min_length=5, max_length=5, description="five numbers"),
    ] = [0.0] * 5
    """Asymmetry of dual pixels' halves, and how it varies over the field: see `focalgradient.optics.DualPixel`."""


class Shot(Table):
    """One image and how it was taken: a table ``[[view]]``."""

    image: Annotated[ImagePath, Field(description="the path of an image, like 'view0.png'")]
    f_number: Annotated[
        float, Field(ge=0.1, description="a positive number of 0.1 or more, like 5.6, or inf for a pinhole")
    ]
    focus_distance_m: Annotated[float, Field(ge=1e-3, description="a positive number of metres, like 0.85, or inf")]
    half: Annotated[Literal["left", "right"] | None, Field(description="'left' or 'right'")] = None
    """The half of dual pixels that saw it."""
    flat: Annotated[ImagePath | None, Field(description="the path of an image, like 'flat_f5.6.png'")] = None
    """Picture of a blank, evenly lit surface at the same aperture: vignetting, divided out."""


class Settings(Table):
    """The camera, and its shots of one scene.

    With a `calibration`, what the shots say of f-number and focus are marks on the lens, and the truth is looked up.

    >>> settings = Settings.model_validate(
    ...     {
    ...         "camera": {"focal_length_mm": 25.0, "pixel_pitch_um": 8.0},
    ...         "view": [{"image": f"{n}.png", "f_number": n, "focus_distance_m": 0.85} for n in (16, 5.6)],
    ...     }
    ... )
    >>> settings.lenses()[1].f_number, round(settings.pixel_angles()[0] * 1e6, 1)
    (5.6, 310.6)
    """

    camera: Annotated[Camera, Field(description="a table [camera] with focal_length_mm and pixel_pitch_um")]
    shots: Annotated[
        list[Shot],
        Field(alias="view", min_length=1, description="one or more [[view]] tables, in double brackets"),
    ]
    calibration: InstanceOf[Calibration] | None = Field(
        None, exclude=True, description="named as calibration = 'camera.toml' in [camera]"
    )
    calibrated_plane: Plane | None = Field(
        None, exclude=True, description="the plane that the calibration's distances count from"
    )

    relative: bool = Field(False, exclude=True, description="true where the foci are known by their order alone")
    _calibration_file: Path | None = PrivateAttr(None)

    tables: ClassVar[dict[str, type[Table]]] = {"camera": Camera, "view": Shot}

    @property
    def files(self) -> list[Path]:
        """All files that these settings name: images, blank ones, and the calibration."""
        named = [path for shot in self.shots for path in (shot.image, shot.flat)]
        return [path for path in (*named, self._calibration_file) if path is not None]

    def given_k(self, shape: str) -> float | None:
        """Sigma / radius of the blur of a `shape`, where the camera's table or its calibration gives it.

        A camera that was calibrated with a shape gives the k of that shape only.
        """
        if self.calibration is None:
            return self.camera.blur_k if "blur_k" in self.camera.model_fields_set else None
        measured = self.calibration.psf
        return self.calibration.k if measured is None or measured.name == shape else None

    @property
    def offset(self) -> float:
        """From the plane that distances are measured from to the entrance pupil, in metres.

        Raises
        ------
        InputError
            If it is another plane than the calibration's, and where either lies is not known.
        """
        camera, body = self.camera, self.camera.body
        plane = camera.distances_from
        focus = self.lenses()[0].focus_distance
        if self.calibration is None:
            return body.offset(plane or "entrance_pupil", focus)
        if plane is None or plane == self.calibrated_plane:
            return self.calibration.offset
        if self.calibrated_plane == "sensor":  # where the entrance pupil lies was measured
            body = replace(body, to_pupil=-self.calibration.offset)
        elif self.calibrated_plane == "lens_front" and body.to_front is not None:
            body = replace(body, to_pupil=body.to_front - self.calibration.offset)
        return body.offset(plane, focus)

    @property
    def plane(self) -> str:
        """The plane that distances count from, in words."""
        plane = self.camera.distances_from or self.calibrated_plane
        return plane_name(plane or ("entrance_pupil" if self.calibration is None else None))

    def lenses(self) -> list[Lens]:
        """Give the lens of each shot, in SI units.

        Raises
        ------
        InputError
            If a shot is focused within the focal length, or was taken at a setting that is not calibrated.
        """
        lenses = []
        for number, shot in enumerate(self.shots, 1):
            try:
                if self.calibration is None:
                    camera = self.camera
                    marked_from = camera.focus_from or camera.distances_from or "entrance_pupil"
                    focus = camera.body.optical(shot.focus_distance_m, marked_from)
                    tolerances = {
                        "focus_tolerance": 0.0 if self.relative else camera.focus_tolerance,
                        "aperture_tolerance": 0.0 if self.relative else camera.f_number_tolerance,
                    }
                    lenses.append(Lens(camera.focal_length_mm * 1e-3, shot.f_number, focus, **tolerances))
                else:
                    lenses.append(self.calibration.lens(shot.f_number, shot.focus_distance_m))
            except InputError as error:
                raise InputError(f"view {number} ({shot.image.name}): {error}") from error
        return lenses

    def optics(self) -> list[Lens | DualPixel]:
        """Give the optics of each shot: its lens, or one half of its pupil."""
        camera = self.camera
        found: list[Lens | DualPixel] = []
        for shot, lens in zip(self.shots, self.lenses(), strict=True):
            left, right = DualPixel.pair(lens, camera.dual_pixel_asymmetry, tuple(camera.dual_pixel_field))
            found.append(lens if shot.half is None else left if shot.half == "left" else right)
        return found

    def pixel_angles(self) -> list[float]:
        """Give the angle in radians that a pixel of each shot subtends on the axis: pixel pitch / sensor distance.

        Focusing moves the sensor, and so changes the angle, unless the lens is telecentric on the image side: then it
        is pixel pitch / focal length in every view.
        """
        camera, pitch = self.camera, self.camera.pixel_pitch_um * 1e-6
        if camera.telecentric:
            return [pitch / (camera.focal_length_mm * 1e-3)] * len(self.shots)
        return [pitch / lens.sensor_distance for lens in self.lenses()]


GIVEN = {
    "focal_length": ("focal_length_mm", "mm"),
    "f_number": ("f_number", ""),
    "focus_distance": ("focus_distance_m", "m"),
    "pixel_pitch": ("pixel_pitch_um", "um"),
}
"""Keys of a settings file, with their units, by the library's parameter."""


def load_settings(path: str | os.PathLike[str], calibrated: Calibrated | None = None) -> Settings:
    """Read and check a settings file; its image paths are relative to its folder.

    Parameters
    ----------
    path
        The file.
    calibrated
        The camera, where it was calibrated; it goes before the ``calibration`` that the file itself may name.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, or has unknown, missing or wrong keys; or contradicts the calibration.
    """
    path = Path(path)
    data = read_toml(path)
    camera = data.get("camera")
    file: Path | None = None
    if isinstance(camera, dict) and "calibration" in camera:
        data["camera"] = {key: value for key, value in camera.items() if key != "calibration"}
        named = camera["calibration"]
        if not isinstance(named, str):
            raise InputError(f"{path}: camera: calibration is {shown(named)}, but must be a path, like 'camera.toml'.")
        file = path.parent / named
        calibrated = calibrated or load_camera(file)
    if calibrated is not None:
        data = calibrated.fill(data) | {
            "calibration": calibrated.calibration,
            "calibrated_plane": calibrated.sensor.distances_from,
        }
    settings = load_table(path, data, Settings)
    settings._calibration_file = file
    if calibrated is not None:
        stated, known = settings.camera.focal_length_mm, calibrated.sensor.focal_length_mm
        if not math.isclose(stated, known, rel_tol=0.01):
            raise InputError(
                f"{path}: camera: focal_length_mm is {stated:g}, but the camera was calibrated at {known:g} mm: "
                "calibrate it at this zoom."
            )
    try:
        with given_as(GIVEN):
            settings.lenses()
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return settings


def make_views(settings: Settings, photographs: Sequence[Photograph]) -> list[View]:
    r"""Join each photograph with the optics of its shot; what their vignetting differs by is evened out.

    Parameters
    ----------
    settings
        Of `load_settings` or `from_exif`.
    photographs
        One for each of the settings' shots, in their order.

    Returns
    -------
    list of View
        As many, each with the photograph's luminance and mask (H x W), and the angle of its pixels in radians.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> lens = "f_number = 4\nfocus_distance_m = 1.0\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name in "ab":
    ...         np.save(Path(folder, f"{name}.npy"), np.random.default_rng(ord(name)).random((8, 9)))
    ...     text = "[camera]\nfocal_length_mm = 50\npixel_pitch_um = 5\n"
    ...     text += "".join(f'[[view]]\nimage = "{name}.npy"\n{lens}' for name in "ab")
    ...     written = Path(folder, "views.toml").write_text(text)
    ...     settings = load_settings(Path(folder, "views.toml"))
    ...     views = make_views(settings, read_photographs([shot.image for shot in settings.shots]))
    >>> views[0].shape, round(1e6 * views[0].pixel_angle, 1)  # 5 um at 1/19 m
    ((8, 9), 95.0)
    """
    shots = zip(photographs, settings.optics(), settings.pixel_angles(), strict=True)
    return even_out([View(photo.luminance, one, angle * photo.binning, mask=photo.mask) for photo, one, angle in shots])


def read_views(path: str | os.PathLike[str]) -> list[View]:
    """Read the views that a settings file names, ready for `focalgradient.recover_depth`.

    Raises
    ------
    InputError
        As `load_settings` and `read_photographs` do.
    """
    settings = load_settings(path)
    with given_as(GIVEN):
        return _views_of(settings)


def _views_of(settings: Settings) -> list[View]:
    images, flats = zip(*((shot.image, shot.flat) for shot in settings.shots), strict=True)
    return make_views(settings, read_photographs(images, settings.camera.encoding, flats))
