"""Stimuli of the depth-rating task: scenes that differ between conditions only in the focal gradient.

Each scene is viewed through a pinhole and three apertures, with its nearest or its farthest object in focus. All
pictures of a scene share one camera, one exposure and one set of rays, and differ only in where the lens focuses them.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import FocalGradientWarning, InputError, check_one_of
from focalgradient.eye.chromatic import PRIMARIES_NM, chromatic_difference
from focalgradient.files import read_array
from focalgradient.optics import Aperture
from focalgradient.parallel import completed
from focalgradient.progress import Progress, part_of, silent
from focalgradient.render import render, render_bands
from focalgradient.render.mitsuba_backend import REMEDY, variant
from focalgradient.render.rendered import LUMINANCE, Rendered
from focalgradient.scenes import Mark, Scene, Sphere, scene, spheres
from focalgradient.stimuli.controls import Sharp, against_prediction
from focalgradient.stimuli.folder import Folder, versions_of
from focalgradient.stimuli.sets import (
    FIXATIONS,
    Fixation,
    StimulusSet,
    add_picture,
    begin_set,
    disc_ends,
    finish_set,
    npy,
    picture_files,
    scene_entry,
    stem_of,
)
from focalgradient.stimuli.sharpness import sharpest

__all__ = ["APERTURES", "make_depth_rating"]

FOCAL_LENGTH = 0.050  # focal length (m)
F_NUMBERS = (22.0, 11.0, 5.6)
APERTURES: dict[str, float] = {"pinhole": math.inf} | {f"f/{number:g}": number for number in F_NUMBERS}
FIELD = 0.35  # width of the picture as a tangent
REFERENCE = PRIMARIES_NM[1]  # wavelength in focus (nm): green contributes most of the luminance
LEAST_DEPTH = 1.15  # minimum difference between nearest and farthest object over all seeds (D)
MOST_SCENES = 100

Engine = Literal["auto", "path", "shaded", "cast"]


def make_depth_rating(
    out: str | Path,
    *,
    seed: int = 0,
    scenes: int = 13,
    size: int = 512,
    display: Display | None = None,
    engine: Engine = "auto",
    samples: int = 256,
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
    out, display, say = Path(out), display or Display(), progress or silent
    _check(seed, scenes, size, samples, display)
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
    folder = begin_set(out, display, (size, size), parameters, seed=seed, versions=_versions(how))
    if not folder.complete:
        recipes = {
            f"spheres-{index:02}": Recipe(MOST_SCENES * seed + index, (size, size), how, samples, chromatic, lenses)
            for index in range(scenes)
        }
        _make_scenes(folder, recipes, display, executor, say)
    return finish_set(folder, say, display)


def named_apertures(numbers: Sequence[float]) -> dict[str, float]:
    """Return the pinhole and the f-numbers by the names used in designs, smallest aperture first.

    Raises
    ------
    InputError
        If there is none, or one is not from 0.5 to 1000, or occurs twice.

    Examples
    --------
    >>> named_apertures([4, 8, 5.6])
    {'pinhole': inf, 'f/8': 8.0, 'f/5.6': 5.6, 'f/4': 4.0}
    """
    values = [float(number) for number in numbers]
    if not values or not all(0.5 <= value <= 1000 for value in values):
        raise InputError(f"apertures is {list(numbers)}, but must be f-numbers from 0.5 to 1000, like 16, 8 and 4.")
    found = {f"f/{value:g}": value for value in sorted(values, reverse=True)}
    if len(found) < len(values):
        raise InputError(f"apertures is {list(numbers)}, but must contain each f-number once: remove the duplicate.")
    return {"pinhole": math.inf} | found


@dataclass(frozen=True, slots=True)
class Recipe:
    """Rendering parameters of one scene."""

    seed: int
    shape: tuple[int, int]
    engine: Engine
    samples: int
    chromatic: bool
    apertures: Mapping[str, float]

    @property
    def pixel_angle(self) -> float:
        """Pixel angle of the camera in radians."""
        return FIELD / self.shape[1]

    def world(self) -> Scene:
        """Return the scene."""
        return _plain(self.seed) if self.engine == "cast" else scene("spheres", self.seed)

    def finer(self) -> Recipe:
        """Return the recipe at twice the resolution and the same total number of rays."""
        height, width = self.shape
        return replace(self, shape=(2 * height, 2 * width), samples=max(2, self.samples // 4))

    def optics(self, aperture: str, focus: float) -> tuple[Aperture, ...]:
        """Return the optics of an aperture focused at `focus` (D): one for all light, or one each for R, G and B."""
        diameter = FOCAL_LENGTH / self.apertures[aperture]
        if not self.chromatic or diameter == 0:
            return (Aperture(diameter, focus),)
        # Light that is refracted less is focused at a smaller vergence.
        return tuple(
            Aperture(diameter, focus - less) for less in chromatic_difference(PRIMARIES_NM, REFERENCE).tolist()
        )

    def render(
        self, world: Scene, optics: Sequence[Aperture], progress: Progress
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.float32]]:
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


def _residual(rendered: Rendered) -> NDArray[np.float32]:
    assert rendered.residual is not None  # every engine halves its samples
    return rendered.residual


@dataclass(frozen=True, slots=True)
class _Scene:
    """Inputs of the pictures of a scene, and measures of those already made.

    `lacking` are the file stems of the pictures to make. `white` is None until the pinhole picture is
    made.
    """

    name: str
    recipe: Recipe
    display: Display
    lacking: tuple[str, ...]
    white: float | None
    versions: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class _Made:
    """A picture: its files and measures, the record of its scene, and the scene's white."""

    stem: str
    files: Mapping[str, bytes]
    measured: dict[str, Any]
    scene: dict[str, Any]
    white: float


def _conditions(recipe: Recipe) -> dict[str, tuple[str, Fixation]]:
    """Return aperture and fixation by file stem; the pinhole picture comes first and serves both fixations."""
    return {stem_of(aperture, end): (aperture, end) for end in FIXATIONS for aperture in recipe.apertures}


def _files(name: str, stem: str) -> list[str]:
    """Return the files of a picture; the scene's depth belongs to the pinhole picture."""
    return [f"{name}/{stem}.{kind}" for kind in ("png", "npy")] + [f"{name}/depth.npy"] * (stem == "pinhole")


def _scene_to_make(folder: Folder, name: str, recipe: Recipe, display: Display) -> _Scene:
    known = folder.content["controls"]["scenes"].get(name, {"pictures": {}})
    held = known["pictures"]
    lacking = [stem for stem in _conditions(recipe) if stem not in held or not folder.has(*_files(name, stem))]
    if not lacking and name not in folder.content["scenes"]:
        lacking = ["pinhole"]
    return _Scene(name, recipe, display, tuple(lacking), known.get("white"), folder.versions)


def _pictures(scene: _Scene, progress: Progress) -> Iterator[_Made]:
    """Make the missing pictures of a scene."""
    recipe, name, display = scene.recipe, scene.name, scene.display
    if _versions(recipe.engine) != scene.versions:
        raise InputError(
            "a worker has other program versions than this process, so that its pictures would differ: install "
            "the same versions everywhere."
        )
    progress(0.0, f"{name} modelling")
    world = recipe.world()
    targets = {end: _target(world.mark(end), recipe) for end in FIXATIONS}
    entry = scene_entry(targets, f"{name}/depth.npy", recipe.seed)
    white = scene.white
    sharp: Sharp | None = None
    conditions = _conditions(recipe)
    for number, stem in enumerate(scene.lacking):
        aperture, end = conditions[stem]
        share = _part(progress, number / len(scene.lacking), (number + 1) / len(scene.lacking), f"{name} {stem}")
        optics = recipe.optics(aperture, 1 / world.mark(end).distance)
        radiance, depth, residual = recipe.render(world, optics, share)
        if aperture == "pinhole":
            white = float(radiance.max())  # blurring only averages, so that, except for noise, nothing is brighter
        assert white is not None  # the pinhole comes first
        light = (radiance / white).astype(np.float32)
        luminance = light @ np.array(LUMINANCE)
        mean, noise = float(luminance.mean()), float(np.sqrt(np.mean(residual**2.0)) / white)
        measured: dict[str, Any] = {
            "mean_luminance": mean,
            "noise": noise,
            "noise_steps": noise / display.step(mean),
            "clipped": float(np.mean(light > 1)),
        }
        files = picture_files(f"{name}/{stem}", light, display, recipe.seed)
        if aperture == "pinhole":
            files[f"{name}/depth.npy"] = npy(depth.astype(np.float32))
        else:
            if sharp is None:
                # At a finer resolution, because a pixel at an edge has one depth but the radiance of two surfaces.
                fine = recipe.finer()
                colour, far, noise_of = fine.render(world, recipe.optics("pinhole", 0.0), silent)
                sharp = Sharp(colour / white, noise_of / white, far, fine.pixel_angle)
            measured |= against_prediction(luminance, residual / white, sharp, optics)
            finer = len(sharp.depth) // len(luminance)
            measured |= sharpest(
                *(luminance, sharp.light @ np.array(LUMINANCE), sharp.depth, optics, sharp.pixel_angle),
                finer=finer,
                residual=residual / white,
                unseen=True,
            )
        yield _Made(stem, files, measured, entry, white)


def _all_pictures(scene: _Scene) -> list[_Made]:
    return list(_pictures(scene, silent))


def _made(executor: Executor | None, scenes: Sequence[_Scene], say: Progress) -> Iterator[tuple[_Scene, _Made]]:
    """Yield each missing picture as it is made: here one by one, by workers scene by scene."""
    if executor is None:
        for number, scene in enumerate(scenes):
            share = part_of(say, number, len(scenes))
            yield from ((scene, picture) for picture in _pictures(scene, share))
        return
    for done, (number, pictures) in enumerate(completed(executor, _all_pictures, scenes), start=1):
        yield from ((scenes[number], picture) for picture in pictures)
        say(done / len(scenes), f"{scenes[number].name} made")


def _make_scenes(
    folder: Folder, recipes: Mapping[str, Recipe], display: Display, executor: Executor | None, say: Progress
) -> None:
    """Make the missing pictures and depths of all scenes, and their entries in the folder's content."""
    content = folder.content
    lacking = [_scene_to_make(folder, name, recipe, display) for name, recipe in recipes.items()]
    for made, picture in _made(executor, [one for one in lacking if one.lacking], say):
        known = content["controls"]["scenes"].setdefault(made.name, {"pictures": {}})
        known["white"] = picture.white
        known["pictures"][picture.stem] = picture.measured
        content["scenes"][made.name] = picture.scene
        folder.put(picture.files)
    # In a fixed order, regardless of the order of completion.
    content["scenes"] = {name: content["scenes"][name] for name in recipes}
    measured = content["controls"]["scenes"]
    content["controls"]["scenes"] = {
        name: {
            "pictures": {stem: measured[name]["pictures"][stem] for stem in _conditions(recipe)},
            "white": measured[name]["white"],
        }
        for name, recipe in recipes.items()
    }
    content["pictures"] = []
    for name, recipe in recipes.items():
        depth = read_array(folder.path / name / "depth.npy")
        for end in FIXATIONS:
            for aperture in recipe.apertures:
                focus = content["scenes"][name][end]["distance_m"]
                blur = _blur_ends(recipe, aperture, focus, depth)
                add_picture(
                    *(folder, f"{name}/{stem_of(aperture, end)}", aperture, end),
                    focus_m=focus,
                    aperture_mm=1e3 * FOCAL_LENGTH / recipe.apertures[aperture],
                    blur_px=blur,
                    blur_arcmin=[display.arcmin(diameter) for diameter in blur],
                )


def _blur_ends(recipe: Recipe, aperture: str, focus: float, depth: NDArray[np.float32]) -> list[float]:
    """Return the smallest and the largest blur disc (px) in all colours, over the whole range of depth."""
    ends = np.array([depth.min(), depth.max()], float)
    discs = []
    for one in recipe.optics(aperture, 1 / focus):
        least, most = disc_ends(one, ends, recipe.pixel_angle)
        discs += [0.0 if 1 / ends[1] <= one.focus_vergence <= 1 / ends[0] else least, most]
    return [min(discs), max(discs)]


def _target(mark: Mark, recipe: Recipe) -> tuple[tuple[float, float], float]:
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


def _part(progress: Progress, start: float, end: float, what: str) -> Progress:
    return lambda done, words: progress(start + (end - start) * done, what)


def _engine(engine: str) -> Engine:
    """Return the engine to use: without Mitsuba the ray caster, unless another was requested."""
    check_one_of("engine", engine, get_args(Engine))
    if engine == "cast":
        return "cast"
    if variant() is None:
        if engine != "auto":
            raise InputError(f"Mitsuba, which engine {engine!r} needs, cannot be used here: {REMEDY}.")
        warnings.warn(
            "Mitsuba cannot be used here, so that plain spheres are ray cast instead of naturalistic scenes: "
            f"{REMEDY}.",
            FocalGradientWarning,
            stacklevel=3,
        )
        return "cast"
    return "shaded" if engine == "shaded" else "path"


def _versions(engine: Engine) -> dict[str, str]:
    versions = versions_of("focalgradient", "numpy", "pillow", "numba" if engine == "cast" else "mitsuba")
    return versions if engine == "cast" else {**versions, "mitsuba variant": str(variant())}


def _check(seed: int, scenes: int, size: int, samples: int, display: Display) -> None:
    """Validate the numbers of a set."""
    for name, value, least in (("seed", seed, 0), ("scenes", scenes, 1), ("size", size, 16), ("samples", samples, 2)):
        if not (isinstance(value, int) and value >= least):
            raise InputError(f"{name} is {value!r}, but must be a whole number of {least} or more.")
    if scenes > MOST_SCENES:
        raise InputError(f"scenes is {scenes}, but a set has at most {MOST_SCENES}: make a second set of another seed.")
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
