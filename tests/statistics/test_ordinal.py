"""The ordinal model: its likelihood against quadrature and direct sums, and answers at the floor."""

import numpy as np
import pandas as pd
import pytest
from scipy import optimize, special

from focalgradient.statistics import Effect
from focalgradient.statistics.cumulative import ICOSAHEDRON, WEIGHTS, _Marginal
from focalgradient.statistics.ordinal import ordinal_rating
from focalgradient.statistics.ordinal_people import _thresholds


def test_the_gradient_of_the_ordinal_likelihood_is_that_of_its_value() -> None:
    rng = np.random.default_rng(2)
    category, subject = rng.integers(0, 4, 120), np.repeat(np.arange(6), 20)
    random = np.column_stack([np.ones(120), rng.uniform(0, 1, 120)])
    marginal = _Marginal(category, random, subject, 9)
    thresholds, level = np.array([-1.0, 0.2, 1.1]), rng.normal(0, 0.5, 120)
    spread = np.array([[0.6, 0.0], [0.2, 0.5]])
    _, by_threshold, by_level, by_spread = marginal.evaluate(thresholds, level, spread)

    def slope(change) -> float:
        ends = [marginal.evaluate(*change(step))[0] for step in (1e-5, -1e-5)]
        return (ends[0] - ends[1]) / 2e-5

    for k, one in enumerate(np.eye(3)):
        assert by_threshold[k] == pytest.approx(
            slope(lambda h, one=one: (thresholds + h * one, level, spread)), abs=1e-3
        )
    for k, one in enumerate(np.eye(120)[:5]):
        assert by_level[k] == pytest.approx(slope(lambda h, one=one: (thresholds, level + h * one, spread)), abs=1e-3)
    for place in ((0, 0), (1, 0), (1, 1)):
        one = np.zeros((2, 2))
        one[place] = 1
        assert by_spread[place] == pytest.approx(
            slope(lambda h, one=one: (thresholds, level, spread + h * one)), abs=2e-3
        )


def test_thirteen_points_integrate_what_twenty_seven_do() -> None:
    x, y, z = ICOSAHEDRON
    for value, moment in ((x**2, 1), (x**4, 3), (x**2 * y**2, 1), (x * y * z**2, 0), (x**3 * y, 0), (z**4, 3)):
        assert WEIGHTS @ value == pytest.approx(moment, abs=1e-12)


@pytest.mark.parametrize("spread", [0.3, 2.0, 12.0])
def test_the_ordinal_likelihood_is_the_integral_over_subjects(spread: float) -> None:
    """By quadrature on a fine grid; with a large spread whole steps of Newton would swing about the mode for ever."""
    category, subject = np.array([0, 2, 2, 1, 0, 0]), np.array([0, 0, 0, 1, 1, 1])
    thresholds, level = np.array([-6.0, 7.0]), np.array([0.0, 1.0, -1.0, 0.5, 0.0, 2.0])
    marginal = _Marginal(category, np.ones((6, 1)), subject, 61)
    found = marginal.evaluate(thresholds, level, np.array([[spread]]))[0]
    v = np.linspace(-9, 9, 20_001)[:, None]
    edges = np.concatenate([[-np.inf], thresholds, [np.inf]])
    eta = level + spread * v
    p = special.expit(edges[category + 1] - eta) - special.expit(edges[category] - eta)
    density = np.exp(-(v[:, 0] ** 2) / 2) / np.sqrt(2 * np.pi)
    wanted = [np.log(np.trapezoid(p[:, subject == one].prod(axis=1) * density, v[:, 0])) for one in (0, 1)]
    assert found == pytest.approx(sum(wanted), abs=0.02 if spread > 5 else 1e-6)


SIGNS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Corners of a square, for the mixed second difference."""


def test_modes_of_each_subject_are_those_of_direct_sums() -> None:
    """Three subjects of unequal numbers of answers, so that no trial can count for another subject unnoticed."""
    rng = np.random.default_rng(4)
    first = np.array([0, 2, 7, 10])
    eta = rng.normal(0, 1.5, 10)
    low, high = eta - rng.uniform(0.2, 2, 10), eta + rng.uniform(0.2, 2, 10)
    low[[0, 5]], high[[3, 9]] = -np.inf, np.inf
    random = rng.normal(0, 3, (10, 2))

    def log_probability(subject: int, effects: np.ndarray) -> float:
        own = slice(first[subject], first[subject + 1])
        moved = random[own] @ effects
        return float(np.log(special.expit(high[own] - moved) - special.expit(low[own] - moved)).sum())

    marginal = _Marginal(np.zeros(10, int), random, np.repeat(np.arange(3), np.diff(first)), 3)
    curvature = marginal.curvature_at_modes(low, high, random)
    assert curvature is not None
    for subject, mode in enumerate(marginal.mode):
        found = optimize.minimize(lambda at, who=subject: at @ at / 2 - log_probability(who, at), np.zeros(2))
        assert mode == pytest.approx(found.x, abs=1e-4)
        for one, other in ((0, 0), (0, 1), (1, 1)):
            step, across = 1e-3 * np.eye(2)[[one, other]]
            corners = [log_probability(subject, mode + a * step + b * across) * a * b for a, b in SIGNS]
            assert curvature[subject, one, other] == pytest.approx((one == other) - sum(corners) / 4e-6, abs=1e-3)


@pytest.mark.parametrize("rise", [0.0, 3.0])
def test_answers_at_the_floor_always_have_a_test(rise: float) -> None:
    """Most answers are the lowest step, and some subjects give no other: each set has an answer, by their own rises."""
    rng = np.random.default_rng(5)
    rows = pd.DataFrame({"participant_id": np.repeat(np.arange(6), 24), "scene": "room", "fixation": "nearest"})
    rows["aperture_mm"] = np.tile([0.0, 2.0, 4.0, 8.0], 36)
    rows["aperture"] = rows["aperture_mm"].astype(str)
    latent = rise * rows["aperture_mm"] / 8 - 2.5 + rng.logistic(size=144)
    rows["rating"] = np.where(rows["participant_id"] < 2, 1, 1 + (latent > 0))
    (test,) = ordinal_rating(rows, []).rises
    assert isinstance(test, Effect)
    few = [ordinal_rating(rows[rows["participant_id"].isin(who)], []).rises[0] for who in ([2, 3], [2])]
    assert [isinstance(each, Effect) for each in few] == [True, False]
    assert "own depth effects" in test.remarks[0]
    assert (test.low > 0) == (rise > 0)


def test_thresholds_of_known_levels_follow_the_shares_and_move_with_the_levels() -> None:
    """Without levels each is the logit of the share below it, and at the maximum the likelihood is flat."""
    rng = np.random.default_rng(8)
    category, start = rng.integers(0, 4, 300), np.array([-1.0, 0.0, 1.0])
    shares = np.cumsum(np.bincount(category))[:-1] / 300
    assert _thresholds(category, np.zeros(300), start) == pytest.approx(special.logit(shares), abs=2e-3)
    level = rng.normal(0, 1, 300)
    cuts = _thresholds(category, level, start)
    assert _thresholds(category, level + 0.7, start) == pytest.approx(cuts + 0.7, abs=2e-3)

    def log_likelihood(at: np.ndarray) -> float:
        edges = np.concatenate([[-np.inf], at, [np.inf]])
        p = special.expit(edges[category + 1] - level) - special.expit(edges[category] - level)
        return float(np.log(p).sum())

    assert optimize.approx_fprime(cuts, log_likelihood, 1e-5) == pytest.approx([0] * 3, abs=0.1)
