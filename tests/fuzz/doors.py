"""Every function that reads files, given damaged ones; the command line is tried by `commands.py`.

A case is a door and a seed. It is passed where what comes out is a result or an `InputError`, in time, and nothing is
left outside the folder it was given.
"""

from __future__ import annotations

import contextlib
import json
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

from mutations import NUMBERS, as_json, as_toml, damaged_bytes, wrong_file  # noqa: E402

from focalgradient.errors import InputError  # noqa: E402

SIDE = 48
"""Width and height of the pictures."""

CAMERA = {"focal_length_mm": 25.0, "pixel_pitch_um": 8.0}
VIEWS = {"camera": CAMERA, "view": [{"image": f"{n}.png", "f_number": n, "focus_distance_m": 0.85} for n in (16, 5.6)]}
TARGETS = {
    "camera": CAMERA | {"offset_m": 0.0, "offset_sd_m": 0.1},
    "view": [{"image": "16.png", "distance_m": d, "f_number": 16.0} for d in (0.5, 1.0)],
}
BODY = {"focal_length_mm": 25.0, "pixel_pitch_um": 8.0, "blur_k": 0.5, "own_blur_um2": 1.0, "offset_m": 0.0}
CALIBRATED = {
    "camera": BODY | {"model_error": 0.02},
    "aperture": [{"f_number": 16.0, "effective": 16.5}, {"f_number": 5.6, "effective": 5.5}],
    "focus": [{"focus_distance_m": 0.85, "vergence_dioptres": 1.17}],
    "uncertainty": {"informed": [0.5] * 6, "covariance": [[1e-4 * (i == j) for j in range(6)] for i in range(6)]},
}
DESIGNS = (
    {"task": "depthrating", "scenes": ["spheres-00"], "repetitions": 1, "catch_trials": 0, "practice_trials": 0},
    {"task": "necker", "repetitions": 1, "strengths_mm": [4.0], "directions": ["right"], "trial_s": 20.0},
    {"task": "pinhole"},
)


@cache
def _texture() -> np.ndarray:
    noise = np.random.default_rng(1).standard_normal((SIDE, SIDE))
    return np.clip(0.5 + cv2.GaussianBlur(noise, (0, 0), 1.5), 0.05, 0.95)  # blur leaves a standard deviation of 0.19


@cache
def _files() -> dict[str, bytes]:
    """Whole image files of each kind."""
    eight, sixteen = (np.rint(top * _texture()) for top in (255, 65535))
    colour = np.repeat(eight.astype(np.uint8)[..., None], 3, axis=2)
    files = {
        "a.png": cv2.imencode(".png", sixteen.astype(np.uint16))[1].tobytes(),
        "b.png": cv2.imencode(".png", colour)[1].tobytes(),
        "a.tif": cv2.imencode(".tif", sixteen.astype(np.uint16))[1].tobytes(),
        "b.tif": cv2.imencode(".tif", _texture().astype(np.float32))[1].tobytes(),
    }
    with tempfile.TemporaryDirectory() as folder:
        exif = Image.Exif()
        exif.get_ifd(0x8769).update({37386: 25.0, 33437: 5.6, 37382: 0.85, 41486: 1250.0, 41488: 3, 274: 6})
        Image.fromarray(colour).save(Path(folder, "a.jpg"), quality=90, exif=exif)
        for name, array in (("a.npy", _texture()), ("b.npy", colour), ("c.npy", _texture().astype(np.float32))):
            np.save(Path(folder, name), array)
        for path in Path(folder).iterdir():
            files[path.name] = path.read_bytes()
    return files


@cache
def _video() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.avi")
        writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"MJPG"), 10, (64, 64))
        for number in range(8):
            frame = np.rint(255 * cv2.resize(_texture(), (64, 64))).astype(np.uint8)
            frame = frame if number % 2 else cv2.GaussianBlur(frame, (0, 0), 1.5)
            writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
        writer.release()
        return path.read_bytes()


@cache
def _dataset() -> dict[str, bytes]:
    """Files of a small data set, by path."""
    from recorded import record_necker, record_ratings

    with tempfile.TemporaryDirectory() as folder:
        root = record_necker(record_ratings(Path(folder, "data"), 2), 2)
        return _read_all(root)


def _read_all(root: Path) -> dict[str, bytes]:
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}


@cache
def _stimuli() -> dict[str, bytes]:
    """Files of a small set of pictures, by path."""
    from focalgradient.display import Display
    from focalgradient.stimuli import make_depth_rating

    with tempfile.TemporaryDirectory() as folder:
        make_depth_rating(folder, scenes=1, size=64, samples=2, engine="cast", display=Display(pixel_pitch=2e-3))
        return _read_all(Path(folder))


def _given(folder: Path, files: dict[str, bytes], chance: random.Random, *names: str) -> None:
    """Put files into a folder, one of them (of `names`, where given) damaged by what it is."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    wrong_file(folder / chance.choice(names or sorted(files)), folder, chance)


def settings(chance: random.Random, folder: Path) -> None:
    from focalgradient.photographs import read_views

    files = {"16.png": _files()["a.png"], "5.6.png": _files()["a.png"], "views.toml": as_toml(VIEWS)}
    _given(folder, files, chance, "views.toml")
    read_views(folder / "views.toml")


def images(chance: random.Random, folder: Path) -> None:
    from focalgradient.photographs import read_photograph

    name = chance.choice(sorted(_files()))
    given = chance.choice(("a.cr2", "a.dng", "x.npy", "x.png", "x.jpg")) if chance.random() < 0.1 else name
    _given(folder, {given: _files()[name]}, chance)
    read_photograph(folder / given, chance.choice((None, "linear", "srgb")))


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
            whole = bytearray(_files()["a.jpg"])
            whole[2:400] = damaged_bytes(bytes(whole[2:400]), chance)
            (folder / name).write_bytes(whole)
    given: dict[str, Any] = {}
    if chance.random() < 0.5:
        given = {"f_numbers": [chance.choice(NUMBERS) for _ in range(2)]}
    from_exif([folder / "a.jpg", folder / "b.jpg"], **given)


def video(chance: random.Random, folder: Path) -> None:
    from focalgradient.video import Frame, Source, alternation, pairs

    (folder / "a.avi").write_bytes(damaged_bytes(_video(), chance))

    def detail(image: np.ndarray) -> float:
        return float(image.std())

    with Source(folder / "a.avi") as source:
        frames = list(source.frames())
    if any(isinstance(one, Frame) for one in frames):
        list(pairs(frames, detail, alternation(frames, detail)))


def calibrations(chance: random.Random, folder: Path) -> None:
    from focalgradient.photographs import load_targets

    _given(folder, {"16.png": _files()["a.png"], "targets.toml": as_toml(TARGETS)}, chance, "targets.toml")
    targets = load_targets(folder / "targets.toml")
    targets.read(targets.shots[0])


def cameras(chance: random.Random, folder: Path) -> None:
    from focalgradient.photographs import camera_toml, load_camera, load_settings

    views = json.loads(json.dumps(VIEWS))
    views["camera"] = {"calibration": "camera.toml"}
    if chance.random() < 0.3:
        views["view"][0]["f_number"] = chance.choice(NUMBERS[:-1])
    _given(folder, {"camera.toml": as_toml(CALIBRATED), "views.toml": as_toml(views)}, chance, "camera.toml")
    calibrated = load_camera(folder / "camera.toml")
    camera_toml(calibrated)
    load_settings(folder / "views.toml").pixel_angles()


def designs(chance: random.Random, folder: Path) -> None:
    from focalgradient.design import load_design

    _given(folder, {"design.toml": as_toml(dict(chance.choice(DESIGNS)))}, chance)
    load_design(folder / "design.toml").trials("01")


def manifests(chance: random.Random, folder: Path) -> None:
    from focalgradient.dataset import check_stimuli
    from focalgradient.stimuli import read_set

    _given(folder, _stimuli(), chance, *["manifest.json"] * 3, *sorted(_stimuli()))
    found = read_set(folder)
    for picture in found.pictures[:2]:
        scene = found.scene(picture.scene)
        found.pixels(picture), found.linear(picture), found.depth(scene.name)
    check_stimuli(folder)


def datasets(chance: random.Random, folder: Path) -> None:
    from focalgradient.dataset import export, journals, read_dataset, validate

    root = folder / "data"
    _given(root, _dataset(), chance)
    for what in (
        lambda: validate(root),
        lambda: read_dataset(root, "depthrating"),
        lambda: read_dataset(root, "necker"),
        lambda: [export(journal) for journal in journals(root)],
    ):
        with contextlib.suppress(InputError):
            what()


def reports(chance: random.Random, folder: Path) -> None:
    from focalgradient.report import analyse_necker, analyse_ratings

    files = {name: data for name, data in _dataset().items() if not name.startswith("sourcedata")}
    _given(folder / "data", files, chance)
    for analyse in (analyse_ratings, analyse_necker):
        with contextlib.suppress(InputError):
            analyse(folder / "data")


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
    _given(folder, {chance.choice(("unfinished.json", "manifest.json")): as_json(listed)}, chance)
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


READERS = (settings, images, exif, video, calibrations, cameras)
DATA = (designs, manifests, datasets, reports, caches, resumables)
DOORS: dict[str, Callable[[random.Random, Path], None]] = {door.__name__: door for door in (*READERS, *DATA)}


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
