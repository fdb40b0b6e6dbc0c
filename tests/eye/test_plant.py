"""The lens and its controller: closed forms against integration, and published responses."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focalgradient.eye import Plant

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
    found = solve_ivp(
        equations(plant, lambda t: 3.0 if t > 0 else 1.0),
        (0, 4),
        [plant.steady(1.0)] * 2,
        t_eval=times,
        rtol=1e-9,
        atol=1e-10,
        max_step=0.02,
    )
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
    found = solve_ivp(
        equations(plant, lambda t: 2 + np.sin(2 * np.pi * frequency * t)),
        (0, 30),
        [plant.steady(2.0)] * 2,
        t_eval=np.linspace(20, 30, 500, endpoint=False),
        rtol=1e-8,
        atol=1e-9,
    )
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
