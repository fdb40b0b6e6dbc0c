"""Tests of conditions in the user's table agree with R: `reference/conditions.R` makes table and results."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from focalgradient.statistics import Effect, NotComputed
from focalgradient.statistics.condition_test import ConditionTest
from focalgradient.statistics.rating_conditions import rating_tests
from focalgradient.user_tables import read_conditions
from focalgradient.user_tables.files import text_table

REFERENCE = Path(__file__).parent / "reference"
SAID = pd.read_csv(REFERENCE / "conditions_reference.csv").groupby("name")["value"].apply(np.array)


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    return pd.read_csv(REFERENCE / "conditions.csv", dtype={"subject": str}).assign(log=lambda d: np.log(d["rating"]))


def by_factor(rows: pd.DataFrame, *by: str) -> dict[str, ConditionTest]:
    """Tests of the ratings by factor."""
    shown = rows[["subject", "scene", "rating", *(name.partition("=")[0] for name in by)]]
    own = read_conditions(text_table(shown.to_csv(index=False)), by=by)
    return {test.factor: test for test in rating_tests(own) if test.answer == "rating"}


def effect_of(test: ConditionTest) -> Effect:
    assert isinstance(test.effect, Effect)
    return test.effect


@pytest.mark.parametrize("name", ["contrast", "contrast_lost"])
def test_levels_are_compared_within_scenes_over_subjects_and_scenes(rows: pd.DataFrame, name: str) -> None:
    """Over subjects alone, .26 of tables without an effect had one, where scenes differ in it by .15."""
    effect = effect_of(by_factor(rows if name == "contrast" else rows[~rows["lost"]], "condition")["condition"])
    found = [effect.estimate, effect.standard_error, effect.df, effect.p]
    assert found == pytest.approx(SAID[name], rel=1e-4)


def test_levels_of_different_scenes_are_compared_by_min_f(rows: pd.DataFrame) -> None:
    """Over subjects alone, .29 of tables without an effect had one. A mixed model has an error at most as large."""
    effect = effect_of(by_factor(rows[(rows["scene"] < "d") == (rows["condition"] == "dim")], "condition")["condition"])
    estimate, f, df, p = SAID["different_scenes"]
    assert (effect.estimate, effect.statistic**2, effect.df, effect.p) == pytest.approx((estimate, f, df, p))
    assert 0.8 < SAID["different_scenes_lmer"][1] / effect.standard_error <= 1


def test_scenes_that_a_group_lacks_are_not_taken_for_its_effect(rows: pd.DataFrame) -> None:
    effect = effect_of(by_factor(rows[(rows["condition"] == "dim") & ~rows["lost"]], "group=young")["group"])
    assert (effect.estimate, effect.df, effect.p) == pytest.approx(SAID["groups_lost"])


def test_scenes_of_one_group_each_count_as_random(rows: pd.DataFrame) -> None:
    """The error of scenes is added to that of subjects; with one scene each there is none to add."""
    apart = rows[(rows["scene"] < "d") == (rows["group"] == "old")]
    effect = effect_of(by_factor(apart, "group=young")["group"])
    subjects, scenes = (apart.groupby([by, "group"])["log"].mean().unstack() for by in ("subject", "scene"))
    errors = [values[group].std() ** 2 / values[group].count() for values in (subjects, scenes) for group in values]
    assert effect.standard_error == pytest.approx(np.sqrt(sum(errors)))
    alone = by_factor(apart[apart["scene"].isin(["a", "e"])], "group=young")["group"].effect
    assert isinstance(alone, NotComputed)
    assert "scenes may differ as they do" in alone.reason


def test_groups_of_unequal_variance_are_adjusted_for_age_with_robust_errors(rows: pd.DataFrame) -> None:
    """With one variance for all, .22 of tables of 30 and 6 people without an effect of the group had one."""
    found = by_factor(rows, "group=young", "age")
    for name in ("group", "age"):
        effect = effect_of(found[name])
        values = [effect.estimate, effect.standard_error, effect.df, effect.p]
        assert values == pytest.approx(SAID[name], rel=1e-6)


def test_two_groups_have_welchs_error_and_the_degrees_of_freedom_of_imbens_and_kolesar() -> None:
    from focalgradient.statistics.rating_conditions import _least_squares

    values = np.random.default_rng(1).normal(size=13)
    group = (np.arange(13) < 4).astype(float)
    [effect] = _least_squares(values, np.column_stack([np.ones(13), group]))
    assert isinstance(effect, Effect)
    welch = stats.ttest_ind(values[:4], values[4:], equal_var=False)
    assert effect.statistic == pytest.approx(welch.statistic)
    assert effect.df == pytest.approx(13**2 * 3 * 8 / (4**2 * 3 + 9**2 * 8))
