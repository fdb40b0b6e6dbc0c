"""What cones catch, and how far apart their bands are focused."""

import numpy as np
import pytest

from focalgradient.eye import (
    Light,
    band_light,
    chromatic_difference,
    cone_fundamentals,
    illuminant,
    luminosity,
)


def test_bands_are_focused_as_far_apart_as_in_the_literature() -> None:
    """0.82 D in equal energy, 0.78 D in daylight: the paper's "one dioptre"."""
    for light, dioptres in (("E", 0.823), ("D65", 0.783)):
        apart = band_light("L+M", light).difference() - band_light("S", light).difference()
        assert apart == pytest.approx(dioptres, abs=5e-4)


def test_sensitivities_are_those_of_people() -> None:
    nm = np.arange(380, 781)
    cones = cone_fundamentals(nm)
    assert cones.shape == (401, 3)
    assert nm[cones.argmax(axis=0)] == pytest.approx([570, 543, 442], abs=2)
    assert cones.max(axis=0) == pytest.approx(1, abs=1e-3)
    assert nm[luminosity(nm).argmax()] == pytest.approx(556, abs=2)
    assert luminosity(nm).max() == pytest.approx(1, abs=1e-3)
    assert (cones[nm < 390] == 0).all()


def test_luminance_is_a_sum_of_l_and_m() -> None:
    """By definition of the CIE 2008 observer: 0.6899 L + 0.3483 M."""
    nm = np.arange(400, 701, 10)
    assert cone_fundamentals(nm)[:, :2] @ [0.689903, 0.348322] == pytest.approx(luminosity(nm), abs=2e-3)


def test_illuminants() -> None:
    assert illuminant([560, 600], "E") == pytest.approx([100, 100])
    assert float(illuminant(560)) == pytest.approx(100)
    assert illuminant(450, "A") < 40 < 110 < illuminant(450, "D65")


def test_light_of_one_wavelength_and_of_two() -> None:
    one = Light(np.array([500.0]), np.array([3.0]))
    assert one.share == pytest.approx([1])
    assert one.effective_wavelength_nm == pytest.approx(500)
    two = Light(np.array([500.0, 600.0]), np.array([1.0, 3.0]))
    assert two.difference() == pytest.approx(
        0.25 * float(chromatic_difference(500)) + 0.75 * float(chromatic_difference(600))
    )
    assert two.difference(600) == pytest.approx(0.25 * float(chromatic_difference(500, 600)))
