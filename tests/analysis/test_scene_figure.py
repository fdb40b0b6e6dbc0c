"""The rendered scene: what it scores, and what it draws."""

import numpy as np
import pytest
import scene

from focalgradient import DepthMap


def test_score_of_errors_known_beforehand():
    truth = np.full((10, 10), 2.0)
    recovered = truth.copy()
    recovered[0] *= 1.10  # one row is 10 % too far, the others 1 % too near
    recovered[1:] *= 0.99
    valid = np.ones(truth.shape, bool)
    valid[-1] = False
    depth = DepthMap(1 / recovered, np.full(truth.shape, 0.003), valid, valid)
    scored = scene.score(depth, truth, np.ones(truth.shape, bool))
    assert scored["valid_percent"] == pytest.approx(90)
    assert scored["median_size_of_error_percent"] == pytest.approx(1)
    assert scored["bias_percent"] == pytest.approx(-1)
    assert scored["within_2_vergence_sd_percent"] == pytest.approx(100 * 8 / 9)  # 1 % of 0.5 D is 0.005 D


def test_jumps_in_depth_are_kept_away_from_on_both_sides():
    truth = np.ones((20, 20))
    truth[:, 10:] = 2.0
    away = scene.away_from_edges(truth, 3)
    assert not away[:, 7:13].any()
    assert away[:, :7].all()
    assert away[:, 13:].all()


def test_views_have_one_truth_and_their_own_focus_and_magnification():
    views, truth = scene.views_and_truth(shape=(48, 64), samples=4)
    assert [1 / view.optics.focus_vergence for view in views] == pytest.approx([0.8, 1.6])
    assert views[0].pixel_angle < views[1].pixel_angle  # nearer focus, longer sensor distance
    assert views[0].shape == truth.shape
    assert 0.5 < truth.min() < truth.max() < 3.1
