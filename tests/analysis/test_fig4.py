"""Fig. 4: blur sorts the segments of an indoor scene by depth, and without blur the order is gone."""

from dataclasses import replace

import numpy as np
from fig4 import LENS, Sorted, noisy_bits

from focalgradient import View


def test_segments_are_sorted_by_their_blur_and_by_nothing_else():
    blurred = Sorted.of(LENS, (360, 480), 64)
    scores = blurred.scores()
    assert scores["segments"] > 30
    assert scores["segments_in_the_right_class_percent"] > 90
    assert scores["pairs_in_the_right_order_percent"] > 95
    assert set(blurred.depth_class(blurred.true).tolist()) == {0, 1, 2}
    sharp = Sorted.of(replace(LENS, f_number=np.inf), (360, 480), 16).scores()
    assert sharp["segments"] > 30
    assert 30 < sharp["pairs_in_the_right_order_percent"] < 70


def test_three_of_eight_bits_are_noise():
    view = View(np.linspace(0.05, 0.8, 6000).reshape(60, 100), LENS, 8e-4)
    grey = 255 * noisy_bits(view, 1).image.astype(float)
    assert np.abs(grey - np.rint(grey)).max() < 1e-4
    noise = grey - 250 * view.image / view.image.max()
    assert np.abs(noise).max() < 4.6
    assert abs(noise.std() - 8 / np.sqrt(12)) < 0.2
