"""From colours to cones, against what colours must do whoever works them out."""

import numpy as np
import pytest

from focalgradient.eye import cone_fundamentals, cone_images


def test_white_is_one_for_every_cone_class() -> None:
    assert cone_images(np.full((2, 3, 3), 0.4)) == pytest.approx(0.4)
    assert cone_images(np.full((1, 1, 9), 2.0), wavelength_nm=np.linspace(400, 720, 9)) == pytest.approx(2)


def test_light_adds() -> None:
    first, second = np.random.default_rng(0).random((2, 4, 5, 3))
    assert cone_images(first + 2 * second) == pytest.approx(cone_images(first) + 2 * cone_images(second))


def test_one_wavelength_is_caught_by_its_sensitivity() -> None:
    nm = np.arange(390.0, 781.0, 5.0)
    line = np.zeros((1, 1, nm.size))
    line[0, 0, list(nm).index(550.0)] = 1
    whole = cone_fundamentals(nm).sum(axis=0)
    assert cone_images(line, wavelength_nm=nm)[0, 0] == pytest.approx(cone_fundamentals(550.0) / whole, rel=1e-6)


def test_displays_differ_and_red_is_for_l_cones() -> None:
    red = np.array([[[1.0, 0.0, 0.0]]])
    seen = [cone_images(red, primaries=name)[0, 0] for name in ("Typical CRT Brainard 1997", "Apple Studio Display")]
    assert not np.allclose(*seen, atol=1e-3)
    for one in seen:
        assert one[0] > one[1] > one[2]


def test_cones_that_catch_nothing_of_a_light_see_nothing() -> None:
    seen = cone_images(np.ones((1, 1, 3)), wavelength_nm=[660.0, 680.0, 700.0])
    assert seen[0, 0].tolist() == pytest.approx([1, 1, 0])
