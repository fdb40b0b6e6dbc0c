"""The eye's signs, written once: what is nearer is sharper in blue, and what follows from it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient.eye import REFERENCE_NM, Eye, Oscillation, blur_transfer, chromatic_difference, point_spread
from focalgradient.eye.wavefront import defocus_term

LIGHT = st.floats(380, 780)


def test_the_reference_is_580_nm() -> None:
    assert REFERENCE_NM == 580
    assert Eye(0.004, 1.5).focus_vergence == 1.5 == Eye(0.004, 1.5, 580).focus_vergence
    assert chromatic_difference(580) == 0


@given(LIGHT, LIGHT)
def test_blue_is_refracted_more(one: float, other: float) -> None:
    """A lower refraction is a stronger eye, that is, one in focus nearer."""
    blue, red = sorted([one, other])
    assert chromatic_difference(blue) <= chromatic_difference(red)
    assert Eye(0.004, 1.0, blue).focus_vergence >= Eye(0.004, 1.0, red).focus_vergence


def test_nearer_is_sharper_in_blue_and_farther_in_red() -> None:
    eye = Eye(0.004, accommodation=2.0)
    blue, red = eye.in_light(450), eye.in_light(650)
    near, far = 1 / 3.0, 1 / 1.5  # m: 1 D nearer than the focus, and 0.5 D beyond it
    assert blue.blur_radius(near) < eye.blur_radius(near) < red.blur_radius(near)
    assert blue.blur_radius(far) > eye.blur_radius(far) > red.blur_radius(far)


@pytest.mark.parametrize("model", ["disc", "gaussian", "wave"])
def test_nearer_is_sharper_in_blue_by_every_model(model: str) -> None:
    eye = Eye(0.004, accommodation=2.0)
    frequency = np.linspace(1, 6, 6)
    blue, red = (blur_transfer(0, np.degrees(frequency), eye.in_light(nm), 2.5, model=model) for nm in (470, 620))  # type: ignore
    assert (blue > np.abs(red)).all()


def test_defocus_is_positive_beyond_the_plane_of_focus_and_accommodation_brings_it_nearer() -> None:
    eye = Eye(0.004, accommodation=2.0)
    assert eye.defocus(1.0) == 1.0
    assert eye.defocus(0.25) == -2.0
    assert eye.in_light(450).defocus(0.5) > 0  # what yellow light shows sharp is beyond the focus of blue
    near, far = Eye(0.004, 1.0).through([0.125, 0.375], Oscillation(0.25, 2.0))
    assert (near.focus_vergence, far.focus_vergence) == pytest.approx((1.25, 0.75))


def test_positive_defocus_is_a_positive_zernike_term() -> None:
    """Spherical aberration tells the two sides of focus apart, and so whether the term stands for the right one."""
    assert defocus_term(0.5, 0.004) > 0
    angles = np.linspace(-1e-3, 1e-3, 9)

    def spread(accommodation: float, *terms: tuple[int, int, float]) -> np.ndarray:
        eye = Eye(0.004, accommodation, aberrations=((4, 0, 0.1), *terms))
        return point_spread(angles, angles, eye, vergence=1.0)

    by_defocus, by_term, opposite = spread(1.5), spread(1.0, (2, 0, 0.288675135)), spread(0.5)
    assert by_term == pytest.approx(by_defocus, rel=1e-5)
    assert np.abs(opposite / by_defocus - 1).max() > 0.5


def test_a_wavefront_that_rises_to_the_right_moves_light_to_the_right() -> None:
    """c(1, 1) of 1 um tilts the wavefront by 2 um over 2 mm: by 1 mrad."""
    angles = np.linspace(-2e-3, 2e-3, 81)
    tilted = point_spread(angles, angles, Eye(0.004, 1.0, aberrations=((1, 1, 1.0),)), vergence=1.0)
    row, column = np.unravel_index(tilted.argmax(), tilted.shape)
    assert angles[[row, column]] == pytest.approx([0, 1e-3], abs=1e-9)
