"""The transfer of an aberrated eye on a grid of frequencies, by FFT, against the quadrature place by place."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from focalgradient.eye.wavefront import Aberrations, Pupil, pupil_transfer_of

NATURAL: Aberrations = ((4, 0, 0.1), (3, 1, 0.2), (3, -3, 0.1))


@pytest.mark.parametrize("defocus", [0.0, 0.5, 2.0])
@pytest.mark.parametrize(
    ("diameter", "aberrations", "stiles_crawford"),
    [(0.004, NATURAL, 0.05), (0.006, NATURAL, 0.0), (0.003, (), 0.05), (0.0025, ((2, 2, 0.2),), 0.0)],
)
def test_the_grid_agrees_with_the_quadrature(
    diameter: float, aberrations: Aberrations, stiles_crawford: float, defocus: float
) -> None:
    pupil = Pupil(diameter, 555.0, defocus, aberrations, stiles_crawford)
    for side, pixel_angle in ((25, 3e-4), (51, 6e-4), (40, 6e-5)):  # to the pupil's own limit in the last
        down, right = np.fft.fftfreq(side)[:, None] / pixel_angle, np.fft.rfftfreq(side)[None] / pixel_angle
        grid = pupil_transfer_of(down, right, pupil)
        assert grid[0, 0] == pytest.approx(1)
        random = np.random.default_rng(side)
        i, j = random.integers(0, side, 15), random.integers(0, side // 2 + 1, 15)
        places = pupil_transfer_of(down[i, 0], right[0, j], pupil)
        assert np.abs(grid[i, j] - places).max() < 3e-4


def test_frequencies_that_are_no_grid_are_taken_one_by_one() -> None:
    pupil = Pupil(0.004, 555.0, 0.5, NATURAL)
    down, right = np.array([[0.0], [100.0], [137.1], *([[1000 * np.pi]] * 14)]), np.array([[0.0, 55.5]])
    grid = pupil_transfer_of(down, right, pupil)
    each, across = np.broadcast_arrays(down, right)
    assert np.allclose(grid, pupil_transfer_of(each, across, pupil), atol=1e-12)


def test_a_fine_line_of_frequencies_takes_no_more_memory_than_its_terms() -> None:
    """By FFT samples of the pupil fill 1.6 GB for a step of 0.05 cycles a degree, and 25 times as much for 0.01."""
    frequency = np.degrees(np.arange(0, 20, 0.05))[:, None]
    pupil = Pupil(0.004, 555.0, 0.5, NATURAL)
    tracemalloc.start()
    line = pupil_transfer_of(frequency, np.zeros((1, 1)), pupil)
    assert tracemalloc.get_traced_memory()[1] < 4e8
    tracemalloc.stop()
    assert line[::20, 0] == pytest.approx(pupil_transfer_of(frequency[::20, 0], np.zeros(20), pupil), abs=1e-9)
