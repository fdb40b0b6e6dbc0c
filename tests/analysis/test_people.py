"""Depth over a population: the same eyes in a larger one, none in focus, each read with its own optics."""

import numpy as np
import pytest
from population import PUPILS, Look, at_focus, cones_of, drawn, looked, population, read, seen, walls


def test_the_first_of_many_eyes_and_walls_are_those_of_few() -> None:
    everyone = population(None)
    assert drawn(everyone, 1) == drawn(everyone, 1) != drawn(everyone, 2)
    assert len(walls(20)) == 20
    assert np.abs(walls(20)).min() > 0.12
    assert at_focus(drawn(everyone, 1), PUPILS[0]).focus_vergence == pytest.approx(2.0)


@pytest.mark.slow
def test_an_eye_reads_depth_with_its_own_optics_and_worse_with_anothers() -> None:
    everyone = population(None)
    own = drawn(everyone, 1)
    rows = looked(Look(1, 0.005, own, (-0.6, 0.4, 0.6)))
    assert np.median([row["median_error_D"] for row in rows]) < 0.05
    assert min(row["valid"] for row in rows) > 0.4
    assert np.mean([row["within_2_sd"] for row in rows]) > 0.9
    another = cones_of("bands", at_focus(drawn(everyone, 2), 0.005))
    views = seen(cones_of("bands", at_focus(own, 0.005)), -0.6, 1001)
    assert read(views, another, -0.6)["unmasked_error_D"] > 2 * rows[0]["unmasked_error_D"]
