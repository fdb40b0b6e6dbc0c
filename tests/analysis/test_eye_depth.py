"""The simulated eye's error against distance: what the figure says, on a few walls."""

import numpy as np
import pytest
from eye_depth import measure
from fig2 import focal_gradient_error

DISTANCES = (1.0, 4.0)


@pytest.mark.slow
def test_both_kinds_of_views_tell_distance_and_its_side():
    found = measure(DISTANCES, (4.0,), kinds=("bands", "oscillation"))
    for one in found.values():
        assert one["side_right"].min() > 0.97
        assert np.all(one["rms_m"] < 10 * focal_gradient_error(DISTANCES))
        assert np.all(one["valid"] > 0.3)
        # An error in dioptres is one of distance times its square.
        assert np.allclose(one["rms_m"], one["rms_error_D"] * np.square(DISTANCES))
    # Error by error, the oscillation's is the smaller: its textures are one, and no cone is coarse.
    assert np.all(found["oscillation"]["rms_m"] < found["bands"]["rms_m"])
