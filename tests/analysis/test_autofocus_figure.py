"""One or two images against thirty: how it is counted, and that two images do what several settings of focus do."""

import math

import autofocus
import pytest


def test_images_needed_for_an_accuracy():
    assert autofocus.images_needed([3, 10, 30], [4.0, 1.0, 0.25], 2.0) == pytest.approx(math.sqrt(30))
    assert autofocus.images_needed([3, 10, 30], [4.0, 1.0, 0.25], 0.1) == math.inf
    assert autofocus.images_needed([3, 10, 30], [4.0, 1.0, 0.25], 5.0) == 3
    assert autofocus.images_needed([3, 10, 30], [1.0, 4.0, 2.0], 2.0) == pytest.approx(30)  # for good, not by chance


@pytest.mark.slow
def test_few_settings_err_more_than_two_views_and_many_less():
    measured = autofocus.measure(autofocus.PLACES[0], counts=(3, 10), samples=64)
    few, many = measured["autofocus"]["median_error_percent"]
    two = measured["two foci"]["median_error_percent"][0]
    assert many < two < few
    shared = measured["same light"]["median_error_percent"][1]
    assert many < shared < 4 * many  # noise is 2.1 times as much
    for values in measured.values():
        assert min(values["valid_percent"]) > 80
        assert min(values["within_2_sd_percent"]) > 88
