"""Fig. 6: what is drawn is what the lens does."""

import fig6
import numpy as np
import pytest


@pytest.fixture(scope="module")
def shown():
    return fig6.make()


def test_the_blur_circle_follows_from_the_rays(shown):
    assert shown.summary["sigma_mm"] == pytest.approx(shown.summary["sigma_by_similar_triangles_mm"])
    assert shown.summary["sigma_mm"] == pytest.approx(3.125)  # 12.5 mm x (75 - 60) / 60
    assert shown.summary["u_from_sigma_by_Eq_1_mm"] == pytest.approx(300)


def test_conjugate_planes_obey_the_thin_lens_law(shown):
    mm = shown.summary
    for there, here in (("u0", "v0"), ("u", "v")):
        assert 1 / mm[f"{there}_mm"] + 1 / mm[f"{here}_mm"] == pytest.approx(1 / mm["F_mm"])
    assert mm["v_mm"] < mm["v0_mm"]  # a point beyond focus is imaged in front of the image plane


def test_rays_from_beyond_focus_end_on_the_rim_of_the_blur_circle(shown):
    ends = [line.get_xydata()[-1] for line in shown.figure.axes[0].lines if len(line.get_xdata()) == 4]
    assert len(ends) == 2
    for x, y in ends:
        assert x == pytest.approx(shown.summary["v0_mm"])
        assert abs(y) == pytest.approx(shown.summary["sigma_mm"])
    assert ends[0][1] == -ends[1][1]
    rays = shown.plotted["ray_from_beyond_mm"]
    slopes = np.diff([y for _, y in rays]) / np.diff([x for x, _ in rays])
    assert slopes[1] == pytest.approx(slopes[2])  # straight behind the lens
