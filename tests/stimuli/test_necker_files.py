"""Frames of the cube as files: a loop without a seam, alike under all conditions but for blur."""

import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from focalgradient import InputError
from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.scenes import NeckerCube
from focalgradient.scenes.necker import EDGES, SYMMETRY, edge_lengths
from focalgradient.stimuli import make_necker
from focalgradient.stimuli.cube_frames import wobbling

CUBE = NeckerCube(size=math.radians(3), speed=0.5, line_width=math.radians(0.06))
ASKED = {"size": 244, "frame_rate": 24.0, "aperture": 0.03}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cube")
    make_necker(folder, CUBE, **ASKED)
    return folder


@pytest.fixture(scope="module")
def manifest(made: Path) -> dict:
    return json.loads((made / "manifest.json").read_text(encoding="utf-8"))


def frames(folder: Path, manifest: dict, gradient: str) -> np.ndarray:
    return np.array([np.array(Image.open(folder / name)) for name in manifest["conditions"][gradient]["frames"]])


def test_files(made: Path, manifest: dict) -> None:
    check_stimuli(made)
    assert list(manifest["conditions"]) == ["none", "rigid", "nonrigid"]
    for gradient in manifest["conditions"]:
        assert frames(made, manifest, gradient).shape == (12, 244, 244)
    there = {str(path.relative_to(made)) for path in made.rglob("*") if path.is_file()}
    assert there == {*manifest["files"], "manifest.json"}


def test_light_of_the_lines_is_the_same_under_all_conditions(made: Path, manifest: dict) -> None:
    display = Display()
    light = [display.decode(frames(made, manifest, gradient)).mean(axis=(1, 2)) for gradient in manifest["conditions"]]
    assert np.ptp(light, axis=0).max() / np.mean(light) < 5e-3
    assert all(one["met"] for one in manifest["controls"].values())
    # One white for all: the brightest place of the loop without a gradient.
    assert frames(made, manifest, "none").max() == 255
    assert max(one["clipped"] for one in manifest["conditions"].values()) == 0
    # Blur is there, and differs.
    assert frames(made, manifest, "rigid").max() < 255
    assert not np.array_equal(frames(made, manifest, "rigid"), frames(made, manifest, "nonrigid"))


def test_what_is_said_of_the_readings(manifest: dict) -> None:
    departure = manifest["departure"]
    assert departure["rigid"]["whole"] < 1e-9
    assert 0.1 < departure["nonrigid"]["whole"] < 0.4
    assert len(departure["nonrigid"]["by_frame"]) == 12
    # Over a quarter turn as over the whole: the cube's edges take each other's places.
    assert np.sqrt(np.mean(np.square(departure["nonrigid"]["by_frame"]))) == pytest.approx(
        departure["nonrigid"]["whole"]
    )
    assert (departure["rigid"]["direction"], departure["nonrigid"]["direction"]) == ("right", "left")
    sharp, blurred = (manifest["conditions"][gradient]["blur_sd_px"] for gradient in ("none", "rigid"))
    assert sharp == [0, 0]
    assert blurred[0] == 0 < 1 < blurred[1]


def test_the_video_shows_a_whole_turn(made: Path, manifest: dict) -> None:
    video = cv2.VideoCapture(str(made / "rigid.mp4"))
    shown = []
    while (read := video.read())[0]:
        shown.append(read[1][..., 1])
    video.release()
    loop = frames(made, manifest, "rigid")
    assert len(shown) == 48
    for number in (0, 7, 30):
        assert np.abs(shown[number].astype(float) - loop[number % 12]).mean() < 3


def test_the_same_files_again_and_on_after_an_interruption(made: Path, manifest: dict, tmp_path: Path) -> None:
    def interrupt(share: float, what: str) -> None:
        if what == "rigid":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_necker(tmp_path, CUBE, **ASKED, progress=interrupt)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.png")}
    assert len(kept) == 24
    again = make_necker(tmp_path, CUBE, **ASKED)
    assert again == manifest
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    before = (tmp_path / "manifest.json").stat().st_mtime_ns
    make_necker(tmp_path, CUBE, **ASKED)
    assert (tmp_path / "manifest.json").stat().st_mtime_ns == before


def test_a_cube_that_does_not_fit_its_frames_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"fills 2.. pixels: use that size"):
        make_necker(tmp_path / "set", CUBE, **{**ASKED, "size": 200})
    assert not (tmp_path / "set").exists()


def test_the_nonrigid_example_tapers_and_shrinks_by_the_shares_that_are_stated() -> None:
    cube = NeckerCube(tilt=0.0)
    for quarter, (top, bottom, height) in enumerate(
        [(0.7, 0.7, 1.0), (0.4, 1.0, 0.7), (0.7, 0.7, 0.4), (1.0, 0.4, 0.7)]
    ):
        lengths = edge_lengths(wobbling(cube, SYMMETRY * quarter / 4)) / cube.edge
        middles = wobbling(cube, SYMMETRY * quarter / 4)[EDGES].mean(axis=1)[:, 1]
        np.testing.assert_allclose(lengths[4:][middles[4:] < 0], top)  # y points down
        np.testing.assert_allclose(lengths[4:][middles[4:] > 0], bottom)
        assert np.ptp(wobbling(cube, SYMMETRY * quarter / 4)[:, 1]) == pytest.approx(height * cube.edge)
    left, right = (wobbling(NeckerCube(tilt=0.0, direction=way), 0.25 / 3)[:, 0] for way in ("left", "right"))
    assert not np.allclose(left, right)
