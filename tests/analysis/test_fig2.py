"""Fig. 2: both curves at points that can be worked out by hand, and against a lens."""

import pytest
from fig2 import focal_gradient_error, stereo_error

from focalgradient import Lens


@pytest.mark.parametrize(("distance", "error"), [(1.0, 0.01), (2.0, 0.0), (4.0, 0.08), (10.0, 0.8)])
def test_focal_gradient_at_points_of_the_paper(distance, error):
    assert focal_gradient_error(distance) == pytest.approx(error, abs=1e-15)


def test_stereo_is_a_millimetre_at_a_metre_and_grows_with_the_square():
    assert stereo_error(1.0) == pytest.approx(1e-3)
    assert stereo_error(10.0) == pytest.approx(0.1)


@pytest.mark.parametrize("lens", [Lens(0.025, 4, 2.0), Lens(0.100, 11, 2.0)])
@pytest.mark.parametrize(("distance", "side"), [(0.8, "nearer"), (1.5, "nearer"), (3.0, "beyond"), (8.0, "beyond")])
def test_a_lens_whose_blur_is_misread_errs_by_the_curve(lens, distance, side):
    """The lens's constants cancel, on both sides of focus."""
    little = 1e-6
    misread = lens.distance_from_blur((1 + little) * lens.blur_radius(distance), side)
    assert abs(misread - distance) == pytest.approx(focal_gradient_error(distance, little), rel=1e-4)
