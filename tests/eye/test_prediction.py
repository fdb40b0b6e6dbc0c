"""What the controller foretells: sines, as people do, and neither steps nor irregular targets."""

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import Course, Microfluctuations, Plant, growth, target_course
from focalgradient.eye.prediction import Predictor


def followed(target, seconds, horizon, noise=0.035, seed=0):
    """The plant alone, whose demand is the target with an estimate's noise; and the skill after 8 s."""
    random, plant, one = np.random.default_rng(seed), Plant(), Predictor(horizon, 0.1)
    times = 0.1 * np.arange(round(10 * seconds))
    wanted = np.array([target(t) for t in times])
    state, waiting, focus, skill = np.full(2, plant.steady(wanted[0])), [wanted[0]] * 4, [], []
    for demand in wanted:
        focus.append(state[1])
        waiting = [*waiting[1:], one.update(demand + noise * random.standard_normal())]
        skill.append(one.skill)
        state = plant.advance(state, waiting[0], 0.1)
    return Course(times, wanted, np.array(focus), wanted, 0 * wanted), float(np.mean(skill[len(skill) // 2 :]))


@pytest.mark.parametrize("hertz", [0.15, 0.206, 0.33, 0.5, 0.7, 1.0])
def test_sines_are_followed_with_the_phase_lag_of_people(hertz):
    """Heron & Charman (2004): a delay of 0.17 s, where latency, controller and lens take 0.6 to 0.7 s."""
    sine = lambda t: 2 + 0.5 * np.sin(2 * np.pi * hertz * t)  # noqa: E731
    phase = [np.degrees(np.angle(followed(sine, 25, horizon)[0].response(hertz, 8.0))) for horizon in (0.0, 0.5)]
    assert phase[1] == pytest.approx(-360 * 0.17 * hertz, abs=6)
    assert phase[0] % 360 < 360 - 210 * hertz  # without prediction: a delay of 0.6 s or more


def test_a_slow_sine_is_foretold_within_its_first_two_periods():
    """The experiments show few: of 0.2 Hz, from the eighth second on."""
    one, skill = Predictor(0.5, 0.1), []
    random = np.random.default_rng(3)
    for number in range(100):
        one.update(2 + 0.5 * np.sin(0.4 * np.pi * 0.1 * number) + 0.035 * random.standard_normal())
        skill.append(one.skill)
    assert min(skill[80:]) > 0.5


def test_an_irregular_target_is_not_foretold():
    skills = []
    for seed in range(4):
        waves = Microfluctuations(rms=0.4, high_share=0, beta=0, lowest=0.05, seed=seed)
        times = np.arange(0, 40, 0.1)
        values = 2 + waves.at(times)
        _, skill = followed(target_course(times, values), 40, 0.5)
        skills.append(skill)
    assert np.mean(skills) < 0.2


def _steps(seed):
    levels = np.random.default_rng(seed).uniform(1, 3, 40)
    return lambda t: float(levels[int(t / 1.3)])


def _waves(seed):
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 6)
    hertz = np.array([0.11, 0.19, 0.29, 0.43, 0.67, 0.89])
    return lambda t: 2 + 0.18 * float(np.sin(2 * np.pi * hertz * t + phases).sum())


def _walk(seed):
    moved = np.cumsum(0.4 * np.sqrt(0.1) * np.random.default_rng(seed).standard_normal(300))
    return target_course(0.1 * np.arange(300), 2.5 + np.clip(moved, -2, 2))


@pytest.mark.parametrize(
    "target", [lambda seed: lambda t: 1 + 0.1 * t, _steps, _waves, _walk], ids=["ramp", "steps", "waves", "walk"]
)
def test_ramps_random_steps_and_unpredictable_sums_are_followed_as_without_prediction(target):
    for seed in range(2):
        (with_it, skill), (without, _) = (followed(target(seed), 25, horizon, seed=seed) for horizon in (0.5, 0.0))
        assert skill < 0.1
        errors = [np.sqrt(np.mean((c.accommodation - c.target)[80:] ** 2)) for c in (with_it, without)]
        assert errors[0] == pytest.approx(errors[1], rel=0.05)


def test_steps_and_still_targets_pass_as_they_are():
    still, skill = followed(lambda t: 2.0, 20, 0.5)
    assert skill == 0
    assert still.accommodation[-1] == pytest.approx(Plant().steady(2.0), abs=0.05)
    step = [followed(lambda t: 3.0 if t > 5 else 1.0, 8, horizon)[0].accommodation for horizon in (0.0, 0.5)]
    assert step[1] == pytest.approx(step[0], abs=0.02)


def test_a_forecast_between_two_frequencies_is_a_parabola_s():
    """Errors of least at the 12.3rd frequency, and forecasts quadratic in its number, are interpolated exactly."""
    one, number = Predictor(horizon=0.4, step=0.1), np.arange(48.0)
    one._missed = 2 + (number - 12.3) ** 2
    assert one._of_best(3 + 2 * number + 0.5 * number**2) == pytest.approx(3 + 2 * 12.3 + 0.5 * 12.3**2)


def test_no_horizon_is_no_prediction():
    one = Predictor(0.0, 0.1)
    assert [one.update(v) for v in (1.0, 2.0, 0.5)] == [1.0, 2.0, 0.5]
    with pytest.raises(InputError, match="step is 0"):
        Predictor(0.5, 0.0)


def test_fluctuations_grow_with_the_response_as_expected_of_an_eye():
    """The law of `Microfluctuations.of`, relative to 2 D."""
    expected = [Microfluctuations.of(0.009, 1e9, response).rms for response in (0.5, 2.0, 5.0)]
    assert growth([0.5, 2.0, 5.0]) == pytest.approx(np.array(expected) / expected[1], rel=1e-6)
