"""Stimuli of the depth-rating task: scenes that differ between conditions only in the focal gradient.

Each scene is viewed through a pinhole and three apertures, with its nearest or its farthest object in focus. All
pictures of a scene share one camera, one exposure and one set of rays, and differ only in where the lens focuses them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError, check_one_of, checked, warn
from focalgradient.eye.chromatic import PRIMARIES_NM, chromatic_difference
from focalgradient.optics import Aperture
from focalgradient.progress import Progress, silent
from focalgradient.quantities import Whole
from focalgradient.render import render, render_bands
from focalgradient.render.mitsuba_backend import REMEDY, variant
from focalgradient.render.rendered import LUMINANCE, Rendered
from focalgradient.scenes import Mark, Scene, Sphere, scene, spheres
from focalgradient.stimuli.controls import Sharp, against_prediction
from focalgradient.stimuli.folder import versions_of
from focalgradient.stimuli.making import F_NUMBERS, FOCAL_LENGTH, Series, make_set, named_apertures
from focalgradient.stimuli.sets import FIXATIONS, StimulusSet
from focalgradient.stimuli.sharpness import sharpest

__all__ = ["APERTURES", "make_depth_rating"]

APERTURES: dict[str, float] = {"pinhole": math.inf} | {f"f/{number:g}": number for number in F_NUMBERS}
FIELD = 0.35  # width of the picture as a tangent
REFERENCE = PRIMARIES_NM[1]  # wavelength in focus (nm): green contributes most of the luminance
LEAST_DEPTH = 1.15  # minimum difference between nearest and farthest object over all seeds (D)
MOST_SCENES = 100

Engine = Literal["auto", "path", "shaded", "cast"]


@checked
def make_depth_rating(
    out: str | Path,
    *,
    seed: Annotated[int, Whole(0)] = 0,
    scenes: Annotated[int, Whole(1, MOST_SCENES, remedy="make a second set of another seed")] = 13,
    size: Annotated[int, Whole(16)] = 512,
    display: Display | None = None,
    engine: Engine = "auto",
    samples: Annotated[int, Whole(2)] = 256,
    chromatic: bool = False,
    apertures: Sequence[float] = F_NUMBERS,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> StimulusSet:
    """Make a set of pictures, resume an interrupted one, or verify a finished one.

    Parameters
    ----------
    out
        Output folder of the set.
    seed
        Random seed of the whole set: the same seed gives the same files on the same machine.
    scenes
        Number of scenes.
    size
        Width and height of the pictures in pixels, even.
    display
        Display for which the pictures are made.
    engine
        ``"path"``, ``"shaded"`` or ``"cast"`` as in `focalgradient.render.render`; ``"auto"`` path traces naturalistic
        scenes if Mitsuba is available, and otherwise ray casts plain spheres.
    samples
        Rays per pixel.
    chromatic
        Whether red, green and blue have the different foci of an eye, which makes the sign of defocus visible.
    apertures
        f-numbers of the lens, each once; a pinhole is added.
    executor
        Executor that renders whole scenes; the files do not depend on it. None: this process.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Returns
    -------
    StimulusSet
        The set, as returned by `read_set`.

    Raises
    ------
    InputError
        If a number is out of range, the display cannot resolve the blur, the folder contains another set or cannot be
        written, or Mitsuba is missing for an engine that needs it.
    """
    display = display or Display()
    _check_size(size, display)
    lenses = named_apertures(apertures)
    how = _engine(engine)
    display.check_f_numbers(list(lenses.values()), FOCAL_LENGTH * LEAST_DEPTH / (FIELD / size))
    parameters = {
        "scenes": scenes,
        "scene_kind": "plain spheres" if how == "cast" else "natural",
        "apertures": list(lenses),
        "focal_length_mm": FOCAL_LENGTH * 1e3,
        "engine": how,
        "samples": samples,
        "chromatic": chromatic,
        "lights_nm": list(PRIMARIES_NM) if chromatic else None,
        "camera_field_deg": [math.degrees(2 * math.atan(FIELD / 2))] * 2,
        "natural_viewing_distance_m": size * display.pixel_pitch / FIELD,
        "pixel_angle_rad": FIELD / size,
    }
    shape, versions = (size, size), _versions(how)
    how_made = shape, how, samples, chromatic, versions
    recipes = [
        SpheresRecipe(f"spheres-{n:02}", display, MOST_SCENES * seed + n, lenses, FIELD / size, *how_made)
        for n in range(scenes)
    ]
    return make_set(
        out, display, shape, parameters, recipes, progress, executor=executor, seed=seed, versions=versions, sheet=True
    )


@dataclass(eq=False)
class SpheresRecipe(Series):
    """One scene: its seed, the height and width of its pictures, and how they are rendered, by which versions."""

    seed: int
    shape: tuple[int, int]
    engine: Engine
    samples: int
    chromatic: bool
    versions: Mapping[str, str]

    def optics(self, aperture: str, focus: float) -> tuple[Aperture, ...]:
        """Return the optics of an aperture focused at `focus` (D): one for all light, or one each for R, G and B."""
        (one,) = Series.optics(self, aperture, focus)
        if not self.chromatic or one.aperture_diameter == 0:
            return (one,)
        # Light that is refracted less is focused at a smaller vergence.
        differences = chromatic_difference(PRIMARIES_NM, REFERENCE).tolist()
        return tuple(replace(one, focus_vergence=focus - less) for less in differences)

    def render(
        self, world: Scene, optics: Sequence[Aperture], progress: Progress
    ) -> tuple[NDArray[np.float32], FloatArray, NDArray[np.float32]]:
        """Return radiance, H x W x 3; depth in metres, H x W; and luminance noise, H x W."""
        how: dict[str, Any] = {"engine": self.engine, "samples": self.samples, "seed": self.seed, "progress": progress}
        if len(optics) == 1:
            one = render(world, optics[0], self.shape, self.pixel_angle, **how)
            colour = np.repeat(one.view.image[..., None], 3, axis=2) if one.colour is None else one.colour
            return colour, one.distance, _residual(one)
        bands = render_bands(world, optics, self.shape, self.pixel_angle, **how)
        # Each band's residual is that of full luminance, of which the band is a part.
        residual = sum(weight * _residual(band) for weight, band in zip(LUMINANCE, bands, strict=True))
        return np.stack([band.view.image for band in bands], axis=2), bands[0].distance, np.asarray(residual)

    @cached_property
    def world(self) -> Scene:
        """The scene."""
        return _plain(self.seed) if self.engine == "cast" else scene("spheres", self.seed)

    @cached_property
    def sharp(self) -> Sharp:
        """Pinhole view at twice the resolution: a pixel at an edge has one depth but the radiance of two surfaces."""
        height, width = self.shape
        fine = replace(self, shape=(2 * height, 2 * width), samples=max(2, self.samples // 4))
        fine.pixel_angle /= 2
        colour, far, noise = fine.render(self.world, self.optics("pinhole", 0.0), silent)
        assert self.white is not None  # the pinhole comes first
        return Sharp(colour / self.white, noise / self.white, far, fine.pixel_angle)

    def picture(self, stem: str, progress: Progress) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Render a picture, and measure it relative to that of the pinhole."""
        if _versions(self.engine) != self.versions:
            raise InputError(
                "a worker has other program versions than this process, so that its pictures would differ: install "
                "the same versions everywhere."
            )
        aperture, end = self.conditions[stem]
        self.targets = {end: _target(self.world.mark(end), self) for end in FIXATIONS}
        optics = self.optics(aperture, 1 / self.world.mark(end).distance)
        radiance, self.depth, residual = self.render(self.world, optics, progress)
        if aperture == "pinhole":
            self.white = float(radiance.max())  # blurring only averages, so that, but for noise, nothing is brighter
        assert self.white is not None
        light = (radiance / self.white).astype(np.float32)
        luminance = light @ np.array(LUMINANCE)
        mean, noise = float(luminance.mean()), float(np.sqrt(np.mean(residual**2.0)) / self.white)
        measured: dict[str, Any] = {
            "mean_luminance": mean,
            "noise": noise,
            "noise_steps": noise / self.display.step(mean),
            "clipped": float(np.mean(light > 1)),
        }
        if aperture != "pinhole":
            sharp, residual = self.sharp, residual / self.white
            measured |= against_prediction(luminance, residual, sharp, optics)
            measured |= sharpest(
                *(luminance, sharp.light @ np.array(LUMINANCE), sharp.depth, optics, sharp.pixel_angle),
                finer=len(sharp.depth) // len(luminance),
                residual=residual,
                unseen=True,
            )
        return light, measured


def _residual(rendered: Rendered) -> NDArray[np.float32]:
    assert rendered.residual is not None  # every engine halves its samples
    return rendered.residual


def _target(mark: Mark, recipe: SpheresRecipe) -> tuple[tuple[float, float], float]:
    row, column = mark.pixel(recipe.shape, recipe.pixel_angle)  # from the middle of the first pixel
    return (column + 0.5, row + 0.5), mark.distance


def _plain(seed: int) -> Scene:
    """Return spheres in a room, for the ray caster, with marks on the nearest and the farthest."""
    made = spheres(seed, field=FIELD)
    balls = sorted((thing for thing in made.objects if isinstance(thing, Sphere)), key=lambda ball: ball.centre[2])
    marks = []
    for name, ball in (("nearest", balls[0]), ("farthest", balls[-1])):
        x, y, z = (part * (1 - ball.radius / math.hypot(*ball.centre)) for part in ball.centre)
        marks.append(Mark(name, (x, y, z)))
    return replace(made, marks=tuple(marks))


def _engine(engine: str) -> Engine:
    """Return the engine to use: without Mitsuba the ray caster, unless another was requested."""
    check_one_of("engine", engine, get_args(Engine))
    if engine == "cast":
        return "cast"
    if variant() is None:
        if engine != "auto":
            raise InputError(f"Mitsuba, which engine {engine!r} needs, cannot be used here: {REMEDY}.")
        warn(
            f"Mitsuba cannot be used here, so that plain spheres are ray cast instead of naturalistic scenes: {REMEDY}."
        )
        return "cast"
    return "shaded" if engine == "shaded" else "path"


def _versions(engine: Engine) -> dict[str, str]:
    versions = versions_of("focalgradient", "numpy", "pillow", "numba" if engine == "cast" else "mitsuba")
    return versions if engine == "cast" else {**versions, "mitsuba variant": str(variant())}


def _check_size(size: int, display: Display) -> None:
    """Validate the width and height of a set's pictures."""
    if size % 2:
        raise InputError(
            f"size is {size}, but must be even, as displays interpolate centred pictures of odd size: use {size + 1}."
        )
    if size > min(display.size_px):
        width, height = display.size_px
        raise InputError(
            f"size is {size}, but pictures must fit the display of {width} x {height} pixels: use {min(width, height)}"
            " or less, or another display."
        )
