"""Fixational eye movements: their statistics against what was asked for."""

import numpy as np
import pytest

from focalgradient.retina import FixationalMovements

MINUTE = np.radians(1 / 60)


def test_drift_diffuses_as_asked_for():
    """Mean square displacement 4 D t, over 400 paths."""
    paths = [FixationalMovements(diffusion=20, rate=0, seed=seed).at([0.0, 0.1, 0.4]) for seed in range(400)]
    square = np.mean([np.sum((path / MINUTE) ** 2, axis=1) for path in paths], axis=0)
    assert square[0] < 1e-3
    assert square[1:] == pytest.approx([8.0, 32.0], rel=0.15)


def test_microsaccades_come_as_often_as_asked_for():
    path = FixationalMovements(diffusion=0, rate=1.5, amplitude=15, seed=3).at(np.arange(0, 60, 0.001)) / MINUTE
    jumps = np.hypot(*np.diff(path, axis=0).T)
    size = jumps[jumps > 1]
    assert size.size == pytest.approx(90, abs=25)
    often = FixationalMovements(diffusion=0, rate=8.0, seed=3).at(np.arange(0, 60, 0.001))
    assert np.count_nonzero(np.hypot(*np.diff(often, axis=0).T)) == pytest.approx(480, rel=0.05)
    assert np.median(size) == pytest.approx(15, rel=0.2)
    assert np.hypot(*path.T).max() < 200  # the gaze stays about


def test_a_path_is_a_function_of_time():
    one = FixationalMovements(seed=5)
    whole = one.at([0.0, 0.5, 1.0])
    assert one.at([0.5]) == pytest.approx(whole[1:2])
    assert not np.allclose(FixationalMovements(seed=6).at([0.5]), whole[1:2])


def test_gaze_moves_the_image_the_other_way_by_as_many_pixels():
    """The centroid of a spot moves by minus the direction of gaze, in colour too, also by parts of a pixel."""
    angle, movements, times = np.radians(1 / 60), FixationalMovements(seed=3), [0.0, 0.2, 0.7, 1.5]
    y, x = np.mgrid[:129, :129] - 64.0
    spot = np.exp(-(x**2 + y**2) / (2 * 4.0**2))
    seen = movements.moved(np.stack([spot, 2 * spot], axis=-1), times, pixel_angle=angle)
    gaze = movements.at(times) / angle
    assert np.abs(gaze).max() > 3
    for one, (right, down) in zip(seen, gaze, strict=True):
        for light in (one[..., 0], one[..., 1]):
            assert (light * x).sum() / light.sum() == pytest.approx(-right, abs=0.01)
            assert (light * y).sum() / light.sum() == pytest.approx(-down, abs=0.01)
