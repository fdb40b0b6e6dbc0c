"""What a display must show for the retinal image of real depth: checked by the retinal image itself, another way."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient.eye import ChromaticStimulus, Eye, SpectralBasis, chromatic_stimulus, cone_images, retinal_image

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
