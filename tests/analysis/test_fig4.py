"""Fig. 4: blur sorts the segments of an indoor scene by depth, and without blur the order is gone."""

from dataclasses import replace

import numpy as np
import pytest
from fig4 import LENS, Sorted, noisy_bits

from focalgradient import View


@pytest.mark.slow
def test_segments_are_sorted_by_their_blur_and_by_nothing_else():
    blurred = Sorted.of(LENS, (480, 480), 32)
    scores = blurred.scores()
    assert scores["segments"] > 20
    assert scores["segments_in_the_right_class_percent"] > 75
    assert scores["pairs_in_the_right_order_percent"] > 80
    sharp = Sorted.of(replace(LENS, f_number=np.inf), (480, 480), 16).scores()
    assert sharp["segments_in_the_right_class_percent"] < 60
    assert sharp["pairs_in_the_right_order_percent"] < 60


def test_three_of_eight_bits_are_noise():
    view = View(np.linspace(0.05, 0.8, 6000).reshape(60, 100), LENS, 8e-4)
    grey = 255 * noisy_bits(view, 1).image.astype(float)
    assert np.abs(grey - np.rint(grey)).max() < 1e-4
    noise = grey - 250 * view.image / view.image.max()
    assert np.abs(noise).max() < 4.6
    assert abs(noise.std() - 8 / np.sqrt(12)) < 0.2
