"""Re-analyses: the main one is the report's, rules are left out one by one, and one person's weight is found."""

import numpy as np
import pandas as pd
import pytest

from focalgradient.plotting.robustness import robustness_figure
from focalgradient.scales.analyses import ANALYSES
from focalgradient.statistics import Rules, analyse, quality
from focalgradient.statistics.robustness import ALL_RULES, NO_RULES, TESTS, most_influential, robustness, sign_flips


def ratings(subjects: int = 7, odd: int | None = None, gaps: bool = False) -> pd.DataFrame:
    """Ratings of six scenes; `odd` has four times the rise, and subject 1 answers too fast in a third of the trials."""
    rng = np.random.default_rng(4)
    rows = []
    for who in range(subjects):
        rise = rng.normal(0.3, 0.08) * (4 if who == odd else 1)
        conditions = [(scene, end) for scene in range(6) for end in (("pinhole", 0.0), ("f/5.6", 8.9))]
        for trial, (scene, (name, mm)) in enumerate(conditions):
            rows.append(
                {
                    "participant_id": f"sub-{who:02}",
                    "trial": trial,
                    "scene": f"s{scene}",
                    "fixation": "nearest",
                    "aperture": name,
                    "aperture_mm": mm,
                    "catch": False,
                    "rating": float(np.exp(rise * mm / 8.9 + rng.normal(0, 0.1))),
                    "response_time": 0.1 if who == 1 and trial % 3 == 0 else 1.0,
                }
            )
    table = pd.DataFrame(rows)
    return table.drop(index=range(3, len(table), 17)).reset_index(drop=True) if gaps else table


@pytest.mark.parametrize("gaps", [False, True])
def test_the_main_variant_is_the_main_analysis(gaps):
    table = ratings(gaps=gaps)
    kept, _ = quality(table)
    rise = analyse(kept, "ratio", bound=1.2).fixations[0].rise
    variants = robustness(table)
    [main] = [each for each in variants if each.main]
    assert (main.estimate, main.low, main.high, main.p) == (rise.estimate, rise.low, rise.high, rise.p)
    assert main.subjects == 6


def test_the_person_who_decides_is_named():
    variants = robustness(ratings(odd=3))
    person = most_influential(variants, "nearest")
    assert person.without == "sub-03"
    alone = robustness(ratings(odd=3).query("participant_id != 'sub-03'"))
    [main] = [each for each in alone if each.main]
    assert (person.estimate, person.p) == pytest.approx((main.estimate, main.p), rel=1e-4)


def test_each_rule_is_left_out_alone():
    table = ratings()
    variants = robustness(table)
    of = {each.rules: each for each in variants if each.main or (each.test == TESTS[0] and each.rules != ALL_RULES)}
    assert (of[ALL_RULES].subjects, of["fast"].subjects, of[NO_RULES].subjects) == (6, 7, 7)
    assert of["fast"].trials == len(table) - 4
    assert of[NO_RULES].trials == len(table)
    for name, rules in (("fast", Rules(fast=None)), (NO_RULES, Rules(fast=None, response_time=None))):
        first = next(each for each in variants if each.rules == name and each.test == TESTS[0])
        rise = analyse(quality(table, rules)[0], "ratio", bound=1.2).fixations[0].rise
        assert (first.estimate, first.p) == pytest.approx((rise.estimate, rise.p), rel=1e-4)
    assert not next(each for each in variants if each.rules == "lapses").distinct


@pytest.mark.parametrize("analysis", ANALYSES.values(), ids=lambda one: one.name)
def test_each_scale_has_its_transformations(analysis):
    table = ratings()
    table["rating"] = np.clip(np.ceil(table["rating"] * 2), 1, 7) if analysis.whole else table["rating"]
    if analysis.binary:
        table["rating"] = (table["rating"] > 1).astype(int)
    variants = robustness(table, scale=analysis)
    assert tuple(dict.fromkeys(each.transformation for each in variants)) == analysis.transformations
    mains = [each for each in variants if each.main]
    assert len(mains) == (0 if analysis.latent else 1)
    if hasattr(analysis, "unit"):
        slope = analyse(quality(table, scale=analysis)[0], analysis, bound=1.2).slopes[0]
        assert (mains[0].estimate, mains[0].low, mains[0].p) == (slope.estimate, slope.low, slope.p)
    figure = robustness_figure(variants, {ALL_RULES: "all rules", NO_RULES: "no rules"}, simulated=True)
    assert len(figure.axes) == 2 * (len(analysis.transformations) + 1)
    assert figure._suptitle.get_text() == "simulated observers"


def test_sign_flips_are_exact():
    low, high, p = sign_flips([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    assert p == 2 / 2**7
    values = np.arange(1.0, 8)
    for end, outward in ((low, -1e-3), (high, 1e-3)):
        assert sign_flips(values - end - outward)[2] < 0.05 < sign_flips(values - end + outward)[2]
    assert sign_flips(values[:5])[1] == np.inf
