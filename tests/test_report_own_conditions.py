"""Reports on ratings by any condition: no fixation, scene, catch trial or repetition is needed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from focalgradient import InputError
from focalgradient.report import make_report
from focalgradient.report.reading import explained_table
from focalgradient.statistics import Effect, read_thresholds
from focalgradient.statistics.own_conditions import rating_tests, read_conditions


@pytest.fixture
def table(tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    rows = [
        [f"S{who}", mm, "young" if who < 4 else "old", round(float(np.exp(slope * mm + rng.normal(0, 0.1))), 3)]
        for who, slope in enumerate(rng.normal(0.05, 0.02, 8))
        for mm in (2.0, 4.0, 8.0)
    ]
    path = tmp_path / "mine.csv"
    pd.DataFrame(rows, columns=["subject", "aperture_mm", "group", "rating"]).to_csv(path, index=False)
    return path


def test_the_slope_per_millimetre_is_the_headline(table: Path) -> None:
    """The slope is the t over subjects of each subject's least-squares line, computed here by SciPy."""
    made = make_report(table)
    text = made.files["report.md"].decode()
    own = pd.read_csv(table)
    slopes = [stats.linregress(rows["aperture_mm"], np.log(rows["rating"])).slope for _, rows in own.groupby("subject")]
    expected = stats.ttest_1samp(slopes, 0)
    [test] = rating_tests(read_conditions(table))
    assert isinstance(test.effect, Effect)
    assert test.effect.estimate == pytest.approx(np.mean(slopes))
    assert test.effect.statistic == pytest.approx(expected.statistic)
    assert f"Each unit of aperture_mm changes ratings by a factor of {np.exp(np.mean(slopes)):.3g}" in text
    assert "not tested" not in text
    assert "f/100" not in text


def test_groups_of_subjects_are_compared_by_welch(table: Path) -> None:
    [test] = rating_tests(read_conditions(table, by=["group"]))
    own = pd.read_csv(table).assign(log=lambda rows: np.log(rows["rating"]))
    means = own.groupby(["group", "subject"])["log"].mean()
    expected = stats.ttest_ind(means["old"], means["young"], equal_var=False)
    assert isinstance(test.effect, Effect)
    assert (test.level, test.against) == ("old", "young")
    assert test.effect.statistic == pytest.approx(expected.statistic)


def test_a_condition_that_is_not_there_or_does_not_vary_is_refused(table: Path) -> None:
    with pytest.raises(InputError, match="has no column blur_D: give by, one or more of subject, aperture_mm, group"):
        read_conditions(table, by=["blur_D"])
    with pytest.raises(InputError, match="by names rating, which is the column of the rating"):
        read_conditions(table, by=["rating"])
    one = pd.read_csv(table).assign(light="dim")
    one.to_csv(table, index=False)
    with pytest.raises(InputError, match="light has the one level dim"):
        read_conditions(table, by=["light"])


def test_what_is_compared_is_explained(table: Path) -> None:
    assert "taken for 24 ratings by aperture_mm" in explained_table(table)[0]


def test_the_number_of_alternatives_is_asked_for_where_the_lowest_level_is_below_two(tmp_path: Path) -> None:
    rows = [f"A,{level},{int(trial < right)}" for level, right in ((0.1, 7), (0.4, 18)) for trial in range(20)]
    path = tmp_path / "four.csv"
    path.write_text("\n".join(["subject,level,correct", *rows]))
    with pytest.raises(InputError, match=r"at level 0\.1 7 of 20 answers are right"):
        read_thresholds(path)
    assert read_thresholds(path, guess=0.25).guess == 0.25
