"""The Necker figure of a data set: shares and durations by gradient, as analysed."""

import sys
from pathlib import Path

import necker
import pytest
from scipy import stats

sys.path.insert(0, str(Path(__file__).parents[1]))

from recorded import record_necker


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
