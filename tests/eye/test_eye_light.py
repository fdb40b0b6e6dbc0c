"""What cones catch of lights, colours and photons, and of pictures of known spectra."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient.eye import (
    Eye,
    Oscillation,
    Photons,
    SpectralBasis,
    SpectralPicture,
    accommodation_views,
    band_light,
    band_picture,
    band_views,
    cone_fundamentals,
    cone_images,
    illuminant,
    luminosity,
    retinal_image,
)
from focalgradient.render import blur_picture


def test_bands_are_focused_as_far_apart_as_in_the_literature() -> None:
    """0.82 D in equal energy, 0.78 D in daylight: the paper's "one dioptre"."""
    for light, dioptres in (("E", 0.823), ("D65", 0.783)):
        apart = band_light("L+M", light).difference() - band_light("S", light).difference()
        assert apart == pytest.approx(dioptres, abs=5e-4)


@pytest.mark.parametrize("light", ["A", "D65"])
def test_grey_reflects_the_illuminants_light_to_every_class_of_cones(light: str) -> None:
    for band in ("L+M", "S"):
        apart = SpectralBasis.grey(light).light(band, 0).difference() - band_light(band, light).difference()
        assert apart == pytest.approx(0, abs=1e-3)


def test_sensitivities_are_those_of_people() -> None:
    nm = np.arange(380, 781)
    cones = cone_fundamentals(nm)
    assert cones.shape == (401, 3)
    assert nm[cones.argmax(axis=0)] == pytest.approx([570, 543, 442], abs=2)
    assert cones.max(axis=0) == pytest.approx(1, abs=1e-3)
    assert nm[luminosity(nm).argmax()] == pytest.approx(556, abs=2)
    assert luminosity(nm).max() == pytest.approx(1, abs=1e-3)
    assert (cones[nm < 390] == 0).all()


def test_luminance_is_a_sum_of_l_and_m_and_illuminants_are_those_of_the_cie() -> None:
    """By definition of the CIE 2008 observer: 0.6899 L + 0.3483 M."""
    nm = np.arange(400, 701, 10)
    assert cone_fundamentals(nm)[:, :2] @ [0.689903, 0.348322] == pytest.approx(luminosity(nm), abs=2e-3)
    assert illuminant([560, 600], "E") == pytest.approx([100, 100])
    assert float(illuminant(560)) == pytest.approx(100)
    assert illuminant(450, "A") < 40 < 110 < illuminant(450, "D65")


def test_cone_images_of_white_of_sums_and_of_what_no_cone_catches() -> None:
    assert cone_images(np.full((2, 3, 3), 0.4)) == pytest.approx(0.4)
    assert cone_images(np.full((1, 1, 9), 2.0), wavelength_nm=np.linspace(400, 720, 9)) == pytest.approx(2)
    first, second = np.random.default_rng(0).random((2, 4, 5, 3))
    assert cone_images(first + 2 * second) == pytest.approx(cone_images(first) + 2 * cone_images(second))
    seen = cone_images(np.ones((1, 1, 3)), wavelength_nm=[660.0, 680.0, 700.0])
    assert seen[0, 0].tolist() == pytest.approx([1, 1, 0])


def test_one_wavelength_is_caught_by_its_sensitivity() -> None:
    nm = np.arange(390.0, 781.0, 5.0)
    line = np.zeros((1, 1, nm.size))
    line[0, 0, list(nm).index(550.0)] = 1
    whole = cone_fundamentals(nm).sum(axis=0)
    assert cone_images(line, wavelength_nm=nm)[0, 0] == pytest.approx(cone_fundamentals(550.0) / whole, rel=1e-6)


def test_displays_differ_and_red_is_for_l_cones() -> None:
    red = np.array([[[1.0, 0.0, 0.0]]])
    seen = [cone_images(red, primaries=name)[0, 0] for name in ("Typical CRT Brainard 1997", "Apple Studio Display")]
    assert not np.allclose(*seen, atol=1e-3)
    for one in seen:
        assert one[0] > one[1] > one[2]


MINUTE = np.radians(1 / 60)


def test_a_troland_is_some_1240000_quanta_of_green_light() -> None:
    """Of 555 nm, per second and square degree at the eye: 1 / 683 W a lumen, 3.58e-19 J a quantum."""
    trolands = 100 * np.pi / 4 * 4**2
    caught = Photons(100.0, integration_time=1.0, efficiency=1.0).caught("L+M", 0.004, np.radians(1))
    # L and M cones together catch a broader band than luminance weighs: a little more.
    assert 0.8 < caught / (1.24e6 * trolands) < 1.3


def test_it_grows_with_light_and_area_and_time() -> None:
    base = Photons(100.0).caught("S", 0.004, MINUTE)
    assert Photons(200.0).caught("S", 0.004, MINUTE) == pytest.approx(2 * base)
    assert Photons(100.0, integration_time=0.1).caught("S", 0.004, MINUTE) == pytest.approx(base / 2)
    assert Photons(100.0).caught("S", 0.002, 2 * MINUTE) == pytest.approx(base)
    assert Photons(100.0, illuminant="A").caught("S", 0.004, MINUTE) < 0.5 * base  # a bulb is poor in blue


def test_light_through_the_rim_counts_less() -> None:
    """Rings of the pupil, each with its area and 10^(-rho r^2): 0.62 of the light of 6 mm, and noisier views."""
    edges = np.linspace(0, 3, 3001)  # mm
    middle = (edges[1:] + edges[:-1]) / 2
    share = np.diff(edges**2) @ 10 ** (-0.05 * middle**2) / 9
    photons = Photons(5.0)
    assert photons.caught("L+M", 0.006, MINUTE, 0.05) == pytest.approx(share * photons.caught("L+M", 0.006, MINUTE))
    noise = []
    for rho in (0.0, 0.05):
        eye = Eye(0.006, 1.0, stiles_crawford=rho)
        (lit,), (clean,) = (
            accommodation_views(1.0, eye, [0.0], Oscillation(), (64, 64), MINUTE, noise=n) for n in (photons, 0.0)
        )
        noise.append(np.std(lit.view.image - clean.view.image))
    assert noise[1] / noise[0] == pytest.approx(share**-0.5, rel=0.02)


PIXEL = np.radians(1 / 60)
EYE = Eye(0.004, 1.0)


def coloured(side: int = 32, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.05, 0.95, (side, side, 3))


@pytest.mark.parametrize("light", ["D65", "A", "3000 K", "LED-B1"])
def test_the_basis_adds_up_to_white_in_its_focus(light: str) -> None:
    basis = SpectralBasis.of_srgb(light)
    for band in ("L+M", "S", "L", "M"):
        assert basis.catch(band).sum() == pytest.approx(1, abs=1e-4)
        assert basis.catch(band).min() > 0
    assert basis.mixed("L+M", [1, 1, 1]).difference() == pytest.approx(band_light("L+M", light).difference(), abs=0.005)


def test_grey_reflectance_is_seen_as_grey() -> None:
    grey, distance = coloured()[..., :1], np.full((32, 32), 0.5)
    plain = band_views((grey[..., 0], distance), EYE, (32, 32), PIXEL)
    spectral = band_views((SpectralPicture.of_srgb(grey * np.ones(3)), distance), EYE, (32, 32), PIXEL)
    for one, other in zip(plain, spectral, strict=True):
        assert one.view.image == pytest.approx(other.view.image, abs=0.004)


@pytest.mark.parametrize("band", ["L+M", "S"])
def test_every_wavelength_on_its_own_gives_the_same(band) -> None:
    """By 5 nm, each blurred alone and weighed by its light: without parts, bases of light or cones' transfers."""
    basis, picture, distance = SpectralBasis.of_srgb("A"), coloured(), np.full((32, 32), 0.8)
    cones = cone_fundamentals(basis.wavelength_nm)
    seen = cones[:, 2] if band == "S" else cones[:, :2].sum(axis=1)
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


def test_warm_light_moves_the_focus_of_all_cones_farther() -> None:
    """As red light does; a black body of 2856 K is the CIE's illuminant A."""
    for band in ("L+M", "S"):
        assert band_light(band, "3000 K").difference() > band_light(band, "D65").difference() + 0.05
    nm = np.array([420.0, 500.0, 640.0])
    assert illuminant(nm, "2856 K") == pytest.approx(illuminant(nm, "A"), rel=0.002)
