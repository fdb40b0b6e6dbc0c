"""Chromatic difference of refraction and of position, against the literature, rays and measured people."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient.eye import Cones, Eye, chromatic_difference, chromatic_wavelength, point_spread

LIGHT = st.floats(380, 780)


def test_values_of_the_chromatic_eye() -> None:
    """Worked by hand from Thibos et al. 1992: R(450) = -1.000, R(550) = -0.201, R(580) = -0.046, R(650) = 0.232."""
    assert chromatic_difference([450, 550, 650]) == pytest.approx([-0.954, -0.155, 0.278], abs=1.0e-3)
    assert chromatic_difference(589) - chromatic_difference(580) == pytest.approx(0.042, abs=5e-4)
    # Its span from 400 to 700 nm is near the 2.1 D of the literature.
    assert chromatic_difference(650, 450) == pytest.approx(1.232, abs=5e-4)
    assert chromatic_difference(700, 400) == pytest.approx(2.104, abs=5e-4)


@given(LIGHT, LIGHT)
def test_a_wavelength_is_found_by_its_difference(light: float, reference: float) -> None:
    assert chromatic_wavelength(chromatic_difference(light, reference), reference) == pytest.approx(light, abs=1e-6)


OFFSET = Eye(0.003, 1.0, pupil_offset=(0.0005, -0.0003))


def centroid(eye: Eye) -> tuple[float, float]:
    """Middle (x, y) of the light of a point in focus at 580 nm, in radians, of its waves."""
    angle = np.linspace(-3e-3, 3e-3, 241)
    light = point_spread(angle, angle, eye, 1.0)
    return float(light.sum(axis=0) @ angle / light.sum()), float(light.sum(axis=1) @ angle / light.sum())


@pytest.mark.parametrize("nm", [480.0, 580.0, 650.0])
def test_the_light_of_a_point_moves_by_offset_times_chromatic_difference(nm):
    change = -float(chromatic_difference(nm))
    assert centroid(OFFSET.in_light(nm)) == pytest.approx((change * 0.0005, change * -0.0003), abs=6e-6)


def test_cones_of_a_decentred_eye_lose_contrast_along_the_shift():
    cones = Cones.of(Eye(0.003, 1.0, pupil_offset=(0.001, 0.0)), "luminance", wavelengths=7)
    assert not cones.isotropic
    f = np.degrees(20.0)
    across, along = abs(cones.optical_transfer(f, 0.0, 1.0)), abs(cones.optical_transfer(0.0, f, 1.0))
    assert along < 0.95 * across
    through = cones.through_focus(np.array([0.0]), np.array([f]), [1.0])[0]
    assert complex(through[0]) == pytest.approx(complex(cones.optical_transfer(0.0, f, 1.0)), abs=2e-3)
