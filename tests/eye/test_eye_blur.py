"""Blur by name, in one light and in many; and how near it comes to a Gaussian."""

import numpy as np
import pytest
from scipy.special import j0

from focalgradient import InputError
from focalgradient.eye import Eye, Light, band_light, best_gaussian, blur_transfer, optical_transfer, pupil_transfer
from focalgradient.psf import disc_transfer, gaussian_transfer

EYE = Eye(pupil_diameter=0.004, accommodation=1.0)
FREQUENCY = np.linspace(0, 40, 21)


def test_names_stand_for_their_models() -> None:
    radius, per_radian = 0.002 * 0.5, np.degrees(FREQUENCY)
    found = {name: blur_transfer(FREQUENCY, 0, EYE, 0.5, model=name) for name in ("disc", "gaussian", "wave")}
    assert found["disc"] == pytest.approx(disc_transfer(per_radian, radius))
    assert found["gaussian"] == pytest.approx(gaussian_transfer(per_radian, radius, 0.5))
    assert found["wave"] == pytest.approx(
        optical_transfer(FREQUENCY, pupil_diameter=0.004, wavelength_nm=580, defocus=0.5)
    )


def test_the_eyes_aberrations_are_in_its_waves() -> None:
    terms = ((3, 1, 0.1),)
    eye = Eye(0.004, 1.0, aberrations=terms, stiles_crawford=0.05)
    expected = pupil_transfer(
        0, FREQUENCY, pupil_diameter=0.004, wavelength_nm=580, defocus=0.5, aberrations=terms, stiles_crawford=0.05
    )
    assert blur_transfer(0, FREQUENCY, eye, 0.5) == pytest.approx(expected)
    assert np.abs(expected.imag).max() > 0.01


@pytest.mark.parametrize("model", ["disc", "gaussian", "wave"])
def test_many_lights_are_their_mean_each_in_its_focus(model: str) -> None:
    light = Light(np.array([450.0, 580.0, 650.0]), np.array([1.0, 0.0, 3.0]))
    blue, red = (blur_transfer(0, FREQUENCY, EYE.in_light(nm), 1.2, model=model) for nm in (450.0, 650.0))  # type: ignore
    assert blur_transfer(0, FREQUENCY, EYE, 1.2, model=model, light=light) == pytest.approx(0.25 * blue + 0.75 * red)  # type: ignore


def test_white_light_in_focus_has_less_contrast_than_yellow() -> None:
    white = blur_transfer(0, FREQUENCY[1:], EYE, 1.0, light=band_light("luminance", "E", 10))
    yellow = blur_transfer(0, FREQUENCY[1:], EYE, 1.0)
    assert (white < yellow).all()


def test_bad_models() -> None:
    with pytest.raises(InputError, match="model is 'cone', but must be one of wave, disc, gaussian"):
        blur_transfer(0, 5, EYE, 1.0, model="cone")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="vergence is nan"):
        blur_transfer(0, 5, EYE, np.nan)


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
    assert fit.reversal_cpd == pytest.approx(np.radians(0.6098 / fit.radius), rel=0.01)


def test_in_focus_there_is_no_disc() -> None:
    fit = best_gaussian(EYE, 1.0)
    assert fit.radius == 0
    assert np.isnan(fit.k)
    assert fit.reversal_cpd == np.inf
    assert fit.sigma == pytest.approx(0.42 * 580e-9 / 0.004, rel=0.05)  # as a Gaussian stands for Airy's disc


def test_white_light_is_nearer_to_a_gaussian_than_yellow() -> None:
    white, yellow = best_gaussian(EYE, 0.0, band_light("luminance", "E", 10)), best_gaussian(EYE, 0.0)
    assert white.residual < yellow.residual
    assert white.lowest > yellow.lowest
