"""Difference scales: R's numbers, recovery, the bootstrap's coverage, the six-point condition, what is refused."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.special import ndtr

from focalgradient.errors import InputError
from focalgradient.statistics import NotComputed, draw_quadruples, draw_triads, fit_difference_scale
from focalgradient.statistics.difference_scaling import _six_point_score, _six_points

REFERENCE = Path(__file__).parent / "reference"
SCALE = 6 * np.linspace(0, 1, 8) ** 1.5


def judged(shown, seed, scale=SCALE, noise=1.0):
    """Simulated judgements by the scale's model."""
    pairs = shown if shown.shape[1] == 4 else shown[:, [0, 1, 1, 2]]
    at = scale[pairs]
    difference = np.abs(at[:, 3] - at[:, 2]) - np.abs(at[:, 1] - at[:, 0])
    return difference + noise * np.random.default_rng(seed).standard_normal(len(shown)) > 0


@pytest.mark.parametrize("kind", ["quadruples", "triads"])
def test_scale_errors_and_likelihood_are_those_of_r(kind):
    table = pd.read_csv(REFERENCE / f"difference_scaling_{kind}.csv")
    expected = pd.read_csv(REFERENCE / "difference_scaling_reference.csv").query("kind == @kind").groupby("name")
    numbers = expected["number"].apply(np.array)
    fit = fit_difference_scale(table.iloc[:, 1:].to_numpy() - 1, table["larger"])
    assert fit.values[1:] == pytest.approx(numbers["value"], rel=1e-5)
    assert fit.standard_errors[1:] == pytest.approx(numbers["error"], rel=1e-4)
    assert fit.log_likelihood == pytest.approx(numbers["logLik"][0], rel=1e-8)


@pytest.mark.parametrize("draw", [draw_quadruples, draw_triads])
def test_a_scale_is_recovered(draw):
    shown = draw(8, 3000, seed=3)
    fit = fit_difference_scale(shown, judged(shown, 4))
    assert (np.abs(fit.values - SCALE) <= 3 * fit.standard_errors).all()
    assert fit.normalised[-1] == 1
    assert fit.sigma == pytest.approx(1 / 6, rel=0.15)


def test_the_order_within_a_pair_and_of_the_pairs_does_not_matter():
    shown = draw_quadruples(8, 400, seed=5)
    larger = judged(shown, 6)
    same = fit_difference_scale(shown, larger)
    assert fit_difference_scale(shown[:, [1, 0, 3, 2]], larger).values == pytest.approx(same.values)
    assert fit_difference_scale(shown[:, [2, 3, 0, 1]], ~larger).values == pytest.approx(same.values)


@pytest.mark.parametrize(("last", "increases"), [(-1.0, False), (0.5, True)])
def test_only_the_last_value_must_be_above_the_first(last: float, increases: bool) -> None:
    """Judgements by the scale 0, 1, 2, -1 and the last value, of every two pairs."""
    scale = np.array([0.0, 1.0, 2.0, -1.0, last])
    shown = np.array([quad for quad in np.ndindex(5, 5, 5, 5) if quad[0] < quad[1] and quad[2] < quad[3]])
    second, first = scale[shown[:, 3]] - scale[shown[:, 2]], scale[shown[:, 1]] - scale[shown[:, 0]]
    larger = np.random.default_rng(2).standard_normal(20 * len(shown)) < np.tile(second - first, 20)
    fit = fit_difference_scale(np.tile(shown, (20, 1)), larger)
    assert isinstance(fit, NotComputed) != increases
    if increases:
        assert fit.values[3] < 0 < fit.values[-1]


def test_designs_have_every_combination_equally_often():
    quadruples = draw_quadruples(7, 70, seed=1)
    _, times = np.unique(np.sort(quadruples, axis=1), axis=0, return_counts=True)
    assert (len(times), set(times)) == (35, {2})
    first, second = np.sort(quadruples[:, :2], axis=1), np.sort(quadruples[:, 2:], axis=1)
    assert ((first[:, 1] < second[:, 0]) | (second[:, 1] < first[:, 0])).all()
    triads = draw_triads(7)
    assert len(np.unique(np.sort(triads, axis=1), axis=0)) == len(triads) == 35


@pytest.mark.slow
def test_bootstrap_intervals_include_the_scale_and_the_six_point_test_keeps_its_level():
    covered, levels = [], []
    for seed in range(100):
        shown = draw_quadruples(8, 210, seed)
        fit = fit_difference_scale(shown, judged(shown, 1000 + seed), bootstrap=100, seed=seed)
        covered.append(((fit.low <= SCALE) & (fit.high >= SCALE))[1:])
        levels.append(fit.six_point_p < 0.05)
    assert 0.89 < np.mean(covered) < 0.98
    assert np.mean(levels) < 0.14  # .075 of 200


@pytest.mark.parametrize("turned", [False, True])
def test_the_six_point_condition_has_its_analytic_likelihood(turned):
    shown = np.array([[0, 1, 3, 4], [1, 2, 4, 5], [0, 2, 3, 5], [0, 1, 2, 5]])
    eta, larger = np.array([0.3, 0.5, 0.8, 1.0]), np.array([True, True, False, True])
    if turned:  # the same judgements, the pairs of every trial the other way round
        shown, eta, larger = shown[:, [2, 3, 0, 1]], -eta, ~larger
    triples = _six_points(shown)
    assert triples.tolist() == [[0, 1, 2]]
    a, b, c = ndtr([0.3, 0.5, 0.8])
    violated = a * b * (1 - c) + (1 - a) * (1 - b) * c  # both parts larger, and their sum smaller
    up = np.full(4, -1.0 if turned else 1.0)
    assert _six_point_score(eta, larger, triples, up) == pytest.approx(np.log(violated))
    kept = larger.copy()
    kept[2] = ~kept[2]
    assert _six_point_score(eta, kept, triples, up) == pytest.approx(np.log(1 - violated))


def test_pairs_that_change_places_turn_their_sign_in_the_six_point_test(monkeypatch):
    """Pairs with a common stimulus too, as in designs of one's own."""
    shown = np.vstack([draw_quadruples(6, 60, seed=2), [[0, 1, 0, 2], [0, 3, 0, 2], [1, 4, 1, 3], [2, 0, 1, 0]]])
    larger, signs = judged(shown, 3, SCALE[:6]), []

    def score(eta, larger, triples, up):
        signs.append(up)
        return 0.0

    monkeypatch.setattr("focalgradient.statistics.difference_scaling._six_point_score", score)
    for trials, answers in ((shown, larger), (shown[:, [2, 3, 0, 1]], ~larger), (shown[:, [1, 0, 2, 3]], larger)):
        fit_difference_scale(trials, answers, bootstrap=2)
    one, turned, mirrored = signs[0], signs[3], signs[6]
    assert one[-4:].tolist() == [1, -1, -1, -1]
    assert turned.tolist() == (-one).tolist()
    assert mirrored.tolist() == one.tolist()


def test_the_p_value_of_the_six_point_test_counts_the_data_among_the_samples(monkeypatch):
    """Data less probable than each of 9 samples are the first of 10."""
    scores = iter(range(10))
    monkeypatch.setattr("focalgradient.statistics.difference_scaling._six_point_score", lambda *_: float(next(scores)))
    shown = draw_quadruples(6, 600, seed=2)
    assert fit_difference_scale(shown, judged(shown, 3, SCALE[:6]), bootstrap=9).six_point_p == pytest.approx(0.1)


def test_what_determines_no_scale_is_said():
    shown = draw_quadruples(6, 60)
    for shown_now, larger, reason in [
        (shown, np.arange(6.0)[shown] @ [1, -1, -1, 1] > 0, "contradicts"),
        (shown[(shown != 2).all(axis=1)], np.ones((shown != 2).all(axis=1).sum()), "Stimulus 2"),
    ]:
        found = fit_difference_scale(shown_now, larger)
        assert isinstance(found, NotComputed)
        assert reason in found.reason


def test_wrong_input_is_refused():
    with pytest.raises(InputError, match="4 columns"):
        fit_difference_scale(np.zeros((3, 5)), np.zeros(3))
    with pytest.raises(InputError, match="whole numbers"):
        fit_difference_scale([[0, 1, 2, 2.5]], [1])
    with pytest.raises(InputError, match="must be 1"):
        fit_difference_scale([[0, 1, 2, 3]], [2])
    with pytest.raises(InputError, match="at least 4"):
        draw_quadruples(3)
