"""Fig. 4: blur sorts the segments of an indoor scene by depth, and without blur the order is gone."""

import numpy as np
import pytest
from fig4 import LENS, Room, noisy_bits

from focalgradient import View


@pytest.fixture(scope="module")
def found():
    return Room.of((480, 480), 32)


@pytest.mark.slow
def test_segments_are_sorted_by_their_blur_and_by_nothing_else(found):
    scores = found.blurred.scores()
    assert scores["segments"] > 20
    assert scores["segments_in_the_right_class_percent"] > 75
    assert scores["pairs_in_the_right_order_percent"] > 80
    sharp = found.sharp.scores()
    assert sharp["segments_in_the_right_class_percent"] < 75
    assert sharp["pairs_in_the_right_order_percent"] < 60


def test_three_of_eight_bits_are_noise():
    view = View(np.linspace(0.05, 0.8, 6000).reshape(60, 100), LENS, 8e-4)
    grey = 255 * noisy_bits(view, 0.8, 1).image.astype(float)
    assert np.abs(grey - np.rint(grey)).max() < 1e-4
    noise = grey - 250 * view.image / 0.8
    assert np.abs(noise).max() < 4.6
    assert abs(noise.std() - 8 / np.sqrt(12)) < 0.2
