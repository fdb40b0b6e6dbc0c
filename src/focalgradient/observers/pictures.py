"""Looks at all pictures of a set, taken once and kept: observers add their own noise to them."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.answers import Seen, Shown
from focalgradient.observers.look import Look, look_at
from focalgradient.stimuli import StimulusSet, make_depth_rating, read_set

__all__ = ["CACHE", "cache_folder", "looks", "small_set"]

CACHE = "FOCALGRADIENT_CACHE"
"""Environment variable that names another folder for what is made once and kept."""

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
    if kept.exists():
        return _kept(stimuli, kept)
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
    _keep(stimuli, found, kept)
    return _kept(stimuli, kept)


def _look(job: tuple[Path, list[Shown]]) -> list[Look]:
    """Look at one file, once for each object that is fixated in it."""
    folder, shown = job
    stimuli = read_set(folder)
    picture = stimuli.picture(*shown[0])
    scene = stimuli.scene(picture.scene)
    fixations = [scene.target("nearest" if end == "nearest" else "farthest").position_px for _, _, end in shown]
    return look_at(stimuli.pixels(picture), stimuli.display, fixations, stimuli.depth(picture.scene))


def _keep(stimuli: StimulusSet, found: Mapping[Shown, Look], place: Path) -> None:
    """Write the looks in the order of the set's pictures; whole or not at all."""
    ordered = [found[one.scene, one.aperture, one.fixation] for one in stimuli.pictures]
    beside = place.with_name(f".{place.stem}.{os.getpid()}.npz")
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(
            beside,
            blur=np.array([look.blur for look in ordered]),
            fixated_blur=np.array([look.fixated_blur for look in ordered]),
            depth=np.array([look.depth for look in ordered]),
        )
        beside.replace(place)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise InputError(
            f"{place} cannot be written ({error.strerror or error}): name another folder by {CACHE} in the environment."
        ) from error


def _kept(stimuli: StimulusSet, place: Path) -> Seen:
    """Looks as they are kept: the same numbers whether just taken or long ago."""
    with np.load(place) as arrays:
        blur, fixated, depth = (arrays[name] for name in ("blur", "fixated_blur", "depth"))
    return {
        (one.scene, one.aperture, one.fixation): (one.png, Look(blur[index], float(fixated[index]), depth[index]))
        for index, one in enumerate(stimuli.pictures)
    }
