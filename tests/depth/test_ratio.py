"""The real-time form: ratios known by analysis, the table against rays, and depth of ray-cast scenes."""

import numpy as np
import pytest
from blurred import PIXEL, lens, wall
from hypothesis import given, settings
from hypothesis import strategies as st
from judged import covered
from scipy import ndimage

from focalgradient import View, recover_depth
from focalgradient.depth.noise import noise_floor
from focalgradient.depth.ratio import energies
from focalgradient.depth.ratio.disparity import focal_disparity
from focalgradient.depth.ratio.likelihood import ENERGY_ERROR
from focalgradient.depth.ratio.table import BANDS, DisparityTable
from focalgradient.photographs import srgb_to_linear
from focalgradient.render import cast, noisy
from focalgradient.scenes import plane, slant
from focalgradient.scenes.texture import Texture
from focalgradient.video import luminance

LENSES = [lens(16), lens(5.6)]


def grating(period: float, contrast: float, shape: tuple[int, int] = (64, 128)) -> np.ndarray:
    wave = np.cos(2 * np.pi * np.arange(shape[1]) / period)
    return np.broadcast_to(1 + contrast * wave, shape).astype(np.float32)


# The kernel, against other ways to the same numbers.


def test_luminance_weighs_light_and_not_stored_values() -> None:
    levels = srgb_to_linear(np.arange(256) / 255).astype(np.float32)
    colours = np.random.default_rng(0).integers(0, 255, (40, 50, 3), np.uint8)
    colours[0] = colours[0, :, :1]
    stored = luminance(levels)(colours)
    light = levels[colours] @ np.array([0.0722, 0.7152, 0.2126])
    np.testing.assert_array_equal(stored[0], colours[0, :, 0])  # grey stays as it is
    assert np.abs(np.searchsorted((levels[1:] + levels[:-1]) / 2, light) - stored.astype(int)).max() <= 1
    colours[5, 5, 1] = 255
    assert luminance(levels)(colours)[5, 5] == 255


@pytest.mark.parametrize("side", [4, 2, 1])
@pytest.mark.parametrize("shape", [(40, 56), (43, 61)])
def test_energy_and_brightness_are_those_of_scipy(side: int, shape: tuple[int, int]) -> None:
    image = np.random.default_rng(0).random(shape, np.float32)
    second = ndimage.laplace(image.astype(float), mode="nearest")
    rows, columns = shape[0] // side, shape[1] // side

    def squares(values: np.ndarray) -> np.ndarray:
        return values[: rows * side, : columns * side].reshape(rows, side, columns, side).mean(axis=(1, 3))

    energy, brightness = energies.energies([image, 1 - image], None, side, False)
    np.testing.assert_allclose(energy[0], squares(second**2), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(energy[1], energy[0], rtol=1e-4, atol=1e-6)  # a negative has the same detail
    np.testing.assert_allclose(brightness[0], squares(image), rtol=1e-5)
    sizes, _ = energies.energies([image], None, side, True)
    np.testing.assert_allclose(sizes[0], squares(np.abs(second)) ** 2, rtol=1e-5, atol=1e-6)


# The ratio.


@pytest.mark.parametrize("band", BANDS)
@pytest.mark.parametrize("share", [0.5, 0.1])
def test_disparity_is_the_share_of_contrast_that_blur_leaves(band: int, share: float) -> None:
    period = 4.0 * band
    disparity, valid = focal_disparity(
        grating(period, 0.04), grating(period, 0.04 * share), band=band, window=8, least=0
    )
    assert valid.all()
    # The Gaussian of 8 pixels leaves 0.04 exp(-2 (8 pi / 32)^2) = 1.2 % of the widest grating in the brightness.
    np.testing.assert_allclose(disparity[3:-3, 4:-4], share, rtol=0.012)


@settings(deadline=None, max_examples=20)
@given(st.floats(0.2, 5.0), st.floats(0.2, 5.0))
def test_exposure_leaves_the_disparity_as_it_is(first: float, second: float) -> None:
    one, other = grating(6, 0.4), grating(6, 0.2)
    usual, _ = focal_disparity(one, other)
    exposed, _ = focal_disparity(np.float32(first) * one, np.float32(second) * other)
    np.testing.assert_allclose(exposed, usual, rtol=1e-3)


@pytest.mark.parametrize("absolute", [False, True])
def test_noise_energy_is_subtracted_without_bias(absolute: bool) -> None:
    random = np.random.default_rng(2)
    texture = random.standard_normal((2, 400, 400)) * np.array([0.1, 0.05])[:, None, None]
    images = [(1 + t + 0.03 * random.standard_normal(t.shape)).astype(np.float32) for t in texture]
    seen, _ = focal_disparity(*images, window=32, absolute=absolute)
    true, _ = focal_disparity(*images, window=32, absolute=absolute, noise=0.03)
    assert np.mean(seen) > 0.55
    assert np.mean(true) == pytest.approx(0.5, rel=0.01)


def test_rounding_to_whole_numbers_is_noise_too() -> None:
    random = np.random.default_rng(3)
    texture = random.standard_normal((400, 400))
    stored = [np.rint(100 + sd * texture).astype(np.uint8) for sd in (4.0, 0.5)]
    disparity, _ = focal_disparity(*stored, window=32)
    assert np.mean(disparity) == pytest.approx(0.125, rel=0.02)


def test_no_estimate_where_the_sharp_view_has_no_detail() -> None:
    random = np.random.default_rng(4)
    sharp = 1 + 0.1 * random.standard_normal((64, 128))
    sharp[:, 64:] = 1 + 0.002 * random.standard_normal((64, 64))
    view = sharp.astype(np.float32)
    disparity, valid = focal_disparity(view, view, noise=0.002, least=0)
    assert valid[:, :16].all()
    assert not valid[:, 17:].any()
    assert (disparity[~valid] == 0).all()


def test_noise_is_estimated_in_the_emptiest_squares() -> None:
    random = np.random.default_rng(5)
    image = 100 + 3 * random.standard_normal((320, 320))
    image[:, :200] += 20 * random.standard_normal((320, 200))
    assert noise_floor(image) == pytest.approx(3, rel=0.06)


@pytest.mark.parametrize("masked", [False, True])
def test_a_blown_out_quarter_leaves_the_rest_as_it_is(masked: bool) -> None:
    """What is saturated, or filled in under a mask, shows no noise, and says nothing of the noise elsewhere."""
    views = []
    for view in wall(LENSES, 1.3, noise=0.01):
        image, mask = view.image.copy(), np.ones(view.shape, bool)
        image[:60], mask[:60] = image.max() + 0.01, False
        views.append(View(image, view.optics, PIXEL, mask if masked else None))
    depth = recover_depth(views, near=0.85, method="ratio")
    assert depth.details["noise"] == pytest.approx([0.01] * 2, rel=0.1)
    assert depth.valid[68:].mean() > 0.95
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1.3, rel=0.02)


# The table.


@pytest.mark.parametrize("psf", ["disc", "gaussian"])
def test_table_falls_with_defocus(psf: str) -> None:
    table = DisparityTable.of(LENSES, PIXEL, psf=psf)  # type: ignore[arg-type]
    falls = []
    for band in BANDS:
        disparity = table.disparity(table.focus - table.defocus, band)
        assert disparity[0] == pytest.approx(1)
        # Where both views are far out of focus, their ratio stands still, or with a disc rises a little.
        falling = disparity[disparity > 1.06 * disparity.min()]
        assert (np.diff(falling) < 0).all()
        falls.append(len(falling))
    assert falls == sorted(falls)  # of a coarser band to a larger defocus


@pytest.mark.parametrize("distance", [1.0, 1.4])
def test_table_agrees_with_rays(distance: float) -> None:
    """The ratios of a ray-cast wall, whose texture is 1/f up to half a cycle a pixel, are those worked out."""
    texture = Texture(texel=PIXEL, projected=True)
    views = [cast(plane(distance, texture=texture), one, (320, 320), PIXEL, samples=64).view for one in LENSES]
    table = DisparityTable.of(LENSES, PIXEL)
    for band in (2, 4):
        disparity, _ = focal_disparity(*(view.image for view in views), band=band, window=64)  # type: ignore[arg-type]
        expected = float(table.disparity([1 / distance], band)[0])
        assert np.median(disparity) == pytest.approx(expected, rel=0.05)


# Depth of ray-cast scenes.


def rendered(near: float, far: float, noise: float, texture: Texture | None = None) -> tuple[list[View], np.ndarray]:
    shape = (160, 320)
    texture = texture or Texture(texel=0.3e-3, projected=True)
    scene = slant(near, far, shape[1] * PIXEL, seed=2, texture=texture)
    casts = [cast(scene, one, shape, PIXEL, samples=128) for one in LENSES]
    sd = noise * float(casts[0].view.image.mean())
    return [noisy(one.view, sd, seed) for seed, one in enumerate(casts)], casts[0].distance


def test_slanted_plane() -> None:
    views, truth = rendered(0.9, 2.2, 0.002)
    depth = recover_depth(views, near=0.85, method="ratio")
    assert depth.valid.mean() > 0.9
    assert np.median(np.abs(depth.distance / truth - 1)[depth.valid]) <= 0.05
    assert 0.85 <= covered(depth, truth) <= 0.995
    assert np.isfinite(depth.vergence).all()
    assert np.isfinite(depth.vergence_sd).all()
    assert depth.side_known.all()
    # Which view is the sharper is known from the optics, not by the order.
    swapped = recover_depth(views[::-1], near=0.85, method="ratio")
    np.testing.assert_allclose(swapped.vergence[depth.valid], depth.vergence[depth.valid], atol=0.02)


def test_what_bands_differ_by_beyond_chance_widens_the_uncertainty() -> None:
    """A texture twice as coarse as the model's: 79 % lay within two standard deviations."""
    views, truth = rendered(0.9, 2.2, 0.002, Texture(texel=0.6e-3, projected=True))
    depth = recover_depth(views, near=0.85, method="ratio")
    assert depth.valid.mean() > 0.9
    assert covered(depth, truth) > 0.88


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize("sigma", [1.0, 4.0])
@pytest.mark.parametrize(("slope", "most"), [(1.0, 0.03), (0.75, ENERGY_ERROR), (1.4, ENERGY_ERROR)])
def test_bias_is_small_at_any_blur_and_slope_of_the_spectrum(sigma: float, slope: float, most: float) -> None:
    lenses = [lens(11.2), lens(5.6)]
    defocus = sigma / 0.5 * PIXEL / (lenses[1].aperture_diameter / 2)
    random = np.random.default_rng(int(10 * sigma))
    frequency = np.hypot(np.fft.fftfreq(512)[:, None], np.fft.fftfreq(512))
    frequency[0, 0] = np.inf
    field = np.fft.ifft2(np.fft.fft2(random.standard_normal((512, 512))) * frequency**-slope * (frequency < 0.5)).real
    views = wall(lenses, 1 / (1 / 0.85 - defocus), psf="gaussian", noise=0.002, field=1 + 0.2 * field / field.std())
    depth = recover_depth(views, near=0.85, method="ratio", psf="gaussian", noise=0.002)
    error = ((1 / 0.85 - depth.vergence) / defocus - 1)[32:-32, 32:-32]
    assert depth.valid[32:-32, 32:-32].mean() > 0.95
    assert abs(error.mean()) < most
    assert error.std() < 0.06


@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_a_view_sharper_than_the_optics_allow_is_rejected() -> None:
    views = wall(LENSES, 1.4, noise=0.003)
    swapped = [View(one.image, other.optics, PIXEL) for one, other in zip(views, views[::-1], strict=True)]
    assert recover_depth(swapped, near=0.85, method="ratio").valid.mean() < 0.05
