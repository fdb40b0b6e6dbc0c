"""SCENES.toml: photographs with depth maps of each scene from a depth camera, for calibration."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from focalgradient.calibration import KnownScene, Priors, SceneFit, fit_scenes
from focalgradient.errors import InputError
from focalgradient.files import printable, read_toml
from focalgradient.optics import Lens
from focalgradient.photographs.images import read_photographs
from focalgradient.photographs.pictures import DepthUnit, read_distances
from focalgradient.photographs.settings import FOCUS_TOLERANCE, Shot
from focalgradient.photographs.settings import GIVEN as KEYS
from focalgradient.photographs.tables import ImagePath
from focalgradient.photographs.targets import TargetCamera, camera_priors
from focalgradient.photographs.vignetting import even_out
from focalgradient.plausibility import given_as
from focalgradient.psf import Psf
from focalgradient.tables import Table, load_table
from focalgradient.view import View

__all__ = ["KnownScenes", "UnusableSceneError", "load_known_scenes", "names_depth"]


class UnusableSceneError(InputError):
    """The views of one scene cannot be compared; the scene is skipped."""


class SceneCamera(TargetCamera):
    """The camera, its priors, and the unit of the depth files: table ``[camera]``."""

    depth_unit: Annotated[DepthUnit, Field(description="'m', 'mm' or 'dioptres'")] = "mm"
    depth_step: Annotated[
        float, Field(gt=0, allow_inf_nan=False, description="a positive number of units in a step of the file, like 1")
    ] = 1.0
    focus_tolerance: Annotated[float, Field(gt=0, lt=1, description="a fraction above 0 and below 1, like 0.1")] = (
        FOCUS_TOLERANCE
    )


class SceneShot(Shot):
    """One photograph of a scene with known depth: table ``[[view]]``."""

    depth: Annotated[ImagePath, Field(description="the path of a depth map, like 'depth_mm.png'")]
    """Depth map registered to this photograph; shots of one scene name the same file."""


class KnownScenes(Table):
    """The camera, and its shots of several scenes."""

    camera: Annotated[SceneCamera, Field(description="a table [camera] with focal_length_mm and pixel_pitch_um")]
    shots: Annotated[
        list[SceneShot],
        Field(alias="view", min_length=2, description="two or more [[view]] tables, in double brackets"),
    ]

    tables: ClassVar[dict[str, type[Table]]] = {"camera": SceneCamera, "view": SceneShot}

    @property
    def files(self) -> list[Path]:
        """All files to be read."""
        return [path for shot in self.shots for path in (shot.image, shot.depth, shot.flat) if path is not None]

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

    def read(self, shots: list[SceneShot], psf: Psf) -> KnownScene:
        """Read one scene, and estimate its depth with the lens's marks."""
        from focalgradient.depth.recover import recover_depth

        camera = self.camera
        photographs = read_photographs(
            [shot.image for shot in shots], camera.encoding, [shot.flat for shot in shots], crop=True
        )
        focus = camera.body.optical(
            shots[0].focus_distance_m, camera.focus_from or camera.distances_from or "entrance_pupil"
        )
        lenses = [Lens(camera.focal_length_mm * 1e-3, shot.f_number, focus) for shot in shots]
        views = []
        for photograph, lens in zip(photographs, lenses, strict=True):
            throw = lens.focal_length if camera.telecentric else lens.sensor_distance
            angle = camera.pixel_pitch_um * 1e-6 * photograph.binning / throw
            views.append(View(photograph.luminance, lens, angle, mask=photograph.mask))
        distance = read_distances(shots[0].depth, camera.depth_unit, scale=camera.depth_step, fill=False).metres
        if distance.shape != views[0].shape:
            sizes = [f"{shape[1]} x {shape[0]}" for shape in (distance.shape, views[0].shape)]
            raise InputError(
                f"{printable(shots[0].depth)} is {sizes[0]} pixels, but {printable(shots[0].image)} is {sizes[1]}: "
                "bring the depth into the photograph's frame."
            )
        beyond = float(np.nanmedian(distance)) > focus
        near, far = (focus, None) if beyond else (None, focus)
        try:
            depth = recover_depth(even_out(views), near=near, far=far, psf=psf, align=True)
        except InputError as error:
            raise UnusableSceneError(f"{printable(shots[0].depth)}: {error}") from error
        step = camera.depth_step * 1e-3 if camera.depth_unit == "mm" else 0.0
        return KnownScene(depth, views, distance, step)

    def fit(self, scenes: list[KnownScene], psf: Psf) -> SceneFit:
        """Fit the camera to scenes that were read."""
        camera, shots = self.camera, self.scenes[0]
        return fit_scenes(
            scenes,
            camera.focal_length_mm * 1e-3,
            camera.pixel_pitch_um * 1e-6,
            [shot.f_number for shot in shots],
            shots[0].focus_distance_m,
            self.priors,
            psf,
        )


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
    try:
        with given_as(KEYS):
            known.scenes  # noqa: B018  raises if the scenes are inconsistent
            for shot in known.shots:
                Lens(known.camera.focal_length_mm * 1e-3, shot.f_number, shot.focus_distance_m)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return known
