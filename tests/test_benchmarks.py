"""Benchmarks' own scenes: they are made, and read as well as the benchmarks' documents say."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from focalgradient import recover_depth


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "benchmarks")


def test_four_bands_read_gaussian_blur_better_than_one() -> None:
    found = import_module("realtime").band_errors(2.0, tries=1)
    assert found["1+2+4+8"][0] < 10 < found["8"][0]
    assert found["1+2+4+8"][1] > 0.95


def test_a_wall_of_gaussian_blur_is_read() -> None:
    trial = import_module("recover_depth").gaussian_wall(1.4, (120, 160))
    depth = recover_depth(trial.views, near=0.85, psf="gaussian")
    assert abs(np.median(depth.distance[depth.valid]) - 1.4) < 0.01
