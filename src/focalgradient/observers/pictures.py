"""Picture sets and their encoded stimuli, computed once and cached; observers add their own noise."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from focalgradient.dataset import check_stimuli
from focalgradient.design import DepthRatingDesign, DepthTrial
from focalgradient.design.depth_rating import EXAMPLES
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import printable, read_arrays, write_whole
from focalgradient.observers.answers import EncodedPictures, PictureKey
from focalgradient.observers.encoding import EncodedStimulus, encode
from focalgradient.parallel import in_order
from focalgradient.progress import Progress
from focalgradient.stimuli import StimulusSet, make_depth_rating, read_set

__all__ = [
    "CACHE",
    "cache_folder",
    "check_pictures",
    "encoded_stimuli",
    "kept_stimuli",
    "natural_set",
    "seen_pictures",
    "small_set",
]

CACHE = "FOCALGRADIENT_CACHE"
"""Environment variable that replaces the default cache folder."""

ARRAYS = ("blur", "fixated_blur", "depth", "blur_log_sd")

ENCODING = 3
"""Version of the encoding; cached data of other versions are ignored."""


def cache_folder() -> Path:
    """Return the cache folder: that of the environment variable, else the user's cache folder."""
    given = os.environ.get(CACHE)
    return Path(given) if given else platformdirs.user_cache_path("focalgradient", appauthor=False)


def small_set(scenes: int, progress: Progress | None = None) -> StimulusSet:
    """Return a cached set of small ray-cast pictures of plain spheres, rendered if necessary on any machine."""
    place, display = cache_folder() / f"pictures-{scenes}", Display(pixel_pitch=0.5e-3)
    return make_depth_rating(
        place, scenes=scenes, size=256, display=display, engine="cast", samples=64, progress=progress
    )


def natural_set(scenes: int, progress: Progress | None = None) -> StimulusSet:
    """Return a cached set of path-traced natural scenes, 512 pixels wide; rendering needs Mitsuba and some minutes.

    Raises
    ------
    InputError
        If Mitsuba is not available.
    """
    place, display = cache_folder() / f"natural-{scenes}", Display(pixel_pitch=0.25e-3)
    return make_depth_rating(
        place, scenes=scenes, size=512, display=display, engine="path", samples=64, progress=progress
    )


def encoded_stimuli(
    stimuli: StimulusSet, executor: Executor | None = None, progress: Progress | None = None
) -> EncodedPictures:
    """Encode every picture of a set, fixating the object in focus; cached by the hash of the set's manifest.

    Parameters
    ----------
    stimuli
        Picture set.
    executor
        Executor that encodes several pictures at once and can read the set's folder. None: this process.
    progress
        Function called with the completed fraction, 0 to 1, and a description of the work.

    Raises
    ------
    InputError
        If the set does not match its manifest, or the cache cannot be written.
    """
    place = cache_folder() / f"encoded-{ENCODING}-{check_stimuli(stimuli.folder).sha256[:16]}.npz"
    keys: list[PictureKey] = [(picture.scene, picture.aperture, picture.fixation) for picture in stimuli.pictures]

    def encoded() -> list[EncodedStimulus]:
        files: dict[str, list[PictureKey]] = {}
        for picture, key in zip(stimuli.pictures, keys, strict=True):
            files.setdefault(picture.png, []).append(key)
        by_key: dict[PictureKey, EncodedStimulus] = {}
        found = in_order(executor, _encode, [(stimuli.folder, shown) for shown in files.values()])
        for number, (shown, of_file) in enumerate(zip(files.values(), found, strict=True), start=1):
            by_key.update(zip(shown, of_file, strict=True))
            if progress is not None:
                progress(number / len(files), "encoding pictures")
        return [by_key[key] for key in keys]

    stored = kept_stimuli(place, len(keys), encoded)
    files = [picture.png for picture in stimuli.pictures]
    return dict(zip(keys, zip(files, stored, strict=True), strict=True))


def _encode(job: tuple[Path, list[PictureKey]]) -> list[EncodedStimulus]:
    """Encode one file, once for each fixated object in it."""
    folder, shown = job
    stimuli = read_set(folder)
    picture = stimuli.picture(*shown[0])
    scene = stimuli.scene(picture.scene)
    fixations = [scene.target(end).position_px for _, _, end in shown]
    return encode(stimuli.pixels(picture), stimuli.display, fixations, stimuli.depth(picture.scene))


def kept_stimuli(place: Path, count: int, encoded: Callable[[], Sequence[EncodedStimulus]]) -> list[EncodedStimulus]:
    """Return the encoded stimuli that a file of the cache keeps; else those of `encoded`, which are kept in it."""
    arrays = _kept(place, count)
    if arrays is None:
        stimuli = encoded()
        arrays = {name: np.array([getattr(stimulus, name) for stimulus in stimuli]) for name in ARRAYS}
        _keep(arrays, place)
    rows = zip(*(arrays[name] for name in ARRAYS), strict=True)
    return [EncodedStimulus(blur, float(fixated), depth, log_sd) for blur, fixated, depth, log_sd in rows]


def _keep(arrays: Mapping[str, NDArray[Any]], place: Path) -> None:
    """Write arrays to a file atomically."""

    def write(path: Path) -> None:
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)  # type: ignore[arg-type]

    remedy = f"name another folder by {CACHE} in the environment"
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{printable(place.parent)} cannot be made ({error.strerror}): {remedy}.") from error
    write_whole(place, write, remedy=remedy)


def _kept(place: Path, count: int) -> dict[str, NDArray[Any]] | None:
    """Read cached `ARRAYS` of `count` stimuli; None if missing or damaged."""
    try:
        arrays = read_arrays(place, ARRAYS)
    except InputError:
        return None
    is_whole = len(arrays) == len(ARRAYS) and all(
        array.shape[:1] == (count,) and np.issubdtype(array.dtype, np.number) for array in arrays.values()
    )
    return arrays if is_whole and arrays["fixated_blur"].shape == (count,) else None


def check_pictures(design: DepthRatingDesign, stimuli: StimulusSet) -> None:
    """Raise `InputError` unless a set contains every picture of the design with the same aperture.

    Raises
    ------
    InputError
        The message names the first missing or differing picture.
    """
    if design.picture_factors:
        raise InputError(
            f"factors names {design.picture_factors[0]!r}, whose levels are pictures, which simulated observers do not "
            "look at: leave it out, or set pictures = false."
        )
    stimuli.picture(design.standard_scene, "pinhole", design.fixations[0])
    for trial in design.trials("01"):
        assert isinstance(trial, DepthTrial)
        if trial.scene in EXAMPLES.values():
            continue  # a drawing, which is not in the set
        picture = stimuli.picture(trial.scene, trial.aperture, trial.fixation)
        if abs(picture.aperture_mm - trial.aperture_mm) > 0.01:
            raise InputError(
                f"{trial.aperture} is {picture.aperture_mm:.3g} mm in {stimuli.folder}, but {trial.aperture_mm:.3g} mm "
                "in the design: make its focal_length_mm that of the pictures."
            )


def seen_pictures(
    design: DepthRatingDesign, folder: Path | None, executor: Executor | None, progress: Progress
) -> dict[str, Any]:
    """Return the stimuli of rating observers: arguments `encoded` and `stimuli` of `simulate`.

    Parameters
    ----------
    design
        Design of the experiment.
    folder
        Folder of the pictures; None: small ones are rendered.
    executor
        Executor that encodes the pictures; None: this process.
    progress
        Function called with the completed fraction and a description of the work.

    Raises
    ------
    InputError
        If a picture of the design is missing.
    """
    pictures = read_set(folder) if folder is not None else small_set(_scenes(design), progress)
    check_pictures(design, pictures)
    return {"encoded": encoded_stimuli(pictures, executor, progress), "stimuli": pictures.folder}


def _scenes(design: DepthRatingDesign) -> int:
    """Return the number of scenes that the small set needs; the design's scenes must be named spheres-NN."""
    names = {*design.scenes, design.standard_scene}
    numbers = [name.removeprefix("spheres-") for name in names]
    if not all(number.isdigit() and len(number) == 2 for number in numbers):
        raise InputError(
            "the design has scenes of other names than spheres-00 to spheres-99, which are not made here: give the "
            "folder of their pictures."
        )
    return max(map(int, numbers)) + 1
