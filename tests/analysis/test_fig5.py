"""Fig. 5: what is drawn is the ratio, and without blur there is none."""

import fig5
import numpy as np
import pytest

from focalgradient import Lens, View
from focalgradient.depth.ratio import focal_disparity


def test_content_of_a_checkerboard_is_known():
    board = 2 + 0.3 * (np.indices((64, 64)).sum(axis=0) % 2)
    content = fig5.content(View(board.astype(np.float32), Lens(0.025, 8, 1.0), 3e-4))
    # Every pixel differs from each of its four neighbours by 0.3, about a mean of 2.15.
    assert content == pytest.approx(4 * 0.3 / 2.15, rel=1e-3)


def test_disparity_comes_out_of_the_blur():
    views, again, truth = fig5.views_and_truth(shape=(120, 160), samples=64)
    small, large, twice = (view.image for view in (*views, again))
    noise = fig5.NOISE * float(small.mean())
    near = np.abs(truth[2::4, 2::4] - fig5.FOCUS) < 0.1
    disparity, told = focal_disparity(small, large, noise=noise, window=8)
    control, control_told = focal_disparity(small, twice, noise=noise, window=8)
    assert np.median(disparity[told & near]) > 1.3 * np.median(disparity[told & ~near])
    assert control[control_told] == pytest.approx(1, abs=0.15)
