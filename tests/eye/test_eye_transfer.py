"""Blur by name, in one light and in many; and how near it comes to a Gaussian."""

import numpy as np
import pytest
from scipy.special import j0

from focalgradient import InputError, Lens
from focalgradient.eye import (
    Cones,
    Eye,
    Light,
    band_light,
    best_gaussian,
    blur_transfer,
    optical_transfer,
    point_spread,
    pupil_transfer,
)
from focalgradient.optics import DualPixel

EYE = Eye(pupil_diameter=0.004, accommodation=1.0)
FREQUENCY = np.linspace(0, 40, 21)  # cycles per degree
PER_RADIAN = np.degrees(FREQUENCY)


def test_the_eyes_aberrations_are_in_its_waves() -> None:
    terms = ((3, 1, 0.1),)
    eye = Eye(0.004, 1.0, aberrations=terms, stiles_crawford=0.05)
    expected = pupil_transfer(
        0, FREQUENCY, pupil_diameter=0.004, wavelength_nm=580, defocus=0.5, aberrations=terms, stiles_crawford=0.05
    )
    assert blur_transfer(0, PER_RADIAN, eye, 0.5) == pytest.approx(expected)
    assert np.abs(expected.imag).max() > 0.01


@pytest.mark.parametrize("model", ["disc", "gaussian", "wave"])
def test_many_lights_are_their_mean_each_in_its_focus(model: str) -> None:
    light = Light(np.array([450.0, 580.0, 650.0]), np.array([1.0, 0.0, 3.0]))
    blue, red = (blur_transfer(0, PER_RADIAN, EYE.in_light(nm), 1.2, model=model) for nm in (450.0, 650.0))  # type: ignore
    assert blur_transfer(0, PER_RADIAN, EYE, 1.2, model=model, light=light) == pytest.approx(0.25 * blue + 0.75 * red)  # type: ignore


LENS = Lens(focal_length=0.050, f_number=4, focus_distance=1.0)


def test_a_lens_is_taken_as_an_eye_is() -> None:
    """A lens as wide as the pupil, in the light of the eye and at its focus, blurs as the eye does."""
    lens, frequency, angles = Lens(0.020, 5, 1.0), PER_RADIAN, np.linspace(-1e-3, 1e-3, 11)
    for model in ("wave", "disc", "gaussian"):
        by_lens = blur_transfer(0, frequency, lens, 0.5, model=model, wavelength_nm=580)  # type: ignore[arg-type]
        assert by_lens == pytest.approx(blur_transfer(0, frequency, EYE, 0.5, model=model))  # type: ignore[arg-type]
    by_lens = point_spread(angles, angles, lens, 0.5, wavelength_nm=580)
    assert by_lens == pytest.approx(point_spread(angles, angles, EYE, 0.5))
    assert best_gaussian(lens, 0.0, wavelength_nm=580) == best_gaussian(EYE, 0.0)


def test_a_lens_wider_than_any_pupil_in_focus_is_bound_by_diffraction_alone() -> None:
    """Airy: the light at the centre of the spread is (pi / 4) (d / wavelength)^2, and the cut-off d / wavelength."""
    centre = point_spread(0.0, 0.0, LENS, 1.0, wavelength_nm=500)[0, 0]
    assert centre == pytest.approx(np.pi / 4 * (0.0125 / 500e-9) ** 2)
    assert blur_transfer(0, [0.0, 0.0125 / 500e-9], LENS, 1.0, wavelength_nm=500) == pytest.approx([1, 0])


def test_light_of_many_wavelengths_leaves_a_lens_in_one_focus() -> None:
    light = Light(np.array([450.0, 650.0]), np.array([1.0, 1.0]))
    one, other = (blur_transfer(0, 500.0, LENS, 0.9, wavelength_nm=nm) for nm in (450, 650))
    assert blur_transfer(0, 500.0, LENS, 0.9, light=light) == pytest.approx((one + other) / 2)
    spreads = [point_spread([0.0], [1e-4], LENS, 0.9, wavelength_nm=nm) for nm in (450, 650)]
    assert point_spread([0.0], [1e-4], LENS, 0.9, light=light) == pytest.approx(sum(spreads) / 2)


def test_cones_give_their_own_transfer() -> None:
    cones = Cones.of(EYE, "L+M")
    assert blur_transfer(0, [100.0, 500.0], cones, 0.5) == pytest.approx(cones.transfer([100.0, 500.0], 0.5))
    with pytest.raises(InputError, match="optics have light of their own, but wavelength_nm or light is given too"):
        blur_transfer(0, 100.0, cones, 0.5, wavelength_nm=550)
    with pytest.raises(InputError, match="not their point spread: give an Eye or a Lens"):
        point_spread(0.0, 0.0, cones, 0.5)


def test_best_gaussian_is_best_in_the_plane() -> None:
    """Least squares over the point spread itself, made by transforming back: no Gaussian near it leaves less."""
    fit = best_gaussian(EYE, 0.0)
    frequency = np.linspace(0, np.radians(0.004 / 580e-9), 3001)
    transfer = optical_transfer(frequency, pupil_diameter=0.004, wavelength_nm=580, defocus=1.0)
    per_radian = np.degrees(frequency)
    angle = np.linspace(0, 0.006, 601)
    waves = j0(2 * np.pi * angle[:, None] * per_radian)
    spread = waves @ (transfer * 2 * np.pi * per_radian * (per_radian[1] - per_radian[0]))
    rings = 2 * np.pi * angle * (angle[1] - angle[0])

    def left(sigma: float) -> float:
        gaussian = np.exp(-((angle / sigma) ** 2) / 2) / (2 * np.pi * sigma**2)
        return float(np.sqrt(rings @ (spread - gaussian) ** 2 / (rings @ spread**2)))

    around = [left(fit.sigma * factor) for factor in (0.97, 1.0, 1.03)]
    assert around[1] == min(around)
    assert around[1] == pytest.approx(fit.residual, abs=0.01)


def test_large_blur_is_a_disc_whose_best_gaussian_is_known() -> None:
    """On a uniform disc the squares 1 / (4 pi s^2) - (2 / pi) (1 - e^(-1 / 2 s^2)) + 1 / pi are to be least.

    Their derivative vanishes where 1 / (2 s^2) = x with e^x = 4: k = 1 / sqrt(2 ln 4) = 0.6006.
    """
    fit = best_gaussian(Eye(0.008, 6.0), 0.0)
    assert fit.k == pytest.approx(1 / np.sqrt(2 * np.log(4)), abs=0.003)
    energy = np.log(4) / (2 * np.pi) - 2 / np.pi * (1 - 1 / 4) + 1 / np.pi
    assert fit.residual == pytest.approx(np.sqrt(energy * np.pi), abs=0.01)
    assert fit.lowest == pytest.approx(-0.132, abs=0.003)
    assert fit.reversal_per_rad == pytest.approx(0.6098 / fit.radius, rel=0.01)


def test_in_focus_there_is_no_disc_and_white_light_is_nearer_to_a_gaussian() -> None:
    fit = best_gaussian(EYE, 1.0)
    assert fit.radius == 0
    assert np.isnan(fit.k)
    assert fit.reversal_per_rad == np.inf
    assert fit.sigma == pytest.approx(0.42 * 580e-9 / 0.004, rel=0.05)  # as a Gaussian stands for Airy's disc
    white, yellow = best_gaussian(EYE, 0.0, band_light("luminance", "E", 10)), best_gaussian(EYE, 0.0)
    assert white.residual < yellow.residual
    assert white.lowest > yellow.lowest


def test_a_gaussian_is_not_fitted_to_blur_that_is_not_round() -> None:
    comatic, decentred = (Eye(0.004, 1.0, aberrations=((3, 1, 0.3),)), Eye(0.004, 1.0, 450.0, pupil_offset=(5e-4, 0.0)))
    for optics in (comatic, decentred, DualPixel(Lens(0.05, 4, 1.0))):
        with pytest.raises(InputError, match="no round blur"):
            best_gaussian(optics, 0.0)
    assert best_gaussian(Eye(0.004, 1.0, aberrations=((4, 0, 0.1),)), 0.0).residual < 1
