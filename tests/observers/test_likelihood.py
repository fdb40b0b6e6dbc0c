"""Observers fitted by likelihood: analytic limits, recovery with honest standard errors, selection among observers."""

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

from focalgradient.errors import InputError
from focalgradient.observers import (
    Answers,
    Durations,
    Ratings,
    compare_observers,
    depth_order_observer,
    exceedance_probabilities,
    fit_observer,
    simulated_choices,
    simulated_ratings,
)
from focalgradient.observers.likelihood import log_likelihood_by_person


def answers_of(observer, people, values, seed):
    """50 trials of each of 6 cells by `people` simulated people."""
    rng = np.random.default_rng(seed)
    cells = np.array([[0.4, 0.2, 0], [1, 0.5, 1], [1, -0.2, 0], [1, -0.5, 0], [2, 0.5, 0], [2, 0.5, 1]])
    viewing, relative, blur = np.tile(np.repeat(cells, 50, axis=0), (people, 1)).T
    who = np.repeat(np.arange(people), 300)
    own = rng.standard_normal(people)[who][:, None]
    conditions = {"viewing": viewing, "relative": relative, "rendered_blur": blur.astype(float)}
    columns = {name: array[:, None] for name, array in conditions.items()}
    probability = observer.probability(columns, values, own)[:, 0]
    return Answers(who, conditions, rng.random(len(who)) < probability)


TRUE = {"disparity": 0.7, "fall": 1.5, "people": 0.4, "near_bias": 0.1, "blur": 0.5}


def test_parameters_are_recovered_within_standard_errors():
    observer = depth_order_observer("blur")
    fit = fit_observer(answers_of(observer, 24, TRUE, 1), observer)
    for name, true in TRUE.items():
        assert fit.values[name] == pytest.approx(true, abs=3 * fit.standard_errors[name]), name
    assert fit.aic == pytest.approx(10 - 2 * fit.log_likelihood)
    assert sum(fit.of_people.values()) == pytest.approx(fit.log_likelihood)


@pytest.mark.slow
def test_the_observer_that_answered_is_preferred_for_people_held_out():
    used = depth_order_observer("blur")
    found = compare_observers(answers_of(used, 10, TRUE, 2), {"with": used, "without": depth_order_observer()})
    assert [one.name for one in found] == ["with", "without"]
    assert found[0].exceedance > 0.9
    assert set(found[0].held_out) == {str(n) for n in range(10)}


def test_fixed_parameters_stay_and_unknown_ones_are_refused():
    observer = depth_order_observer("blur")
    fit = fit_observer(answers_of(observer, 3, TRUE, 3), observer, ["disparity"])
    assert fit.values["fall"] == observer.start["fall"]
    assert fit.parameters == 1
    with pytest.raises(InputError, match="no parameter 'colour'"):
        fit_observer(answers_of(observer, 3, TRUE, 3), observer, ["colour"])


def test_ratings_have_the_normal_model_s_mean_and_error():
    rng = np.random.default_rng(4)
    rated = 1.3 + 0.5 * rng.standard_normal(400)

    def moments(conditions, values, own):
        return values["mean"] + 0 * own, values["sd"] + 0 * own

    model = Ratings(moments, {"mean": 0.0, "sd": 1.0}, frozenset({"sd"}))
    fit = fit_observer(Answers(np.zeros(400), {}, rated), model)
    assert fit.values["mean"] == pytest.approx(rated.mean(), abs=1e-4)
    assert fit.standard_errors["mean"] == pytest.approx(rated.std() / 20, rel=1e-3)


def test_observers_that_can_only_be_simulated_are_fitted_too():
    rng = np.random.default_rng(5)
    level = np.repeat([0.5, 1.0, 2.0], 100)
    chosen = Answers(np.zeros(300), {"level": level}, rng.random(300) < ndtr(0.8 * level))

    def choose(conditions, values, own, random):
        evidence = values["d"] * conditions["level"] + random.standard_normal(own.shape)
        return np.asarray(evidence > 0, float)

    by_choice = simulated_choices(choose, {"d": 1.2}, frozenset({"d"}), draws=200)
    assert fit_observer(chosen, by_choice).values["d"] == pytest.approx(0.8, abs=0.2)
    rated = Answers(np.zeros(300), {"level": level}, 0.8 * np.log(level) + 0.2 * rng.standard_normal(300))

    def rate(conditions, values, own, random):
        return values["e"] * np.log(conditions["level"]) + 0.2 * random.standard_normal(own.shape)

    by_rating = simulated_ratings(rate, {"e": 1.0}, draws=20)
    assert fit_observer(rated, by_rating).values["e"] == pytest.approx(0.8, abs=0.05)


def test_without_evidence_every_observer_is_as_likely_the_most_frequent():
    assert exceedance_probabilities(np.zeros((5, 4))) == pytest.approx(0.25, abs=0.01)


def law(conditions, values, own):
    """Blur shortens the reading that it contradicts: log median by half the log odds."""
    median = np.log(values["median"]) + values["blur"] * conditions["blur"] / 2 + values["people"] * own
    return median, values["spread"] + 0 * median


PERCEPTS = Durations(
    law, {"median": 3.0, "blur": 0.0, "people": 0.3, "spread": 1.0}, frozenset({"median", "people", "spread"})
)


def test_durations_have_the_log_normal_density_and_survival():
    fixed = {"median": 4.0, "blur": 0.0, "people": 0.0, "spread": 0.8}
    answers = Answers(np.zeros(2), {"blur": np.zeros(2), "censored": np.array([0.0, 1.0])}, [2.0, 9.0])
    expected = stats.lognorm(s=0.8, scale=4.0)
    found = PERCEPTS.log_density(answers, fixed, np.zeros(1))[:, 0]
    assert found == pytest.approx([expected.logpdf(2.0), expected.logsf(9.0)])


def test_the_integral_over_people_is_the_joint_normal_density_of_their_durations():
    values = {"median": 4.0, "blur": 0.0, "people": 0.5, "spread": 0.4}
    seconds = np.exp(np.random.default_rng(8).normal(2.0, 0.4, 60))
    answers = Answers(np.zeros(60), {"blur": np.zeros(60), "censored": np.zeros(60)}, seconds)
    joint = stats.multivariate_normal(np.full(60, np.log(4.0)), 0.4**2 * np.eye(60) + 0.5**2)
    (found,) = log_likelihood_by_person(answers, PERCEPTS, values).values()
    assert found == pytest.approx(joint.logpdf(np.log(seconds)) - np.log(seconds).sum(), abs=1e-6)


def test_ratings_of_many_trials_have_the_joint_normal_density():
    """A person's effect known to a fiftieth of its spread: too closely for fixed nodes."""
    rated = np.random.default_rng(9).normal(0.7, 0.3, 250)
    model = Ratings(lambda _, values, own: (values["people"] * own, 0.3 + 0 * own), {"people": 1.0})
    joint = stats.multivariate_normal(np.zeros(250), 0.3**2 * np.eye(250) + 1)
    (found,) = log_likelihood_by_person(Answers(np.zeros(250), {}, rated), model, {"people": 1.0}).values()
    assert found == pytest.approx(joint.logpdf(rated), abs=1e-5)
