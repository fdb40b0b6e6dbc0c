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


def test_halves_of_a_pupil_move_apart_by_the_distance_of_their_centres() -> None:
    """8 / (3 pi) radii for each dioptre; views alike do not tell the side of focus."""
    halves = import_module("pupil_halves")
    pairs = halves.pairs()
    expected = 60 * np.degrees(8 / (3 * np.pi) * halves.PUPIL / 2)
    assert halves.shift(*pairs["halves"]) == pytest.approx(expected, rel=0.03)
    whole, half = (halves.through(*pairs[name]) for name in ("whole pupil", "halves"))
    assert halves.divergence(whole) == pytest.approx(0, abs=1e-6)
    assert halves.divergence(half) > 50
    assert halves.deviation(half) < halves.deviation(whole)
