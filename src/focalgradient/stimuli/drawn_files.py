"""Reading and writing of a drawn stimulus: arrays in linear radiance, a picture for a display, ``stimulus.json``."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.files import parse_json, printable, read_array, read_arrays, read_bytes
from focalgradient.stimuli.manifest import StimulusRecord
from focalgradient.stimuli.sets import (
    check_size,
    display_json,
    npy,
    png_of,
    stored_display,
)
from focalgradient.stimuli.stimulus import Stimulus
from focalgradient.tables import check_table

__all__ = ["FILES", "SUMMARY", "read_stimuli", "read_stimulus", "stimulus_files"]

SUMMARY = "stimulus.json"

ARRAYS = {"picture.npy": "picture", "sharp.npy": "sharp", "depth.npy": "depth_m", "blur.npy": "blur_arcmin"}
"""Attribute of `Stimulus` stored in each array file."""

MASKS = "masks.npz"

FILES = ("picture.png", *ARRAYS, MASKS, SUMMARY)


def stimulus_files(one: Stimulus, display: Display) -> tuple[dict[str, bytes], dict[str, Any]]:
    """Return the content of each file except `SUMMARY`, and that of `SUMMARY` as plain values.

    Raises
    ------
    InputError
        If the picture does not fit the display.
    """
    height, width = one.shape
    check_size("the picture", one.shape, display)
    masks = io.BytesIO()
    named = {name.replace(" ", "_"): mask for name, mask in one.masks.items()}
    np.savez_compressed(masks, **named)  # type: ignore[arg-type]
    known = np.isfinite(one.depth_m)
    files = {name: npy(getattr(one, attribute).astype(np.float32)) for name, attribute in ARRAYS.items()}
    files |= {"picture.png": png_of(display.encode(one.picture)), MASKS: masks.getvalue()}
    summary: dict[str, Any] = {
        "name": one.name,
        "source": list(one.source),
        "picture_px": [width, height],
        "pixel_angle_arcmin": 60 * np.degrees(one.pixel_angle),
        "blur_arcmin": [float(one.blur_arcmin.min()), float(one.blur_arcmin.max())],
        "depth_m": [float(one.depth_m[known].min()), float(one.depth_m[known].max())] if known.any() else None,
        "controlled": one.controlled,
        "parameters": {name: value for name, value in one.parameters.items() if name != "optics"},
        "masks": list(named),
        "display": display_json(display),
        "sha256": {name: hashlib.sha256(data).hexdigest() for name, data in files.items() if name in ARRAYS},
    }
    return files, summary


def read_stimulus(folder: str | Path) -> tuple[Stimulus, Display]:
    """Return the stimulus written by ``focalgradient stimuli NAME``, and the display for which it was drawn.

    Parameters
    ----------
    folder
        Folder with `stimulus.json`; the arrays have 32-bit precision.

    Raises
    ------
    InputError
        If there is no stimulus, or a file was changed since it was written.
    """
    folder = Path(folder)
    path, what = folder / SUMMARY, "the record of a drawn stimulus, in a folder that 'focalgradient stimuli' wrote"
    record = check_table(printable(path), parse_json(read_bytes(path, what), printable(path), what), StimulusRecord)
    for name in ARRAYS:
        if hashlib.sha256(read_bytes(folder / name, "a file of a stimulus")).hexdigest() != record.sha256.get(name):
            raise InputError(
                f"{printable(folder / name)} does not match the checksum in {printable(path)}, so that its sharpness "
                "is unknown: draw the stimulus again, or import pictures with 'focalgradient stimuli import'."
            )
    arrays = {attribute: np.asarray(read_array(folder / name), float) for name, attribute in ARRAYS.items()}
    if len({array.shape for array in arrays.values()}) > 1 or arrays["picture"].ndim != 2:
        raise InputError(f"the arrays in {printable(folder)} differ in shape: draw the stimulus again.")
    masks: Mapping[str, NDArray[Any]] = read_arrays(folder / MASKS, record.masks)
    one = Stimulus(
        name=record.name,
        **arrays,
        masks={name: mask.astype(bool) for name, mask in masks.items()},
        pixel_angle=float(np.radians(record.pixel_angle_arcmin / 60)),
        parameters=record.parameters,
        controlled=record.controlled.model_dump(),
        source=tuple(record.source),
    )
    return one, stored_display(record.display)


def read_stimuli(folders: Iterable[str | Path]) -> tuple[dict[str, Stimulus], Display]:
    """Return the stimuli in several folders by the folders' names, and the display for which all were drawn.

    Raises
    ------
    InputError
        If a folder contains no stimulus, two have the same name, or displays differ.
    """
    drawn: dict[str, Stimulus] = {}
    displays: dict[str, Display] = {}
    for folder in map(Path, folders):
        name = folder.resolve().name
        if name in drawn:
            raise InputError(f"two folders are named {name!r}, but names of scenes must differ: rename one.")
        drawn[name], displays[name] = read_stimulus(folder)
        first = next(iter(displays))
        if displays[name] != displays[first]:
            raise InputError(
                f"{name} is drawn for a display other than that of {first}: draw all with the same width, distance and "
                "other display options."
            )
    if not drawn:
        raise InputError("folders is empty, but must have the folder of a drawn stimulus: give one.")
    return drawn, next(iter(displays.values()))
