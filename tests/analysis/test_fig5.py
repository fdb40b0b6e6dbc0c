"""Fig. 5: what is drawn is the ratio, and without blur there is none."""

import fig5
import numpy as np
import pytest

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.ratio.disparity import focal_disparity


@pytest.mark.slow
def test_content_of_a_checkerboard_is_known():
    board = 2 + 0.3 * (np.indices((64, 64)).sum(axis=0) % 2)
    content = fig5.content(View(board.astype(np.float32), Lens(0.025, 8, 1.0), 3e-4))
    # Every pixel differs from each of its four neighbours by 0.3, about a mean of 2.15.
    assert content == pytest.approx(4 * 0.3 / 2.15, rel=1e-3)


@pytest.mark.slow
def test_disparity_comes_out_of_the_blur_and_reflections_lie_behind_their_mirror():
    views, again, truth = fig5.views_and_truth(shape=(200, 150), samples=64)
    small, large, twice = (view.image for view in (*views, again))
    seen = np.trace(truth.vergence, axis1=-2, axis2=-1) / 2
    noise = 0.03 * float(small.mean())  # of the rays, mostly
    disparity, valid = focal_disparity(small, large, noise=noise, window=8)
    control, control_valid = focal_disparity(small, twice, noise=noise, window=8)
    grid, shown = (image[2::4, 2::4][: valid.shape[0], : valid.shape[1]] for image in (1 / truth.distance, seen))
    near, far = valid & (shown > 0.97), valid & (shown < 0.8)
    assert np.median(disparity[near]) > 1.5 * np.median(disparity[far])
    assert np.median(control[control_valid]) == pytest.approx(1, abs=0.05)
    # At the foot of the bottle the checks are seen in it, behind its surface.
    depth = recover_depth(views, method="ratio", near=fig5.FOCUS, far=fig5.FAR)
    mirrored = depth.valid & (1 / truth.distance - seen > fig5.MIRRORED)
    assert np.median((1 / truth.distance - depth.vergence)[mirrored]) > 0
    assert np.mean(grid[valid] >= shown[valid] - 1e-3) > 0.9
