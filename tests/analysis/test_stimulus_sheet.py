"""The sheet of the depth-rating experiment: what is drawn is what was measured."""

import numpy as np
import pytest
import stimulus_sheet
from matplotlib.text import Text


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


@pytest.mark.slow
def test_every_condition_is_drawn_and_named(shown):
    pictures = [ax for ax in shown.figure.findobj(lambda artist: hasattr(artist, "images")) if ax.images]
    assert len(pictures) == 8
    texts = {text.get_text() for text in shown.figure.findobj(Text)}
    assert {"pinhole", "f/22", "f/11", "f/5.6", "nearest in focus", "farthest in focus"} <= texts
    assert "plain spheres" in shown.caption[0]
