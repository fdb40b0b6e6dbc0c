"""Prescriptions, lenses before the eye, age and descriptions: closed forms, published numbers, and the image itself."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import (
    CORRECTIONS,
    EMMETROPES,
    MYOPES,
    Cones,
    Correction,
    Eye,
    EyeDescription,
    Refraction,
    ViewingConditions,
    ZonedLens,
    accommodation_amplitude,
    compared_views,
    image_quality,
    natural_pupil,
    off_axis,
    point_images,
    read_eye,
    resolved_cpd,
)
from focalgradient.eye.refraction import focus_of


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("-2.00 -0.75 x 180", (-2.0, -0.75, 180.0)),
        ("-2 -0.75 180", (-2.0, -0.75, 180.0)),
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
        along_x, along_y = (abs(eye.optical_transfer(y, x, vergence)) for y, x in ((0.0, fine), (fine, 0.0)))
        sharp, blurred = (along_x, along_y) if axis == "x" else (along_y, along_x)
        assert sharp > 0.8
        assert blurred < 0.4


def test_an_oblique_axis_is_that_of_the_examiner():
    """Axis 45, counter-clockwise for the examiner, as the OSA's x and y: c(2, -2) is -J45 r^2 / (2 sqrt 6)."""
    eye = Eye(0.004, refraction="-1.00 -1.00 x 45", age=30)
    terms = {(n, m): c for n, m, c in eye.aberrations}
    ocular = [power / (1 - 0.012 * power) for power in (-1.0, -2.0)]
    assert terms[2, -2] == pytest.approx(-(ocular[0] - ocular[1]) / 2 * 4 / (2 * 6**0.5))
    assert (2, 2) not in terms


def test_amplitudes_of_anderson_et_al_bound_what_presbyopes_reach():
    """Nearly constant below 20 years, a taper to nothing beyond 50."""
    assert accommodation_amplitude(20) > 0.96 * 7.083
    assert accommodation_amplitude(55) < 0.3
    near = [Eye(age=age, looking_at=4.0).focus_vergence for age in (25, 45, 65)]
    assert near[0] == pytest.approx(4.0)
    assert near[1] == pytest.approx(float(accommodation_amplitude(45)))
    assert near[2] < 0.1


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


def test_without_a_diameter_the_pupil_is_the_natural_one_of_one_eye_or_two():
    assert Eye(age=60).pupil_diameter == float(natural_pupil(100.0, age=60, field_deg=20.0))
    dim = Eye(refraction="-1.00", age=25, luminance=0.5, field_deg=40.0)
    assert dim.pupil_diameter == float(natural_pupil(0.5, age=25, field_deg=40.0))
    assert Eye(refraction="plano").pupil_diameter == float(natural_pupil(100.0))
    assert Eye(0.005, age=15).pupil_diameter == 0.005  # an age of which the pupil's formula knows nothing
    assert natural_pupil(100.0, eyes=1) == pytest.approx(natural_pupil(10.0, eyes=2))


def test_everything_else_of_an_eye_goes_with_a_refraction():
    lens = ZonedLens((0.002, 0.008), (2.0, 0.0))
    others = {"wavelength_nm": 550.0, "chromatic_scale": 0.9, "stiles_crawford": 0.05, "pupil_offset": (3e-4, 0.0)}
    eye = Eye(0.004, aberrations=((2, 2, 0.1), (4, 0, 0.05)), lens=lens, **others, refraction=MYOPE)
    plain = Eye(0.004, refraction=MYOPE)
    astigmatism = plain.aberrations[0][2]
    assert eye.aberrations == ((2, 2, pytest.approx(astigmatism + 0.1)), (4, 0, 0.05))
    assert eye == replace(plain, aberrations=eye.aberrations, lens=lens, **others)


@pytest.mark.parametrize(
    ("refraction", "people"), [(None, EMMETROPES), ("+1", EMMETROPES), ("-0.49", EMMETROPES), ("-0.50", MYOPES)]
)
def test_the_periphery_is_that_of_the_group(refraction, people):
    assert EyeDescription(refraction=refraction).periphery is people


def test_a_measured_eye_is_read_from_its_file(tmp_path: Path):
    terms = [0, 0, 0, 0, 0.5, 0, 0, 0.2]
    (tmp_path / "terms.csv").write_text("2,0,0.5\n3,-1,0.2\n", encoding="utf-8")
    path = tmp_path / "eye.toml"
    path.write_text('pupil_mm = 4.0\nzernike = "terms.csv"\nmeasured_mm = 6.0\n', encoding="utf-8")
    measured = Eye.from_zernike(terms, 0.004, measured_diameter=0.006)
    assert read_eye(path, 1.5).aberrations == pytest.approx(np.array(measured.aberrations))
    assert read_eye(path, 1.5).focus_vergence == 1.5  # its defocus is corrected
    path.write_text("pupil_mm = 40\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"eye\.toml: pupil_mm is 40 mm, but must be from 0\.1 to 9 mm"):
        read_eye(path, 1.5)


def test_conditions_change_the_light_the_optics_and_the_resolution():
    eye, fovea = Eye(0.003, 1.0), ViewingConditions()
    aside = ViewingConditions(eccentricity_deg=20.0, meridian="nasal")
    assert fovea.off_axis(eye) is eye
    assert aside.off_axis(eye, MYOPES) == off_axis(eye, 20.0, "nasal", foci=MYOPES, coma=True)
    assert fovea.cones(eye, "L+M") == Cones.of(eye, "L+M")
    assert aside.cones(eye, "L+M").finest_cpd == resolved_cpd(20.0, "nasal")
    assert aside.cones(eye, "luminance").finest_cpd == math.inf
    old = ViewingConditions(age=80, scatter=True)
    assert old.light("S").difference() > fovea.light("S").difference()  # the lens absorbs the shortest wavelengths
    assert old.cones(eye, "S").transfer(np.degrees(3.0), 1.0) < fovea.cones(eye, "S").transfer(np.degrees(3.0), 1.0)


def test_views_differ_in_band_and_moment():
    eye = Eye(0.004, 1.0)
    seen = {cue: compared_views(0.8, eye, cue, (64, 64), math.radians(1 / 60)) for cue in ("bands", "moments")}
    focus = {cue: [one.view.optics.focus_vergence for one in views.values()] for cue, views in seen.items()}
    assert [*seen["bands"]] == ["L+M", "S"]
    assert focus["bands"][1] - focus["bands"][0] == pytest.approx(0.8, abs=0.1)
    assert focus["moments"][0] - focus["moments"][1] == pytest.approx(0.5)  # 0.25 D to either side


def test_the_range_of_image_quality_covers_the_zones_of_a_lens():
    eye = EyeDescription(zones="2:3,8:0").eye(0.0, 0.0035)
    cones = Cones(eye, "luminance", (580.0,))
    assert image_quality(cones).vergences[[0, -1]] == pytest.approx([-2.0, 5.0])
    images = point_images(cones, 0.0)
    assert [*images] == [0, 0.75, 1.5, 2.25, 3.0]
    assert max(images, key=lambda change: images[change].max()) in (0, 3)
