"""Looks at all pictures of a set, taken once and kept: observers add their own noise to them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import printable, read_arrays, write_whole
from focalgradient.observers.answers import Seen, Shown
from focalgradient.observers.look import Look, look_at
from focalgradient.stimuli import StimulusSet, make_depth_rating, read_set

__all__ = ["CACHE", "cache_folder", "looks", "small_set"]

CACHE = "FOCALGRADIENT_CACHE"
"""Environment variable that names another folder for what is made once and kept."""

ARRAYS = ("blur", "fixated_blur", "depth")

READING = 1
"""Version of how pictures are read: what another version has kept is not used."""


def cache_folder() -> Path:
    """Where what can be made again is kept: the user's cache folder, unless the environment names another."""
    if given := os.environ.get(CACHE):
        return Path(given)
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "focalgradient"


def small_set(scenes: int, progress: Callable[[float, str], object] | None = None) -> StimulusSet:
    """A set of small pictures of plain spheres, made once and kept; ray cast, so that every machine can make it."""
    return make_depth_rating(
        cache_folder() / f"pictures-{scenes}",
        scenes=scenes,
        size=256,
        display=Display(pixel_pitch=0.5e-3),
        engine="cast",
        samples=64,
        progress=progress,
    )


def looks(
    stimuli: StimulusSet, executor: Executor | None = None, progress: Callable[[float], object] | None = None
) -> Seen:
    """Look at every picture of a set, fixating what it has in focus; kept by the hash of the set's manifest.

    Parameters
    ----------
    stimuli
        The set.
    executor
        Where several pictures are looked at at once; it must be able to read the set's folder. None: here.
    progress
        Called with the share done, 0 to 1.

    Raises
    ------
    InputError
        If the set is not as its manifest says, or the looks cannot be kept.
    """
    kept = cache_folder() / f"looks-{READING}-{check_stimuli(stimuli.folder).sha256[:16]}.npz"
    if (seen := _kept(stimuli, kept)) is not None:
        return seen
    files: dict[str, list[Shown]] = {}
    for picture in stimuli.pictures:
        files.setdefault(picture.png, []).append((picture.scene, picture.aperture, picture.fixation))
    jobs = [(stimuli.folder, shown) for shown in files.values()]
    found: dict[Shown, Look] = {}
    for number, (shown, looked) in enumerate(
        zip(files.values(), map(_look, jobs) if executor is None else executor.map(_look, jobs), strict=True), start=1
    ):
        found.update(zip(shown, looked, strict=True))
        if progress is not None:
            progress(number / len(files))
    arrays = _arrays(stimuli, found)
    _keep(arrays, kept)
    return _seen(stimuli, arrays)


def _look(job: tuple[Path, list[Shown]]) -> list[Look]:
    """Look at one file, once for each object that is fixated in it."""
    folder, shown = job
    stimuli = read_set(folder)
    picture = stimuli.picture(*shown[0])
    scene = stimuli.scene(picture.scene)
    fixations = [scene.target("nearest" if end == "nearest" else "farthest").position_px for _, _, end in shown]
    return look_at(stimuli.pixels(picture), stimuli.display, fixations, stimuli.depth(picture.scene))


def _arrays(stimuli: StimulusSet, found: Mapping[Shown, Look]) -> dict[str, NDArray[Any]]:
    """The looks in the order of the set's pictures."""
    ordered = [found[one.scene, one.aperture, one.fixation] for one in stimuli.pictures]
    return {name: np.array([getattr(look, name) for look in ordered]) for name in ARRAYS}


def _keep(arrays: Mapping[str, NDArray[Any]], place: Path) -> None:
    """Write the looks, whole or not at all."""

    def write(path: Path) -> None:
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)  # type: ignore[arg-type]

    remedy = f"name another folder by {CACHE} in the environment"
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{printable(place.parent)} cannot be made ({error.strerror}): {remedy}.") from error
    write_whole(place, write, remedy=remedy)


def _kept(stimuli: StimulusSet, place: Path) -> Seen | None:
    """Looks as they are kept: the same numbers whether just taken or long ago; None for none, or damaged ones."""
    try:
        arrays = read_arrays(place, ARRAYS)
    except InputError:
        return None
    count = len(stimuli.pictures)
    sound = len(arrays) == len(ARRAYS) and all(
        array.shape[:1] == (count,) and np.issubdtype(array.dtype, np.number) for array in arrays.values()
    )
    return _seen(stimuli, arrays) if sound and arrays["fixated_blur"].ndim == 1 else None


def _seen(stimuli: StimulusSet, arrays: Mapping[str, NDArray[Any]]) -> Seen:
    blur, fixated, depth = (arrays[name] for name in ARRAYS)
    return {
        (one.scene, one.aperture, one.fixation): (one.png, Look(blur[index], float(fixated[index]), depth[index]))
        for index, one in enumerate(stimuli.pictures)
    }
