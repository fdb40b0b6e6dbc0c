"""Re-analyses with each exclusion rule left out."""

import numpy as np
import pandas as pd
import pytest

from focalgradient.analyses import ANALYSES
from focalgradient.statistics import Rules, analyse, quality
from focalgradient.statistics.robustness import ALL_RULES, robustness


def ratings(subjects: int = 7, gaps: bool = False) -> pd.DataFrame:
    """Ratings of six scenes; subject 1 answers too fast in a third of the trials."""
    rng = np.random.default_rng(4)
    conditions = [(f"s{scene}", *end) for scene in range(6) for end in (("pinhole", 0.0), ("f/5.6", 8.9))]
    rows = [
        (f"sub-{who:02}", trial, *shown, np.exp(rise * shown[-1] / 8.9 + rng.normal(0, 0.1)))
        for who in range(subjects)
        for rise in [rng.normal(0.3, 0.08)]
        for trial, shown in enumerate(conditions)
    ]
    names = ["participant_id", "trial", "scene", "aperture", "aperture_mm", "rating"]
    table = pd.DataFrame(rows, columns=names).assign(fixation="nearest", catch=False)
    fast = (table["participant_id"] == "sub-01") & (table["trial"] % 3 == 0)
    table["response_time"] = np.where(fast, 0.1, 1.0)
    return table.drop(index=range(3, len(table), 17)).reset_index(drop=True) if gaps else table


@pytest.mark.parametrize("gaps", [False, True])
def test_each_rule_is_left_out_alone(gaps):
    """Subject 1 answers too fast: excluded by `fast`, with single trials excluded by `response_time`."""
    table = ratings(gaps=gaps)
    of = {variant.rules: variant for variant in robustness(table)}
    assert (of[ALL_RULES].subjects, of["fast"].subjects) == (6, 7)
    assert of["fast"].trials == len(table) - 4
    for name, rules in ((ALL_RULES, Rules()), ("fast", Rules(fast=None))):
        rise = analyse(quality(table, rules)[0], "ratio").fixations[0].rise
        assert (of[name].estimate, of[name].low, of[name].p) == pytest.approx((rise.estimate, rise.low, rise.p))
        assert of[name].distinct
    assert not of["lapses"].distinct
    assert of["lapses"].estimate == of[ALL_RULES].estimate


@pytest.mark.parametrize("analysis", ANALYSES.values(), ids=lambda one: one.name)
def test_each_scale_is_analysed_by_its_own_analysis(analysis):
    table = ratings()
    table["rating"] = np.clip(np.ceil(table["rating"] * 2), 1, 7) if analysis.whole else table["rating"]
    if analysis.binary:
        table["rating"] = (table["rating"] > 1).astype(int)
    main = robustness(table, scale=analysis)[0]
    effect = analyse(quality(table, scale=analysis)[0], analysis).answers.primary[0].outcome
    assert (main.estimate, main.low, main.p) == pytest.approx((effect.estimate, effect.low, effect.p))


def test_a_rule_that_excludes_everyone_leaves_the_others() -> None:
    table = ratings().assign(response_time=0.1)
    of = {variant.rules: variant for variant in robustness(table)}
    assert ALL_RULES not in of
    assert "response_time" not in of  # all are fast as well
    both = robustness(table, Rules(fast=None))
    assert [variant.subjects for variant in both if variant.rules == "response_time"] == [7]
