"""Pictures of known spectra: against the light of every wavelength blurred on its own, and what must hold of any."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient.eye import (
    Cones,
    Eye,
    SpectralBasis,
    SpectralPicture,
    band_light,
    band_picture,
    band_views,
    chromatic_difference,
    cone_fundamentals,
    cone_images,
    illuminant,
    retinal_image,
)
from focalgradient.render import blur_picture

PIXEL = np.radians(1 / 60)
EYE = Eye(0.004, 1.0)
LIGHTS = ("D65", "A", "3000 K", "LED-B1")


def coloured(side: int = 32, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.05, 0.95, (side, side, 3))


@pytest.mark.parametrize("light", LIGHTS)
def test_the_basis_adds_up_to_white(light: str) -> None:
    basis = SpectralBasis.of_srgb(light)
    for band in ("L+M", "S", "L", "M"):
        assert basis.catch(band).sum() == pytest.approx(1, abs=1e-4)
        assert basis.catch(band).min() > 0


def test_grey_reflectance_is_seen_as_grey() -> None:
    grey, distance = coloured()[..., :1], np.full((32, 32), 0.5)
    plain = band_views((grey[..., 0], distance), EYE, (32, 32), PIXEL)
    spectral = band_views((SpectralPicture.of_srgb(grey * np.ones(3)), distance), EYE, (32, 32), PIXEL)
    for one, other in zip(plain, spectral, strict=True):
        assert one.view.image == pytest.approx(other.view.image, abs=0.004)


@pytest.mark.parametrize("nm", [470.0, 550.0, 630.0])
def test_light_of_one_wavelength_is_in_the_focus_of_the_formula(nm: float) -> None:
    wavelength = np.arange(400.0, 701.0, 10.0)
    basis = SpectralBasis.of_reflectances(wavelength, np.eye(31)[:, [int((nm - 400) / 10)]])
    cones = Cones.in_light(EYE, "L+M", basis.light("L+M", 0))
    assert cones.focus_vergence == pytest.approx(1 - float(chromatic_difference(nm)), abs=1e-9)


@pytest.mark.parametrize("band", ["L+M", "S"])
def test_every_wavelength_on_its_own_gives_the_same(band) -> None:
    """By 5 nm, each blurred alone and weighed by its light: without parts, bases of light or cones' transfers."""
    basis, picture, distance = SpectralBasis.of_srgb("A"), coloured(), np.full((32, 32), 0.8)
    seen = cone_fundamentals(basis.wavelength_nm)[:, :2].sum(axis=1)
    if band == "S":
        seen = cone_fundamentals(basis.wavelength_nm)[:, 2]
    total, white = np.zeros((32, 32)), float(seen @ basis.white)
    for nm, sensitivity, radiance in zip(basis.wavelength_nm, seen, basis.radiance, strict=True):
        if sensitivity > 1e-4:
            light = blur_picture(picture @ radiance, distance, EYE.in_light(float(nm)), pixel_angle=PIXEL)
            total += sensitivity * light / white
    ours = band_picture(SpectralPicture(picture, basis), distance, EYE, band, pixel_angle=PIXEL)
    assert ours == pytest.approx(total, abs=0.006)


def test_band_views_and_the_retinal_image_are_one_rendering() -> None:
    picture, distance = coloured(), np.full((32, 32), 0.6)
    cones = cone_images(retinal_image(picture, distance, EYE, pixel_angle=PIXEL))
    blues = band_views((picture, distance), EYE, (32, 32), PIXEL, s_finest_cpd=1e3)[1]
    assert blues.view.image == pytest.approx(cones[..., 2], abs=1e-5)


@pytest.mark.parametrize("light", LIGHTS)
def test_bands_of_one_light_agree_with_their_own(light: str) -> None:
    mixed = SpectralBasis.of_srgb(light).mixed("L+M", [1, 1, 1])
    assert mixed.difference() == pytest.approx(band_light("L+M", light).difference(), abs=0.005)


def test_warm_light_moves_the_focus_of_all_cones_farther() -> None:
    """As red light does; a black body of 2856 K is the CIE's illuminant A."""
    for band in ("L+M", "S"):
        assert band_light(band, "3000 K").difference() > band_light(band, "D65").difference() + 0.05
    nm = np.array([420.0, 500.0, 640.0])
    assert illuminant(nm, "2856 K") == pytest.approx(illuminant(nm, "A"), rel=0.002)
