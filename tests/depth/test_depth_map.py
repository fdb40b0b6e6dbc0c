"""A depth map on disk: all of it or nothing."""

import json
from pathlib import Path

import numpy as np
import pytest

from focalgradient import DepthMap, InputError
from focalgradient.plotting import draw_uncertainty, new_figure


@pytest.fixture
def depth() -> DepthMap:
    random = np.random.default_rng(0)
    vergence = random.uniform(-0.1, 2, (5, 7)).astype(np.float32)
    flags = random.random((2, 5, 7)) < 0.5
    return DepthMap(
        vergence, 0.01 + 0 * vergence, flags[0], flags[1], {"psf": "disc", "gain": [1.0, 1.5], "near_m": None}
    )


def test_comes_back_as_it_was(depth: DepthMap, tmp_path: Path) -> None:
    path = tmp_path / "depth.npz"
    depth.save(path)
    again = DepthMap.load(path)
    assert again.common_errors.shape == (0, 5, 7)
    for name in ("vergence", "vergence_sd", "valid", "side_known"):
        before, after = getattr(depth, name), getattr(again, name)
        assert after.dtype == before.dtype
        assert (after == before).all()
    assert again.details == depth.details
    assert again.shape == (5, 7)
    with pytest.raises(InputError, match=r"is the name of a picture.* ends in \.npz"):
        depth.save(tmp_path / "depth.png")
    assert [file.name for file in tmp_path.iterdir()] == ["depth.npz"]


def test_the_archive_can_be_read_without_us(depth: DepthMap, tmp_path: Path) -> None:
    depth.save(tmp_path / "depth.npz")
    with np.load(tmp_path / "depth.npz") as file:
        assert set(file) == {
            *("distance", "vergence", "vergence_sd", "common_sd", "common_errors", "valid", "side_known", "offset"),
            *("plane", "details"),
        }
        beyond_infinity = file["vergence"] <= 0
        assert beyond_infinity.any()
        assert np.isinf(file["distance"][beyond_infinity]).all()
        assert (file["distance"] * file["vergence"])[~beyond_infinity] == pytest.approx(1)
        assert file["valid"].dtype == bool
        assert json.loads(str(file["details"]))["gain"] == [1.0, 1.5]


def test_sd_of_distance_is_that_of_vergence_carried_over_and_infinite_at_infinity() -> None:
    """Numerically: 1/V of many draws of V."""
    draws = np.random.default_rng(1).normal(0.5, 0.005, 200_000)
    one = np.ones((1, 1), bool)
    depth = DepthMap(np.full((1, 1), 0.5), np.full((1, 1), 0.005), one, one)
    assert depth.distance_sd[0, 0] == pytest.approx(float(np.std(1 / draws)), rel=0.01)
    vergence = np.array([[0.0, 0.0, -0.1, 0.5]])
    depth = DepthMap(vergence, np.array([[0.0, 0.1, 0.1, 0.0]]), vergence > -1, vergence > -1)
    assert depth.distance_sd.tolist() == [[np.inf, np.inf, np.inf, 0.0]]


def test_a_map_of_order_only_has_no_metres() -> None:
    two = np.full((2, 3), 1.5)
    depth = DepthMap(two, 0.1 * two, two > 0, two > 0, {"order_only": 5})
    assert np.isnan(depth.distance).all()
    assert np.isnan(depth.distance_sd).all()
    assert repr(depth) == "<DepthMap of 2 x 3 pixels: order only, 100% valid>"
    assert depth.summary() == "Depth map of 2 x 3 pixels: order only, 100% valid"


def test_a_picture_of_order_only_shows_what_lies_beyond_the_stack() -> None:
    where = np.full((60, 80), 1.5)
    beyond = np.repeat([1, -1, 0, 0], 20)[None].astype(np.int8) + np.zeros((60, 1), np.int8)
    depth = DepthMap(where, 0.1 * where, beyond == 0, beyond == 0, {"order_only": 5}, beyond=beyond)
    assert depth.summary().count(": 25%") == 2
    title = depth.plot().get_title(loc="left")
    assert "grey: at or before the focus of the first (25 %)" in title
    assert "red: at or after the focus of the last (25 %)" in title
    sd = draw_uncertainty(new_figure(120.0, 80.0, layout="compressed").add_subplot(), depth)
    assert sd.get_title(loc="left") == "Uncertainty: median sd 0.6 positions"
