"""TARGETS.toml: photographs of a target at known distances, for calibration."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from pydantic import Field

from focalgradient.calibration import Calibration, Priors, Reading, likeliest_shape, measure_target, pair_blur, shape_k
from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.recover import recover_depth
from focalgradient.errors import InputError, located
from focalgradient.files import read_toml
from focalgradient.optics import Lens
from focalgradient.photographs.images import read_photograph
from focalgradient.photographs.settings import GIVEN as KEYS
from focalgradient.photographs.settings import views_with
from focalgradient.photographs.tables import Photographs, Sensor, ShotFiles
from focalgradient.plausibility import (
    check_focal_length,
    check_focus,
    check_hyperfocal,
    check_offset,
    check_pixel_pitch,
    check_target,
    given_as,
)
from focalgradient.psf import Disc, Psf
from focalgradient.tables import load_table
from focalgradient.view import View

__all__ = ["TargetCamera", "TargetShot", "Targets", "camera_priors", "depth_on_side", "load_targets"]

_DEFAULT = Priors()

MARK_SD = 0.05
"""Relative standard deviation of a focus mark with known reference plane, by default: marks are wrong by up to 10 %."""

PLANE_SD_FOCAL_LENGTHS = 1.0
"""Standard deviation, in focal lengths, of the distance between the reference planes of marks and of measured distances
if either is unknown. Sensor and entrance pupil are 1 to 4 focal lengths apart."""

_Fraction = Annotated[float, Field(gt=0, lt=1, description="a fraction above 0 and below 1, like 0.07")]
_Length = Annotated[float, Field(gt=0, allow_inf_nan=False, description="a positive number of metres, like 0.1")]


class TargetCamera(Sensor):
    """The camera and its priors: table ``[camera]``."""

    offset_m: float = Field(0.0, allow_inf_nan=False, description="a number of metres, like 0.05")
    """Prior mean of the distance from the reference plane to the entrance pupil; negative if the plane lies in
    front."""
    offset_sd_m: _Length = _DEFAULT.offset_sd
    distance_sd_m: _Length = _DEFAULT.distance_sd
    f_number_tolerance: _Fraction = _DEFAULT.f_number_sd
    focus_tolerance: _Fraction = _DEFAULT.focus_sd
    blur_k: float = Field(_DEFAULT.k, gt=0, le=2, description="a number above 0 and up to 2")
    blur_k_tolerance: _Fraction = _DEFAULT.k_sd


class TargetShot(ShotFiles):
    """One photograph of the target: table ``[[view]]``."""

    distance_m: float = Field(ge=1e-3, le=1e6, allow_inf_nan=False, description="a positive number of metres, like 0.5")
    f_number: float = Field(ge=0.1, le=1e6, allow_inf_nan=False, description="a positive number, like 5.6")
    focus_distance_m: float | None = Field(None, gt=0, description="a positive number of metres, like 0.85, or inf")
    """As marked on the lens; views with the same mark, or without one, share one focus."""


class Targets(Photographs[TargetCamera, TargetShot]):
    """The camera, and its shots of a target."""

    @property
    def priors(self) -> Priors:
        """Priors of the camera."""
        return camera_priors(self.camera, [shot.focus_distance_m for shot in self.shots])

    def read(self, shot: TargetShot) -> Reading:
        """Measure the blur in one of the photographs.

        Raises
        ------
        InputError
            If it cannot be read, or shows too few sharp edges.
        """
        view = self._view(shot)
        pitch = view.pixel_angle * self.camera.focal_length_mm * 1e-3
        with located(shot.image):
            blur = measure_target(view)
        return Reading(shot.distance_m, shot.f_number, shot.focus_distance_m, *(pitch * size for size in blur))

    @property
    def pairs(self) -> list[tuple[TargetShot, TargetShot]]:
        """Pairs of shots at one distance and focus: each at the smallest f-number with one at the largest, in order.

        Raises
        ------
        InputError
            If there are none.
        """
        kinds: dict[tuple[float, float | None], list[TargetShot]] = {}
        for shot in self.shots:
            kinds.setdefault((shot.distance_m, shot.focus_distance_m), []).append(shot)
        found: list[tuple[TargetShot, TargetShot]] = []
        for shots in kinds.values():
            least, most = (limit(shot.f_number for shot in shots) for limit in (min, max))
            if least < most:
                wide, narrow = ([shot for shot in shots if shot.f_number == number] for number in (least, most))
                found += [(shot, narrow[n % len(narrow)]) for n, shot in enumerate(wide)]
        if not found:
            raise InputError(
                "no two views show the target at one distance and focus with different f-numbers, but the default "
                'method is calibrated from such pairs: add them, or calibrate the method "edges".'
            )
        return found

    def read_pair(self, pair: tuple[TargetShot, TargetShot], psf: Psf) -> Reading:
        """Measure the blur of the wider-aperture photograph of a pair by equalisation, for `calibrate_pairs`.

        Raises
        ------
        InputError
            If one cannot be read, or they show no difference in blur.
        """
        views = [self._view(shot) for shot in pair]
        with located(f"{pair[0].image}, {pair[1].image}"):
            blur = pair_blur(views, [shot.f_number for shot in pair], psf)
        unit = shape_k(psf) * views[0].pixel_angle * self.camera.focal_length_mm * 1e-3
        wide = pair[0]
        return Reading(wide.distance_m, wide.f_number, wide.focus_distance_m, blur.radius * unit, blur.radius_sd * unit)

    def map_pair(self, pair: tuple[TargetShot, TargetShot], camera: Calibration) -> tuple[list[View], DepthMap] | None:
        """Return views and depth map of a pair by the default method with a calibrated `camera`; None if it fails."""
        # The sharper view first.
        views = [self._view(shot, camera.lens(shot.f_number, shot.focus_distance_m)) for shot in reversed(pair)]
        depth = depth_on_side(views, pair[0].distance_m + camera.offset, camera.psf or Disc())
        return None if depth is None else (views, depth)

    def shape(self, pairs: Sequence[tuple[TargetShot, TargetShot]]) -> Psf:
        """Return the blur shape that best explains the pairs."""
        return likeliest_shape(
            [([self._view(shot) for shot in pair], [shot.f_number for shot in pair]) for pair in pairs]
        )

    def _view(self, shot: TargetShot, lens: Lens | None = None) -> View:
        """Return a photograph as a view; without a lens, blur is in pixels, independent of the unknown optics."""
        photograph = read_photograph(shot.image, self.camera.encoding, shot.flat)
        unknown = Lens(self.camera.focal_length_mm * 1e-3, shot.f_number, float("inf"))
        return self.camera.view(photograph, lens or unknown)


def depth_on_side(views: Sequence[View], distance: float, psf: Psf) -> DepthMap | None:
    """Return the depth map of views with one focus, on the side of it where `distance` (m) lies; None if it fails."""
    focus = 1 / views[0].optics.focus_vergence
    near, far = (focus, None) if distance > focus else (None, focus)
    try:
        return recover_depth(views, near=near, far=far, psf=psf, align=True)
    except InputError:
        return None


def camera_priors(camera: TargetCamera, focus_distances: Sequence[float | None]) -> Priors:
    """Return the priors of a camera with focus marks in metres."""
    offset, offset_sd = camera.offset_m, camera.offset_sd_m
    focus_sd, focus_offset = camera.focus_tolerance, None
    body, marks = camera.body, [mark for mark in focus_distances if mark]
    mark = min(marks, default=math.inf)
    if camera.distances_from is not None:
        given = camera.model_fields_set
        offset = offset if "offset_m" in given else body.offset(camera.distances_from, mark)
        offset_sd = offset_sd if "offset_sd_m" in given else body.offset_sd(camera.distances_from)
    if camera.focus_from is not None and "focus_tolerance" not in camera.model_fields_set:
        focus_sd = MARK_SD
    if camera.focus_from is not None and camera.focus_from != camera.distances_from and math.isfinite(mark):
        focus_offset = body.optical(mark, camera.focus_from) - mark
    if None in (camera.distances_from, camera.focus_from):  # marks and distances may have different reference planes
        focus_sd = math.hypot(focus_sd, PLANE_SD_FOCAL_LENGTHS * camera.focal_length_mm * 1e-3 / mark)
    return Priors(
        k=camera.blur_k,
        k_sd=camera.blur_k_tolerance,
        offset=offset,
        offset_sd=offset_sd,
        focus_offset=focus_offset,
        telecentric=camera.telecentric,
        f_number_sd=camera.f_number_tolerance,
        focus_sd=focus_sd,
        distance_sd=camera.distance_sd_m,
    )


def load_targets(path: str | os.PathLike[str]) -> Targets:
    """Read and validate TARGETS.toml; its image paths are relative to its folder.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, or has unknown, missing or invalid keys.
    """
    data = read_toml(Path(path), "a settings file that names photographs of a target")
    if "aperture" in data:
        raise InputError(f"{path} is a calibration already: give the settings file that names photographs of a target.")
    if views_with(data, "f_number", "focus_distance_m") and not any("distance_m" in view for view in data["view"]):
        raise InputError(
            f"{path} states no distance: give each view of a target distance_m, each view of a scene depth, or the "
            "file to focalgradient depth."
        )
    targets = load_table(Path(path), data, Targets)
    with located(path), given_as(GIVEN):
        _check_units(targets)
    return targets


GIVEN = KEYS | {
    "distance": ("distance_m", "m"),
    "offset": ("offset_m", "m"),
    "offset_sd": ("offset_sd_m", "m"),
    "distance_sd": ("distance_sd_m", "m"),
}
"""Keys of TARGETS.toml and their units, by quantity."""


def _check_units(targets: Targets) -> None:
    """Raise `InputError` if optics and distances are implausible in combination."""
    camera = targets.camera
    focal_length, pitch = 1e-3 * camera.focal_length_mm, 1e-6 * camera.pixel_pitch_um
    check_focal_length(focal_length)
    check_pixel_pitch(pitch, pitch / focal_length)
    slope = focal_length**2 / min(shot.f_number for shot in targets.shots) / 2 / pitch
    for shot in targets.shots:
        if shot.focus_distance_m is not None:
            check_focus(shot.focus_distance_m, focal_length)
            check_hyperfocal(shot.focus_distance_m, focal_length, slope, shot.f_number)
    nearest = min(shot.distance_m for shot in targets.shots)
    check_target(nearest, focal_length, slope)  # other distances are judged by the photographs themselves
    for name in ("offset", "offset_sd", "distance_sd"):
        if f"{name}_m" in camera.model_fields_set:
            check_offset(name, getattr(camera, f"{name}_m"), nearest)
