"""What cones make of the light: exact transfers, sampling, and scatter against published straylight."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0, j1

from focalgradient.eye import Cones, Eye, Scatter, band_light, blur_transfer, optical_transfer
from focalgradient.eye.cones import sampling
from focalgradient.eye.parts import parts_of_band
from focalgradient.optics import capabilities, own_blur

EYE = Eye(pupil_diameter=0.004, accommodation=2.0)
CPD = np.linspace(0, 60, 121)


@pytest.mark.parametrize("pupil", [0.002, 0.006])
@pytest.mark.parametrize("vergence", [2.0, 1.7, -1.0])
def test_one_wavelength_is_blurred_as_the_exact_transfer_says(pupil: float, vergence: float) -> None:
    cones = Cones(Eye(pupil, 2.0), "green", (555.0,))
    exact = optical_transfer(CPD, pupil_diameter=pupil, wavelength_nm=555, defocus=cones.focus_vergence - vergence)
    assert np.abs(cones.transfer(np.degrees(CPD), vergence) - exact).max() < 2e-4


@pytest.mark.parametrize("frequency", [[3.0, 7.0, 20.0], 7.0])
def test_by_rays_each_wavelength_is_blurred_by_the_disc_of_its_own_focus(frequency) -> None:
    """Airy's function of the angle that the pupil subtends at the point in focus: half of 4 mm times the defocus."""
    cones = Cones(EYE, "two", (450.0, 650.0), model="disc", weights=(1.0, 3.0))
    blue, red = (2 * np.pi * 0.002 * abs(EYE.focus_in(nm) - 1.2) * np.degrees(frequency) for nm in (450.0, 650.0))
    assert cones.transfer(np.degrees(frequency), 1.2) == pytest.approx((2 * j1(blue) / blue + 6 * j1(red) / red) / 4)


@pytest.mark.parametrize(("band", "finest_cpd"), [("L+M", np.inf), ("S", 10.0)])
@pytest.mark.parametrize("pupil", [0.002, 0.004, 0.007])
def test_the_wavelengths_have_the_transfer_of_the_whole_band(band: Any, finest_cpd: float, pupil: float) -> None:
    """Against the exact transfer, averaged over 79 wavelengths."""
    light, eye = band_light(band, "D65", 5.0), Eye(pupil, 2.0)
    cones = Cones.of(eye, band, finest_cpd=finest_cpd)
    for vergence in (1.0, 1.8, 2.1, 2.6, 3.5):
        exact = blur_transfer(0, np.degrees(CPD), eye, vergence, light=light) * sampling(np.degrees(CPD), finest_cpd)
        assert np.abs(cones.transfer(np.degrees(CPD), vergence) - exact).max() < 0.01
    assert sum(cones.weights) == pytest.approx(1)


def test_bands_are_focused_as_far_apart_as_their_lights_and_keep_their_means() -> None:
    apart = Cones.of(EYE, "S").focus_vergence - Cones.of(EYE, "L+M").focus_vergence
    assert apart == pytest.approx(0.783, abs=2e-3)  # `test_eye_light`
    cones = Cones.of(EYE, "S")
    assert cones.accommodated(0.0).focus_vergence == pytest.approx(cones.focus_vergence - 2, abs=1e-9)
    light = band_light("S", "D65")
    wavelengths, shares = parts_of_band(light, 4)
    mean = np.dot([EYE.in_light(nm).focus_vergence for nm in wavelengths], shares)
    assert mean == pytest.approx(2.0 - light.difference(), abs=2e-3)


def test_cones_state_their_blur_and_do_not_resolve_what_is_too_fine() -> None:
    coarse, fine = Cones.of(EYE, "S", finest_cpd=10), Cones.of(EYE, "S")
    ratio = coarse.transfer(np.degrees([0, 6, 8, 14]), 2.5) / fine.transfer(np.degrees([0, 6, 8, 14]), 2.5)
    assert ratio[:3] == pytest.approx(1, abs=0.03)
    assert ratio[3] == 0
    assert own_blur(Cones.of(EYE, "S")).isotropic
    assert capabilities(Cones.of(EYE, "S")).waveband == "S"
    assert own_blur(EYE).isotropic
    assert not own_blur(EYE).forms_views


@pytest.mark.parametrize("model", ["wave", "disc", "gaussian"])
def test_one_frequency_and_none_are_taken_as_many_are(model) -> None:
    cones = Cones.of(EYE, "S", wavelengths=2, model=model)
    many = cones.transfer(np.array([0.0, 300.0]), np.array([[1.0], [1.5]]))
    assert float(cones.transfer(300.0, 1.5)) == many[1, 1]
    assert float(blur_transfer(0.0, 300.0, cones, 1.5)) == many[1, 1]
    assert cones.transfer([], 1.5).shape == (0,)


@pytest.mark.parametrize(("age", "log_s"), [(20, 0.87), (70, 1.24)])
def test_straylight_of_van_den_berg_et_al(age, log_s):
    """log10(theta^2 L / E) at 7 degrees, from 0.87 at 20 years by 1 + (age / 65)^4 (2007, Am. J. Ophth. 144, 358)."""
    found = float(np.log10(49 * Scatter(age, 0.5).veil(7.0)))
    assert found == pytest.approx(log_s, abs=0.08)


def test_the_transform_is_the_hankel_integral():
    one = Scatter(50, 1.0)
    for cpd in (0.0, 0.05):
        weight = lambda t, f=cpd: float(one.veil(t)) * 2 * np.pi * np.sin(np.radians(t)) * j0(2 * np.pi * f * t)  # noqa: E731
        whole = sum(quad(weight, a, b, limit=400)[0] for a, b in ((0.1, 1), (1, 10), (10, 89.999))) * np.pi / 180
        assert 1 - one.share + whole == pytest.approx(float(one.transfer(np.degrees(cpd))), abs=2e-3)


def test_cones_lose_contrast_by_scatter():
    cones = Cones.of(Eye(0.003, 1.0), "luminance", wavelengths=3)
    old = replace(cones, scatter=Scatter(75))
    f = np.degrees([0.0, 5.0, 20.0])
    assert old.transfer(f, 1.0) == pytest.approx(cones.transfer(f, 1.0) * Scatter(75).transfer(f))
    assert old.transfer(0.0, 1.0) == pytest.approx(1.0)
    assert old.optical_transfer(f[1], 0.0, 1.0) == pytest.approx(old.transfer(f[1], 1.0))
