"""Hierarchical psychometric functions: derivatives, recovery, pooling, and wrong tables."""

import dataclasses
import importlib.util
import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy import optimize, special, stats

from focalgradient.errors import InputError
from focalgradient.statistics import (
    SHAPES,
    NotComputed,
    PsychometricGroups,
    bayes_psychometric_groups,
    fit_psychometric_groups,
)
from focalgradient.statistics.psychometric import _result, psychometric_data
from focalgradient.statistics.psychometric_model import _Model, _outer_errors, fit_model


def answered(people=6, conditions=("near", "far"), trials=90, ratio=1.5, seed=1, lapse=0.02, guess=0.5):
    rng = np.random.default_rng(seed)
    rows = []
    for person, own in enumerate(math.log(0.2) + 0.3 * rng.standard_normal(people)):
        for number, condition in enumerate(conditions):
            level = np.resize(np.geomspace(0.05, 0.8, 9), trials)
            detected = 1 - 0.5 ** ((level / math.exp(own + number * math.log(ratio))) ** 3.5)
            right = rng.random(trials) < guess + (1 - guess - lapse) * detected
            rows.append(pd.DataFrame({"participant_id": f"p{person}", "condition": condition, "level": level}))
            rows[-1]["correct"] = right
    return pd.concat(rows, ignore_index=True)


@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_derivatives_are_those_of_differences(shape):
    z = np.linspace(-3, 3, 13)
    value, first, second = SHAPES[shape].values(z)
    above, below = SHAPES[shape].values(z + 1e-5), SHAPES[shape].values(z - 1e-5)
    assert SHAPES[shape].values(np.zeros(1))[0] == pytest.approx(0.5)
    assert first == pytest.approx((above[0] - below[0]) / 2e-5, abs=1e-8)
    assert second == pytest.approx((above[1] - below[1]) / 2e-5, abs=1e-8)
    assert (np.diff(value) > 0).all()


@pytest.mark.parametrize("overdispersed", [False, True])
def test_gradient_of_the_joint_density_is_that_of_differences(overdispersed):
    data = psychometric_data(answered(3), guess="people", lapse="people", overdispersed=overdispersed)
    model = _Model(data.counts, data.layout, data.shape)
    rng = np.random.default_rng(2)
    model.b = model.b + 0.2 * rng.standard_normal(model.b.shape)
    model.v = rng.standard_normal(model.v.shape)
    sd, free = np.linspace(0.2, 0.6, len(model.which)), np.array([0.0] * len(data.layout.sds) + [-2.0])
    by_b, by_v, _, bv, vv = model._derivatives(sd, free, exact=True)
    step = 1e-5
    for place in range(len(model.b)):
        one = np.eye(len(model.b))[place] * step
        slope = (model._height(model.b + one, model.v, sd, free) - model._height(model.b - one, model.v, sd, free)) / 2
        assert by_b[place] == pytest.approx(slope / step, rel=1e-4, abs=1e-4)
    start = model.v.copy()
    for place in range(start.shape[1]):
        model.v = start.copy()
        model.v[1, place] += step
        up = model._derivatives(sd, free, exact=True)
        assert vv[1, :, place] == pytest.approx(-(up[1][1] - by_v[1]) / step, rel=1e-3, abs=1e-2)
        assert bv[1, :, place] == pytest.approx(-(up[0] - by_b) / step, rel=1e-3, abs=1e-2)


def test_fixed_effects_are_near_the_maximum_of_the_exact_integral_over_people():
    """By a grid over each person's deviations; in the joint mode of people and means the slope is too steep."""
    data = psychometric_data(answered(8, ("near",), trials=36, lapse=0.0), lapse=0.0)
    model, sd = _Model(data.counts, data.layout, data.shape), np.array([0.4, 0.3])
    model.integrated(np.log(sd))
    joint = model.b
    model.move_to_marginal_mode(sd, np.log(sd))
    v = np.stack(np.meshgrid(*[np.linspace(-5, 5, 61)] * 2)).reshape(2, -1)
    counts = data.counts

    def lost(b):
        z = np.exp(b[1] + sd[1] * v[1]) * (counts.x[:, None] - b[0] - sd[0] * v[0])
        p = np.clip(0.5 + 0.5 * data.shape.values(z)[0], 1e-12, 1 - 1e-12)
        own = counts.right[:, None] * np.log(p) + (counts.shown - counts.right)[:, None] * np.log1p(-p)
        people = np.stack([own[counts.person == person].sum(axis=0) for person in range(8)])
        return -special.logsumexp(people - (v**2).sum(axis=0) / 2, axis=1).sum() - model._prior(b)[0]

    exact = optimize.minimize(lost, joint, method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-4}).x
    assert joint[1] - exact[1] > 0.03
    assert np.abs(model.b - exact).max() < 0.35 * (joint[1] - exact[1])


def test_conditions_within_one_person_are_compared_as_by_the_likelihood_ratio():
    """Without a second person nothing is generalised: the quantile is that of the normal distribution."""
    table = answered(1, trials=270, ratio=1.2)
    found = fit_psychometric_groups(table, lapse=0.02)
    (effect,) = (one.effect for one in found.differences)
    level, right = (table[name].to_numpy() for name in ("level", "correct"))
    near = (table["condition"] == "near").to_numpy()

    def lost(free, apart):
        at, steep = np.where(near, free[0], free[0] + apart * free[3]), np.exp(np.where(near, free[1], free[2]))
        p = 0.5 + 0.48 * (1 - 0.5 ** np.exp(steep * (np.log(level) - at)))
        return -np.log(np.where(right, p, 1 - p)).sum()

    start = [math.log(0.2), math.log(3.5), math.log(3.5), 0.0]
    together, each = (optimize.minimize(lost, start, args=(apart,), method="Nelder-Mead").fun for apart in (0, 1))
    assert effect.p == pytest.approx(stats.chi2.sf(2 * (together - each), 1), rel=0.25)
    assert effect.df == math.inf
    assert effect.high - effect.low == pytest.approx(2 * stats.norm.ppf(0.975) * effect.standard_error)
    assert effect.method.endswith("normal intervals")
    assert "hold for these alone" in found.remarks[0]


def test_as_many_people_as_conditions_are_not_compared():
    table = answered(2, trials=120)
    found = fit_psychometric_groups(table[(table["participant_id"] == "p0") == (table["condition"] == "near")])
    assert found.differences == ()
    assert any("more people than conditions" in remark for remark in found.remarks)


def test_a_standard_deviation_whose_error_exceeds_its_limits_has_no_interval():
    """exp(1.96 x 1000) would overflow."""
    data = psychometric_data(answered(2, trials=120), lapse=0.02)
    fit = fit_model(data.counts, data.layout, data.shape)
    found = _result(dataclasses.replace(fit, sds=0 * fit.sds + 0.3, sd_errors=0 * fit.sd_errors + 1e3), data, "")
    assert {(one.low, one.high) for one in found.sd.values()} == {(None, None)}


def test_a_sigmoid_of_ones_own_needs_a_name(monkeypatch):
    own, table = type("Own", (type(SHAPES["lognormal"]),), {})(), answered(2)
    with pytest.raises(InputError, match="class Own and no name"):
        fit_psychometric_groups(table, shape=own)
    monkeypatch.setitem(SHAPES, "own", own)
    found, same = (fit_psychometric_groups(table, shape=one) for one in (own, "lognormal"))
    assert (found.shape, found.groups[0].threshold) == ("own", same.groups[0].threshold)


@pytest.mark.slow
def test_conditions_and_people_are_recovered_and_drawn_together():
    table = answered()
    found = fit_psychometric_groups(table, unit="D")
    assert isinstance(found, PsychometricGroups)
    near, far = found.groups
    assert near.threshold.low < 0.2 < near.threshold.high
    assert far.threshold.low < 0.3 < far.threshold.high
    (difference,) = found.differences
    assert (difference.condition, difference.other) == ("near", "far")
    assert difference.effect.low < -math.log(1.5) < difference.effect.high < 0
    assert 0 < found.lapse.low < 0.02 < found.lapse.high < 0.1
    # one person's few answers are drawn towards the others'
    few = table[(table["participant_id"] != "p0") | (np.arange(len(table)) < 9)]
    pooled = fit_psychometric_groups(few)
    assert isinstance(pooled, PsychometricGroups)
    (own,) = [one for one in pooled.people if one.participant_id == "p0"]
    assert abs(math.log(own.threshold.estimate / 0.2)) < 0.5
    whole = next(one for one in found.people if one.participant_id == "p0")
    assert math.log(own.threshold.high / own.threshold.low) > math.log(whole.threshold.high / whole.threshold.low)


def test_people_in_one_condition_each_leave_fewer_degrees_of_freedom():
    """One for each mean, as in a t-test between groups; the half width of every interval is by that t."""
    table, shares = answered(4, trials=36, lapse=0.0), []
    found = fit_psychometric_groups(
        table[table["participant_id"].isin(["p0", "p1"]) == (table["condition"] == "near")],
        lapse=0.0,
        progress=lambda share, _: shares.append(share),
    )
    assert (np.diff(shares) > 0).all()
    assert 0 < shares[0] < shares[-1] <= 1
    assert [one.subjects for one in found.groups] == [2, 2]
    (effect,) = (one.effect for one in found.differences)
    assert effect.df == 2
    thresholds = [one.threshold.estimate for one in found.groups]
    assert effect.estimate == pytest.approx(math.log(thresholds[0] / thresholds[1]))
    assert effect.high - effect.low == pytest.approx(2 * stats.t.ppf(0.975, 2) * effect.standard_error)
    assert effect.method.endswith("t on subjects - conditions")


def test_without_a_maximum_no_function_is_given(monkeypatch):
    monkeypatch.setattr(_Model, "_find_mode", lambda *_, **__: False)
    found = fit_psychometric_groups(answered(2, trials=18), lapse=0.0)
    assert isinstance(found, NotComputed)
    assert "no maximum" in found.reason


@pytest.mark.parametrize("rho", [0.0, 0.02, 0.4])
def test_correlated_answers_have_the_variance_that_the_correlation_says(rho):
    """All counts of 9 answers: with correlation rho the variance is 1 + 8 rho times the binomial one."""
    right, p = np.arange(10.0), np.full(10, 0.7)
    of = SimpleNamespace(
        counts=SimpleNamespace(right=right, shown=np.full(10, 9.0)), layout=SimpleNamespace(overdispersed=rho > 0)
    )
    free = np.array([0.0, special.logit(rho)]) if rho else np.zeros(1)
    value, slope, curve, _ = _Model._answers(of, p, free)
    share = special.comb(9, right) * np.exp(value)
    assert share.sum() == pytest.approx(1)
    assert share @ right == pytest.approx(9 * 0.7)
    assert share @ (right - 6.3) ** 2 == pytest.approx(9 * 0.7 * 0.3 * (1 + 8 * rho))
    above, below = (_Model._answers(of, p + step, free) for step in (1e-5, -1e-5))
    assert slope == pytest.approx((above[0] - below[0]) / 2e-5, rel=1e-5, abs=1e-5)
    assert curve == pytest.approx(-(above[1] - below[1]) / 2e-5, rel=1e-5, abs=1e-5)


def test_errors_of_the_spreads_are_those_of_the_curvature_and_none_at_a_limit():
    curvature = np.array([[4.0, 1.0, 0.5], [1.0, 3.0, -0.4], [0.5, -0.4, 2.0]])
    low, high = np.full(3, -3.0), np.full(3, 3.0)

    def errors(at):
        return _outer_errors(lambda free: 7 + free @ curvature @ free / 2, np.array(at), low, high)

    assert errors([0.5, -1.0, 2.0]) == pytest.approx(np.sqrt(np.diag(np.linalg.inv(curvature))))
    one_less = np.sqrt(np.diag(np.linalg.inv(curvature[1:, 1:])))
    assert errors([-3.0, -1.0, 2.0]) == pytest.approx([math.nan, *one_less], nan_ok=True)
    assert errors([-3.0, 3.0, 2.95]) == pytest.approx([math.nan] * 3, nan_ok=True)


def test_levels_may_be_negative_and_guessing_estimated():
    rng = np.random.default_rng(3)
    level = np.tile(np.linspace(-3, 3, 7), 60)
    who = np.repeat(np.arange(6), 70)
    yes = rng.random(420) < 0.1 + 0.88 / (1 + np.exp(-2 * (level - 0.5 - 0.4 * rng.standard_normal(6)[who])))
    table = {"participant_id": who, "level": level, "correct": yes}
    found = fit_psychometric_groups(table, shape="logistic", guess="common", lapse="common")
    assert isinstance(found, PsychometricGroups)
    assert found.groups[0].threshold.low < 0.5 < found.groups[0].threshold.high
    assert found.groups[0].slope.low < 2 < found.groups[0].slope.high
    assert found.guess.low < 0.1 < found.guess.high
    moved = fit_psychometric_groups(table | {"level": 10 * level + 5}, shape="logistic", guess="common", lapse="common")
    assert isinstance(moved, PsychometricGroups)
    assert moved.groups[0].threshold.estimate == pytest.approx(10 * found.groups[0].threshold.estimate + 5, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "options", "sentence"),
    [
        ({"level": -1.0}, {}, r"level is -1 in row 0, but levels must be numbers above 0"),
        ({"correct": 2}, {}, r"correct is 2 in row 0, but must be 0 or 1"),
        ({"level": 0.1}, {}, r"All trials have one level"),
        ({}, {"guess": 1.2}, r"guess is 1.2, but must be a rate from 0 to below 1"),
        ({}, {"guess": 1.0}, r"guess is 1.0, but must be a rate from 0 to below 1,"),
        ({}, {"lapse": 0.5}, r"lapse is 0.5, but must be a rate from 0 to below 0.5"),
        ({}, {"lapse": -0.01}, r"lapse is -0.01, but must be a rate from 0 to below 0.5"),
        ({}, {"lapse": True}, r"lapse is True, but must be a rate from 0 to below 0.5"),
        ({}, {"lapse": "some"}, r"lapse is 'some', but must be a rate from 0 to below 0.5"),
        ({}, {"shape": "cosine"}, r"shape is 'cosine', but must be one of 'weibull'"),
    ],
)
def test_what_is_wrong_is_named(change, options, sentence):
    with pytest.raises(InputError, match=sentence):
        fit_psychometric_groups(answered(2).assign(**change), **options)


def test_a_column_that_lacks_is_named_and_equal_answers_have_no_function():
    with pytest.raises(InputError, match="no column 'level'"):
        fit_psychometric_groups(answered(2).drop(columns="level"))
    found = fit_psychometric_groups(answered(2).assign(correct=True))
    assert isinstance(found, NotComputed)


def test_without_the_extra_the_posterior_names_the_remedy(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'focalgradient\[bayes\]'"):
        bayes_psychometric_groups(answered(2))


@pytest.mark.slow
@pytest.mark.skipif(not importlib.util.find_spec("pymc"), reason="the extra bayes is not installed")
@pytest.mark.filterwarnings("default")
def test_the_posterior_is_near_the_likelihood():
    table = answered(6, trials=72)
    sampled = bayes_psychometric_groups(table, lapse="common", draws=200, tune=300, chains=2)
    fitted = fit_psychometric_groups(table, lapse="common")
    assert isinstance(fitted, PsychometricGroups)
    assert sampled.diagnostics["r_hat"] < 1.1
    for one, other in zip(sampled.groups, fitted.groups, strict=True):
        assert math.log(one.threshold.estimate / other.threshold.estimate) == pytest.approx(0, abs=0.1)
    for one, other in zip(sampled.people, fitted.people, strict=True):
        assert one.threshold.low < other.threshold.estimate < one.threshold.high
