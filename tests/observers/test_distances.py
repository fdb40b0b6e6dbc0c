"""Distance in metres by blur: planes of known distance, looked at with their layout up to its scale."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from focalgradient.display import Display
from focalgradient.observers import OBSERVERS, DistanceOfFixated, RelativeLayout
from focalgradient.stimuli import slanted_plane

DISPLAY = Display()


@cache
def plane(distance):
    size = {"width_deg": 10, "height_deg": 10, "pixels_per_degree": DISPLAY.pixels_per_degree}
    return slanted_plane(slant_deg=75, distance_m=distance, pupil_mm=4, **size)


def seen(distance, observer="default", **cues):
    drawn = plane(distance)
    question = DistanceOfFixated(RelativeLayout(drawn.depth_m, **cues), (drawn.shape[1] / 2, drawn.shape[0] / 2))
    one = OBSERVERS[observer] if isinstance(observer, str) else observer
    return one.look(drawn.picture, DISPLAY, question)


def test_the_blur_of_a_layout_gives_its_distance():
    sure = replace(OBSERVERS["default"], defocus=1.0)
    answers = {distance: seen(distance, sure) for distance in (0.3, 0.6)}
    for distance, answer in answers.items():
        assert abs(np.log(answer.median / distance)) < 2 * answer.log_sd
        assert answer.log_sd < 2.2  # the layout alone leaves 3
    assert answers[0.6].median > 1.4 * answers[0.3].median


def test_who_does_not_use_blur_sees_what_the_other_cues_suggest():
    answer = seen(0.3, "blur-blind", expected_m=20.0, log_sd=0.2)
    assert answer.median == pytest.approx(20.0, rel=0.03)
    assert answer.log_sd == pytest.approx(0.2, rel=0.03)


def test_blur_pulls_what_is_thought_far_away_near_and_less_the_surer_that_is():
    unsure, sure = (seen(0.3, expected_m=20.0, log_sd=sd).median for sd in (2.0, 0.3))
    assert unsure < 2
    assert unsure < sure < 20.5
