"""Depth of coloured textures: the spectrum is estimated with the depth, or known; one that is not known misleads."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from textures import natural

from focalgradient import InputError, recover_depth
from focalgradient.eye import (
    ColouredCones,
    Cones,
    Eye,
    KnownSpectrum,
    LocalColours,
    Oscillation,
    SeenContrast,
    SpectralBasis,
    SpectralPicture,
    accommodation_views,
    band_picture,
    band_views,
    cone_catches,
    estimate_colours,
)
from focalgradient.eye.local_colour import FREQUENCIES, SCALES, LitCones, _passed

PIXEL = np.radians(1 / 60)
EYE = Eye(0.004, 1.0)
BASIS = SpectralBasis.of_srgb()
RED, BLUE, VERGENCE = (0.7, 0.1, 0.08), (0.08, 0.12, 0.6), 1.6


def texture(side: int = 128, seed: int = 0) -> np.ndarray:
    """A natural texture of mean 1 (side x side x 1)."""
    return natural((side, side), seed)[..., None]


def wall(colour, side: int = 128) -> tuple[SpectralPicture, np.ndarray]:
    return SpectralPicture(texture(side) * np.array(colour), BASIS), np.full((side, side), 1 / VERGENCE)


@pytest.mark.parametrize(("colour", "vergence"), [(RED, 0.4), ((0.5, 0.5, 0.5), 1.0), (BLUE, 2.0)])
def test_the_spectrum_is_found_through_blur_where_depth_is_known(colour, vergence: float) -> None:
    """The focus of the L and M cones in its light, to 0.025 D."""
    picture, _ = wall(colour)
    catches = cone_catches(picture, np.full((128, 128), 1 / vergence), EYE, PIXEL)
    colours = estimate_colours(catches, BASIS, EYE, PIXEL)
    assert len(colours.spectra) <= 2
    for spectrum in colours.spectra:
        focus = BASIS.mixed("L+M", spectrum.amounts(BASIS, np.array([vergence]))[0]).difference()
        assert focus == pytest.approx(BASIS.mixed("L+M", colour).difference(), abs=0.025)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("colour", [RED, BLUE])
def test_depth_of_coloured_walls_by_moments(colour) -> None:
    # With less noise, the blue wall contradicts white light, and depth as white is rejected.
    rendered = accommodation_views(wall(colour), EYE, (0.125, 0.375), Oscillation(), (128, 128), PIXEL, noise=0.008)
    views = [one.view for one in rendered]
    depth = recover_depth(views)
    error = depth.vergence[depth.valid] - VERGENCE
    assert depth.valid.mean() > 0.6
    assert abs(np.median(error)) < 0.03
    assert np.mean(np.abs(error) <= 2 * depth.vergence_sd[depth.valid]) > 0.85
    # As white, the focus of the L and M cones is 0.3 D (red) or 0.45 D (blue) off.
    white = [replace(view, optics=Cones.of(view.optics.eye, "L+M")) for view in views]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of views that contradict their optics
        plain = recover_depth(white)
    error = float(np.median(plain.vergence[plain.valid]) - VERGENCE)
    assert abs(error) > 0.1
    # The map says so, in the direction of the error.
    assert "assumes" not in depth.details
    (sentence,) = plain.details["assumes"]
    red, blue = sentence.split("red texture")[1].split("blue texture")
    assert ("near" if error > 0 else "far") in (red if colour is RED else blue)
    assert sentence in plain.summary()


def test_depth_of_a_red_wall_by_bands() -> None:
    views = [one.view for one in band_views(wall(RED), EYE, (128, 128), PIXEL, noise=0.005)]
    assert all(isinstance(view.optics, ColouredCones) for view in views)
    depth = recover_depth(views)
    assert depth.valid.mean() > 0.6
    assert abs(np.median(depth.vergence[depth.valid]) - VERGENCE) < 0.03


@pytest.mark.slow
def test_two_colours_side_by_side_lie_at_one_depth() -> None:
    """Red and blue, whose foci differ by 0.6 D and more: a mixture of colours over the field."""
    colour = np.where((np.arange(160) < 80)[None, :, None], np.array(RED), np.array(BLUE) * 1.3)
    scene = SpectralPicture(texture(160) * colour, BASIS), np.full((160, 160), 1 / VERGENCE)
    seen = accommodation_views(scene, EYE, (0.125, 0.375), Oscillation(), (160, 160), PIXEL, noise=0.005)
    views = [one.view for one in seen]
    assert len(views[0].optics.mixture.optics) > 2
    depth = recover_depth(views)
    for columns in (np.s_[:, 24:56], np.s_[:, 104:136]):
        valid = depth.valid[columns]
        assert valid.mean() > 0.5
        assert np.median(depth.vergence[columns][valid]) == pytest.approx(VERGENCE, abs=0.03)


def test_without_chromatic_aberration_colour_moves_nothing() -> None:
    eye = replace(EYE, chromatic_scale=0.0)
    seen = SeenContrast((1.4, 0.9, 0.1), eye, PIXEL)
    mean, shares = np.array([0.8, 0.1, 0.1]), np.ones((1, 40, 40))
    colours = LocalColours(BASIS, (seen,), mean, shares, np.zeros((40, 40)), np.ones(3))
    frequency = np.degrees(np.array([2.0, 8.0, 16.0]))
    cones = colours.seen_by(Cones.of(eye, "L+M"))
    lit = cones.mixture.optics[0].through_focus(0 * frequency, frequency, [1.3])
    assert lit[0] == pytest.approx(Cones.of(eye, "L+M").transfer(frequency, 1.3), abs=0.02)


def test_colours_of_another_frame_are_refused() -> None:
    known = LocalColours.known(BASIS, RED, (64, 64))
    views = [one.view for one in band_views(wall(RED), EYE, (128, 128), PIXEL, colours=known)]
    with pytest.raises(InputError, match="at the views' pixels"):
        recover_depth(views)


def test_the_contrast_that_s_cones_see_is_expected_from_the_colours() -> None:
    """Light and shade on blue beside brown: a contrast over the mean light that S cones see as L and M cones do."""
    shade, side = texture(128), 128
    colour = np.where((np.arange(side) < side // 2)[None, :, None], np.array(RED), np.array(BLUE))
    catches = np.stack([shade[..., 0] * (colour[0] @ BASIS.catch(band))[None, :] for band in "LMS"], axis=-1)
    colours = estimate_colours(catches, BASIS, EYE, PIXEL)
    parts = colours.seen_by(Cones.of(EYE, "S")).mixture
    assert parts.gain == pytest.approx(1.0, abs=3 * parts.gain_sd)
    # Where the texture is blue, S cones see more of it than where it is red.
    red, blue = (parts.shares[:, :, columns].mean(axis=(1, 2)) for columns in (np.s_[16:40], np.s_[88:112]))
    seen = np.array([one.contrast(np.array([1.0]))[0] for one in parts.optics])
    assert blue @ seen > 3 * (red @ seen)


@pytest.mark.slow
def test_bands_share_a_texture_whose_gain_differs_from_place_to_place() -> None:
    """Detail in brown and in grey light, side by side: depth by bands is valid and right in both."""
    own = np.where((np.arange(128) < 64)[None, :, None], np.array((1.2, 1.0, 0.6)), np.array((0.9, 1.0, 1.3)))
    detail = texture(128) - 1
    scene = SpectralPicture(0.4 * (1 + detail * own), BASIS), np.full((128, 128), 1 / VERGENCE)
    depth = recover_depth([one.view for one in band_views(scene, EYE, (128, 128), PIXEL, noise=0.003)])
    error = (depth.vergence - VERGENCE)[depth.valid]
    assert depth.valid.mean() > 0.6
    assert abs(np.median(error)) < 0.04
    assert np.mean(np.abs(error) <= 2 * depth.vergence_sd[depth.valid]) > 0.85


def test_what_s_cones_show_besides_is_seen_by_l_and_m_cones_in_blue_light() -> None:
    side, vergence, eye, basis = 96, 2.4, Eye(0.005, 1.5), SpectralBasis.of_srgb()
    covariance = 1 + 0.64 * np.eye(3)  # texture in common, and one of each component's own
    both = basis.catch("L+M")
    spectrum = covariance @ both / (both @ covariance @ both)
    rest = covariance / (both @ covariance @ both) - np.outer(spectrum, spectrum)

    def rendered(band: str) -> NDArray[np.complex128]:
        """Spectra of what the cones see of a point of each component."""
        points = np.zeros((3, side, side, 3))
        points[range(3), side // 2, side // 2, range(3)] = 1
        distance = np.full((side, side), 1 / vergence)
        seen = [band_picture(SpectralPicture(one, basis), distance, eye, band, pixel_angle=PIXEL) for one in points]
        return np.fft.fft2(np.fft.ifftshift(seen, axes=(1, 2)))[:, 0, 2:7]

    first, second = rendered("L+M"), rendered("S")
    cross = np.einsum("jf,jk,kf->f", second, covariance, first.conj()).real
    shown = cross / np.einsum("jf,jk,kf->f", first, covariance, first.conj()).real

    def stated(rest: NDArray[np.float64]) -> NDArray[np.float64]:
        known, given = KnownSpectrum(tuple(spectrum.tolist())), tuple(tuple(row) for row in rest.tolist())
        parts = [LitCones(Cones.of(eye, band), basis, known, 1.0, given) for band in ("L+M", "S")]
        at = np.fft.fftfreq(side)[2:7] / PIXEL
        of_lm, of_s = (one.through_focus(0 * at, at, [vergence])[0].real for one in parts)
        return np.asarray(basis.catch("S") @ spectrum * of_s / of_lm)

    assert stated(rest) == pytest.approx(shown, rel=0.005)
    assert (stated(0 * rest)[2:] < 0.99 * shown[2:]).all()


def test_the_same_catches_in_another_light_are_the_same_colours_of_that_light() -> None:
    """What cones catch is seen, whatever the light: assumed later, the light gives what it gives at once."""
    own = np.concatenate([texture(96, seed) - 1 for seed in (1, 2, 3)], axis=-1)
    sheets = texture(96) + 0.3 * own
    catches = 0.4 * sheets @ np.stack([BASIS.catch(band) for band in "LMS"]).T
    lamp = SpectralBasis.of_srgb("A")
    daylight, at_once = (estimate_colours(catches, one, EYE, PIXEL) for one in (BASIS, lamp))
    moved = daylight.lit_by(lamp)
    assert moved.mean == pytest.approx(at_once.mean, abs=0.01)
    assert moved.light == pytest.approx(at_once.light, abs=1e-6)
    stated, wanted = (np.array(one.rest_of_amounts()) for one in (moved, at_once))
    assert stated == pytest.approx(wanted, abs=0.02 * np.abs(wanted).max())
    # In daylight's amounts it is another covariance.
    unmoved = np.array(daylight.rest_of_amounts())
    assert np.abs(unmoved - wanted).max() > 0.1 * np.abs(wanted).max()


@pytest.mark.parametrize("scale", SCALES[1:])
def test_what_a_scale_passes_of_a_texture_is_what_two_gaussians_differ_by(scale):
    """Filtered in space: the share of the power up to each of some frequencies."""
    fine, coarse = (gaussian_filter(natural((512, 512), 1), sd, mode="wrap", truncate=8) for sd in scale)
    power = np.abs(np.fft.fft2(fine - coarse)) ** 2
    radius = np.hypot(np.fft.fftfreq(512)[:, None], np.fft.fftfreq(512))
    found = np.cumsum(_passed(*scale))
    for number in range(0, len(FREQUENCIES) - 1, 3):
        below = (FREQUENCIES[number] + FREQUENCIES[number + 1]) / 2
        assert found[number] == pytest.approx(power[radius < below].sum() / power.sum(), abs=0.03)
