"""Fixational eye movements: their statistics against what was asked for."""

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import FixationalMovements

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
    assert np.median(size) == pytest.approx(15, rel=0.2)
    assert np.hypot(*path.T).max() < 200  # the gaze stays about


def test_a_path_is_a_function_of_time():
    one = FixationalMovements(seed=5)
    whole = one.at([0.0, 0.5, 1.0])
    assert one.at([0.5]) == pytest.approx(whole[1:2])
    assert not np.allclose(FixationalMovements(seed=6).at([0.5]), whole[1:2])


@pytest.mark.parametrize("bad", [{"diffusion": -1}, {"rate": -1}, {"amplitude": np.nan}, {"seed": 1.5}])
def test_bad_input(bad):
    with pytest.raises(InputError, match=f"{next(iter(bad))} is"):
        FixationalMovements(**bad)
    with pytest.raises(InputError, match="the first time is -1"):
        FixationalMovements().at([-1.0, 0.0])
