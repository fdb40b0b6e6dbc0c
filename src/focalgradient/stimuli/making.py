"""Making of a set, scene by scene and picture by picture, resumed where it was interrupted.

What differs between kinds of sets is a `Recipe`: which pictures a scene has, how they are made and measured, and what
the manifest states of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import read_array
from focalgradient.optics import Aperture
from focalgradient.parallel import completed
from focalgradient.progress import Progress, part_of, silent
from focalgradient.stimuli.controls import AGAIN, judged, refuse_seams
from focalgradient.stimuli.folder import Folder, versions_of
from focalgradient.stimuli.sets import (
    FIXATIONS,
    Fixation,
    StimulusSet,
    Targets,
    display_json,
    npy,
    picture_entry,
    png_of,
    read_set,
    scene_entry,
    stem_of,
    stored_distance,
)
from focalgradient.stimuli.sheet import sheet_note, sheet_png

__all__ = ["FOCAL_LENGTH", "F_NUMBERS", "Depth", "Entry", "Recipe", "Series", "make_set", "named_apertures"]

FOCAL_LENGTH = 0.050  # focal length (m)
F_NUMBERS = (22.0, 11.0, 5.6)


Entry = Mapping[str, Any]
"""Entry of a scene or a picture in the manifest, or measures of it."""

Depth = NDArray[np.floating] | None
"""Distances in metres, H x W, if known."""


class Made(NamedTuple):
    """A picture of a recipe: its file stem, contents by file name, and measures; and the entry of its scene."""

    name: str
    stem: str
    files: Mapping[str, bytes]
    measured: Entry
    scene: Entry
    white: float | None


@dataclass(eq=False)
class Recipe:
    """A scene of a set: a subclass makes, measures and lists its pictures. `seed` and `white` are None if unused."""

    name: str
    display: Display
    seed: int | None
    white: float | None = field(init=False, default=None)
    targets: Targets = field(init=False)
    depth: Depth = field(init=False)

    @property
    def stems(self) -> tuple[str, ...]:
        """File stems of all pictures, each once, the pinhole's first."""
        raise NotImplementedError

    def picture(self, stem: str, progress: Progress) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Make a picture: linear radiance (white = 1), H x W x 3, and its measures."""
        raise NotImplementedError

    def listed(self, scene: Entry, depth: Depth) -> Iterator[Entry]:
        """Return the manifest's entry of each picture (`picture_entry`), from that of its scene and the depth."""
        raise NotImplementedError

    def encoded(self, stem: str, light: NDArray[np.float32]) -> bytes:
        """Return a picture as a PNG file for the display."""
        return png_of(self.display.encode(light, self.seed or 0))

    def made(self, lacking: Sequence[str], progress: Progress) -> Iterator[Made]:
        """Make the `lacking` pictures."""
        for number, stem in enumerate(lacking):
            share = partial(_named, part_of(progress, number, len(lacking)), f"{self.name} {stem}")
            light, measured = self.picture(stem, share)
            share(1.0, "")
            own = f"{self.name}/{stem}"
            files = {f"{own}.png": self.encoded(stem, light), f"{own}.npy": npy(light)}
            depth = None
            if self.depth is not None:
                depth = f"{self.name}/depth.npy"
                files[depth] = npy(stored_distance(self.depth, self.name))
            yield Made(self.name, stem, files, measured, scene_entry(self.targets, depth, self.seed), self.white)


def _named(progress: Progress, what: str, done: float, words: str) -> None:
    progress(done, what)


def _all_made(job: tuple[Recipe, Sequence[str]]) -> list[Made]:
    return list(job[0].made(job[1], silent))


def _made(executor: Executor | None, jobs: Sequence[tuple[Recipe, Sequence[str]]], say: Progress) -> Iterator[Made]:
    """Yield each missing picture as it is made: here one by one, by workers scene by scene."""
    if executor is None:
        for number, (recipe, lacking) in enumerate(jobs):
            yield from recipe.made(lacking, part_of(say, number, len(jobs)))
        return
    for done, (number, pictures) in enumerate(completed(executor, _all_made, jobs), start=1):
        yield from pictures
        say(done / len(jobs), f"{jobs[number][0].name} made")


def make_set(
    out: str | Path,
    display: Display,
    shape: tuple[int, int],
    parameters: dict[str, Any],
    recipes: Iterable[Recipe],
    progress: Progress | None,
    *,
    executor: Executor | None = None,
    seed: int | None = None,
    versions: Mapping[str, str] | None = None,
    sheet: bool = False,
    remedy: str = AGAIN,
) -> StimulusSet:
    """Make, resume or return a set of pictures of a `shape` (height, width).

    Measures mean luminance relative to the pinhole picture of each scene that has one, judges the controls of all
    blurred pictures, and draws the contact sheet if `sheet`. There is one recipe for each scene; they are not iterated
    where the set is finished. `versions` are those of the programs by which a set that is resumed must be finished;
    None: of those that all need. `remedy` is as for `refuse_seams`.

    Raises
    ------
    InputError
        If the folder contains something else, or a picture is sharper than its blur allows.
    """
    height, width = shape
    size = {"picture_px": [width, height], "picture_deg": [display.degrees(width), display.degrees(height)]}
    settings = {"set": "depth-rating", "seed": seed, "parameters": size | parameters, "display": display_json(display)}
    folder = Folder(Path(out), settings, versions or versions_of("focalgradient", "numpy", "pillow"))
    say = progress or silent
    if not folder.complete:
        folder.content = {"scenes": {}, "pictures": [], "controls": {"scenes": {}}} | folder.content
        _make_scenes(folder, list(recipes), executor, say)
        controls = folder.content["controls"]
        measured = [scene["pictures"] for scene in controls["scenes"].values()]
        for stems in measured:
            sharp = next((one for stem, one in stems.items() if stem.startswith("pinhole")), {"mean_luminance": 0.0})
            for one in stems.values() if sharp["mean_luminance"] > 0 else ():
                if one is not sharp:
                    one["mean_luminance_percent"] = 100 * (one["mean_luminance"] / sharp["mean_luminance"] - 1)
        refuse_seams(controls["scenes"], remedy)
        controls |= judged([one for stems in measured for stem, one in stems.items() if stem != "pinhole"])
        if sheet:
            say(1.0, "sheet")
            folder.put({"sheet.png": sheet_png(folder.path, folder.content, sheet_note(controls, display, width))})
        folder.finish()
    say(1.0, "finished")
    return read_set(folder.path)


def _make_scenes(folder: Folder, recipes: Sequence[Recipe], executor: Executor | None, say: Progress) -> None:
    """Make the missing pictures and depths of all scenes, and their entries in the folder's content."""
    scenes, measured = folder.content["scenes"], folder.content["controls"]["scenes"]
    jobs = []
    for recipe in recipes:
        name, known = recipe.name, measured.setdefault(recipe.name, {"pictures": {}})
        recipe.white = known.get("white")
        held = {stem for stem in known["pictures"] if folder.has(f"{name}/{stem}.png", f"{name}/{stem}.npy")}
        lacking = [stem for stem in recipe.stems if stem not in held]
        if not (lacking or (name in scenes and folder.has(*filter(None, [scenes[name]["depth"]])))):
            lacking = [recipe.stems[0]]
        if lacking:
            jobs.append((recipe, lacking))
    for picture in _made(executor, jobs, say):
        known = measured[picture.name]
        known["pictures"][picture.stem] = picture.measured
        known |= {} if picture.white is None else {"white": picture.white}
        scenes[picture.name] = picture.scene
        folder.put({file: data for file, data in picture.files.items() if not folder.has(file)})
    # In a fixed order, regardless of the order of completion.
    folder.content["scenes"] = {recipe.name: scenes[recipe.name] for recipe in recipes}
    folder.content["pictures"] = []
    for recipe in recipes:
        name, scene = recipe.name, scenes[recipe.name]
        known = measured.pop(name)
        measured[name] = known | {"pictures": {stem: known["pictures"][stem] for stem in recipe.stems}}
        depth = read_array(folder.path / scene["depth"]) if scene["depth"] else None
        folder.content["pictures"] += recipe.listed(scene, depth)


@dataclass(eq=False)
class Series(Recipe):
    """Pictures of a scene through each aperture, by name, with its nearest or its farthest object in focus."""

    apertures: Mapping[str, float]
    pixel_angle: float

    @property
    def conditions(self) -> dict[str, tuple[str, Fixation]]:
        """Aperture and fixation by file stem; the pinhole picture comes first and serves both fixations."""
        return {stem_of(aperture, end): (aperture, end) for end in FIXATIONS for aperture in self.apertures}

    @property
    def stems(self) -> tuple[str, ...]:
        """File stems of all pictures, each once, the pinhole's first."""
        return tuple(self.conditions)

    def optics(self, aperture: str, focus: float) -> tuple[Aperture, ...]:
        """Return the optics of an aperture focused at `focus` (D): one for all light, or one each for R, G and B."""
        return (Aperture(FOCAL_LENGTH / self.apertures[aperture], focus),)

    def listed(self, scene: Entry, depth: Depth) -> Iterator[Entry]:
        """Return the manifest's entry of each picture, with the blur at the ends of the scene's depth."""
        assert depth is not None
        near, far = 1 / float(depth.min()), 1 / float(depth.max())
        for end in FIXATIONS:
            focus = scene[end]["distance_m"]
            for aperture, number in self.apertures.items():
                blur = [math.inf, 0.0]
                for one in self.optics(aperture, 1 / focus):
                    at, size = one.focus_vergence, one.aperture_diameter
                    blur[0] = min(blur[0], size * max(at - near, far - at, 0.0) / self.pixel_angle)
                    blur[1] = max(blur[1], size * max(near - at, at - far) / self.pixel_angle)
                yield picture_entry(
                    *(f"{self.name}/{stem_of(aperture, end)}", aperture, end),
                    focus_m=focus,
                    aperture_mm=1e3 * FOCAL_LENGTH / number,
                    blur_px=blur,
                    blur_arcmin=[self.display.arcmin(diameter) for diameter in blur],
                )


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
