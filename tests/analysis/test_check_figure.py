"""The figure of the internal check: what contradicts is told from what agrees."""

import numpy as np
from check import control, examine, reflection
from scipy.stats import chi2

SHAPE = (136, 136)


def test_reflections_are_found_and_a_sound_wall_is_left_alone():
    agreeing, wrong = examine(control, SHAPE, range(1))
    mirrored, off = examine(reflection, SHAPE, range(1))
    assert wrong.mean() < 0.1
    assert off.mean() > 0.5
    assert np.mean(agreeing > chi2.isf(0.01, 1)) < 0.1
    assert (mirrored[off][:, None] > agreeing).mean() > 0.9
