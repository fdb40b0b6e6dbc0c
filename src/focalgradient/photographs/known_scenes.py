"""SCENES.toml: photographs with depth maps of each scene from a depth camera, for calibration."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from focalgradient.calibration import (
    LEAST_SCENE_SHARE,
    KnownScene,
    Priors,
    SceneFit,
    SceneScore,
    fit_scenes,
    score_scene,
)
from focalgradient.errors import FocalGradientWarning, InputError, located, warn
from focalgradient.files import printable, read_toml
from focalgradient.optics import Lens
from focalgradient.photographs.cameras import Calibrated
from focalgradient.photographs.pictures import DepthUnit, read_distances
from focalgradient.photographs.settings import FOCUS_TOLERANCE, Shot
from focalgradient.photographs.settings import GIVEN as KEYS
from focalgradient.photographs.tables import ImagePath, Photographs
from focalgradient.photographs.targets import TargetCamera, camera_priors, depth_on_side
from focalgradient.photographs.vignetting import even_out
from focalgradient.plausibility import given_as
from focalgradient.progress import Progress
from focalgradient.psf import Psf
from focalgradient.tables import load_table

__all__ = [
    "KnownScenes",
    "SceneCalibration",
    "calibrate_scenes",
    "load_known_scenes",
    "names_depth",
]

LEAST_HELD_OUT = 4
"""Minimum number of scenes for testing a fit to one half of them on the other half."""


class SceneCamera(TargetCamera):
    """The camera, its priors, and the unit of the depth files: table ``[camera]``."""

    depth_unit: DepthUnit = Field("mm", description="'m', 'mm' or 'dioptres'")
    depth_step: float = Field(
        1.0, gt=0, allow_inf_nan=False, description="a positive number of units in a step of the file, like 1"
    )
    focus_tolerance: float = Field(FOCUS_TOLERANCE, gt=0, lt=1, description="a fraction above 0 and below 1, like 0.1")


class SceneShot(Shot):
    """One photograph of a scene with known depth: table ``[[view]]``."""

    depth: ImagePath = Field(description="the path of a depth map, like 'depth_mm.png'")
    """Depth map registered to this photograph; shots of one scene name the same file."""


class KnownScenes(Photographs[SceneCamera, SceneShot]):
    """The camera, and its shots of several scenes."""

    shots: list[SceneShot] = Field(
        alias="view", min_length=2, description="two or more [[view]] tables, in double brackets"
    )

    @property
    def scenes(self) -> list[list[SceneShot]]:
        """Shots of each scene, sharpest first.

        Raises
        ------
        InputError
            If a scene does not have two f-numbers, or the scenes differ in focus mark or f-numbers.
        """
        by_depth: dict[Path, list[SceneShot]] = {}
        for shot in self.shots:
            by_depth.setdefault(shot.depth, []).append(shot)
        scenes = [sorted(shots, key=lambda shot: -shot.f_number) for shots in by_depth.values()]
        kinds = {tuple((shot.f_number, shot.focus_distance_m) for shot in shots) for shots in scenes}
        if len(kinds) > 1 or len({mark for _, mark in next(iter(kinds))}) > 1:
            raise InputError(
                "the scenes were taken at several focus marks or f-numbers, but one calibration from scenes needs one "
                "focus mark and the same f-numbers: calibrate each separately."
            )
        if len({number for number, _ in next(iter(kinds))}) < 2:
            raise InputError(
                f"{printable(scenes[0][0].depth)} belongs to photographs of one f-number only, but calibration needs "
                "two of each scene: name the same depth file in two views."
            )
        return scenes

    @property
    def priors(self) -> Priors:
        """Priors of the camera."""
        return camera_priors(self.camera, [shot.focus_distance_m for shot in self.shots])

    def read(self, shots: list[SceneShot], psf: Psf) -> KnownScene | None:
        """Read one scene, and estimate its depth with the lens's marks; None if its views cannot be compared."""
        camera = self.camera
        lenses = [camera.lens(shot.f_number, shot.focus_distance_m) for shot in shots]
        views = list(map(camera.view, self.read_shots(shots, crop=True), lenses))
        distance = read_distances(shots[0].depth, camera.depth_unit, scale=camera.depth_step, fill=False).metres
        if distance.shape != views[0].shape:
            sizes = [f"{shape[1]} x {shape[0]}" for shape in (distance.shape, views[0].shape)]
            raise InputError(
                f"{printable(shots[0].depth)} is {sizes[0]} pixels, but {printable(shots[0].image)} is {sizes[1]}: "
                "bring the depth into the photograph's frame."
            )
        depth = depth_on_side(even_out(views), float(np.nanmedian(distance)), psf)
        step = camera.depth_step * 1e-3 if camera.depth_unit == "mm" else 0.0
        return None if depth is None else KnownScene(depth, views, distance, step)

    def fit(self, scenes: list[KnownScene], psf: Psf) -> SceneFit:
        """Fit the camera to scenes that were read."""
        shots, lengths = self.scenes[0], (self.camera.focal_length_mm * 1e-3, self.camera.pixel_pitch_um * 1e-6)
        f_numbers, focus = [shot.f_number for shot in shots], shots[0].focus_distance_m
        return fit_scenes(scenes, *lengths, f_numbers, focus, self.priors, psf)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SceneCalibration:
    """Camera calibrated from scenes, with the prediction of each scene by a fit to the half that excludes it.

    Parameters
    ----------
    calibrated
        Sensor and calibration of the camera, for `camera_toml` and `depth_from_photographs`.
    fit
        The fit to all scenes that gave depth.
    names, scores
        Each of these scenes, and the agreement of its depth with the fit to the other half; None if not predicted.
    count
        Number of scenes, including those that gave no depth.
    """

    calibrated: Calibrated
    fit: SceneFit
    names: Sequence[str]
    scores: Sequence[SceneScore | None]
    count: int

    def __repr__(self) -> str:
        return f"SceneCalibration({len(self.names)} of {self.count} scenes, {self.calibrated.calibration!r})"

    def record(self) -> dict[str, Any]:
        """Return the parameters and the scores, for JSON; units are in the names."""
        camera = self.fit.calibration
        of_targets = ("own_blur_um2", "model_error_of_blur")
        held_out = [
            None
            if score is None
            else {
                "scene": name,
                "bias_dioptres": score.bias,
                "median_relative_error": score.median_error,
                "mean_relative_error": score.mean_error,
                "within_2_sd": score.within_2_sd,
            }
            for name, score in zip(self.names, self.scores, strict=True)
        ]
        return {name: value for name, value in camera.record().items() if name not in of_targets} | {
            "focus_repeat_dioptres": self.fit.repeat,
            "blur_over_the_field": list(camera.field.blur),
            "scatter_dioptres": self.fit.scatter,
            "held_out": held_out,
            "scenes": self.count,
        }

    def summary(self) -> str:
        """Return the camera's parameters with standard deviations, and a table of the scenes as predicted."""
        camera = self.fit.calibration
        (mark, vergence), sd = next(iter(camera.focus.items())), camera.sd
        focus_sd = math.sqrt(max(sd[-1] ** 2 - self.fit.repeat**2, 0.0))
        lines = [
            f"{len(self.names)} of {self.count} scenes gave depth from blur.",
            f"Focus marked {mark:g} m: {vergence:.4f} +- {focus_sd:.4f} D, which is {1 / vergence - camera.offset:.3f} "
            f"m from the plane of the depth maps; it varies between scenes by {self.fit.repeat:.3f} D (SD).",
            f"Offset of the entrance pupil: {camera.offset:+.3f} +- {sd[2]:.3f} m",
        ]
        for number, (f_mark, effective) in enumerate(camera.f_numbers.items(), 3):
            lines.append(f"f-number marked {f_mark:g}: {effective:.3f} +- {effective * sd[number]:.3f}")
        field = " ".join(f"{value:+.3f}" for value in camera.field.blur)
        lines.append(f"Blur over the field, of x, y, x^2, x y, y^2 (relative): {field}")
        lines.append(f"Scatter of pixels around the fit: {self.fit.scatter:.3f} D")
        rows = [
            (name, score.bias, score.median_error, score.within_2_sd)
            for name, score in zip(self.names, self.scores, strict=True)
            if score is not None
        ]
        if rows:
            lines.append(f"{'Predicted by the other half':34}{'bias, D':>9}{'median error':>14}{'within 2 sd':>13}")
            medians = np.median([row[1:] for row in rows], axis=0)
            for name, bias, error, within in [*rows, ("Median of scenes", *medians)]:
                lines.append(f"{name:34.34}{bias:>+9.3f}{error:>14.1%}{within:>13.1%}")
        return "\n".join(lines)


def calibrate_scenes(known: KnownScenes, psf: Psf, progress: Progress) -> SceneCalibration:
    """Fit a camera to scenes of known depth by one shape of blur, and predict each from the half that excludes it.

    Raises
    ------
    InputError
        If no scene gives depth from blur.

    Warns
    -----
    FocalGradientWarning
        If there are too few scenes to test the calibration.
    """
    scenes, names, count = [], [], len(known.scenes)
    for number, group in enumerate(known.scenes):
        name = printable(group[0].depth.parent.name + "/" + group[0].depth.name)
        progress(number / (count + 1), name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FocalGradientWarning)
            scene = known.read(group, psf)
        if scene is not None and scene.depth.valid.mean() >= LEAST_SCENE_SHARE:
            scenes.append(scene)
            names.append(name)
    if not scenes:
        raise InputError(
            "no scene gave depth from blur: use scenes with texture, without saturation, at two f-numbers that "
            "differ by at least two stops."
        )
    progress(count / (count + 1), "fitting the camera")
    fit = known.fit(scenes, psf)
    scores = _held_out(known, scenes, psf)
    if len(scenes) < LEAST_HELD_OUT:
        warn(
            f"only {len(scenes)} of {count} scenes gave depth from blur, too few to test the calibration on left-out "
            "scenes: add scenes."
        )
    return SceneCalibration(
        Calibrated(sensor=known.camera.only, calibration=fit.calibration), fit, names, scores, count
    )


def _held_out(known: KnownScenes, scenes: list[KnownScene], psf: Psf) -> list[SceneScore | None]:
    """Score each scene's prediction by a fit to the half of the scenes that it does not belong to."""
    found: list[SceneScore | None] = [None] * len(scenes)
    marks = [(shot.f_number, shot.focus_distance_m) for shot in known.scenes[0]]
    for half in (0, 1) if len(scenes) >= LEAST_HELD_OUT else ():
        try:
            fit = known.fit(scenes[1 - half :: 2], psf)
        except InputError:
            continue
        for place in range(half, len(scenes), 2):
            found[place] = score_scene(scenes[place], fit, marks)
    return found


def names_depth(path: str | os.PathLike[str]) -> bool:
    """Return whether the views of a settings file name depth maps, i.e. describe scenes instead of a target."""
    views: Any = read_toml(path, "a settings file that names photographs of a target").get("view")
    return isinstance(views, list) and any(isinstance(view, dict) and "depth" in view for view in views)


def load_known_scenes(path: str | os.PathLike[str]) -> KnownScenes:
    """Read and validate SCENES.toml; its paths are relative to its folder.

    Raises
    ------
    InputError
        If it cannot be read, is not TOML, has unknown, missing or invalid keys, or its scenes are inconsistent.
    """
    known = load_table(Path(path), read_toml(Path(path)), KnownScenes)
    with located(path), given_as(KEYS):
        known.scenes  # noqa: B018  raises if the scenes are inconsistent
        for shot in known.shots:
            Lens(known.camera.focal_length_mm * 1e-3, shot.f_number, shot.focus_distance_m)
    return known
