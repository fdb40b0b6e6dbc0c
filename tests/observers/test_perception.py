"""Depth by blur: monotone, what comes of prior, blur and discounting, and what not when one of them is taken away."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from focalgradient.display import Display
from focalgradient.observers import OBSERVERS, EncodedStimulus, encode, perceive, perceived_depth, relief
from focalgradient.observers.perception import (
    SD_PER_RADIUS,
    amplitude,
    blur_depth,
    off_layout,
    response,
)
from focalgradient.psf import disc_transfer

DEFAULT = OBSERVERS["default"]
DEPTH = np.random.default_rng(1).uniform(0, 1.5, 200)  # dioptres from the near end
APERTURES = (0.0, 0.050 / 22, 0.050 / 11, 0.050 / 5.6)
PUPILS = (0.002, 0.004, 0.006, 0.008)
DISTANCES = (0.57, 0.366, 0.25)


def scene(aperture: float, focus: float) -> EncodedStimulus:
    """A scene through an aperture (m), focused so many dioptres beyond its near end: a disc on the retina."""
    radius = np.degrees(aperture / 2 * np.abs(DEPTH - focus)) * 60
    return EncodedStimulus(np.hypot(SD_PER_RADIUS * radius, 1.0), 1.0, DEPTH - focus)


def ratio(observer, aperture, focus):
    depths = [[relief(scene(a, focus), observer, np.random.default_rng(n)) for n in range(20)] for a in (aperture, 0.0)]
    return float(np.mean(depths[0]) / np.mean(depths[1]))


@given(
    pupil=st.sampled_from(PUPILS),
    blur=st.floats(0, 20),
    more=st.floats(0, 20),
    layout=st.floats(0.02, 3),
    prior=st.floats(-1, 1),
    weber=st.floats(0.1, 1),
    spread=st.floats(0.1, 2),
)
def test_more_blur_never_makes_less_depth(pupil, blur, more, layout, prior, weber, spread):
    observer = replace(DEFAULT, pupil=pupil, prior=prior, weber=weber, layout_spread=spread)
    assert amplitude(layout, blur + more, observer) >= amplitude(layout, blur, observer) * (1 - 1e-9)


def picture(size, aperture, end):
    """A textured ground, 0.4 to 2.2 dioptres away, through an aperture (m) that is focused on its near or far end."""
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size))
    texture = np.fft.irfft2(
        np.fft.rfft2(np.random.default_rng(0).standard_normal((size, size))) / np.maximum(frequency, 1 / size)
    )
    light = np.fft.rfft2(0.4 * np.exp(0.15 * texture / texture.std()))
    vergence = np.linspace(0.4, 2.2, size)
    radius = aperture / 2 * np.abs(vergence - (2.2 if end == "nearest" else 0.4)) / (0.35 / size)
    levels = np.linspace(0, max(radius.max(), 1e-9), 17)
    blurred = np.array([np.fft.irfft2(light * disc_transfer(frequency, r)) for r in np.maximum(levels, 1e-6)])
    row = np.arange(size)
    low = np.clip(np.searchsorted(levels, radius) - 1, 0, 15)
    share = ((radius - levels[low]) / levels[1])[:, None]
    return blurred[low, row] * (1 - share) + blurred[low + 1, row] * share, np.tile(1 / vergence[:, None], size)


@pytest.mark.slow
def test_depth_rises_with_the_aperture_of_pictures_at_every_distance_and_for_every_pupil():
    """Through the pixels and the encoding; flat with the far end in focus."""
    size, display = 256, Display(pixel_pitch=0.5e-3)

    def depths(end, row, apertures, distance):
        """Mean log depth for each aperture, pupils x apertures."""
        nearer, encoded = replace(display, distance=distance), []
        for aperture in apertures:
            light, depth = picture(size, aperture, end)
            pixels = np.repeat(display.encode(light)[..., None], 3, 2)
            encoded += encode(pixels, nearer, [(size / 2, row * size)], depth)
        observers = [replace(DEFAULT, pupil=pupil) for pupil in PUPILS]
        glances = [np.random.SeedSequence(n) for n in range(5)]
        return np.log(
            [[[relief(one, o, np.random.default_rng(g)) for g in glances] for one in encoded] for o in observers]
        ).mean(2)

    for distance in DISTANCES:
        near = depths("nearest", 0.95, APERTURES, distance)
        assert np.diff(near).min() > 0
        assert (near[:, -1] - near[:, 0]).min() > 0.15
    far = depths("farthest", 0.05, (APERTURES[0], APERTURES[-1]), DISTANCES[0])
    assert far[:, 1] == pytest.approx(far[:, 0], abs=0.01)


def test_noise_of_rendering_makes_no_depth_fall():
    """Noise of a share of the light: 16 rays of the caster leave 2 steps of 255, which is 0.01 here."""
    noise, display, encoded = 0.02, Display(pixel_pitch=0.5e-3), []
    for number, aperture in enumerate(APERTURES):
        light, depth = picture(256, aperture, "nearest")
        light = light * (1 + noise * np.random.default_rng(number).standard_normal(light.shape))
        pixels = np.repeat(display.encode(np.clip(light, 0, 1))[..., None], 3, 2)
        encoded += encode(pixels, display, [(128.0, 0.95 * 256)], depth)
    for pupil in PUPILS:
        observer = replace(DEFAULT, pupil=pupil)
        depths = [relief(one, observer, np.random.default_rng(1)) for one in encoded]
        assert (np.diff(np.log(depths)) > -0.005).all()
        assert depths[-1] > 1.15 * depths[0]


def test_the_sky_has_the_blur_of_what_stands_before_it():
    """Clouds are soft in any focus."""
    light, depth = picture(256, APERTURES[0], "nearest")
    clouds = gaussian_filter(light, 6)
    light = np.where(np.arange(256)[:, None] < 96, clouds, light)
    pixels = np.repeat(Display().encode(np.clip(light, 0, 1))[..., None], 3, 2)
    depth = np.where(np.arange(256)[:, None] < 96, np.inf, depth)
    display = Display(pixel_pitch=0.5e-3)
    (known,) = encode(pixels, display, [(128.0, 240.0)], depth)
    (unknown,) = encode(pixels, display, [(128.0, 240.0)], np.where(np.isinf(depth), 50.0, depth))
    sky = known.depth > known.depth.max() - 1e-6
    assert np.median(known.blur[sky]) < 1.5 * np.median(known.blur[~sky])
    assert np.median(unknown.blur[sky]) > 3 * np.median(known.blur[~sky])


def test_a_blurred_eye_estimates_depth_by_its_own_pupil():
    """What the eye's own pupil would blur so, is where it is."""
    assert blur_depth(scene(DEFAULT.pupil, 0.0), DEFAULT) == pytest.approx(DEPTH, rel=1e-6)


@given(st.floats(-5, 5))
def test_the_scale_of_blur_has_errors_of_one(amplitude):
    """Its slope is the inverse of the standard deviation that the model states."""
    step = 1e-4
    slope = (response(amplitude + step, DEFAULT) - response(amplitude - step, DEFAULT)) / (2 * step)
    floor = np.radians(DEFAULT.intrinsic / 60) / SD_PER_RADIUS / (DEFAULT.pupil / 2)
    sd = np.sqrt(floor**2 + (DEFAULT.weber**2 + 1 - DEFAULT.prior**2) * amplitude**2)
    assert slope == pytest.approx(DEFAULT.prior / sd, rel=1e-4)


def test_a_layout_that_leaves_nothing_open_gives_the_relief_and_blur_its_amplitude_only():
    sure = replace(DEFAULT, layout_error=1e-6, layout_noise=0.0)
    places = [perceived_depth(scene(a, 0.0), sure, np.random.default_rng(0)) for a in (0.0, 0.009)]
    assert np.corrcoef(*places)[0, 1] == pytest.approx(1, abs=1e-6)
    assert places[1].std() > 1.2 * places[0].std()


def halves(blur=4.0):
    """A flat layout, half of it sharp and half of it blurred by some arcmin."""
    return EncodedStimulus(np.repeat([0.5, blur], 32), 0.5, np.zeros(64))


def test_on_a_flat_layout_depth_is_that_of_blur_and_on_the_side_of_the_prior():
    for name, side in (("default", 1), ("opposite", -1)):
        seen = perceive(halves(), OBSERVERS[name], np.random.default_rng(1))
        assert seen.along == 0
        assert side * (seen.depth[32:].mean() - seen.depth[:32].mean()) > 0.05
    for observer in (OBSERVERS["blur-blind"], replace(DEFAULT, defocus=0.0), replace(DEFAULT, layout_error=1e-9)):
        assert perceive(halves(), observer, np.random.default_rng(1)).off < 1e-6


@given(st.floats(0, 20), st.floats(0, 20), st.floats(0, 2), st.floats(0.01, 2))
def test_more_blur_off_the_layout_never_makes_less_depth(blur, more, layout, error):
    observer = replace(DEFAULT, layout_error=error)
    assert off_layout(layout, blur + more, observer) >= off_layout(layout, blur, observer) - 1e-9
    assert off_layout(layout, 0.0, observer) == pytest.approx(0, abs=1e-12)


def test_errors_at_single_places_are_not_taken_for_relief():
    """Equal blur everywhere but for Weber's error at each place: on a flat layout nearly no depth."""
    equal = EncodedStimulus(np.full(256, 4.0), 0.5, np.zeros(256))
    errors = [perceive(equal, DEFAULT, np.random.default_rng(n)).off for n in range(20)]
    assert np.mean(errors) < 0.25 * perceive(halves(), DEFAULT, np.random.default_rng(1)).off


def test_depth_grows_with_blur_when_the_near_is_in_focus_and_not_when_the_far_is():
    rising = [ratio(DEFAULT, aperture, 0.0) for aperture in (0.002, 0.0045, 0.009)]
    assert 1.0 < rising[0] < rising[1] < rising[2]
    assert rising[2] > 1.4
    for aperture in (0.002, 0.0045, 0.009):
        assert ratio(DEFAULT, aperture, 1.5) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("observer", "near", "far"),
    [
        (OBSERVERS["blur-blind"], False, False),
        (OBSERVERS["opposite"], False, True),
        (replace(DEFAULT, sign="layout"), True, True),  # blur gives the amount, and the layout the side
        (replace(DEFAULT, weber=20.0), False, False),  # discriminates no blur
        (replace(DEFAULT, intrinsic=300.0), False, False),  # everything is blurred
    ],
)
def test_without_a_part_of_the_mechanism_it_comes_out_otherwise(observer, near, far):
    for focus, rises in ((0.0, near), (1.5, far)):
        assert (ratio(observer, 0.009, focus) > 1.3) is rises
        if not rises:
            assert ratio(observer, 0.009, focus) == pytest.approx(1.0, abs=0.02)


def test_without_discounting_contradictory_blur_flattens():
    assert ratio(replace(DEFAULT, discounting=0.0), 0.009, 1.5) < 0.8
