"""Figures of any data set: as in the paper, with the numbers of the analysis, and honest about who answered."""

import sys
from pathlib import Path

import fig3
import necker
import pytest
from matplotlib.text import Text
from recorded import record_necker, record_ratings
from scipy import stats

from focalgradient.power import Model
from focalgradient.report import analyse_ratings

sys.path.insert(0, str(Path(__file__).parents[1]))


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return record_ratings(tmp_path_factory.mktemp("data") / "data", 8, Model(effect=2.2))


def test_both_curves_are_drawn_with_their_axis_and_all_subjects(data):
    shown = fig3.shown(data)
    (ax,) = shown.figure.axes
    assert [label.get_text().split() for label in ax.get_xticklabels()] == [
        *(["pinhole", "0"], ["f/22", "2.27"], ["f/11", "4.55"], ["f/5.6", "8.93"])
    ]
    assert ax.get_xticks() == pytest.approx([0, 50 / 22, 50 / 11, 50 / 5.6], abs=0.01)
    assert ax.get_ylim()[0] < 1 < 3 < ax.get_ylim()[1]
    texts = {text.get_text() for text in shown.figure.findobj(Text)}
    assert {"near object\nin focus", "far object\nin focus", "simulated observers"} <= texts
    assert fig3.ASSUMED in shown.caption
    assert "With the nearest object in focus the impression of depth rose" in " ".join(shown.caption)
    near, far = shown.plotted["nearest"], shown.plotted["farthest"]
    assert near["estimate"][0] == 1
    assert near["estimate"][-1] > 1.7
    assert near["low"][-1] < near["estimate"][-1] < near["high"][-1]
    assert far["estimate"][-1] == pytest.approx(1, abs=0.25)
    assert len(near["subjects"]) == 8
    assert shown.summary["p_of_the_rise_with_nearest_in_focus"] < 0.001


def test_of_people_the_picture_says_nothing_of_simulation(tmp_path):
    shown = fig3.make(record_ratings(tmp_path / "data", 2, kind="human"))
    assert shown.summary["simulated"] is False
    assert not any("imulated" in text.get_text() for text in shown.figure.findobj(Text))
    assert "simulated" not in " ".join(shown.caption)


@pytest.mark.parametrize(("effect", "near"), [(1.0, "was not shown to change"), (0.5, "fell")])
def test_the_caption_follows_the_numbers(effect, near, tmp_path):
    """Each fixation's ratio and direction are those of the analysis, beside what the paper reports."""
    root = record_ratings(tmp_path / "data", 6, Model(effect=effect, far_effect=0.6))
    caption = " ".join(fig3.shown(root).caption)
    assert fig3.PUBLISHED in caption
    for fixation in analyse_ratings(root).result.fixations:
        assert f"With the {fixation.fixation} object in focus the impression of depth " in caption
        assert f"ratio {fixation.rise.ratio.estimate:.2f}, 95 % CI [" in caption
    assert f"With the nearest object in focus the impression of depth {near}" in caption
    assert "With the farthest object in focus the impression of depth fell" in caption


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    return necker.make(record_necker(tmp_path_factory.mktemp("data") / "data", 6))


def test_bars_are_the_shares_of_all_the_time(shown):
    bars = shown.figure.axes[1].patches
    total = [sum(bar.get_height() for bar in bars if round(bar.get_x() + 0.375) == x) for x in range(3)]
    assert total == pytest.approx([100] * 3)
    nonrigid = {
        row["gradient"]: row["estimate"] for row in shown.plotted["share_of_time"] if row["percept"] == "nonrigid"
    }
    assert {round(bar.get_height(), 6) for bar in bars} >= {round(100 * share, 6) for share in nonrigid.values()}
    assert nonrigid["rigid"] < nonrigid["none"] < nonrigid["nonrigid"]


def test_medians_are_those_of_the_fits(shown):
    row = next(row for row in shown.plotted["durations"] if (row["gradient"], row["percept"]) == ("none", "rigid"))
    law = stats.gamma if row["family"] == "gamma" else stats.lognorm
    median = law.median(row["shape"], scale=row["scale_s"])
    heights = [y for line in shown.figure.axes[2].lines for y in line.get_ydata()]
    assert any(height == pytest.approx(median) for height in heights)
    assert shown.summary["p_nonrigid_4mm"] < 0.01
