"""Eyes of a refraction and an age: focus, astigmatism and pupil by hand, and a frozen record as any other eye."""

import math
from dataclasses import replace

import numpy as np
import pytest

from focalgradient.eye import CORRECTIONS, Correction, Eye, Refraction, ZonedLens, natural_pupil

MYOPE = "-2.00 -0.75 x 180"


def test_a_relaxed_eye_is_focused_at_its_far_points():
    """-2.00 D along x, -2.75 D along y, 12 mm before the cornea: 1.953 and 2.662 D at it."""
    eye = Eye(refraction=MYOPE, age=30, pupil_diameter=0.004)
    along_x, along_y = 2.0 / 1.024, 2.75 / 1.033
    assert eye.accommodation == pytest.approx((along_x + along_y) / 2)
    ((n, m, um),) = eye.aberrations
    # The vergence of a c(2, 2) over a radius r is 2 sqrt(6) c / r^2 along x, and its opposite along y.
    assert (n, m) == (2, 2)
    assert 2 * math.sqrt(6) * um / 2.0**2 == pytest.approx((along_x - along_y) / 2)


@pytest.mark.parametrize(("metres", "response"), [(0.4, 2.179), (0.25, 3.492)])
def test_accommodation_behind_spectacles_follows_vergence_traced_by_hand(metres, response):
    """-6 D: divergence from the target, through the lens at 12 mm and on to the cornea, less the eye's own error."""
    at_lens = -1 / (metres - 0.012) - 6.0
    needed = -6.0 / 1.072 - at_lens / (1 - 0.012 * at_lens)
    assert needed == pytest.approx(response, abs=1e-3)
    for given in ({"looking_at": 1 / metres}, {"response": needed}):
        eye = Eye(0.004, refraction="-6.00", age=25, correction="spectacles", **given)
        assert eye.focus_vergence == pytest.approx(1 / metres, abs=1e-6)
    assert Eye(0.004, refraction="-6.00", response=needed).focus_vergence == pytest.approx(6 / 1.072 + needed)


def test_what_is_worn_is_given_by_name_or_as_a_lens():
    for name, worn in CORRECTIONS.items():
        assert Eye(refraction=MYOPE, age=30, correction=name) == Eye(refraction=MYOPE, age=30, correction=worn)
    assert Eye(refraction=MYOPE, age=30, correction="none") == Eye(refraction=MYOPE, age=30)
    reading = Eye(age=75, correction=Correction(Refraction(2.0)))  # focused 0.5 m before a lens at 12 mm
    assert reading.focus_vergence == pytest.approx(1 / 0.512)


def test_the_amplitude_of_its_age_bounds_accommodation():
    """At 40 years 7.083 / (1 + e^(0.2031 x 3.8 - 0.6109)) = 3.26 D (Anderson et al. 2008)."""
    assert Eye(age=40, looking_at=8.0).focus_vergence == pytest.approx(3.257, abs=1e-3)
    assert Eye(age=40, response=3.25).focus_vergence == pytest.approx(3.25)
    assert Eye(0.004, refraction="plano", looking_at=8.0).focus_vergence == pytest.approx(8.0)  # no age, no limit
    relaxed = Eye(0.004, refraction="-3.00", age=30, looking_at=1.0)
    assert relaxed.focus_vergence == pytest.approx(3 / 1.036)  # not beyond its relaxed state


def test_without_a_diameter_the_pupil_is_the_natural_one():
    assert Eye(age=60).pupil_diameter == float(natural_pupil(100.0, age=60, field_deg=20.0))
    dim = Eye(refraction="-1.00", age=25, luminance=0.5, field_deg=40.0)
    assert dim.pupil_diameter == float(natural_pupil(0.5, age=25, field_deg=40.0))
    assert Eye(refraction="plano").pupil_diameter == float(natural_pupil(100.0))
    assert Eye(0.005, age=15).pupil_diameter == 0.005  # an age of which the pupil's formula knows nothing


def test_everything_else_of_an_eye_goes_with_a_refraction():
    lens = ZonedLens((0.002, 0.008), (2.0, 0.0))
    others = {"wavelength_nm": 550.0, "chromatic_scale": 0.9, "stiles_crawford": 0.05, "pupil_offset": (3e-4, 0.0)}
    eye = Eye(0.004, aberrations=((2, 2, 0.1), (4, 0, 0.05)), lens=lens, **others, refraction=MYOPE)
    plain = Eye(0.004, refraction=MYOPE)
    astigmatism = plain.aberrations[0][2]
    assert eye.aberrations == ((2, 2, pytest.approx(astigmatism + 0.1)), (4, 0, 0.05))
    assert eye == replace(plain, aberrations=eye.aberrations, lens=lens, **others)


def test_the_blur_is_that_of_its_far_points():
    """At 8 c/deg a relaxed eye of -2.00 D passes most from 1.953 D, as one that is focused there."""
    fine = np.degrees(8.0)
    near, far = (float(abs(Eye(0.004, refraction="-2.00").optical_transfer(0.0, fine, v))) for v in (1.953, 1.0))
    assert near == pytest.approx(float(abs(Eye(0.004, 1.953).optical_transfer(0.0, fine, 1.953))), abs=1e-3)
    assert far < 0.2 < 0.7 < near
