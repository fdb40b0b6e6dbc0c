"""Blur estimated from one image: against images whose blur is known."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from focalgradient.observers.perception import SD_PER_RADIUS
from focalgradient.observers.retinal_blur import CONTRAST, LINE, estimate_blur, power_law, retinal_image
from focalgradient.psf import disc_transfer
from focalgradient.render import wireframe

SIDE = 256


def texture(transfer=lambda frequency: 1.0, contrast=0.2, seed=0):
    frequency = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    spectrum = np.fft.rfft2(np.random.default_rng(seed).standard_normal((SIDE, SIDE))) / np.maximum(frequency, 1 / SIDE)
    spectrum[0, 0] = 0
    scale = contrast / np.fft.irfft2(spectrum).std()
    noise = CONTRAST * np.random.default_rng(seed + 1).standard_normal((SIDE, SIDE))
    return scale * np.fft.irfft2(spectrum * transfer(frequency)) + noise


def median_blur(image, **how):
    estimate = estimate_blur(image, 32, **how)
    return float(np.exp(np.median(estimate.log_blur[np.isfinite(estimate.log_sd)])))


@pytest.mark.parametrize(("sigma", "contrast"), [(1.0, 0.1), (2.0, 0.5), (4.0, 0.1)])
def test_blur_of_texture_is_estimated_whatever_its_contrast(sigma, contrast):
    image = texture(lambda f: np.exp(-2 * (np.pi * sigma * f) ** 2), contrast, seed=3)
    assert median_blur(image, edges=False) == pytest.approx(np.hypot(sigma, 0.5), rel=0.15)


@pytest.mark.parametrize(("sigma", "noise"), [(0.3, 0.03), (2.0, 0.02), (4.0, 0.06)])
def test_noise_of_the_picture_is_not_taken_for_sharp_texture(sigma, noise):
    """White noise, as of rendering with few rays; without that hypothesis sd 4 comes out as 3.1 and 0.5."""
    image = texture(lambda f: np.exp(-2 * (np.pi * sigma * f) ** 2))
    image = image + noise * np.random.default_rng(5).standard_normal(image.shape)
    assert median_blur(image, edges=False) == pytest.approx(np.hypot(sigma, 0.5), rel=0.2)


@pytest.mark.parametrize("radius", [2.0, 5.0])
def test_discs_are_estimated_as_the_observer_takes_them_to_be(radius):
    found = median_blur(texture(lambda f: disc_transfer(f, radius)), edges=False)
    assert np.sqrt(found**2 - 0.25) / radius == pytest.approx(SD_PER_RADIUS, rel=0.15)


@pytest.mark.parametrize("sigma", [1.0, 3.0])
def test_blur_of_lone_edges_is_estimated(sigma):
    step = 0.4 * (np.indices((SIDE, SIDE))[1] + 0.3 * np.arange(SIDE)[:, None] > 160)
    image = gaussian_filter(step.astype(float), sigma) + 0.004 * np.random.default_rng(0).standard_normal((SIDE, SIDE))
    estimate = estimate_blur(image, 32)
    sure = estimate.log_sd < 0.11  # the edge itself
    assert sure.sum() >= 6
    assert np.exp(np.median(estimate.log_blur[sure])) == pytest.approx(np.hypot(sigma, 0.5), rel=0.2)
    beside = np.isfinite(estimate.log_sd) & ~sure
    assert np.exp(np.median(estimate.log_blur[beside])) < 2 * np.hypot(sigma, 0.5)


@pytest.mark.parametrize("sigma", [1.5, 3.0])
def test_blur_of_lines_is_estimated(sigma):
    lines = [[[-20, 16 + 64 * n], [SIDE + 20, 16 + 64 * n]] for n in range(4)]
    image = wireframe(lines, np.zeros((4, 2)), (SIDE, SIDE), width=sigma, brightness=np.sqrt(2 * np.pi) * sigma)
    estimate = estimate_blur(image.astype(float), 32, law=power_law(LINE), edges=False)
    estimates = np.exp(estimate.log_blur[0::2])  # the rows of places that lines run through
    assert np.median(estimates) == pytest.approx(np.hypot(sigma, 0.5), rel=0.15)


def test_nothing_is_estimated_where_there_is_nothing():
    image = texture()
    image[:, :128] = 0.0
    unknown = np.isinf(estimate_blur(image, 32).log_sd)
    assert unknown[:, :2].all()
    assert not unknown[:, 4:].any()


def test_the_eye_itself_blurs_and_a_wide_pupil_more():
    light = np.exp(texture(seed=1))
    found = [median_blur(np.log(retinal_image(light, 60, pupil)), edges=False) for pupil in (0.002, 0.006)]
    assert median_blur(np.log(light), edges=False) < found[0] < found[1]
