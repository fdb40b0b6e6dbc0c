"""The lens and its controller: closed forms against integration, and the published steps, pulses and phase lags."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focalgradient import InputError
from focalgradient.eye import Course, Microfluctuations, Plant, Pulse, PulsedPlant, growth, target_course
from focalgradient.eye.prediction import Predictor

PLANTS = [
    Plant(),
    Plant(latency=0.1, time_constant=0.3, gain=2.0, integrator=5.0, rest=0.5),
    Plant(gain=0.0),
    Plant(time_constant=0.5, gain=0.125, integrator=1.0),  # two equal roots
]


def equations(plant: Plant, demand):
    """The plant's differential equations, as they stand in its docstring."""

    def change(t, state):
        u, a = state
        push = plant.rest + plant.gain * (demand(t - plant.latency) - a)
        return (push - u) / plant.integrator, (u - a) / plant.time_constant

    return change


@pytest.mark.parametrize("plant", PLANTS)
def test_a_step_against_integration(plant):
    times = np.linspace(0, 4, 41)
    change, rest = equations(plant, lambda t: 3.0 if t > 0 else 1.0), [plant.steady(1.0)] * 2
    found = solve_ivp(change, (0, 4), rest, t_eval=times, rtol=1e-9, atol=1e-10, max_step=0.02)
    assert plant.step_response(times, 1.0, 3.0) == pytest.approx(found.y[1], abs=2e-3)


@pytest.mark.parametrize("plant", PLANTS)
def test_advancing_is_the_step_response(plant):
    state, course = np.full(2, plant.steady(1.0)), []
    for _ in range(40):
        course.append(state[1])
        state = plant.advance(state, 3.0, 0.05)
    expected = plant.step_response(plant.latency + 0.05 * np.arange(40), 1.0, 3.0)
    assert course == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("frequency", [0.1, 0.5, 1.5])
def test_a_sine_against_integration(frequency):
    plant = Plant()
    change, rest = equations(plant, lambda t: 2 + np.sin(2 * np.pi * frequency * t)), [plant.steady(2.0)] * 2
    times = np.linspace(20, 30, 500, endpoint=False)
    found = solve_ivp(change, (0, 30), rest, t_eval=times, rtol=1e-8, atol=1e-9)
    wave = np.exp(-2j * np.pi * frequency * found.t)
    measured = 2j * np.mean(found.y[1] * wave)
    assert measured == pytest.approx(complex(plant.sine_response(frequency)), abs=2e-3)


def test_responses_of_young_eyes():
    """Latency, 10-90 % rise below a second, lag a tenth of the demand, less gain and more phase lag when fast."""
    plant = Plant()
    t = np.arange(0, 4, 0.001)
    share = (plant.step_response(t, 1.0, 3.0) - plant.steady(1.0)) / (plant.steady(3.0) - plant.steady(1.0))
    assert np.all(share[t < 0.3] == 0)
    rise = t[share > 0.9][0] - t[share > 0.1][0]
    assert 0.3 < rise < 1.0  # Campbell & Westheimer 1960: the whole response takes about 0.6 s
    slow, fast = plant.sine_response([0.1, 0.6])
    assert 0.8 < abs(slow) < 1.0
    assert abs(fast) < 0.8
    assert np.angle(fast) < np.angle(slow) < 0
    assert plant.steady(1.4) == pytest.approx(1.4)  # no lag at rest, a lead beyond it
    assert plant.steady(0.0) > 0
    assert plant.steady(5.0) < 5


def test_the_lens_has_limits():
    state = np.array([7.9, 7.9])
    for _ in range(50):
        state = Plant().advance(state, 20.0, 0.1)
    assert state[1] == 8.0


MS = 0.002


def course(before, after, seconds=2.0, pulse=Pulse()):  # noqa: B008
    one = PulsedPlant(Plant(), pulse, before)
    return np.array([one.accommodation, *(one.advance(after, MS) for _ in range(round(seconds / MS)))])


def peak(before, after, **kwargs):
    """Peak velocity (D/s) over 10 ms, as recordings are differentiated."""
    focus = course(before, after, **kwargs)
    return np.abs(focus[5:] - focus[:-5]).max() / (5 * MS)


def demand_for(response):
    """The demand that the plant answers by this accommodation."""
    return response + (response - Plant().rest) / Plant().gain


def test_disaccommodation_is_faster_the_nearer_it_starts_however_far_it_goes():
    """Bharadwaj & Schor 2004: 1.39 x start + 1.12 D/s for steps of 1 to 4 D from 2, 3 and 4 D."""
    starts = np.array([2.0, 3.0, 4.0])
    found = {
        start: [peak(demand_for(start), demand_for(start - size)) for size in np.arange(1.0, start + 0.1, 0.5)]
        for start in starts
    }
    full = [max(found[start]) for start in starts]
    slope, at_infinity = np.polyfit(starts, full, 1)
    assert slope == pytest.approx(1.39, abs=0.03)
    assert at_infinity == pytest.approx(1.12, abs=0.1)
    for start in starts:  # the same for all sizes from 1.5 D on; a pulse for 1 D from 4 D ends before its peak
        assert min(found[start][1:]) > 0.95 * max(found[start])
        assert min(found[start]) > 0.7 * max(found[start])


def test_accommodation_is_faster_the_farther_it_goes_wherever_it_starts():
    sizes = np.array([1.0, 2.0, 3.0])
    found = np.array([[peak(demand_for(start), demand_for(start + size)) for size in sizes] for start in (0.5, 2.0)])
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    slope, at_nothing = np.polyfit(sizes, found[0], 1)
    assert slope == pytest.approx(2.19, abs=0.02)  # of a second-order system of these constants
    assert at_nothing == pytest.approx(0, abs=0.01)


def test_a_pulse_peaks_as_early_as_peoples_and_ends_where_the_plant_does():
    """Bharadwaj & Schor 2004: 206 ms, standard deviation 82, from the movement's begin to its peak velocity."""
    focus = course(4.0, 1.0)
    fastest = MS * np.argmax(np.abs(np.diff(focus)) >= 0.999 * np.abs(np.diff(focus)).max())
    assert 0.06 < fastest < 0.3
    assert focus[-1] == pytest.approx(Plant().steady(1.0), abs=0.01)
    assert focus.min() > Plant().steady(1.0) - 0.05  # no overshoot to speak of
    # Movement is over as early as the plant's own: within a tenth of the step from its end.
    alone = course(4.0, 1.0, pulse=None)
    late = [MS * np.argmax(one < Plant().steady(1.0) + 0.3) for one in (focus, alone)]
    assert late[0] == pytest.approx(late[1], abs=0.25)


def test_small_slow_and_nearer_changes_are_the_plants_own():
    for before, after in ((2.0, 1.7), (1.0, 3.0)):
        assert course(before, after) == pytest.approx(course(before, after, pulse=None), abs=1e-12)
    one, alone = (PulsedPlant(Plant(), pulse, 2.0) for pulse in (Pulse(), None))
    for t in np.arange(0, 6, 0.1):
        demand = 2 + 0.5 * np.sin(np.pi * t)
        assert one.advance(demand, 0.1) == alone.advance(demand, 0.1)


@pytest.mark.parametrize("to", [0.0, 3.9])
def test_a_new_demand_within_a_pulse_is_followed(to):
    """Where it lies farther the pulse goes on; where it lies nearer it ends."""
    one = PulsedPlant(Plant(), Pulse(), 4.0)
    one.advance(2.0, 0.15)
    assert one.advance(to, 5.0) == pytest.approx(max(Plant().steady(to), 0), abs=0.02)


def test_the_course_does_not_depend_on_the_moments():
    coarse, fine = (PulsedPlant(Plant(), Pulse(), 4.0) for _ in range(2))
    for _ in range(8):
        found = coarse.advance(1.5, 0.1)
        for _ in range(10):
            expected = fine.advance(1.5, 0.01)
        assert found == pytest.approx(expected, abs=0.01)


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


def test_without_a_horizon_and_for_steps_and_still_targets_nothing_is_foretold():
    still, skill = followed(lambda t: 2.0, 20, 0.5)
    assert skill == 0
    assert still.accommodation[-1] == pytest.approx(Plant().steady(2.0), abs=0.05)
    step = [followed(lambda t: 3.0 if t > 5 else 1.0, 8, horizon)[0].accommodation for horizon in (0.0, 0.5)]
    assert step[1] == pytest.approx(step[0], abs=0.02)
    one = Predictor(0.0, 0.1)
    assert [one.update(v) for v in (1.0, 2.0, 0.5)] == [1.0, 2.0, 0.5]
    with pytest.raises(InputError, match="step is 0"):
        Predictor(0.5, 0.0)


def test_fluctuations_grow_with_the_response_as_expected_of_an_eye():
    """The law of `Microfluctuations.of`, relative to 2 D."""
    expected = [Microfluctuations.of(0.009, 1e9, response).rms for response in (0.5, 2.0, 5.0)]
    assert growth([0.5, 2.0, 5.0]) == pytest.approx(np.array(expected) / expected[1], rel=1e-6)
