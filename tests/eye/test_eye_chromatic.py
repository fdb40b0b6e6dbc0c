"""Chromatic difference of refraction against the literature."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient.eye import Eye, chromatic_difference, chromatic_wavelength

LIGHT = st.floats(380, 780)


def test_values_of_the_chromatic_eye() -> None:
    """Worked by hand from Thibos et al. 1992: R(450) = -1.000, R(550) = -0.201, R(580) = -0.046, R(650) = 0.232."""
    assert chromatic_difference([450, 550, 650]) == pytest.approx([-0.954, -0.155, 0.278], abs=1.0e-3)
    assert chromatic_difference(589) - chromatic_difference(580) == pytest.approx(0.042, abs=5e-4)


def test_spans_of_the_chromatic_eye() -> None:
    """Its span from 400 to 700 nm is near the 2.1 D of the literature; 1.232 D from 450 to 650 nm."""
    assert chromatic_difference(650, 450) == pytest.approx(1.232, abs=5e-4)
    assert chromatic_difference(700, 400) == pytest.approx(2.104, abs=5e-4)


@given(LIGHT, LIGHT, LIGHT)
def test_differences_add_up(one: float, two: float, three: float) -> None:
    assert chromatic_difference(three, one) == pytest.approx(
        chromatic_difference(two, one) + chromatic_difference(three, two), abs=1e-9
    )


@given(LIGHT, LIGHT)
def test_a_wavelength_is_found_by_its_difference(light: float, reference: float) -> None:
    assert chromatic_wavelength(chromatic_difference(light, reference), reference) == pytest.approx(light, abs=1e-6)


def test_an_individual_has_more_or_less_of_it() -> None:
    spans = [
        Eye(0.004, 0.0, 450, scale).focus_vergence - Eye(0.004, 0.0, 650, scale).focus_vergence
        for scale in (0.0, 1.0, 1.25)
    ]
    assert spans == pytest.approx([0, 1.232, 1.540], abs=5e-4)
