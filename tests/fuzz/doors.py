"""What no command reads by itself, given damaged: EXIF, depth maps and work that goes on; `commands.py` tries the rest.

A case is a door and a seed. It is passed where what comes out is a result or an `InputError`, in time, and nothing is
left outside the folder it was given.
"""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from mutations import NUMBERS, as_json, damaged_bytes, wrong_file  # noqa: E402

from focalgradient.errors import InputError  # noqa: E402

SIDE = 48
"""Width and height of the pictures."""

BODY = {"focal_length_mm": 25.0, "pixel_pitch_um": 8.0, "blur_k": 0.5, "own_blur_um2": 1.0, "offset_m": 0.0}
CALIBRATED = {
    "camera": BODY | {"model_error": 0.02},
    "aperture": [{"f_number": 16.0, "effective": 16.5}, {"f_number": 5.6, "effective": 5.5}],
    "focus": [{"focus_distance_m": 0.85, "vergence_dioptres": 1.17}],
    "uncertainty": {"informed": [0.5] * 6, "covariance": [[1e-4 * (i == j) for j in range(6)] for i in range(6)]},
}


@cache
def _texture() -> np.ndarray:
    noise = np.random.default_rng(1).standard_normal((SIDE, SIDE))
    return np.clip(0.5 + cv2.GaussianBlur(noise, (0, 0), 1.5), 0.05, 0.95)  # blur leaves a standard deviation of 0.19


@cache
def photograph() -> bytes:
    """A JPEG file with the settings of a camera."""
    exif = Image.Exif()
    exif.get_ifd(0x8769).update({37386: 25.0, 33437: 5.6, 37382: 0.85, 41486: 1250.0, 41488: 3, 274: 6})
    file = io.BytesIO()
    Image.fromarray(np.rint(255 * _texture()).astype(np.uint8)).save(file, "JPEG", quality=90, exif=exif)
    return file.getvalue()


def exif(chance: random.Random, folder: Path) -> None:
    from focalgradient.photographs import from_exif

    tags = {37386: 25.0, 33437: 5.6, 37382: 0.85, 41486: 1250.0, 41488: 3, 40962: SIDE, 40963: SIDE}
    for _ in range(chance.randrange(3)):
        tags[chance.choice(list(tags))] = chance.choice([n for n in NUMBERS if 0 <= n < 2**32])
    for name in ("a.jpg", "b.jpg"):
        made = Image.Exif()
        made.get_ifd(0x8769).update(tags)
        with contextlib.suppress(Exception):  # not every number can be written
            Image.fromarray(np.rint(255 * _texture()).astype(np.uint8)).save(folder / name, exif=made)
        if not (folder / name).exists() or chance.random() < 0.5:
            whole = bytearray(photograph())
            whole[2:400] = damaged_bytes(bytes(whole[2:400]), chance)
            (folder / name).write_bytes(whole)
    given: dict[str, Any] = {}
    if chance.random() < 0.5:
        given = {"f_numbers": [chance.choice(NUMBERS) for _ in range(2)]}
    from_exif([folder / "a.jpg", folder / "b.jpg"], **given)


def caches(chance: random.Random, folder: Path) -> None:
    from focalgradient import DepthMap
    from focalgradient.files import read_arrays

    grid = np.full((8, 8), 0.5)
    DepthMap(grid, 0.1 * grid, grid > 0, grid > 0, {"psf": "disc"}).save(folder / "depth.npz")
    if chance.random() < 0.3:
        with np.load(folder / "depth.npz") as whole:
            arrays = dict(whole)
        others = (np.array("x"), np.array("[" * 9000), np.zeros(3), np.zeros((2, 2, 2)), np.array(1j))
        arrays[chance.choice(sorted(arrays))] = chance.choice(others)
        np.savez(folder / "depth.npz", **arrays)
    else:
        wrong_file(folder / "depth.npz", folder, chance)
    with contextlib.suppress(InputError):
        read_arrays(folder / "depth.npz", ("vergence", "valid"))
    DepthMap.load(folder / "depth.npz")


def resumables(chance: random.Random, folder: Path) -> None:
    from focalgradient.design import DepthRatingDesign
    from focalgradient.power import Model, Study, run
    from focalgradient.stimuli.folder import Folder

    listed = {"set": "x", "versions": {"a": "1"}, "files": {"a.png": "0" * 64}, "conditions": {}}
    kept = folder / chance.choice(("unfinished.json", "manifest.json"))
    kept.write_bytes(as_json(listed))
    wrong_file(kept, folder, chance)
    with contextlib.suppress(InputError):
        Folder(folder, {"set": "x"}, {"a": "1"})
    study = Study(Model(), DepthRatingDesign())
    row = {"subjects": 3, "number": 0, "width": 0.1, "far_width": None, "left_out": 0.0} | dict.fromkeys(
        study.tests, 1.0
    )
    file = folder / "experiments.jsonl"
    run(study, [3], 0, file)
    file.write_bytes(file.read_bytes() + b"".join(as_json(row | {"number": n}) + b"\n" for n in range(4)))
    if chance.random() < 0.8:
        wrong_file(file, folder, chance)
    run(study, [3], 0, file)


DOORS: dict[str, Callable[[random.Random, Path], None]] = {door.__name__: door for door in (exif, caches, resumables)}


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """What FFmpeg and others write past Python stays out of the terminal."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def case(door: str, seed: int) -> None:
    """Try one case: what goes wrong comes out as its exception."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as outer:
        folder = Path(outer, "folder")
        folder.mkdir()
        with warnings.catch_warnings(), contextlib.suppress(InputError):
            warnings.simplefilter("error", RuntimeWarning)
            warnings.filterwarnings("ignore", category=UserWarning)
            DOORS[door](random.Random(f"{door} {seed}"), folder)
        left = [path.name for path in Path(outer).iterdir()]
        assert left == ["folder"], f"left outside: {left}"
        hidden = [path.name for path in folder.rglob(".focalgradient-*")]
        assert not hidden, f"hidden files left: {hidden}"
        shutil.rmtree(folder)
