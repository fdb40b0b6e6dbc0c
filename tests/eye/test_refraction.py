"""Prescriptions, lenses before the eye, and age: closed forms, published numbers, and the image itself."""

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import (
    CORRECTIONS,
    Correction,
    Eye,
    Refraction,
    accommodation_amplitude,
    natural_pupil,
)
from focalgradient.eye.refraction import focus_of


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("-2.00 -0.75 x 180", (-2.0, -0.75, 180.0)),
        ("+1.25", (1.25, 0.0, 0.0)),
        ("plano -0.50x90", (0.0, -0.5, 90.0)),
        ("−2.00 / −1.25 × 25", (-2.0, -1.25, 25.0)),
        ("-2.00 DS +0.50 DC x 5", (-2.0, 0.5, 5.0)),
    ],
)
def test_prescriptions_are_read_as_they_are_written(text, parts):
    read = Refraction.parse(text)
    assert (read.sphere, read.cylinder, read.axis) == parts


@pytest.mark.parametrize("text", ["", "-2.00 -0.75", "two", "-2 x 90", "-2 -1 x 200", "-200"])
def test_what_is_no_prescription_is_refused(text):
    with pytest.raises(InputError, match=r"refraction is|axis is|sphere is"):
        Refraction.parse(text)


def test_power_vectors_of_thibos_wheeler_and_horner():
    """Plus and minus cylinders of one lens have one power vector."""
    minus, plus = Refraction(-2.0, -0.75, 30.0), Refraction(-2.75, 0.75, 120.0)
    assert minus.power_vector == pytest.approx(plus.power_vector)
    meridian = np.array([np.cos(np.radians(30)), np.sin(np.radians(30))])
    assert meridian @ minus.matrix @ meridian == pytest.approx(-2.0)  # no power of the cylinder along its axis


def test_effectivity_of_textbooks():
    """-10 D at 12 mm is -8.93 D at the cornea; +10 D is +11.36 D."""
    for prescribed, ocular in ((-10.0, -8.93), (10.0, 11.36)):
        focus = focus_of(Refraction(prescribed), 0.0, CORRECTIONS["none"])
        assert -focus[0, 0] == pytest.approx(ocular, abs=0.005)


def test_the_demand_of_spectacles_against_vergence_traced_by_hand():
    """A target at 1/3 m: -5 D spectacles at 14 mm ask for less accommodation than 3 D, +5 D for more."""
    for power in (-5.0, 5.0):
        worn = Correction(Refraction(power), 0.014)
        at_lens = -1 / (1 / 3 - 0.014)
        behind = at_lens + power
        at_eye = behind / (1 - 0.014 * behind)
        ocular = power / (1 - 0.014 * power)
        focus = focus_of(Refraction(power), ocular - at_eye, worn, vertex=0.014)
        assert focus[0, 0] == pytest.approx(3.0)
        assert (ocular - at_eye < 3.0) is (power < 0)


def test_full_corrections_focus_far_and_a_contact_lens_leaves_accommodation_as_it_is():
    one = Refraction(-4.0, -1.5, 20.0)
    for name in ("spectacles", "contact-lens"):
        assert focus_of(one, 0.0, CORRECTIONS[name]) == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    assert focus_of(one, 2.5, CORRECTIONS["contact-lens"]) == pytest.approx(2.5 * np.eye(2))


def test_an_astigmatic_eye_focuses_each_meridian_where_its_prescription_says():
    """-1.00 -2.00 x 180: the vertical meridian's far point is near 3 D, and detail along y is sharp there."""
    eye = Eye(0.003, refraction=Refraction(-1.0, -2.0, 180.0), age=30, correction=Correction(Refraction(), 0.0))
    far_point = {axis: -focus for axis, focus in (("x", -1 / 1.012), ("y", -3 / 1.036))}
    fine = np.degrees(6.0)
    for axis, vergence in far_point.items():
        contrast = {
            "x": abs(complex(eye.optical_transfer(0.0, fine, vergence))),
            "y": abs(complex(eye.optical_transfer(fine, 0.0, vergence))),
        }
        other = "y" if axis == "x" else "x"
        assert contrast[axis] > 0.8
        assert contrast[other] < 0.4


def test_an_oblique_axis_is_that_of_the_examiner():
    """Axis 45, counter-clockwise for the examiner, as the OSA's x and y: c(2, -2) is -J45 r^2 / (2 sqrt 6)."""
    eye = Eye(0.004, refraction="-1.00 -1.00 x 45", age=30)
    terms = {(n, m): c for n, m, c in eye.aberrations}
    ocular = [power / (1 - 0.012 * power) for power in (-1.0, -2.0)]
    assert terms[2, -2] == pytest.approx(-(ocular[0] - ocular[1]) / 2 * 4 / (2 * 6**0.5))
    assert (2, 2) not in terms


def test_presbyopes_do_not_reach_what_is_near():
    near = [Eye(age=age, looking_at=4.0).focus_vergence for age in (25, 45, 65)]
    assert near[0] == pytest.approx(4.0)
    assert near[1] == pytest.approx(float(accommodation_amplitude(45)))
    assert near[2] < 0.1


def test_one_eye_sees_as_a_tenth_of_the_light_of_two():
    assert natural_pupil(100.0, eyes=1) == pytest.approx(natural_pupil(10.0, eyes=2))


def test_amplitudes_of_anderson_et_al():
    """Nearly constant below 20 years, a taper to nothing beyond 50."""
    assert accommodation_amplitude(20) > 0.96 * 7.083
    assert accommodation_amplitude(55) < 0.3
    assert accommodation_amplitude(36.2 + 0.6109 / 0.2031) == pytest.approx(7.083 / 2)
