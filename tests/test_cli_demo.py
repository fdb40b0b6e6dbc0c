"""`focalgradient demo`: every file is there, small, and holds what README.txt in it says is true."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from command_line import run, sentence, succeed
from scipy import ndimage

from focalgradient import DepthMap
from focalgradient.examples.files import CARDS_M, FOCUS_M, STOPS
from focalgradient.photographs import load_camera, load_settings, load_targets


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> tuple[Path, Result]:
    """The folder, and what the command said."""
    folder = tmp_path_factory.mktemp("examples") / "demo"
    return folder, succeed("demo", "--out", folder)


def test_it_is_small_and_says_what_each_file_is(made):
    folder, result = made
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 3e6
    said = (folder / "README.txt").read_text()
    for path in folder.iterdir():
        assert path.name in said or path.name.startswith("target_") or path.name == "README.txt", path.name
    assert "about twice the stated uncertainty" in result.stdout
    assert (folder / "depth" / "depth.png").is_file()


def test_the_depth_map_is_that_of_the_scene(made):
    folder, _ = made
    depth = DepthMap.load(folder / "depth" / "depth.npz")
    truth = np.load(folder / "distance.npy")
    valid = depth.valid
    assert valid.mean() > 0.6
    error = np.abs(1 / depth.distance[valid] - 1 / truth[valid])  # dioptres; the picture is magnified by 1 % more
    assert np.median(error) < 0.03
    assert np.percentile(error, 90) < 0.3
    vergence = 1 / truth
    jumps = ndimage.maximum_filter(vergence, 3) - ndimage.minimum_filter(vergence, 3) > 0.06  # dioptres
    outlines = ndimage.distance_transform_edt(~jumps) < 16  # twice the window's standard deviation
    within = np.abs(1 / depth.distance - vergence) < 2 * depth.vergence_sd
    assert within[valid & ~outlines].mean() == pytest.approx(0.97, abs=0.015)
    assert within[valid & outlines].mean() == pytest.approx(0.93, abs=0.015)  # as the sentence on what to trust states
    assert [shot.image.name for shot in load_settings(folder / "views.toml").shots] == ["near.png", "far.png"]


def test_the_camera_is_the_true_one_within_its_uncertainty(made):
    folder, _ = made
    camera = load_camera(folder / "camera.toml").calibration
    sd = camera.sd
    assert abs(camera.offset) < 3 * sd[2]
    for n, stop in enumerate(sorted(STOPS)):
        assert abs(np.log(camera.f_numbers[stop] / stop)) < 3 * sd[3 + n]
    assert abs(camera.focus[FOCUS_M] - 1 / FOCUS_M) < 3 * sd[5]
    assert len(load_targets(folder / "targets.toml").shots) == 6


def test_edges_by_the_calibrated_camera_give_the_distances_of_the_cards(made, tmp_path):
    folder, _ = made
    command = ("depth", folder / "cards.png", "--method", "edges", "--f-number", "5.6", "--near", "0.85")
    succeed(*command, "--calibration", folder / "camera.toml", "--out", tmp_path / "cards")
    depth = DepthMap.load(tmp_path / "cards" / "depth.npz")
    columns = np.array_split(np.arange(depth.distance.shape[1]), 3)
    for metres, part in zip(CARDS_M, columns, strict=True):
        found = depth.distance[:, part][depth.valid[:, part]]
        assert len(found) > 50
        assert np.median(found) == pytest.approx(metres, rel=0.05)


def test_files_of_somebody_else_are_not_replaced(tmp_path):
    (tmp_path / "views.toml").write_text("mine")
    said = sentence(run("demo", "--out", tmp_path))
    assert "views.toml is there already and was not written by 'focalgradient demo'" in said
    assert [path.name for path in tmp_path.iterdir()] == ["views.toml"]
