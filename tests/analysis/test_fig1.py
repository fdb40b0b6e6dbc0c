"""Fig. 1: the sharpness of a mirrored image tells where it is, and traced rays say the same."""

import numpy as np
import pytest
from fig1 import FOCUS, pair, peak, sweep


@pytest.mark.slow
def test_reflection_is_sharpest_where_traced_rays_put_it():
    foci = np.arange(0.65, 1.2, 0.1)
    measured = sweep(foci, 1e-3, 32)
    across, upright = (peak(foci, measured[name]) for name in ("across", "upright"))
    assert abs(across - measured["traced_across"][0]) < 0.04
    assert measured["traced_upright"][1] < upright < measured["traced_upright"][2]
    # Both lie behind the surface, the upright image far behind.
    assert upright < across - 0.1 < FOCUS - 0.1


@pytest.mark.slow
def test_the_large_aperture_blurs_what_is_out_of_focus_alone():
    small, large = pair((90, 66), 32)
    near = np.abs(1 / small.distance - FOCUS) < 0.02
    far = small.distance > 2
    row = np.abs(np.diff(large.view.image, axis=1)) / np.abs(np.diff(small.view.image, axis=1)).mean()
    assert row[:, :-1][far[:, 2:]].mean() < 0.6 * np.abs(row[:, :-1][near[:, 2:]]).mean()
    # The truth is that of the scene: the same through both.
    assert np.array_equal(small.distance, large.distance)
