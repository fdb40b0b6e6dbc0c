"""A colour picture on the retina, and what a display must show for it: colours, light and fringes as they must be."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient.eye import (
    ChromaticStimulus,
    Cones,
    Eye,
    SpectralBasis,
    chromatic_stimulus,
    cone_images,
    parts_needed,
    retinal_image,
)

PIXEL = np.radians(1 / 60)


def test_without_blur_every_colour_comes_back() -> None:
    """Coarse colours through a small pupil without chromatic aberration, in focus: as they were, in the middle."""
    colours = np.kron(np.random.default_rng(2).uniform(0.1, 0.9, (2, 2, 3)), np.ones((24, 24, 1)))
    eye = Eye(0.002, 1.0, chromatic_scale=0.0)
    seen = retinal_image(colours, np.ones(colours.shape[:2]), eye, pixel_angle=PIXEL)
    for row in (12, 36):
        for column in (12, 36):
            assert seen[row, column] == pytest.approx(colours[row, column], abs=0.02)


def test_a_white_edge_has_a_blue_fringe_beyond_focus_and_a_red_one_before_it() -> None:
    """Accommodated nearer than the edge, blue is blurred most; farther than the edge, red is."""
    edge = np.zeros((24, 64, 3))
    edge[:, :32] = 1.0
    dark = np.s_[12, 36:42]
    ratios = []
    for accommodation in (2.5, 0.5):
        seen = retinal_image(edge, np.full(edge.shape[:2], 1 / 1.5), Eye(0.003, accommodation), pixel_angle=PIXEL)
        red, _, blue = seen[dark].mean(axis=0)
        ratios.append(blue / red)
    assert ratios[0] > 1.1
    assert ratios[1] < 0.9


@pytest.mark.parametrize(("pupil", "accommodation"), [(0.003, 1.5), (0.006, 1.0)])
def test_the_number_of_wavelengths_follows_from_pupil_and_distance(pupil: float, accommodation: float) -> None:
    """A step from black to white is right to 0.01 of white; one wavelength for each primary and cone class is not."""
    picture = np.zeros((32, 64, 3))
    picture[:, 32:] = 1.0
    distance = np.full((32, 64), 0.8)
    eye = Eye(pupil, accommodation)
    many = retinal_image(picture, distance, eye, pixel_angle=PIXEL, wavelengths=61)
    assert np.abs(retinal_image(picture, distance, eye, pixel_angle=PIXEL) - many).max() < 0.01
    assert np.abs(retinal_image(picture, distance, eye, pixel_angle=PIXEL, wavelengths=1) - many).max() > 0.02


def test_the_parts_of_a_clear_pupil_suffice_for_an_astigmatic_eye() -> None:
    """What each cone class resolves (S cones 10 cycles per degree) of white on a display, by these parts and by 21."""
    eye, frequency = Eye(0.004, refraction="-1.00 -0.75 x 180"), np.degrees([2.0, 4.0, 8.0, 16.0])
    display = SpectralBasis.of_display()
    count = parts_needed([0.5, 1.0], eye, pixel_angle=np.radians(1 / 60))

    def seen(band: str, parts: int, vergence: float) -> np.ndarray:
        cones = [Cones.in_light(eye, band, display.light(band, one), wavelengths=parts) for one in range(3)]
        each = [one.optical_transfer(0.0, frequency, vergence) for one in cones]
        return display.catch(band) @ np.array(each)

    for band in ("L", "M", "S"):
        for vergence in (1.0, 2.0):
            off = np.abs(seen(band, count, vergence) - seen(band, 21, vergence))
            assert off[: 3 if band == "S" else 4].max() < 0.01


PIXEL, SIDE = np.radians(1 / 60), 56
EYE = Eye(0.004, 1.0)


def picture() -> np.ndarray:
    random = np.random.default_rng(1)
    radius = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.fftfreq(SIDE))
    radius[0, 0] = 1
    grey, tint = (np.fft.ifft2(np.fft.fft2(random.standard_normal((SIDE, SIDE))) / radius).real for _ in range(2))
    colours = 0.15 * (grey / grey.std())[..., None] + 0.05 * (tint / tint.std())[..., None] * np.array([1, -1, 0.5])
    return np.clip(0.5 + colours, 0, 1)


def found(distance: float) -> ChromaticStimulus:
    return chromatic_stimulus(picture(), np.full((SIDE, SIDE), distance), EYE, screen=1.0, pixel_angle=PIXEL)


def left(shown: np.ndarray, distance: float) -> np.ndarray:
    """Difference of the retinal images of the scene and of what is shown, by `retinal_image`, away from the border."""
    wanted, got = (
        cone_images(retinal_image(light, np.full((SIDE, SIDE), where), EYE, pixel_angle=PIXEL))
        for light, where in ((picture(), distance), (shown, 1.0))
    )
    return np.sqrt(np.mean((wanted - got)[8:-8, 8:-8] ** 2, axis=(0, 1)))


def test_beyond_the_display_every_cone_gets_what_the_scene_would_give() -> None:
    one = found(2.0)
    assert one.shown.min() >= 0
    assert one.shown.max() <= 1
    assert max(one.residual) < 0.005
    assert np.all(np.array(one.residual) < 0.15 * np.array(one.alike))
    assert left(one.shown, 2.0).max() < 0.006


def test_nearer_than_the_display_blue_cannot_be_as_sharp_as_the_scene_is() -> None:
    """The eye blurs the display's blue by 0.8 D more than the scene's: contrast can be taken away, not added."""
    one = found(0.5)
    assert max(one.residual[:2]) < 0.01
    assert max(one.residual[:2]) < 0.3 * max(one.alike[:2])
    assert one.residual[2] > 0.02
    assert one.unlimited[2] <= one.residual[2]
    assert left(one.shown, 0.5) == pytest.approx(one.residual, abs=0.015)


def test_at_the_display_the_scene_itself_is_to_be_shown() -> None:
    one = found(1.0)
    # Of blue the eye sees no fine detail.
    assert np.abs(one.shown - picture())[..., :2].mean() < 0.015
    assert max(one.residual) < 0.005
    assert max(one.scene_shown) > 3 * max(one.residual)


@pytest.mark.slow
def test_the_display_is_seen_through_the_lens_of_a_given_age() -> None:
    """Through a lens of 80 years the picture found for it is nearer the scene than the one found for 32 years."""
    old = SpectralBasis.of_display().through_lens(80)
    scene, near = np.full((SIDE, SIDE), 0.8), np.full((SIDE, SIDE), 1.0)
    found = [
        chromatic_stimulus(picture(), scene, EYE, screen=1.0, pixel_angle=PIXEL, basis=basis).shown
        for basis in (old, SpectralBasis.of_display())
    ]
    wanted, *got = (
        retinal_image(light, where, EYE, pixel_angle=PIXEL, basis=old)
        for light, where in ((picture(), scene), *((shown, near) for shown in found))
    )
    off = [np.sqrt(np.mean((one - wanted)[8:-8, 8:-8] ** 2)) for one in got]
    assert off[0] < 0.97 * off[1]
    assert np.abs(found[0] - found[1]).max() > 0.02
