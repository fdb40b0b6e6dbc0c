"""Power by simulation against Student's t in closed form."""

import math

import pytest
from scipy import stats

from focalgradient.design import DepthRatingDesign
from focalgradient.power import Model, rise_power
from focalgradient.statistics.skewness import FACTOR


@pytest.mark.parametrize(("noise", "repetitions", "subjects"), [(0.3, 1, 8), (0.3, 4, 8), (0.9, 2, 20)])
def test_power_is_that_of_the_noncentral_t(noise: float, repetitions: int, subjects: int) -> None:
    """Where people and scenes do not differ, the effect's standard error follows from the noise of one rating.

    A rise is the difference of two means of `repetitions` ratings.
    """
    scenes = ("spheres-01", "spheres-02")
    design = DepthRatingDesign(scenes=scenes, fixations=("nearest",), repetitions=repetitions)
    error = noise * math.sqrt(2 / (repetitions * len(scenes) * subjects))
    effect = 2.2 * error
    model = Model(effect=math.exp(effect), between=0.0, between_scenes=0.0, noise=noise)
    found = rise_power(model, design, 1.2, subjects, 4000)
    limit = stats.t.isf(0.025 / FACTOR, subjects - 1)
    upper = float(stats.nct.sf(limit, subjects - 1, effect / error))
    assert upper - 0.1 < found["near_rise"] < upper + 0.03  # the rest is what the sample's skewness costs
