"""Observers that reports fit: analytic limits, simulate and estimate, and the answers that make the right one win."""

import numpy as np
import pytest
from scipy import stats

from focalgradient.observers import Answers, compare_observers, fit_observer
from focalgradient.observers.blur_rules import BLUR_RULES, blur_choices, blur_ratings
from focalgradient.observers.likelihood import log_likelihood_by_person
from focalgradient.observers.percept_rules import PERCEPT_OBSERVERS, GammaDurations
from focalgradient.observers.transducers import transducer_observers

APERTURES = np.array([0.0, 2.0, 4.5, 9.0])


def rated(people=12, repetitions=12, seed=1, **changes):
    """Ratings by which blur deepens with the nearest object in focus only; simulated."""
    rng = np.random.default_rng(seed)
    aperture, nearest = (array.ravel() for array in np.meshgrid(APERTURES, [0.0, 1.0]))
    aperture, nearest = (np.tile(array, people * repetitions) for array in (aperture, nearest))
    who = np.repeat(np.arange(people), len(aperture) // people)
    true = {"level": 0.2, "people": 0.3, "rise": 0.4, "sensitivity": 0.2, "noise": 0.25} | changes
    level = true["level"] + true["people"] * rng.standard_normal(people)[who]
    rise = true["rise"] + true["sensitivity"] * rng.standard_normal(people)[who]
    answer = level + rise * aperture / 9 * nearest + true["noise"] * rng.standard_normal(len(who))
    return Answers(who, {"aperture": aperture, "nearest": nearest}, answer), true


def observers_of(answers):
    return blur_ratings(answers.conditions["aperture"], answers.conditions["nearest"], answers.answer)


def test_the_likelihood_of_ratings_is_that_of_the_joint_normal_distribution():
    answers, true = rated(people=3, repetitions=2)
    observer = observers_of(answers)["blurred is farther, or ignored"]
    found = observer.log_likelihoods(answers, true)
    size = answers.conditions["aperture"] / 9 * answers.conditions["nearest"]
    for person in range(3):
        own = answers.participant == str(person)
        along = np.stack([np.full(own.sum(), true["people"]), true["sensitivity"] * size[own]])
        covariance = along.T @ along + true["noise"] ** 2 * np.eye(own.sum())
        mean = true["level"] + true["rise"] * size[own]
        assert found[str(person)] == pytest.approx(
            stats.multivariate_normal(mean, covariance).logpdf(answers.answer[own]), abs=1e-6
        )


@pytest.mark.slow
def test_the_rule_that_made_the_ratings_predicts_people_held_out_best():
    answers, _ = rated()
    observers = observers_of(answers)
    assert list(observers) == list(BLUR_RULES)
    found = compare_observers(answers, observers)
    assert found[0].name in ("blurred is farther, or ignored", "a change of its own for each focus")
    assert found[-1].name in ("blind to blur", "blurred is nearer, or ignored")


def test_ratings_recover_the_parameters_that_made_them():
    answers, true = rated()
    observers = observers_of(answers)
    fit = fit_observer(answers, observers["blurred is farther, or ignored"])
    for name, value in true.items():
        assert fit.values[name] == pytest.approx(value, abs=3.5 * fit.standard_errors[name]), name


def test_rules_that_the_trials_cannot_distinguish_are_not_compared():
    assert list(blur_ratings(APERTURES, np.ones(4), APERTURES)) == ["blind to blur", "any blur deepens"]
    farthest = blur_choices(APERTURES, np.zeros(4))
    assert list(farthest) == ["blind to blur", "any blur deepens"]
    assert "compression" not in blur_choices([0.0, 9.0], [1, 1])["any blur deepens"].start


def test_choices_without_an_effect_are_even_and_rise_with_the_aperture():
    observer = blur_choices(APERTURES, [1, 1, 1, 1])["any blur deepens"]
    shown = {"aperture": APERTURES[:, None], "nearest": np.ones((4, 1))}
    values = {"bias": 0.0, "rise": 2.0, "sensitivity": 0.0, "compression": 0.0}
    share = observer.probability(shown, values, np.zeros((1, 1)))[:, 0]
    assert share[0] == pytest.approx(0.5)
    assert share[-1] == pytest.approx(0.01 + 0.98 * stats.norm.cdf(2**0.5), abs=1e-9)


def percepts(seed=1, people=6, percepts_of_each=60):
    """Durations of readings with a preference for the rigid one and an effect of the gradient; simulated."""
    rng = np.random.default_rng(seed)
    count = people * percepts_of_each
    who = np.repeat(np.arange(people), percepts_of_each)
    place = np.arange(count)
    reading, first = np.where(place % 2 == 0, 0.5, -0.5), (place % 6 == 0).astype(float)
    favoured = np.repeat(rng.choice([-1.0, 0.0, 1.0], count // 6), 6) * reading
    log_median = np.log(4) + 0.6 * reading + 0.8 * favoured + 0.3 * rng.standard_normal(people)[who]
    seconds = np.exp(log_median + 0.7 * rng.standard_normal(count))
    shown = {"reading": reading, "favoured": favoured, "first": first}
    before = {f"before_{name}": np.where(first > 0, 0.0, np.roll(array, 1)) for name, array in shown.items()}
    before["before_log"] = np.where(first > 0, 0.0, np.roll(np.log(seconds), 1))
    return Answers(who, shown | before | {"censored": np.zeros(count)}, seconds)


def test_durations_recover_preference_and_gradient_and_no_memory_where_there_is_none():
    fit = fit_observer(percepts(), PERCEPT_OBSERVERS["preference and blur"])
    for name, true in {"preference": 0.6, "gradient": 0.8, "first": 0.0, "serial": 0.0, "spread": 0.7}.items():
        assert fit.values[name] == pytest.approx(true, abs=3.5 * fit.standard_errors[name]), name


def test_gamma_durations_have_the_density_and_the_survival_of_scipy():
    names = [one for name in ("reading", "favoured", "first") for one in (name, f"before_{name}")]
    shown = {name: np.zeros(2) for name in [*names, "before_log"]} | {"censored": np.array([0.0, 1.0])}
    answers = Answers(np.array(["a", "a"]), shown, np.array([3.0, 5.0]))
    values = {"level": 4.0, "people": 0.5, "shape": 2.0, "preference": 0.1, "gradient": 0.1}
    found = GammaDurations().log_density(answers, values, np.zeros((1, 1)))[:, 0]
    gamma = stats.gamma(2.0, scale=2.0)
    assert found == pytest.approx([gamma.logpdf(3.0), gamma.logsf(5.0)], abs=1e-9)


def test_transducers_are_right_in_three_of_four_at_the_threshold_and_recover_it():
    rng = np.random.default_rng(3)
    who, level = np.repeat(np.arange(6), 200), rng.choice([0.05, 0.1, 0.2, 0.4], 1200)
    observers = transducer_observers(level, np.zeros(1200))
    power = observers["power transducer"]
    values = {"threshold": 0.12, "people": 0.3, "exponent": 2.0}
    shown = {"level": level, "condition": np.zeros(1200)}
    at = power.probability({"level": np.full((1, 1), 0.12), "condition": np.zeros((1, 1))}, values, np.zeros((1, 1)))
    assert at.item() == pytest.approx(0.01 + 0.98 * 0.75, abs=1e-9)
    columns = {name: array[:, None] for name, array in shown.items()}
    share = power.probability(columns, values, rng.standard_normal(6)[who][:, None])[:, 0]
    answers = Answers(who, shown, rng.random(1200) < share)
    fit = fit_observer(answers, power)
    for name, true in values.items():
        assert fit.values[name] == pytest.approx(true, abs=3.5 * fit.standard_errors[name]), name
    guessing = log_likelihood_by_person(answers, observers["guessing"], {})
    assert sum(guessing.values()) == pytest.approx(1200 * np.log(0.5), abs=1e-6)
    several = transducer_observers(level, rng.integers(0, 2, 1200))
    assert several["power transducer, a threshold for each condition"].start.keys() >= {"threshold", "threshold_1"}
