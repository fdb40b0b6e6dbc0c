"""Photographs as people have them: stacks without focus distances, views of unequal size, a sheet to print."""

import json

import cv2
import numpy as np
import pytest
from command_line import run, succeed
from photographed import SHAPE, TILE, RealCamera, encoded, write
from textures import natural_spectrum

from focalgradient import DepthMap, InputError
from focalgradient.photographs import read_photographs
from focalgradient.plotting import PAPERS, calibration_sheet
from focalgradient.psf import transfer

OPTICS = ("--focal-length", "35", "--pixel-pitch", "20", "--focus-distance", "1", "--focus-distance", "1")
STOPS = ("--f-number", "11", "--f-number", "4")


def stack(folder, count=5):
    """A slant that is in focus at the left in the first photograph, at the right in the last."""
    random = np.random.default_rng(0)
    frequency = np.hypot(np.fft.fftfreq(TILE)[:, None], np.fft.rfftfreq(TILE))
    spectrum = natural_spectrum((TILE, TILE), random, 0.12)
    height, width = SHAPE
    vergence = np.linspace(2.0, 1.0, width)
    paths = []
    for number, focus in enumerate(np.linspace(2.1, 0.9, count)):
        radius = np.abs(focus - vergence) * 8
        radii = np.linspace(0, radius.max() + 0.01, 14)
        blurred = np.stack(
            [np.fft.irfft2(spectrum * transfer(frequency, one, "disc"))[:height, :width] for one in radii]
        )
        place = np.clip(radius / (radii[1] - radii[0]), 0, 12.99)
        low, column = place.astype(int), np.arange(width)
        light = blurred[low, :, column].T * (low + 1 - place) + blurred[low + 1, :, column].T * (place - low)
        light = 0.4 + light + 0.003 * random.standard_normal(SHAPE)
        paths.append(write(folder / f"s{number}.png", encoded(light)))
    return paths


def test_a_stack_without_focus_distances_gives_the_order(tmp_path):
    result = succeed("depth", *stack(tmp_path), "--method", "autofocus", "--out", tmp_path / "out")
    assert "order of depth" in result.stderr
    assert all(f"--{name}" in result.stderr for name in ("focus-distance", "focal-length", "f-number", "pixel-pitch"))
    assert "of 5 (order only)" in result.stdout
    depth = DepthMap.load(tmp_path / "out" / "depth.npz")
    assert np.isnan(depth.distance).all()
    columns = np.array([np.median(part[valid]) for part, valid in zip(
        np.array_split(depth.vergence, 8, axis=1), np.array_split(depth.valid, 8, axis=1), strict=True)])  # fmt: skip
    assert (np.diff(columns) > 0.05).all()
    # Foci are evenly spaced: vergences from 2.1 to 0.9 stand at 1 to 2.
    assert columns[4] == pytest.approx(1 + (2.1 - 1.44) / 1.2, abs=0.03)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["details"]["order_only"] == 5
    camera, views = summary["settings"]["camera"], summary["settings"]["views"]
    assert {camera[name] for name in ("focal_length_mm", "pixel_pitch_um", "telecentric")} == {None}
    assert {view[name] for view in views for name in ("f_number", "focus_distance_m", "pixel_angle_rad")} == {None}


def test_optics_given_for_a_stack_without_focus_distances_are_recorded_and_not_asked_for(tmp_path):
    given = ("--method", "autofocus", "--focal-length", "35", "--f-number", "4", "--telecentric")
    result = succeed("depth", *stack(tmp_path, 3), *given, "--out", tmp_path / "out")
    assert "photograph, and --pixel-pitch)" in result.stderr
    settings = json.loads((tmp_path / "out" / "summary.json").read_text())["settings"]
    assert settings["camera"]["telecentric"]
    assert settings["camera"]["focal_length_mm"] == 35
    assert [view["f_number"] for view in settings["views"]] == [4, 4, 4]


@pytest.fixture
def pair(tmp_path):
    camera = RealCamera(scale=1.0, focus=1.0, curvature=0.0)
    paths = [camera.take(tmp_path / f"{mark}.png", 0.7, mark, seed=1) for mark in (11, 4)]
    cut = cv2.imread(str(paths[1]), cv2.IMREAD_GRAYSCALE)[13:, 7:-12]
    cv2.imwrite(str(tmp_path / "cut.png"), cut)
    return paths[0], tmp_path / "cut.png"


@pytest.mark.slow
def test_views_of_unequal_size_are_cropped_when_asked(pair, tmp_path):
    refused = run("depth", *pair, "--out", tmp_path / "out", *OPTICS, *STOPS, "--far", 1)
    assert refused.exit_code == 2
    assert "--align" in refused.stderr
    succeed("depth", *pair, "--out", tmp_path / "out", *OPTICS, *STOPS, "--far", 1, "--align")
    depth = DepthMap.load(tmp_path / "out" / "depth.npz")
    assert depth.shape == (SHAPE[0] - 13, SHAPE[1] - 19)
    assert np.median(depth.distance[depth.valid]) == pytest.approx(0.7, abs=0.005)


def test_cropping_finds_the_common_part_and_refuses_what_was_resized(pair, tmp_path):
    whole, cut = read_photographs(pair, crop=True)
    assert whole.luminance.shape == cut.luminance.shape
    assert np.corrcoef(whole.luminance.ravel(), cut.luminance.ravel())[0, 1] > 0.85
    image = cv2.imread(str(pair[0]), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path / "half.png"), cv2.resize(image, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA))
    with pytest.raises(InputError, match="without resizing"):
        read_photographs([pair[0], tmp_path / "half.png"], crop=True)


def test_a_sheet_to_print(tmp_path):
    for paper, (width, height) in PAPERS.items():
        assert calibration_sheet(paper).get_size_inches() * 25.4 == pytest.approx((width, height))
    succeed("calibrate", "--sheet", "A4", "--out", tmp_path / "sheet.pdf")
    data = (tmp_path / "sheet.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert b"/MediaBox [ 0 0 841.88" in data  # 297 mm in points
    assert run("calibrate", "--sheet", "A4", "--out", tmp_path / "sheet.png").exit_code == 2
    assert "--sheet A4" in run("calibrate", "--out", tmp_path / "c.toml").stderr


@pytest.mark.slow
def test_what_an_assumed_encoding_leaves_open_is_stated(tmp_path):
    camera = RealCamera(scale=1.0, focus=1.0, curvature=0.0)
    paths = [camera.take(tmp_path / f"{mark}.png", 0.7, mark, seed=1) for mark in (11, 4)]
    result = succeed("depth", *paths, "--out", tmp_path / "out", *OPTICS, *STOPS, "--far", 1)
    assert "if they were linear, " in result.stdout
    stated = json.loads((tmp_path / "out" / "summary.json").read_text())["details"]["encoding_difference_D"]
    # What it says is what reading them as linear gives.
    given = run("depth", *paths, "--out", tmp_path / "linear", *OPTICS, *STOPS, "--far", 1, "--encoding", "linear")
    assert "were they linear" not in given.stdout
    as_srgb, as_linear = (DepthMap.load(tmp_path / name / "depth.npz") for name in ("out", "linear"))
    both = as_srgb.valid & as_linear.valid
    assert stated == pytest.approx(np.median((as_linear.vergence - as_srgb.vergence)[both]), abs=0.005)
