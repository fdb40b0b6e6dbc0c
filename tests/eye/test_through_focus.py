"""The transfer of an aberrated pupil at many defoci and on grids, against the quadrature at each place."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from focalgradient.eye.through_focus import through_focus
from focalgradient.eye.wavefront import Aberrations, Pupil, pupil_transfer_of

NATURAL: Aberrations = (
    (2, -2, 0.1),
    (2, 2, -0.15),
    (3, -1, -0.1),
    (3, 1, 0.12),
    (3, -3, -0.08),
    (4, 0, 0.1),
    (5, 1, 0.03),
)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("diameter", "aberrations", "stiles_crawford"),
    [
        (0.003, NATURAL, 0.0),
        (0.005, NATURAL, 0.05),
        (0.006, ((2, -2, 3.0), (3, 1, 0.1)), 0.0),
        (0.004, ((2, 2, 1.6),), 0.0),  # 3.9 D of astigmatism, as 40 degrees off axis
        (0.006, ((3, 1, 0.5),), 0.0),
    ],
)
def test_through_focus_agrees_with_the_quadrature(
    diameter: float, aberrations: Aberrations, stiles_crawford: float
) -> None:
    random = np.random.default_rng(3)
    cut_off = diameter / 480e-9  # cycles per radian
    share, way = np.linspace(0, 1, 60), random.uniform(0, 2 * np.pi, 60)
    down, right = cut_off * share * np.sin(way), cut_off * share * np.cos(way)
    defocus = np.linspace(-1.5, 1.5, 7)
    found = through_focus(down, right, Pupil(diameter, 480.0, 0.2, aberrations, stiles_crawford), defocus)
    assert found[:, 0] == pytest.approx(1, abs=1e-4)
    for row, more in zip(found, defocus.tolist(), strict=True):
        exact = pupil_transfer_of(down, right, Pupil(diameter, 480.0, 0.2 + more, aberrations, stiles_crawford))
        assert np.abs(row - exact).max() < 1e-3


def test_defoci_need_not_be_even_and_nothing_passes_beyond_the_cut_off() -> None:
    pupil = Pupil(0.004, 555.0, 0.0, NATURAL)
    down, right = np.array([300.0, -700.0]), np.array([500.0, 100.0])
    even = through_focus(down, right, pupil, np.linspace(0, 1, 5))
    some = through_focus(down, right, pupil, np.array([0.0, 0.25, 1.0]))
    assert np.allclose(some, even[[0, 1, 4]], atol=1e-6)
    assert not through_focus(np.zeros(1), np.array([8000.0]), pupil, np.zeros(2)).any()


@pytest.mark.parametrize(
    ("aberrations", "side_open"), [(((3, 1, 0.15), (3, -3, 0.1), (5, 1, 0.05)), True), (((4, 0, 0.1),), False)]
)
def test_odd_aberrations_leave_the_side_of_focus_open_and_even_ones_do_not(
    aberrations: Aberrations, side_open: bool
) -> None:
    """Of one view in one wavelength: the contrast left is the same on either side."""
    down, right = np.random.default_rng(1).uniform(-1200, 1200, (2, 60))
    beyond, nearer = np.abs(through_focus(down, right, Pupil(0.004, 555.0, 0.0, aberrations), np.array([0.5, -0.5])))
    if side_open:
        assert beyond == pytest.approx(nearer, abs=2e-3)
    else:
        assert np.abs(beyond - nearer).max() > 0.05


COMATIC: Aberrations = ((4, 0, 0.1), (3, 1, 0.2), (3, -3, 0.1))


@pytest.mark.parametrize(
    "pupil",
    [
        Pupil(0.004, 555.0, 0.5, COMATIC, 0.05),
        Pupil(0.006, 555.0, 2.0, COMATIC),
        Pupil(0.003, 555.0, 0.0, (), 0.05),
        Pupil(0.0025, 555.0, 0.5, ((2, 2, 0.2),)),
    ],
)
def test_the_grid_agrees_with_the_quadrature(pupil: Pupil) -> None:
    for side, pixel_angle in ((25, 3e-4), (51, 6e-4), (40, 6e-5)):  # to the pupil's own limit in the last
        down, right = np.fft.fftfreq(side)[:, None] / pixel_angle, np.fft.rfftfreq(side)[None] / pixel_angle
        grid = pupil_transfer_of(down, right, pupil)
        assert grid[0, 0] == pytest.approx(1)
        random = np.random.default_rng(side)
        i, j = random.integers(0, side, 15), random.integers(0, side // 2 + 1, 15)
        places = pupil_transfer_of(down[i, 0], right[0, j], pupil)
        assert np.abs(grid[i, j] - places).max() < 3e-4


def test_frequencies_that_are_no_grid_are_taken_one_by_one() -> None:
    pupil = Pupil(0.004, 555.0, 0.5, COMATIC)
    down, right = np.array([[0.0], [100.0], [137.1], *([[1000 * np.pi]] * 14)]), np.array([[0.0, 55.5]])
    grid = pupil_transfer_of(down, right, pupil)
    each, across = np.broadcast_arrays(down, right)
    assert np.allclose(grid, pupil_transfer_of(each, across, pupil), atol=1e-12)


def test_a_fine_line_of_frequencies_takes_no_more_memory_than_its_terms() -> None:
    """By FFT samples of the pupil fill 1.6 GB for a step of 0.05 cycles a degree, and 25 times as much for 0.01."""
    frequency = np.degrees(np.arange(0, 20, 0.05))[:, None]
    pupil = Pupil(0.004, 555.0, 0.5, COMATIC)
    tracemalloc.start()
    line = pupil_transfer_of(frequency, np.zeros((1, 1)), pupil)
    assert tracemalloc.get_traced_memory()[1] < 4e8
    tracemalloc.stop()
    assert line[::20, 0] == pytest.approx(pupil_transfer_of(frequency[::20, 0], np.zeros(20), pupil), abs=1e-9)
