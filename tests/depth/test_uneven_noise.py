"""Noise that rises with brightness: found where it is, left alone where it is not, and covered by what is stated."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from judged import said
from textures import natural_spectrum

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.equalise import parts
from focalgradient.depth.noise import NoiseLaw, noise_law
from focalgradient.psf import transfer

LENSES = [Lens(focal_length=0.025, f_number=n, focus_distance=0.85) for n in (16, 5.6)]
PIXEL = 8e-6 / 0.0258
SIDE = 384
DISTANCE = 1.4


def views(light, sd, *, photons, seed=0):
    """A textured wall under uneven `light` (H x W), through both apertures, with noise of `sd` where light is 1."""
    random = np.random.default_rng(seed)
    frequency = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    sharp = np.fft.rfft2(light * np.exp(np.fft.irfft2(natural_spectrum((SIDE, SIDE), random, 0.25))))
    made = []
    for lens in LENSES:
        image = np.fft.irfft2(sharp * transfer(frequency, lens.blur_radius(DISTANCE) / PIXEL, "disc"))
        noise = sd * np.sqrt(np.maximum(image, 0)) if photons else sd
        made.append(View((image + noise * random.standard_normal(image.shape)).astype(np.float32), lens, PIXEL))
    return made


def waves(ratio):
    """Light that goes from dark to `ratio` times that and back, down and across: 1 on average."""
    wave = np.exp(np.log(ratio) / 2 * np.sin(2 * np.pi * np.arange(SIDE) / SIDE))
    light = np.sqrt(np.outer(wave, np.roll(wave, SIDE // 3)))
    return light / light.mean()


def coverage(depth, where):
    some = depth.valid & where
    return float((np.abs(depth.vergence - 1 / DISTANCE)[some] < 2 * depth.vergence_sd[some]).mean())


def test_photons_are_covered_in_the_dark_and_in_the_light():
    light = waves(30)
    depth = recover_depth(views(light, 0.02, photons=True), near=0.86, far=2.4)
    assert depth.details["noise_by_brightness"]["share"] > 0.95
    assert depth.valid.mean() > 0.97
    for where in (light < np.quantile(light, 0.25), light > np.quantile(light, 0.75)):
        assert coverage(depth, where) > 0.89
    # Bright places are known better: their contrast is larger against the noise.
    dark, bright = (np.median(depth.vergence_sd[light < 0.5]), np.median(depth.vergence_sd[light > 1.5]))
    assert bright < dark


def test_even_noise_and_noise_that_is_given_are_left_alone():
    depth = recover_depth(views(waves(8), 0.01, photons=False), near=0.86, far=2.4)
    assert depth.details["noise_by_brightness"] is None
    assert depth.valid.mean() > 0.95
    depth = recover_depth(views(waves(8), 0.01, photons=True), near=0.86, far=2.4, noise=0.02)
    assert depth.details["noise_by_brightness"] is None


def test_tiles_take_the_law_of_the_frame(monkeypatch):
    seen = views(waves(30), 0.02, photons=True)
    whole = recover_depth(seen, near=0.86, far=2.4)
    monkeypatch.setattr(parts, "CORE", SIDE // 2)
    tiled = recover_depth(seen, near=0.86, far=2.4)
    law, other = (depth.details["noise_by_brightness"]["share"] for depth in (whole, tiled))
    assert abs(law - other) < 0.2
    both = whole.valid & tiled.valid
    assert both.mean() > 0.85
    apart = np.abs(whole.vergence - tiled.vergence)[both] / whole.vergence_sd[both]
    assert np.median(apart) < 0.3


@settings(max_examples=15, deadline=None)
@given(st.floats(0.3, 0.95), st.integers(0, 2**32 - 1))
def test_the_law_is_recovered_beneath_what_contradicts(share, seed):
    random = np.random.default_rng(seed)
    brightness = random.uniform(0.05, 2.0, 4000)
    variance = NoiseLaw(share, 1.0).variance(brightness) * random.gamma(50, 1 / 50, 4000)
    variance[random.random(4000) < 0.3] *= 5  # outlines
    found = noise_law(variance, brightness, np.ones(4000), at=1.0)
    assert found is not None
    assert abs(found.share - share) < 0.12


def test_few_places_or_no_light_tell_nothing():
    assert noise_law(*3 * [np.arange(1.0, 20)], at=1.0) is None
    assert noise_law(*3 * [np.arange(1.0, 400)], at=0.0) is None


def test_a_map_without_a_valid_pixel_says_why():
    first, second = views(waves(2), 0.01, photons=False)
    stained = second.image * (
        1 + 0.3 * np.random.default_rng(1).standard_normal((SIDE // 8, SIDE // 8)).repeat(8, 0).repeat(8, 1)
    )
    depth, _ = said([first, View(stained, second.optics, PIXEL)], near=0.86, far=2.4)
    assert not depth.valid.any()
    assert "blocks of JPEG" in depth.details["rejected"]  # the stains are as large
    assert f"no pixel is valid: {depth.details['rejected']}" in depth.summary()
    assert "rejected" not in recover_depth([first, second], near=0.86, far=2.4).details


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("focus", "near", "sds"),
    [
        ((0.85, 0.85), 0.86, (0.03, 0.01)),
        ((0.85, 1.25), None, (0.03, 0.006)),  # less than a fifth of the other is not resolved
        ((0.85, 1.25), None, (0.004, 0.03)),
    ],
)
def test_noise_is_estimated_for_each_view(focus, near, sds):
    """Frames of one camera at two ISO settings: the noise of each is found, and depth is covered."""
    lenses = [Lens(0.025, 8 if near is None else stop, at) for stop, at in zip((16, 5.6), focus, strict=True)]
    random = np.random.default_rng(3)
    frequency = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    sharp = np.fft.rfft2(random.standard_normal((SIDE, SIDE))) / np.maximum(frequency, 1 / SIDE)
    seen = []
    for lens, sd in zip(lenses, sds, strict=True):
        image = 1 + 5e-2 * np.fft.irfft2(sharp * transfer(frequency, lens.blur_radius(DISTANCE) / PIXEL, "disc"))
        seen.append(View((image + sd * random.standard_normal(image.shape)).astype(np.float32), lens, PIXEL))
    depth = recover_depth(seen, near=near)
    assert depth.details["noise"] == pytest.approx(sds, rel=0.35)
    assert depth.valid.mean() > 0.85
    assert coverage(depth, True) > 0.9
