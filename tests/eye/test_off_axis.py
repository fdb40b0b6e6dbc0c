"""Focus, coma and sampling off axis, against rays traced in space by other formulas and published numbers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from focalgradient import InputError
from focalgradient.eye import (
    EMMETROPES,
    MYOPES,
    SCHEMATIC,
    Cones,
    Eye,
    field_coma,
    field_foci,
    midget_density,
    off_axis,
    resolved_cpd,
)

# Escudero-Sanz & Navarro (1999): vertex and radius in mm, conic constant, index behind.
EYE = [(0.0, 7.72, -0.26, 1.3777), (0.55, 6.5, 0.0, 1.3391), (3.6, 10.2, -3.1316, 1.4222), (7.6, -6.0, -1.0, 1.3377)]
RETINA = 23.9203


def met(point, way, vertex, radius, conic):
    """Where a ray in space meets a conic, by Newton's method, and the unit normal there."""

    def implicit(t):
        x, y, z = point + t * way
        z -= vertex
        gradient = np.array([2 * x, 2 * y, 2 * (1 + conic) * z - 2 * radius])
        return x**2 + y**2 + (1 + conic) * z**2 - 2 * radius * z, gradient

    t = (vertex - point[2]) / way[2]
    for _ in range(50):
        value, gradient = implicit(t)
        t -= value / (gradient @ way)
    return point + t * way, gradient / np.linalg.norm(gradient)


def refracted(way, normal, ratio):
    """Snell's law for vectors."""
    normal = normal if normal @ way < 0 else -normal
    cosine = -normal @ way
    return ratio * way + (ratio * cosine - np.sqrt(1 - ratio**2 * (1 - cosine**2))) * normal


def outward(start, through):
    """From a point of the retina through one of the pupil into air: where a ray leaves the eye, and its way."""
    point, way = start, (through - start) / np.linalg.norm(through - start)
    pupil = point
    for number in (3, 2, 1, 0):
        vertex, radius, conic, index = EYE[number]
        point, normal = met(point, way, vertex, radius, conic)
        way = refracted(way, normal, index / (EYE[number - 1][3] if number else 1.0))
        pupil = point if number == 2 else pupil
    return point, way, pupil


def aim(start):
    """Where to aim from the retina for the ray to pass the middle of the pupil, through the lens behind it."""
    miss = lambda y: outward(start, np.array([0.0, y, 3.6]))[2][1]  # noqa: E731
    return np.array([0.0, brentq(miss, -3, 3), 3.6])


def vergence(start, aside):
    """Vergence (D) from which a point of the retina is in focus, in the plane of `aside` (mm), a step in the pupil."""
    middle = aim(start)
    (p, u, _), (q, v, _) = outward(start, middle), outward(start, middle + np.array(aside))
    across = v - (u @ v) * u  # light that spreads comes to a focus behind, negative
    return float(-1e3 * (across @ across) / (across @ (q - p)))


@pytest.mark.parametrize("place", [0.0, 5.0, 8.0])
def test_foci_are_where_traced_rays_meet(place) -> None:
    """Rays from a place on the retina (mm from the axis), a thousandth of a millimetre apart in the pupil."""
    start = np.array([0.0, -place, RETINA - (12 - np.sqrt(144 - place**2))])
    field = np.degrees(np.arccos(-outward(start, aim(start))[1][2]))
    centre = np.array([0.0, 0.0, RETINA])
    there = [vergence(start, step) for step in ((0.0, 0.001, 0.0), (0.001, 0.0, 0.0))]
    here = vergence(centre, (0.001, 0.0, 0.0))
    assert field_foci(field) == pytest.approx([one - here for one in there], abs=0.02)


def test_an_eye_off_axis_is_focused_in_one_plane_where_its_tangential_focus_is() -> None:
    """At the tangential focus, detail across the tangential plane is sharp, and detail along it is not."""
    eye = off_axis(Eye(0.003, 1.0), 30.0, foci=SCHEMATIC)
    tangential, sagittal = (1.0 + one for one in field_foci(30.0))
    cones = Cones.of(eye, "L+M", wavelengths=1)
    shift = cones.focus_vergence - eye.focus_vergence
    fine = np.degrees(5.0)
    for plane, focus in ((0, tangential), (1, sagittal)):
        along = [abs(cones.optical_transfer(y, x, focus + shift)) for y, x in ((0.0, fine), (fine, 0.0))]
        assert along[plane] > 0.8
        assert along[1 - plane] < 0.3
    turned = off_axis(Eye(0.003, 1.0), 30.0, "superior", foci=SCHEMATIC)
    assert turned.aberrations[0][2] == pytest.approx(-eye.aberrations[0][2])


def test_measured_foci_take_the_place_of_the_model_s_and_terms_add_up() -> None:
    eye = off_axis(Eye(0.004, 0.5, aberrations=((2, 2, 0.1),)), 25.0, foci=(-0.2, -1.0))
    assert eye.accommodation == pytest.approx(0.5 - 0.6)
    assert {(n, m): c for n, m, c in eye.aberrations}[2, 2] == pytest.approx(0.1 + 0.8 * 16 / (16 * 6**0.5))
    assert Cones.of(eye, "L+M", finest_cpd=float(resolved_cpd(25.0))).finest_cpd < 5
    # A wavefront may state a term twice; off axis it keeps both.
    twice, once = (Eye(0.004, 0.5, aberrations=terms) for terms in (((3, 1, 0.1), (3, 1, 0.2)), ((3, 1, 0.3),)))
    there = [{(n, m): c for n, m, c in off_axis(eye, 20.0).aberrations} for eye in (twice, once)]
    assert there[0] == pytest.approx(there[1])


@pytest.mark.parametrize("place", [2.5, 8.0])
def test_coma_is_that_of_traced_rays(place) -> None:
    """From one place on the retina (mm from the axis): how the rays' direction bends over the pupil, in space."""
    start = np.array([0.0, -place, RETINA - (12 - np.sqrt(144 - place**2))])
    middle = aim(start)
    p, u, _ = outward(start, middle)
    field = np.degrees(np.arccos(-u[2]))
    across = np.array([0.0, -u[2], u[1]])
    place_mm, turn = [], []
    for height in np.linspace(-0.4, 0.4, 9):
        q, v, _ = outward(start, middle + np.array([0.0, height, 0.0]))
        q = q - v * ((q - p) @ u) / (v @ u)  # in the plane across the middle ray
        place_mm.append((q - p) @ across)
        turn.append((v @ across) / (v @ u))
    bend = np.polynomial.polynomial.polyfit(place_mm, turn, 4)[2] * 1e6  # rad per m^2
    expected = abs(bend) * 0.002**3 / (18 * 2**0.5) * 1e6
    assert abs(field_coma(field, 0.004)) == pytest.approx(expected, rel=0.03)


def test_coma_points_to_what_is_looked_at() -> None:
    """Opposite sides have opposite signs, coma grows with the cube of the pupil, and there is none in the middle."""
    terms = {
        side: {(n, m): c for n, m, c in off_axis(Eye(0.004, 1.0), 20.0, side, foci=SCHEMATIC, coma=True).aberrations}
        for side in ("temporal", "nasal", "superior", "inferior")
    }
    size = field_coma(20.0, 0.004)
    assert terms["temporal"][3, 1] == -terms["nasal"][3, 1] == pytest.approx(size)
    assert terms["inferior"][3, -1] == -terms["superior"][3, -1] == pytest.approx(size)
    assert field_coma(20.0, 0.006) == pytest.approx(size * 1.5**3)
    assert field_coma(0.0, 0.004) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("people", "angle", "m", "j0"),
    [  # means of Jaeken & Artal's eyes; 82 emmetropes and 44 myopes
        (EMMETROPES, -30, -1.041, -1.306),
        (EMMETROPES, 20, -0.080, -0.243),
        (EMMETROPES, 30, -0.479, -0.618),
        (MYOPES, -30, -0.120, -1.065),
        (MYOPES, 30, 0.361, -0.523),
    ],
)
def test_people_off_axis_are_refracted_as_measured(people, angle, m, j0) -> None:
    side = "temporal" if angle > 0 else "nasal"
    assert people.at(abs(angle), side) == pytest.approx((m, j0), abs=0.14)
    eye = off_axis(Eye(0.004, 1.0), abs(angle), side, foci=people)
    assert eye.accommodation == pytest.approx(1.0 - m, abs=0.14)  # myopic is focused nearer


def test_people_were_measured_along_the_horizontal_meridian_only() -> None:
    with pytest.raises(InputError, match="temporal and nasal field"):
        off_axis(Eye(0.004, 1.0), 10.0, "superior", foci=EMMETROPES)
    with pytest.raises(InputError, match="measured to 40"):
        MYOPES.at(40.001)
    assert MYOPES.at(40.0)[0] == pytest.approx(MYOPES.at(39.99)[0], abs=0.01)


MERIDIANS = ("temporal", "superior", "nasal", "inferior")


def test_sampling_is_that_of_watson_and_falls_outwards() -> None:
    """Watson's Table 2: 29,609.2 midget fields in a square degree, and a Nyquist frequency of 65.37 cycles a degree."""
    for meridian in MERIDIANS:
        assert midget_density(0, meridian) == pytest.approx(29609.2, rel=1e-3)
        assert resolved_cpd(0, meridian) == pytest.approx(65.37, rel=1e-3)
    far = np.linspace(0, 60, 61)
    every = np.stack([resolved_cpd(far, meridian) for meridian in MERIDIANS])
    assert np.all(np.diff(every) < 0)
    assert np.all(every[0, 15:] >= every[:, 15:])
