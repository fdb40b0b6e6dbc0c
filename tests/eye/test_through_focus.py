"""The transfer of an aberrated pupil at many defoci at once, against the quadrature at each."""

from __future__ import annotations

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
        (0.004, (), 0.0),
        (0.006, ((3, 1, 0.5),), 0.0),
        (0.004, ((2, 2, 1.6),), 0.0),  # 3.9 D of astigmatism, as 40 degrees off axis
        (0.006, ((2, -2, 3.0), (3, 1, 0.1)), 0.0),
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


def test_defoci_need_not_be_even() -> None:
    pupil = Pupil(0.004, 555.0, 0.0, NATURAL)
    down, right = np.array([300.0, -700.0]), np.array([500.0, 100.0])
    even = through_focus(down, right, pupil, np.linspace(0, 1, 5))
    some = through_focus(down, right, pupil, np.array([0.0, 0.25, 1.0]))
    assert np.allclose(some, even[[0, 1, 4]], atol=1e-6)


def test_nothing_passes_beyond_the_cut_off() -> None:
    assert through_focus(np.zeros(1), np.array([8000.0]), Pupil(0.004, 555.0, 0.0, NATURAL), np.zeros(2)).tolist() == [
        [0],
        [0],
    ]


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
