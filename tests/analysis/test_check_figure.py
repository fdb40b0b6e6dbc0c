"""The figure of the internal check: what contradicts is distinguished from what agrees."""

import numpy as np
import pytest
from check import control, examine, reflection
from scipy.stats import chi2

SHAPE = (136, 136)


@pytest.mark.slow
def test_reflections_are_found_and_a_sound_wall_is_left_alone():
    sound, mirrored = (examine(kind, SHAPE, range(1)) for kind in (control, reflection))
    assert sound.wrong.mean() < 0.1
    assert mirrored.wrong.mean() > 0.5
    assert np.mean(sound.statistic > chi2.isf(0.01, 1)) < 0.1
    assert (mirrored.statistic[mirrored.wrong][:, None] > sound.statistic).mean() > 0.9
    assert sound.default_rejected.mean() < 0.1
    # The default method states so much more uncertainty that hardly an answer is wrong by it, and claims none.
    assert mirrored.default_rejected.mean() > 0.9
    assert (mirrored.default_wrong & ~mirrored.default_rejected).mean() < 0.05
