"""The strip of the Necker cube: what is drawn is what is said."""

import necker_strip
import numpy as np
import pytest
from necker_strip import CUBE, FIELD


@pytest.fixture(scope="module")
def shown():
    return necker_strip.make()


def test_frames_hold_the_whole_cube_with_its_blur():
    assert max(CUBE.extent) < FIELD / 2
    for row in necker_strip.frames(200).values():
        for picture in row:
            rim = np.concatenate([picture[[0, -1]].ravel(), picture[:, [0, -1]].ravel()])
            assert rim.max() < 1e-3 * picture.max()


def test_the_numbers_are_of_two_readings_of_one_picture(shown):
    said = shown.summary
    assert said["departure_from_rigid_of_the_rigid_reading_percent"] < 1e-9
    whole = said["departure_from_rigid_of_the_nonrigid_reading_percent"]
    least, largest = said["its_least_and_largest_at_one_moment_percent"]
    assert 1 < least < whole < largest
    assert {said["direction_of_the_rigid_reading"], said["direction_of_the_nonrigid_reading"]} == {"right", "left"}
    shortest, longest = said["shortest_and_longest_edge_of_the_nonrigid_reading_over_the_cubes"]
    assert shortest < 1 < longest
    assert said["largest_difference_of_light_between_gradients_percent"] < 0.02
    assert 0 <= said["blur_sd_of_vertices_least_and_largest_px"][0] < 1
    assert said["blur_sd_of_vertices_least_and_largest_px"][1] <= said["blur_sd_at_the_farthest_of_the_turn_px"]


def test_departure_falls_to_nothing_with_perspective(shown):
    perspective, whole = shown.plotted["perspective"], shown.plotted["departure_by_perspective"]
    assert np.all(np.diff(whole) > 0)
    assert whole[0] < perspective[0] < 0.03
