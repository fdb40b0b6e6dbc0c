"""Two wavebands that see one wall before another: what is claimed beside the outline is covered by what is stated."""

import numpy as np
import pytest

from focalgradient import recover_depth
from focalgradient.depth.equalise.outline_jumps import _surfaces
from focalgradient.eye import Cones, Eye, eye_views
from focalgradient.eye.cones import S_FINEST_CPD
from focalgradient.scenes import step

PIXEL, SHAPE = np.radians(1 / 60), (112, 224)


@pytest.mark.slow
@pytest.mark.parametrize(("near", "far", "seed"), [(1.8, 0.4, 3), (0.8, 0.2, 4)])
def test_depth_between_two_surfaces_is_not_claimed(near: float, far: float, seed: int) -> None:
    eye = Eye(0.004, 1.0)
    cones = [Cones.of(eye, "L+M"), Cones.of(eye, "S", finest_cpd=S_FINEST_CPD)]
    views = eye_views(step(1 / near, 1 / far, seed=seed), cones, SHAPE, PIXEL, noise=0.01, correlation=0.95, seed=seed)
    depth = recover_depth([one.view for one in views])
    off = np.abs(depth.vergence - 1 / views[0].distance)[depth.valid] / depth.vergence_sd[depth.valid]
    assert depth.valid.mean() > 0.5
    assert (off > 5).mean() < 0.01  # 2 and 7 % where what lies in between counts as depth
    assert (off < 2).mean() > 0.93


def test_a_jump_between_nodes_of_which_one_side_falls_between_those_used_is_none() -> None:
    """Every other node is used; on the far side only those in between are known, which once divided by 0."""
    down, across = np.mgrid[:19, :40]
    is_far = (down < 9) & (across > 19)
    level = np.where(is_far, 0.0, 12.0)
    level[9, 19] = 7.5
    is_known = ((down > 9) & (across < 19)) | (is_far & (across % 2 == 0))
    is_known[9, 19] = True
    _, near, _ = _surfaces(level, np.full(level.shape, 0.9), is_known, np.full(level.shape, 4.42), 2.0)
    assert not near.any()
