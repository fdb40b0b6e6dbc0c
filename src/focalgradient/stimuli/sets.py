"""Finished sets of pictures, and what all makers of sets share."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from focalgradient.display import Display
from focalgradient.errors import InputError, check_one_of
from focalgradient.files import inner_name, read_array, read_bytes, read_json
from focalgradient.photographs.pictures import png_of
from focalgradient.stimuli.blurred_scene import blurred_scene
from focalgradient.stimuli.controls import LIMITS
from focalgradient.stimuli.drawings import DRAWINGS, example_picture, noise_mask
from focalgradient.stimuli.folder import MANIFEST
from focalgradient.stimuli.manifest import Fixation, Manifest, Picture, StoredDisplay, Target
from focalgradient.tables import check_table

__all__ = [
    "FIXATIONS",
    "Fixation",
    "Picture",
    "ShownScene",
    "StimulusSet",
    "Target",
    "Targets",
    "check_size",
    "display_json",
    "npy",
    "picture_entry",
    "png_of",
    "read_set",
    "scene_entry",
    "stem_of",
    "stored_display",
    "stored_distance",
]

FIXATIONS: tuple[Fixation, ...] = ("nearest", "farthest")
"""Fixated objects that every scene with depth has."""

LARGEST_PICTURE = 256 << 20
"""Maximum size of a picture file in bytes: an 8-bit PNG of the largest display has some 100 MB."""


@dataclass(frozen=True, slots=True)
class ShownScene:
    """A scene of the set: its seed and depth file (None if it has none), and its fixated objects."""

    name: str
    seed: int | None
    depth: str | None
    targets: Mapping[Fixation, Target]

    @property
    def nearest(self) -> Target:
        """The nearest object."""
        return self.target("nearest")

    @property
    def farthest(self) -> Target:
        """The farthest object."""
        return self.target("farthest")

    def target(self, fixation: Fixation) -> Target:
        """Return the fixated object; `InputError` if the scene has none of that name."""
        check_one_of(f"fixation of scene {self.name}", fixation, self.targets)
        return self.targets[fixation]


@dataclass(frozen=True, slots=True, eq=False)
class StimulusSet:
    """A finished set of pictures in a folder.

    Parameters
    ----------
    folder
        Path of the folder.
    manifest
        Content of its manifest.
    display
        Display for which the pictures are made.
    pictures
        Pictures, each listed once per fixation.
    """

    folder: Path
    manifest: Mapping[str, Any]
    display: Display
    pictures: tuple[Picture, ...]

    @property
    def scenes(self) -> tuple[str, ...]:
        """Names of the scenes."""
        return tuple(self.manifest["scenes"])

    def summary(self) -> dict[str, Any]:
        """Return the scenes, number of pictures, and worst value and limit of each control, as plain JSON."""
        keys = ("worst", "limit", "met")
        controls = {name: one for name, one in self.manifest["controls"].items() if name in LIMITS}
        return {
            "scenes": list(self.scenes),
            "pictures": len({one.png for one in self.pictures}),
            "controls": {name: {key: controls[name][key] for key in keys} for name in LIMITS if name in controls},
        }

    def scene(self, name: str) -> ShownScene:
        """Return the named scene; `InputError` if there is none."""
        known = self.manifest["scenes"]
        check_one_of(f"scene of the set in {self.folder}", name, known)
        entry = known[name]
        ends = {end: entry[end] for end in ("nearest", "farthest") if entry.get(end)} | entry.get("targets", {})
        targets = {end: Target.model_validate(one) for end, one in ends.items()}
        return ShownScene(name, entry["seed"], entry["depth"], targets)

    def picture(self, scene: str, aperture: str, fixation: str, levels: Mapping[str, str] | None = None) -> Picture:
        """Return the picture of a scene through an aperture with one object in focus; `InputError` if there is none.

        `levels` are a design's factor levels: a column of the pictures' table with a factor's name must match.
        """
        for one in self.pictures:
            if (one.scene, one.aperture, one.fixation) == (scene, aperture, fixation) and one.agrees(levels or {}):
                return one
        raise InputError(
            f"the set in {self.folder} has no picture of {scene!r} through {aperture!r} with {fixation!r} in focus: it "
            f"has the scenes {', '.join(self.scenes)}, each through "
            f"{', '.join(dict.fromkeys(one.aperture for one in self.pictures))}, with "
            f"{', '.join(dict.fromkeys(one.fixation for one in self.pictures))} in focus."
        )

    def check(self, needed: Iterable[tuple[str, str, str, Mapping[str, str]]], factors: Iterable[str]) -> None:
        """Raise `InputError` unless the set has all pictures of a design, and a column for each factor.

        Parameters
        ----------
        needed
            Scene, aperture, fixation and factor levels of each picture, as for `picture`.
        factors
            Names of the factors whose levels are different pictures.

        Raises
        ------
        InputError
            For the first missing picture or factor.
        """
        for scene, aperture, fixation, levels in needed:
            self.picture(scene, aperture, fixation, levels)
        for name in factors:
            if not all(name in one.others for one in self.pictures):
                raise InputError(
                    f"factors names {name!r}, but the pictures in {self.folder} have no such column: import them with "
                    "it, or set pictures = false."
                )

    def drawing(self, scene: str) -> NDArray[np.uint8] | None:
        """Return the named drawing, H x W, in the size of the set's pictures; None for a scene of the set."""
        return example_picture(scene, self.pixels(self.pictures[0]).shape[:2]) if scene in DRAWINGS else None

    def blurred(self, design: Any, scene: str, amount: float) -> NDArray[np.uint8]:
        """Return a scene's pinhole picture with the blur of a threshold's trial (`blurred_scene`)."""
        return blurred_scene(self, design, scene, amount)

    def mask(self, seed: tuple[int, ...]) -> NDArray[np.uint8]:
        """Return a mask of noise, H x W, in the size of the set's pictures."""
        return noise_mask(self.pixels(self.pictures[0]).shape[:2], self.display.pixels_per_degree, seed)

    def pixels(self, picture: Picture) -> NDArray[np.uint8]:
        """Return the 8-bit values of a picture, H x W x 3, after verifying the file's checksum.

        Raises
        ------
        InputError
            If the file cannot be read, or its SHA-256 differs from the manifest's.
        """
        path = self.folder / picture.png
        content = read_bytes(path, "a picture of the set", LARGEST_PICTURE)
        if hashlib.sha256(content).hexdigest() != self.manifest["files"].get(picture.png):
            raise InputError(f"{path} has changed since the manifest was written: make the stimuli again.")
        try:
            with Image.open(io.BytesIO(content), formats=("PNG",)) as image:
                return np.array(image.convert("RGB"))
        except (OSError, SyntaxError) as error:
            raise _lost(path) from error

    def linear(self, picture: Picture) -> NDArray[np.float32]:
        """Return the linear radiance of a picture, H x W x 3 (red, green, blue); 1 is the display's white."""
        return self._array(picture.linear)

    def depth(self, scene: str) -> NDArray[np.float32]:
        """Return the distance in metres along the camera's axis of each pixel of a scene, H x W; ``inf`` for sky.

        Raises
        ------
        InputError
            If the set has no depth for that scene, or its file cannot be read.
        """
        name = self.scene(scene).depth
        if name is None:
            raise InputError(
                f"the set in {self.folder} has no depth of {scene!r}: give the column depth when its pictures are "
                "imported."
            )
        return self._array(inner_name(name, f"{self.folder / MANIFEST}: a file's name"))

    def _array(self, name: str) -> NDArray[np.float32]:
        try:
            return np.asarray(read_array(self.folder / name), np.float32)
        except (InputError, ValueError) as error:
            raise _lost(self.folder / name) from error


def read_set(folder: str | Path) -> StimulusSet:
    """Read a finished set of pictures; `focalgradient.dataset.check_stimuli` verifies its files.

    Raises
    ------
    InputError
        If there is no finished set in the folder.
    """
    folder = Path(folder)
    path = folder / MANIFEST
    remedy = "make it with 'focalgradient stimuli depth-rating' or 'focalgradient stimuli import'"
    try:
        manifest = read_json(path, "a manifest of stimuli")
    except InputError as error:
        why = str(error).rpartition(": ")[0]
        raise InputError(f"{why}, so that {folder} contains no finished set: {remedy}.") from error
    if not isinstance(manifest, dict) or manifest.get("set") != "depth-rating":
        raise InputError(f"{path} is not the manifest of a depth-rating set: {remedy}.")
    checked = check_table(str(path), manifest, Manifest)
    for name in (name for one in checked.pictures for name in (one.png, one.linear)):
        inner_name(name, f"{path}: a file's name")
    return StimulusSet(folder, manifest, stored_display(checked.display), tuple(checked.pictures))


def check_size(
    what: str, shape: tuple[int, int], display: Display, first: tuple[int, int] | None = None
) -> tuple[int, int]:
    """Return the `shape` (height, width) of the `first` picture; raise `InputError` unless another has it and fits.

    >>> check_size("yard", (100, 101), Display())
    Traceback (most recent call last):
    focalgradient.errors.InputError: yard has 101 x 100 pixels, but both must be even, as displays interpolate ...
    """
    height, width = shape
    first = first or shape
    has = f"{what} has {width} x {height} pixels, but"
    if shape != first:
        raise InputError(f"{has} those before it {first[1]} x {first[0]}: crop all pictures to one size.")
    if width % 2 or height % 2:
        raise InputError(
            f"{has} both must be even, as displays interpolate centred pictures of odd size: crop it, and its depth, "
            f"to {width - width % 2} x {height - height % 2}."
        )
    if width > display.size_px[0] or height > display.size_px[1]:
        raise InputError(
            f"{has} the display {display.size_px[0]} x {display.size_px[1]}: make it smaller, or use another display."
        )
    return first


def stem_of(aperture: str, end: Fixation) -> str:
    """Return the stem of a picture's files; the pinhole picture serves all fixations."""
    return "pinhole" if aperture == "pinhole" else f"{aperture.replace('/', '')}-{end}"


Targets = Mapping[Fixation, tuple[Sequence[float], float | None]]
"""Position (px) and distance (m, None if unknown) of each fixated object."""


def scene_entry(targets: Targets, depth: str | None, seed: int | None = None) -> dict[str, Any]:
    """Return the manifest's entry of a scene with a `depth` file."""
    entry: dict[str, Any] = {"seed": seed, "depth": depth}
    for end, (position, metres) in targets.items():
        place = entry if end in FIXATIONS else entry.setdefault("targets", {})
        place[end] = {"name": end, "distance_m": metres, "position_px": list(position)}
    return entry


def picture_entry(
    stem: str,
    aperture: str,
    fixation: Fixation,
    *,
    focus_m: float | None,
    aperture_mm: float,
    blur_px: Sequence[float | None] = (None, None),
    blur_arcmin: Sequence[float | None] = (None, None),
    **others: Any,
) -> dict[str, Any]:
    """Return the manifest's entry of a picture, whose files are `stem`.png and `stem`.npy."""
    return {
        "scene": stem.partition("/")[0],
        "aperture": aperture,
        "fixation": fixation,
        "png": f"{stem}.png",
        "linear": f"{stem}.npy",
        "focus_m": focus_m,
        "aperture_mm": aperture_mm,
        "blur_px": blur_px,
        "blur_arcmin": blur_arcmin,
        **others,
    }


def display_json(display: Display) -> dict[str, Any]:
    """Return a display as plain JSON with units in the key names."""
    return {
        "kind": "sRGB" if display.gamma == "sRGB" else "gamma",
        "gamma": list(display.gamma) if isinstance(display.gamma, tuple) else display.gamma,
        "bits": 8,
        "dither": display.dither,
        "white_cd_m2": display.white,
        "size_px": list(display.size_px),
        "size_deg": list(display.size_deg),
        "pixel_pitch_mm": display.pixel_pitch * 1e3,
        "distance_m": display.distance,
        "pixels_per_degree": display.pixels_per_degree,
    }


def npy(array: NDArray[Any]) -> bytes:
    """Return an array as a ``.npy`` file."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def stored_distance(distance: NDArray[np.floating], name: str) -> NDArray[np.float32]:
    """Return distances in metres as stored in a set, in 32 bits; `InputError` names a value out of range.

    >>> stored_distance(np.array([0.5, np.inf]), "yard").tolist()
    [0.5, inf]
    >>> stored_distance(np.array([1e60]), "yard")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: yard contains a distance of 1e+60 m, but distances are stored as 32-bit numbers ...
    """
    kept = np.finfo(np.float32)
    finite = distance[np.isfinite(distance)]
    beyond = finite[(finite > kept.max) | (finite < kept.tiny)]
    if beyond.size:
        raise InputError(
            f"{name} contains a distance of {beyond[0]:.3g} m, but distances are stored as 32-bit numbers of "
            f"{kept.tiny:.2g} to {kept.max:.2g}: give its depth in metres, with inf for sky."
        )
    return distance.astype(np.float32)


def stored_display(shown: StoredDisplay) -> Display:
    """Return the display described by a validated table: the inverse of `display_json`."""
    (width, height), pitch = shown.size_px, shown.pixel_pitch_mm * 1e-3
    gamma: Any = (*shown.gamma,) if isinstance(shown.gamma, list) else shown.gamma  # `Display` requires three
    return Display((width, height), pitch, shown.distance_m, gamma, shown.white_cd_m2, shown.dither)


def _lost(path: Path) -> InputError:
    return InputError(f"{path} cannot be read: make the set again with the command that made it.")
