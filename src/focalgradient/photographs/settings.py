"""VIEWS.toml, the settings file: images and the optics with which they were taken."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, InstanceOf, PrivateAttr

from focalgradient.calibration import Calibration
from focalgradient.errors import InputError, located
from focalgradient.files import read_toml
from focalgradient.optics import DualPixel, Lens
from focalgradient.optics.dual_pixel import ASYMMETRY
from focalgradient.optics.lens import FIELD_TOLERANCE
from focalgradient.photographs.cameras import Calibrated, load_camera
from focalgradient.photographs.photograph import Photograph
from focalgradient.photographs.planes import Plane, plane_name
from focalgradient.photographs.tables import Photographs, Sensor, ShotFiles
from focalgradient.photographs.vignetting import even_out
from focalgradient.plausibility import given_as
from focalgradient.tables import load_table, shown
from focalgradient.view import View

__all__ = ["GIVEN", "Camera", "Settings", "Shot", "load_settings", "make_views", "read_views", "views_with"]


FOCUS_TOLERANCE = 0.1
"""Relative standard deviation of a focus distance from a lens scale or EXIF: marks are wrong by up to 10 or 20 %."""

F_NUMBER_TOLERANCE = 0.05
"""Relative standard deviation of a common factor of the marked f-numbers: they are rounded to a third of a stop, and
real blur differs from a disc."""

_FRACTION_HELP = "a fraction from 0 to below 1, like 0.05"


class Camera(Sensor):
    """Parameters common to all views: table ``[camera]``."""

    blur_k: float = Field(
        0.5, gt=0, le=2, description="a number above 0 and up to 2, the sd of the blur divided by the disc's radius"
    )
    """Standard deviation of a Gaussian blur divided by the blur-disc radius; no effect on disc blur."""
    focus_tolerance: float = Field(FOCUS_TOLERANCE, ge=0, lt=1, description=_FRACTION_HELP)
    """Relative standard deviation of the marked focus distances."""
    f_number_tolerance: float = Field(F_NUMBER_TOLERANCE, ge=0, lt=1, description=_FRACTION_HELP)
    """Relative standard deviation of a common factor of all marked f-numbers."""
    field_tolerance: float = Field(FIELD_TOLERANCE, ge=0, lt=1, description=_FRACTION_HELP)
    """Curvature and tilt of the field at the corner of the frame, relative to the focal length: see `Lens`."""
    dual_pixel_asymmetry: float = Field(ASYMMETRY, gt=0, le=1, description="a fraction above 0 and up to 1, like 0.315")
    dual_pixel_field: list[Annotated[float, Field(allow_inf_nan=False)]] = Field(
        [0.0] * 5, min_length=5, max_length=5, description="five numbers"
    )
    """Asymmetry of the dual-pixel halves, and its variation over the field: see `focalgradient.optics.DualPixel`."""


class Shot(ShotFiles):
    """One image and its camera settings: table ``[[view]]``."""

    f_number: float = Field(ge=0.1, description="a positive number of 0.1 or more, like 5.6, or inf for a pinhole")
    focus_distance_m: float = Field(ge=1e-3, description="a positive number of metres, like 0.85, or inf")
    half: Literal["left", "right"] | None = Field(None, description="'left' or 'right'")
    """Half of the dual pixels that recorded it."""


class Settings(Photographs[Camera, Shot]):
    """The camera, and its shots of one scene.

    With a `calibration`, the shots' f-numbers and focus distances are marks on the lens, which it converts to true
    values.

    >>> settings = Settings.model_validate(
    ...     {
    ...         "camera": {"focal_length_mm": 25.0, "pixel_pitch_um": 8.0},
    ...         "view": [{"image": f"{n}.png", "f_number": n, "focus_distance_m": 0.85} for n in (16, 5.6)],
    ...     }
    ... )
    >>> settings.lenses()[1].f_number, round(settings.pixel_angles()[0] * 1e6, 1)
    (5.6, 310.6)
    """

    calibration: InstanceOf[Calibration] | None = Field(
        None, exclude=True, description="named as calibration = 'camera.toml' in [camera]"
    )
    calibrated_plane: Plane | None = Field(
        None, exclude=True, description="the reference plane of the calibration's distances"
    )

    placeholders: tuple[str, ...] = Field(
        (), exclude=True, description="parameters without a known value, if only the order of the foci is known"
    )
    _calibration_file: Path | None = PrivateAttr(None)

    @property
    def files(self) -> list[Path]:
        """All files named by these settings: images, flat fields, and the calibration."""
        return [*super().files, *([] if self._calibration_file is None else [self._calibration_file])]

    @property
    def relative(self) -> bool:
        """Whether only the order of the foci is known."""
        return bool(self.placeholders)

    @property
    def marks(self) -> list[tuple[float, float]]:
        """f-number and focus distance (m) of each shot, as stated."""
        return [(shot.f_number, shot.focus_distance_m) for shot in self.shots]

    def given_k(self, shape: str) -> float | None:
        """Return sigma / radius of the blur of a `shape`, if given by the camera's table or its calibration.

        A camera calibrated with one shape gives the k of that shape only.
        """
        if self.calibration is None:
            return self.camera.blur_k if "blur_k" in self.camera.model_fields_set else None
        measured = self.calibration.psf
        return self.calibration.k if measured is None or measured.name == shape else None

    @property
    def offset(self) -> float:
        """Distance from the reference plane of measured distances to the entrance pupil, in metres.

        Raises
        ------
        InputError
            If the plane differs from the calibration's, and the position of either is unknown.
        """
        camera, body = self.camera, self.camera.body
        plane = camera.distances_from
        focus = self.lenses()[0].focus_distance
        if self.calibration is None:
            return body.offset(plane or "entrance_pupil", focus)
        if plane is None or plane == self.calibrated_plane:
            return self.calibration.offset
        if self.calibrated_plane == "sensor":  # the position of the entrance pupil was measured
            body = replace(body, to_pupil=-self.calibration.offset)
        elif self.calibrated_plane == "lens_front" and body.to_front is not None:
            body = replace(body, to_pupil=body.to_front - self.calibration.offset)
        return body.offset(plane, focus)

    @property
    def plane(self) -> str:
        """Name of the reference plane of distances."""
        plane = self.camera.distances_from or self.calibrated_plane
        return plane_name(plane or ("entrance_pupil" if self.calibration is None else None))

    def lenses(self) -> list[Lens]:
        """Return the lens of each shot, in SI units.

        Raises
        ------
        InputError
            If a shot is focused within the focal length, or at a setting that was not calibrated.
        """
        lenses = []
        for number, shot in enumerate(self.shots, 1):
            with located(f"view {number} ({shot.image.name})"):
                if self.calibration is None:
                    camera = self.camera
                    tolerances = {
                        "focus_tolerance": 0.0 if self.relative else camera.focus_tolerance,
                        "aperture_tolerance": 0.0 if self.relative else camera.f_number_tolerance,
                        "field_tolerance": 0.0 if self.relative else camera.field_tolerance,
                    }
                    lenses.append(camera.lens(shot.f_number, shot.focus_distance_m, **tolerances))
                else:
                    lenses.append(self.calibration.lens(shot.f_number, shot.focus_distance_m))
        return lenses

    def optics(self) -> list[Lens | DualPixel]:
        """Return the optics of each shot: its lens, or one half of its pupil."""
        camera = self.camera
        found: list[Lens | DualPixel] = []
        for shot, lens in zip(self.shots, self.lenses(), strict=True):
            left, right = DualPixel.pair(lens, camera.dual_pixel_asymmetry, tuple(camera.dual_pixel_field))
            found.append(lens if shot.half is None else left if shot.half == "left" else right)
        return found

    def pixel_angles(self) -> list[float]:
        """Return the angle in radians subtended by a pixel of each shot on the axis."""
        return [self.camera.pixel_angle(lens) for lens in self.lenses()]


GIVEN = {
    "focal_length": ("focal_length_mm", "mm"),
    "f_number": ("f_number", ""),
    "focus_distance": ("focus_distance_m", "m"),
    "pixel_pitch": ("pixel_pitch_um", "um"),
}
"""Keys of a settings file and their units, by parameter of the library."""


def load_settings(path: str | os.PathLike[str], calibrated: Calibrated | None = None) -> Settings:
    """Read and validate a settings file; its image paths are relative to its folder.

    Parameters
    ----------
    path
        Path of the file.
    calibrated
        Calibration of the camera, which takes precedence over the ``calibration`` named in the file.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, has unknown, missing or invalid keys, or contradicts the calibration.
    """
    path = Path(path)
    data = read_toml(path, "a settings file that names photographs")
    if "aperture" in data:
        raise InputError(f"{path} is the calibration of a camera: give it beside the photographs (calibration).")
    if views_with(data, "distance_m"):
        raise InputError(
            f"{path} names photographs of a target at known distances: give it to focalgradient calibrate."
        )
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
    with located(path), given_as(GIVEN):
        settings.lenses()
    return settings


def views_with(data: Mapping[str, Any], *keys: str) -> bool:
    """Return whether each view in a file's `data` has the `keys`.

    >>> views_with({"view": [{"image": "a.png", "distance_m": 0.5}]}, "distance_m")
    True
    """
    views = data.get("view")
    if not (isinstance(views, list) and views):
        return False
    return all(isinstance(view, dict) and all(key in view for key in keys) for view in views)


def make_views(settings: Settings, photographs: Sequence[Photograph]) -> list[View]:
    r"""Return views: each photograph with the optics of its shot, corrected for differences in vignetting.

    Parameters
    ----------
    settings
        Settings from `load_settings` or `from_exif`.
    photographs
        One photograph per shot of the settings, in order.

    Returns
    -------
    list of View
        One view per photograph, with its luminance and mask (H x W), and its pixel angle in radians.

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
    ...     views = make_views(settings, settings.read_shots(settings.shots))
    >>> views[0].shape, round(1e6 * views[0].pixel_angle, 1)  # 5 um at 1/19 m
    ((8, 9), 95.0)
    """
    shots = zip(photographs, settings.optics(), settings.pixel_angles(), strict=True)
    return even_out([View(photo.luminance, one, angle * photo.binning, mask=photo.mask) for photo, one, angle in shots])


def read_views(path: str | os.PathLike[str]) -> list[View]:
    """Read the views named in a settings file, ready for `focalgradient.recover_depth`.

    Raises
    ------
    InputError
        As for `load_settings` and `read_photographs`.
    """
    settings = load_settings(path)
    with given_as(GIVEN):
        return make_views(settings, settings.read_shots(settings.shots))
