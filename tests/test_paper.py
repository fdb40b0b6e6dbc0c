"""The paper's equations in its own terms, against rays, similar triangles and filtering in space."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import ndimage

from focalgradient import Lens
from focalgradient.paper import conjugate_distance, paper_distance, pinhole_distance

FOCAL = st.floats(0.004, 0.2)
NUMBER = st.floats(0.95, 45)
FOCUS = st.floats(0.25, 50)
DISTANCE = st.floats(0.25, 1000)

LENS = Lens(focal_length=0.050, f_number=2, focus_distance=1.0)
TERMS = {"focal_length": 0.050, "sensor_distance": 1 / 19, "paper_f_number": 4}  # of this lens, worked by hand
SIGMA = 0.025 / 76  # the radius of the blur circle of a point at 2 m, by similar triangles


@given(focal_length=FOCAL, f_number=NUMBER, focus=FOCUS, distance=DISTANCE)
def test_eq_1_and_16_agree_with_vergence(focal_length: float, f_number: float, focus: float, distance: float) -> None:
    assume(min(focus, distance) > 1.01 * focal_length)
    lens = Lens(focal_length, f_number, focus)
    found = paper_distance(
        lens.blur_radius(distance) * lens.sensor_distance,
        focal_length=focal_length,
        sensor_distance=lens.sensor_distance,
        paper_f_number=2 * f_number,
        side="beyond" if distance > focus else "nearer",
    )
    # Equation 1 subtracts the nearly equal v0 and F, which costs digits.
    assert 1 / found == pytest.approx(1 / distance, abs=1e-9)


@pytest.mark.parametrize(("side", "true", "trapped"), [("beyond", 2.0, 4 / 3), ("nearer", 2 / 3, 4 / 5)])
def test_the_trap_of_the_factor_two(side: str, true: float, trapped: float) -> None:
    """f = F / (lens radius): the photographer's number takes the point half as far, in dioptres, from focus."""
    assert paper_distance(SIGMA, **TERMS, side=side) == pytest.approx(true)
    assert paper_distance(SIGMA, **{**TERMS, "paper_f_number": 2}, side=side) == pytest.approx(trapped)


def test_eq_1_says_where_no_point_blurs_so_much() -> None:
    infinity = float(LENS.blur_radius(math.inf)) * LENS.sensor_distance
    found = paper_distance(np.array([0.999, 1.001]) * infinity, **TERMS, side="beyond")
    assert found[0] == pytest.approx(1000, rel=1e-6)
    assert found[1] < 0


def test_eq_13_is_where_two_rays_cross_and_holds_within_the_focal_length() -> None:
    """A ray along the axis goes through the far focus, one through the centre goes straight on: they meet in the image.

    A point 1 high at 2 m, F = 50 mm: 1 - x / F = -x / 2 at x = 2/39 m.
    """
    assert conjugate_distance(2 / 39, focal_length=0.050) == pytest.approx(2.0)
    assert conjugate_distance(2.0, focal_length=0.050) == pytest.approx(2 / 39)  # and back: Eq. 12 is symmetrical
    assert conjugate_distance([0.05, math.inf], focal_length=0.05).tolist() == [math.inf, 0.05]
    virtual = conjugate_distance(0.025, focal_length=0.05)
    assert virtual == pytest.approx(-0.05)  # by Newton: x x' = F^2


@pytest.mark.parametrize("distance", [1.25, 2.0, 10.0])
def test_eq_15_similar_triangles(distance: float) -> None:
    """R / v = sigma / (v0 - v): the cone of light from the rim to the image, cut by the sensor."""
    v0, v = LENS.sensor_distance, float(conjugate_distance(distance, focal_length=LENS.focal_length))
    assert LENS.blur_radius(distance) * v0 / (v0 - v) == pytest.approx(0.0125 / v)


@pytest.mark.parametrize(("distance", "side"), [(2.0, "beyond"), (0.8, "nearer")])
def test_eq_10_finds_the_distance_from_a_pinhole_view(distance: float, side: str) -> None:
    """Texture on a sensor of 20 um pixels, blurred in space by the paper's Gaussian, its sigma by similar triangles."""
    pitch, v0 = 20e-6, 1 / 19
    v = 1 / (1 / 0.050 - 1 / distance)
    sigma = 0.0125 * abs(v0 - v) / v
    sharp = np.random.default_rng(3).standard_normal((256, 256))
    blurred = ndimage.gaussian_filter(sharp, sigma / pitch, mode="wrap", truncate=8)
    frequency = np.fft.fftfreq(256, pitch)  # cycles per metre
    square = frequency[:, None] ** 2 + frequency**2
    used = (square > 0) & (sigma**2 * square < 0.1)
    log_ratio = np.log(np.abs(np.fft.fft2(sharp)[used]) / np.abs(np.fft.fft2(blurred)[used]))
    slope = np.polyfit(square[used], log_ratio, 1)[0]
    found = pinhole_distance(slope, **TERMS, side=side)
    assert found == pytest.approx(distance, rel=1e-3)


@pytest.mark.parametrize(("k", "moment"), [(1.0, 1.0), (2.0, 0.5)])
def test_the_appendix_s_k_takes_the_circle_for_the_spatial_constant(k: float, moment: float) -> None:
    """A blur circle of 25/76 mm; the sd per axis of a uniform disc is half its radius, so that k = 2."""
    assert paper_distance(moment * SIGMA, **TERMS, side="beyond", paper_k=k) == pytest.approx(2.0)
    assert paper_distance(moment * SIGMA, **TERMS, side="nearer", paper_k=k) == pytest.approx(2 / 3)
    slope = 2 * (math.pi * moment * SIGMA) ** 2
    assert pinhole_distance(slope, **TERMS, side="beyond", paper_k=k) == pytest.approx(2.0)
