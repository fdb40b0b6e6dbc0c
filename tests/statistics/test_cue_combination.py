"""Cue combination: closed forms, recovery of the rule that was simulated, the test's level, what is refused."""

import numpy as np
import pytest

from focalgradient.errors import InputError
from focalgradient.statistics import (
    CUE_RULES,
    CueThreshold,
    NotComputed,
    fit_cue_combination,
    predict_combined,
    simulate_cue_judgements,
)
from focalgradient.statistics.cue_combination import LAPSES, _Person

SDS = (1.0, 1.4)


def trials(seed, conflict=0.8, each=120):
    """Levels of the first cue alone, the second alone, both, and both with two conflicts."""
    level = np.random.default_rng(seed).choice(np.linspace(-2.5, 2.5, 9), 5 * each)
    condition = np.repeat(np.arange(5), each)
    shift = np.array([0, 0, 0, conflict, -conflict])[condition] / 2
    return np.where(condition == 1, np.nan, level + shift), np.where(condition == 0, np.nan, level - shift)


def people(rule, count, seed, **about):
    """Trials of `count` simulated people."""
    shown = [trials(100 * seed + n, **about) for n in range(count)]
    answers = [simulate_cue_judgements(a, b, SDS, rule, seed=7 * seed + n) for n, (a, b) in enumerate(shown)]
    first, second = (np.concatenate([one[k] for one in shown]) for k in (0, 1))
    return first, second, np.concatenate(answers), np.repeat(np.arange(count), len(first) // count)


def test_equal_cues_halve_the_variance_and_errors_follow_the_delta_method():
    found = predict_combined([CueThreshold(1.0, 0.1, 0.2, 0.1), CueThreshold(1.0, 0.1, 0.0, 0.1)])
    assert found.weights == pytest.approx((0.5, 0.5))
    assert found.combined.sd == pytest.approx(0.5**0.5)
    assert found.combined.sd_se / found.combined.sd == pytest.approx(0.1 * 0.5**0.5)
    assert found.weight_ses == pytest.approx((0.5 * 0.1 * 2**0.5,) * 2)  # w (1 - w) times the error of the log odds
    assert found.combined.pse == pytest.approx(0.1)
    drawn = np.exp(0.1 * np.random.default_rng(1).standard_normal((100_000, 2)))
    weight = drawn[:, 0] ** -2 / (drawn**-2).sum(axis=1)
    pse = 0.2 * weight + 0.1 * np.random.default_rng(2).standard_normal((100_000, 2)) @ [0.5, 0.5]
    assert weight.std() == pytest.approx(found.weight_ses[0], rel=0.05)
    assert pse.std() == pytest.approx(found.combined.pse_se, rel=0.05)


def test_a_measured_function_is_tested_against_the_prediction_and_the_best_cue():
    cues = [CueThreshold(1.0, 0.05), CueThreshold(1.0, 0.05)]
    optimal = predict_combined(cues, CueThreshold(0.5**0.5, 0.03))
    assert optimal.p_sd == pytest.approx(1)
    assert optimal.p_best < 0.001
    best = predict_combined(cues, CueThreshold(1.0, 0.05))
    assert best.p_sd < 0.001
    assert best.p_best == pytest.approx(0.5)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("rule", CUE_RULES)
def test_the_rule_that_was_simulated_is_recovered(rule):
    found = fit_cue_combination(*people(rule, 4, 1, each=300), bootstrap=0)
    weights = {one.name: one.weight for one in found.models}
    assert weights[rule] > 0.1 * max(weights.values())  # by chance another can be a little ahead
    wrong = {"optimal": "best single cue", "best single cue": "average", "average": "switching", "switching": "optimal"}
    assert weights[wrong[rule]] < 1e-3
    for one in found.people:
        for estimate, true in zip((one.first, one.second), SDS, strict=True):
            assert estimate.sd == pytest.approx(true, abs=3.5 * estimate.sd_se)


@pytest.mark.parametrize("rule", CUE_RULES)
def test_both_answers_together_are_certain_and_lapses_limit_each(rule):
    """By every rule, at levels near to the thresholds and far from them."""
    a, b = trials(4)
    person = _Person(10 * a, 10 * b, np.ones(len(a), bool))
    free = np.concatenate([np.log(SDS), [0.1, -0.2], CUE_RULES[rule].start])
    each = [person.probability(free, CUE_RULES[rule], np.full(len(a), sign)) for sign in (1.0, -1.0)]
    assert sum(each) == pytest.approx(np.ones(len(a)))
    assert [one.min() for one in each] == pytest.approx([LAPSES / 2] * 2, rel=1e-3)


def test_weights_come_from_conflicts_only():
    found = fit_cue_combination(*people("optimal", 2, 3, each=300), bootstrap=0)
    for one in found.people:
        assert one.weight == pytest.approx(1.4**2 / (1 + 1.4**2), abs=3 * one.weight_se)
    without = fit_cue_combination(*people("optimal", 2, 3, conflict=0.0), bootstrap=0)
    assert all(np.isnan(one.weight) for one in without.people)
    freely = {one.name: one.parameters for one in without.models}
    assert freely["free"] - freely["optimal"] == 2  # a standard deviation for each person


@pytest.mark.slow
def test_the_test_against_optimality_keeps_its_level():
    p = [fit_cue_combination(*people("optimal", 1, seed), bootstrap=0).p_optimal for seed in range(100)]
    assert np.mean(np.array(p) < 0.05) < 0.12


def test_the_correction_divides_by_the_mean_of_simulated_ratios():
    """Without conflicts and with few trials by single cues the ratio is larger than chi-square: p rises."""
    judged = people("optimal", 1, 5, conflict=0.0, each=60)
    plain, corrected = (fit_cue_combination(*judged, bootstrap=samples).p_optimal for samples in (0, 40))
    again = fit_cue_combination(*judged, bootstrap=40).p_optimal
    assert corrected == again
    assert corrected == pytest.approx(plain, abs=0.25)
    assert corrected != plain


def test_wrong_input_is_refused_and_too_few_trials_are_said():
    a, b, larger, _ = people("optimal", 1, 1)
    with pytest.raises(InputError, match="differ in length"):
        fit_cue_combination(a, b[1:], larger)
    with pytest.raises(InputError, match="neither cue"):
        fit_cue_combination([np.nan], [np.nan], [1])
    with pytest.raises(InputError, match="must be 1"):
        fit_cue_combination(a, b, larger * 2)
    with pytest.raises(InputError, match="one of optimal"):
        simulate_cue_judgements(a, b, SDS, "robust")
    with pytest.raises(InputError, match="at least 2"):
        predict_combined([CueThreshold(1, 0.1)])
    with pytest.raises(InputError, match="sd must be positive"):
        predict_combined([CueThreshold(1, 0.1), CueThreshold(0, 0.1)])
    alone = fit_cue_combination(a[~np.isnan(a)], b[~np.isnan(a)], larger[~np.isnan(a)])
    assert isinstance(alone, NotComputed)
    assert "second cue alone" in alone.reason
    few = np.flatnonzero(np.isnan(a + b)).tolist() + np.flatnonzero(~np.isnan(a + b))[:3].tolist()
    by_both = fit_cue_combination(a[few], b[few], larger[few])
    assert isinstance(by_both, NotComputed)
    assert "3 trials by both cues" in by_both.reason
