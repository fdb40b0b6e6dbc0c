"""The Necker cube: a cube that turns, and its other reading, whose picture is the same and whose shape is not rigid."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient import InputError
from focalgradient.scenes.necker import EDGES, SYMMETRY, NeckerCube, departure_from_rigid, edge_lengths

TURN = np.arange(360) / 360

cubes = st.builds(
    NeckerCube,
    size=st.floats(0.01, 1.0),
    perspective=st.floats(0.001, 0.8),
    distance=st.floats(0.1, 10.0),
    tilt=st.floats(-0.6, 0.6),
    direction=st.sampled_from(["right", "left"]),
)


def test_twelve_edges_meet_by_threes_and_upright_ones_come_first() -> None:
    assert len({tuple(edge) for edge in EDGES.tolist()}) == 12
    assert np.bincount(EDGES.ravel()).tolist() == [3] * 8
    ends = NeckerCube(tilt=0.0).vertices(0.07)[EDGES]
    assert np.allclose(np.ptp(ends[:4], axis=1)[:, [0, 2]], 0)
    assert np.allclose(np.ptp(ends[4:], axis=1)[:, 1], 0)


@given(cubes, st.floats(-3, 3))
def test_true_shape_is_a_cube_at_the_distance(cube: NeckerCube, turn: float) -> None:
    shape = cube.vertices(turn)
    assert edge_lengths(shape) == pytest.approx(cube.edge, rel=1e-12)
    diagonals = np.linalg.norm(shape[:4] - shape[:3:-1], axis=1)  # from each vertex to the opposite one
    assert diagonals == pytest.approx(math.sqrt(3) * cube.edge, rel=1e-12)
    assert shape.mean(axis=0) == pytest.approx([0, 0, cube.distance], abs=1e-12)


@given(cubes, st.floats(-3, 3))
def test_both_readings_have_one_picture_and_mirrored_depth(cube: NeckerCube, turn: float) -> None:
    true, reverse = cube.seen(turn, "rigid"), cube.seen(turn, "nonrigid")
    assert np.abs(cube.project(true) - cube.project(reverse)).max() < 1e-12
    assert true[:, 2] + reverse[:, 2] == pytest.approx(2 * cube.distance)


@given(cubes)
def test_depth_limits_are_reached_and_never_passed(cube: NeckerCube) -> None:
    for reading in ("rigid", "nonrigid"):
        depth = cube.seen(TURN, reading)[..., 2]  # every whole degree, the 45th among them
        assert depth.min() == pytest.approx(cube.nearest, rel=1e-12)
        assert depth.max() == pytest.approx(cube.farthest, rel=1e-12)


@given(cubes)
def test_extent_just_holds_every_picture_of_a_turn(cube: NeckerCube) -> None:
    farthest = np.abs(cube.project(cube.vertices(np.arange(3600) / 3600))).max(axis=(0, 1))
    assert np.all(farthest <= np.array(cube.extent) * (1 + 1e-12))
    assert farthest == pytest.approx(cube.extent, rel=1e-4)


def test_sign_conventions() -> None:
    cube = NeckerCube(tilt=math.radians(20), direction="right")
    turn, little = 0.03, 1e-4
    before, after = cube.vertices(turn), cube.vertices(turn + little)
    near, far = before[:, 2].argsort()[[0, -1]]
    assert after[near, 0] > before[near, 0]  # the near side moves right, the far side left
    assert after[far, 0] < before[far, 0]
    picture = cube.project(before)
    # Seen from above: of the upper corners, the far one is the higher in the picture (y is down).
    tops = [i for i in range(8) if not i & 2]
    nearest, farthest = (min(tops, key=lambda i: sign * before[i, 2]) for sign in (1, -1))
    assert picture[nearest, 1] > picture[farthest, 1]
    # Near edges are larger.
    lengths = np.linalg.norm(np.diff(picture[EDGES[:4]], axis=1)[:, 0], axis=1)
    depths = before[EDGES[:4], 2].mean(axis=1)
    assert lengths.argsort().tolist() == depths.argsort()[::-1].tolist()


def test_an_edge_that_faces_the_viewer_at_the_centre_has_the_stated_size() -> None:
    cube = NeckerCube(size=0.2, perspective=0.5, distance=3.0)
    ends = cube.project([[-cube.edge / 2, 0, 3.0], [cube.edge / 2, 0, 3.0]])
    assert np.ptp(ends[:, 0]) == pytest.approx(0.2)
    natural = NeckerCube(size=0.5, perspective=0.5)  # seen as the cube itself
    point = natural.vertices(0.1)[3]
    assert natural.project(point) == pytest.approx(point[:2] / point[2])


def test_each_reading_turns_the_way_it_is_said_to() -> None:
    """Every vertex winds once about the upright through the centre; the near side then moves to that side."""
    cube = NeckerCube(direction="left")
    for reading in ("rigid", "nonrigid"):
        shape = cube.seen(np.arange(361) / 360, reading) - [0, 0, cube.distance]
        azimuth = np.unwrap(np.arctan2(shape[..., 0], -shape[..., 2]), axis=0)  # 0 in front, positive to the right
        turns = (azimuth[-1] - azimuth[0]) / (2 * np.pi)
        assert turns == pytest.approx({"right": 1, "left": -1}[cube.direction_seen(reading)])


def test_a_quarter_turn_repeats_the_shape_and_left_is_right_run_backwards() -> None:
    assert np.allclose(
        NeckerCube(direction="left").vertices(TURN), NeckerCube(direction="right").vertices(-TURN), atol=1e-15
    )

    def corners(turn: float) -> np.ndarray:
        shape = NeckerCube().reversed(turn).round(9) + 0.0
        return shape[np.lexsort(shape.T)]

    assert np.allclose(corners(0.03), corners(0.03 + SYMMETRY), atol=1e-8)
    for share in (1 / 2, 1 / 3):
        assert not np.allclose(corners(0.03), corners(0.03 + share * SYMMETRY), atol=1e-4)


def test_rigid_shapes_depart_by_nothing() -> None:
    assert departure_from_rigid(NeckerCube(perspective=0.8).vertices(TURN)).whole < 1e-12
    box = NeckerCube().vertices(TURN) - [0, 0, 0.5]
    lean = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    departure = departure_from_rigid(box[:1] * [1.0, 2.0, 0.3] @ np.stack([lean] * 7))  # no cube, in one pose or more
    assert departure.whole < 1e-12
    assert departure.by_frame.shape == (7,)


def test_departure_in_weak_perspective_is_what_first_order_says() -> None:
    """By hand: upright edges change by sqrt(2) p cos t, level ones by p cos t cos 2t."""
    weak = NeckerCube(perspective=1e-4, tilt=0.0)
    departure = departure_from_rigid(weak.reversed(TURN))
    assert departure.whole == pytest.approx(1e-4 / math.sqrt(2), rel=1e-3)
    by_hand = 1e-4 * np.sqrt((1 + np.cos(4 * np.pi * TURN) ** 2) / 3)
    assert departure.by_frame == pytest.approx(by_hand, rel=1e-3)


def test_departure_grows_with_perspective() -> None:
    whole = [departure_from_rigid(NeckerCube(perspective=p).reversed(TURN)).whole for p in (0.05, 0.1, 0.2, 0.4, 0.8)]
    assert np.all(np.diff(whole) > 0)


def test_a_loop_takes_a_whole_number_of_frames_or_says_which_speed_would() -> None:
    assert NeckerCube(speed=0.1).loop_frames(60) == 150
    with pytest.raises(InputError, match=r"21\.4286 frames") as caught:
        NeckerCube(speed=0.7).loop_frames(60)
    better = float(str(caught.value).split("use ")[1].split(",")[0])
    assert NeckerCube(speed=better).loop_frames(60) == 21
    with pytest.raises(InputError, match=r"use 5, which makes 3"):  # 1.5 frames: neither way
        NeckerCube(speed=10).loop_frames(60)
    with pytest.raises(InputError, match="frame_rate"):
        NeckerCube().loop_frames(0)


def test_the_perspective_said_to_be_possible_is() -> None:
    with pytest.raises(InputError) as caught:
        NeckerCube(perspective=2.0)
    most = float(str(caught.value).rstrip(".").split("take at most ")[1])
    assert NeckerCube(perspective=most).nearest > 0
    with pytest.raises(InputError):
        NeckerCube(perspective=most + 0.001)
