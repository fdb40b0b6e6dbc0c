"""The mechanism: what comes out of prior, blur and discounting, and what not when one of them is taken away."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import kendalltau

from focalgradient.observers import OBSERVERS, Look, relief
from focalgradient.observers.perception import READ_PER_RADIUS, agreement, blur_depth

DEFAULT = OBSERVERS["default"]
DEPTH = np.random.default_rng(1).uniform(0, 1.5, 200)  # dioptres from the near end


def scene(aperture: float, focus: float) -> Look:
    """A scene through an aperture (m), focused so many dioptres beyond its near end: a disc on the retina."""
    radius = np.degrees(aperture / 2 * np.abs(DEPTH - focus)) * 60
    return Look(np.hypot(READ_PER_RADIUS * radius, 1.0), 1.0, DEPTH - focus)


def ratio(observer, aperture, focus):
    depths = [[relief(scene(a, focus), observer, np.random.default_rng(n)) for n in range(20)] for a in (aperture, 0.0)]
    return float(np.mean(depths[0]) / np.mean(depths[1]))


@given(st.permutations(range(8)), st.permutations(range(8)))
def test_agreement_is_kendalls_where_nothing_is_level(one, other):
    assert agreement(np.array(one), np.array(other)) == pytest.approx(kendalltau(one, other).statistic)


@given(st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=2, max_size=20))
def test_agreement_turns_with_a_cue_and_is_nothing_for_a_level_one(pairs):
    one, other = np.array(pairs, float).T
    assert agreement(one, -other) == -agreement(one, other) == -agreement(other, one)
    assert agreement(one, np.zeros(len(one))) == 0
    assert -1 <= agreement(one, other) <= 1


def test_a_blurred_eye_reads_depth_by_its_own_pupil():
    """What the eye's own pupil would blur so, is where it is."""
    assert blur_depth(scene(DEFAULT.pupil, 0.0), DEFAULT) == pytest.approx(DEPTH, rel=1e-6)


def test_depth_grows_with_blur_when_the_near_is_in_focus_and_not_when_the_far_is():
    rising = [ratio(DEFAULT, aperture, 0.0) for aperture in (0.002, 0.0045, 0.009)]
    assert 1.0 < rising[0] < rising[1]
    assert rising[2] > 1.5
    for aperture in (0.002, 0.0045, 0.009):
        assert ratio(DEFAULT, aperture, 1.5) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("observer", "near", "far"),
    [
        (OBSERVERS["blind"], False, False),
        (OBSERVERS["opposite"], False, True),
        (replace(DEFAULT, weber=20.0), False, False),  # sees no blur
        (replace(DEFAULT, intrinsic=300.0), False, False),  # sees everything blurred
    ],
)
def test_without_a_part_of_the_mechanism_it_comes_out_otherwise(observer, near, far):
    for focus, rises in ((0.0, near), (1.5, far)):
        assert (ratio(observer, 0.009, focus) > 1.5) is rises
        if not rises:
            assert ratio(observer, 0.009, focus) == pytest.approx(1.0, abs=0.02)


def test_without_discounting_contradictory_blur_works_on_depth():
    trusting = replace(DEFAULT, discounts=False)
    assert abs(np.log(ratio(trusting, 0.009, 1.5))) > 0.1


def test_uncertain_layout_gives_way_to_blur():
    weak, strong = (replace(DEFAULT, layout_spread=spread) for spread in (1.5, 0.3))
    assert ratio(weak, 0.009, 0.0) > ratio(DEFAULT, 0.009, 0.0) > ratio(strong, 0.009, 0.0) > 1.0
