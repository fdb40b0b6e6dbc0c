"""Looking without a layout: depth by blur alone, unbiased by texture, and thresholds with their dip."""

import numpy as np
import pytest

from focalgradient.display import Display
from focalgradient.observers import OBSERVERS, blur_threshold, look
from focalgradient.stimuli import texture_border

FINE = Display(distance=Display().distance * 60 / Display().pixels_per_degree)
"""A display of about 60 pixels per degree."""


def halves(slope, observer, left=1.0, right=4.0):
    drawn = texture_border(
        left_blur_arcmin=left,
        right_blur_arcmin=right,
        border="straight",
        slope=slope,
        pixels_per_degree=FINE.pixels_per_degree,
        width_deg=5,
        height_deg=5,
        seed=2,
    )
    return look(drawn.picture, FINE, (60.0, 150.0), OBSERVERS[observer])


def test_two_halves_of_unequal_blur_have_depth_on_a_flat_display():
    seen = halves(1.0, "default")
    assert np.nanmedian(seen.depth[:, -3:]) - np.nanmedian(seen.depth[:, :3]) > 0.5
    assert np.nanmedian(halves(1.0, "opposite").depth[:, -3:]) < -0.5
    assert np.nanmax(np.abs(halves(1.0, "blur-blind").depth)) == 0


@pytest.mark.parametrize("slope", [0.75, 1.0, 1.25])
def test_a_sharp_texture_is_not_read_as_blurred_for_its_slope(slope):
    """The eye's own blur and the sampling read about 1.1 arcmin; half of the Weber fraction is allowed."""
    seen = halves(slope, "default", 0.0, 1.0)
    assert np.nanmedian(seen.blur[:, :3]) == pytest.approx(1.08, rel=0.2)
    assert 2.7 - slope <= seen.texture_power <= 3 - slope  # too low by the eye's transfer, which is no Gaussian


def test_the_threshold_dips_near_the_intrinsic_blur_and_follows_weber_far_above_it():
    observer = OBSERVERS["default"]
    pedestals = np.linspace(0, 3, 301)
    thresholds = [blur_threshold(blur, observer) for blur in pedestals]
    assert 0.3 < pedestals[int(np.argmin(thresholds))] < 0.5
    assert blur_threshold(1000.0, observer) == pytest.approx(0.4 * 1000, rel=1e-3)
