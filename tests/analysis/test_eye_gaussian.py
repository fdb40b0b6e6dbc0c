"""Gaussians for the eye's blur: what the figure says, on a few points."""

import eye_gaussian
import numpy as np
import pytest


@pytest.mark.slow
def test_far_from_focus_the_disc_comes_back_and_near_it_a_core_on_a_skirt():
    defocus = np.array([0.0, 0.75, 2.0, 6.0])
    white = eye_gaussian.measure(defocus, step_nm=20)
    one = eye_gaussian.measure(defocus, white=False)
    assert np.isnan(white["k"][:, 0]).all()
    assert white["k"][1:, 3] == pytest.approx(eye_gaussian.DISC, abs=0.01)
    assert (white["residual"][2:, 0] > 0.5).all()
    assert (white["residual"][1:, 1] < 0.1).all()
    assert (white["residual"][:, 2:] < one["residual"][:, 2:]).all()
    assert (one["lowest"][:, 2:] < white["lowest"][:, 2:]).all()
    assert (white["lowest"][:, 2:] < -0.05).all()


def test_the_drawn_transfers_reverse_where_no_gaussian_does():
    transfers = eye_gaussian._transfers()
    assert min(curve.min() for curve in transfers["gaussian"]) >= 0
    assert [bool(curve.min() < -0.05) for curve in transfers["white"]] == [False, False, True]
