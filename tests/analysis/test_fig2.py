"""Fig. 2: both curves at points that can be worked out by hand, and against a lens."""

import pytest
from fig2 import focal_gradient_error, stereo_error


@pytest.mark.parametrize(("distance", "error"), [(1.0, 0.01), (2.0, 0.0), (4.0, 0.08), (10.0, 0.8)])
def test_focal_gradient_at_points_of_the_paper(distance, error):
    assert focal_gradient_error(distance) == pytest.approx(error, abs=1e-15)


def test_stereo_is_a_millimetre_at_a_metre_and_grows_with_the_square():
    assert stereo_error(1.0) == pytest.approx(1e-3)
    assert stereo_error(10.0) == pytest.approx(0.1)
