"""The sheet of the depth-rating experiment: what is drawn is what was measured."""

import numpy as np
import pytest
import stimulus_sheet


@pytest.fixture(scope="module")
def shown():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stimulus_sheet, "variant", lambda: None)  # the quick scenes, as where there is no Mitsuba
        return stimulus_sheet.make()


@pytest.mark.slow
def test_conditions_are_controlled(shown):
    said = shown.summary
    assert said["largest_change_of_mean_luminance_percent"] < 0.5
    assert said["largest_shift_against_the_prediction_px"] < 0.05
    near, far = said["distance_of_the_nearest_and_the_farthest_object_m"]
    assert near < 0.7 < 1.5 < far
    ratios = np.array(list(shown.plotted["amplitude_over_predicted"].values()))
    assert ratios.shape == (6, 4)
    worst = said["largest_difference_of_amplitude_from_the_prediction_percent"]
    assert worst == pytest.approx(100 * np.abs(ratios - 1).max())
    assert worst < 15  # at this coarse pixel
