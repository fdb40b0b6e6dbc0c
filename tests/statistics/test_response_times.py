"""Response times: answers as a covariate, and diffusion parameters that simulated people were given."""

import numpy as np
import pandas as pd
import pytest

from focalgradient.errors import InputError
from focalgradient.statistics import Effect, EzDiffusion, NotComputed, response_times
from focalgradient.statistics.response_times import _ez


def diffused(rng: np.random.Generator, drift: float, boundary: float, trials: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (s) and whether right, by a random walk of steps of half a millisecond from half-way.

    A walk in steps passes its end by 0.583 root steps on average (Siegmund 1985): that much nearer are the ends.
    """
    step, place = 0.5e-3, np.zeros(trials)
    end = boundary / 2 - 0.583 * np.sqrt(step)
    time, right, going = np.zeros(trials), np.zeros(trials, bool), np.arange(trials)
    for number in range(1, 20_000):
        place[going] += drift * step + np.sqrt(step) * rng.normal(size=going.size)
        done = np.abs(place[going]) >= end
        time[going[done]], right[going[done]] = number * step, place[going[done]] > 0
        going = going[~done]
        if not going.size:
            break
    return time, right


def test_diffusion_parameters_of_a_random_walk_are_recovered() -> None:
    """Two conditions whose drift differs, eight people: intervals hold the means that people were given."""
    rng = np.random.default_rng(5)
    rows, drifts = [], []
    for person in range(8):
        base, boundary, rest = 1.0 + 0.3 * rng.normal(), 1.2 + 0.1 * rng.normal(), 0.3 + 0.02 * rng.normal()
        drifts.append((base, boundary, rest))
        for condition, more in (("far", 0.0), ("near", 1.0)):
            time, right = diffused(rng, base + more, boundary, 400)
            trials = {"participant_id": person, "condition": condition, "response_time": rest + time, "correct": right}
            rows.append(pd.DataFrame(trials))
    found = response_times(pd.concat(rows))
    far = found.diffusion["far"]
    assert isinstance(far, EzDiffusion)
    for got, true, tolerance in zip(
        (far.drift, far.boundary, far.non_decision), np.mean(drifts, axis=0), (0.12, 0.06, 0.03), strict=True
    ):
        assert got.estimate == pytest.approx(true, abs=tolerance)
    near = found.drifts["near less far"]
    assert isinstance(near, Effect)
    assert near.low < 1.0 < near.high
    assert near.estimate == pytest.approx(1.0, abs=0.2)


def test_a_condition_that_changes_answers_only_does_not_change_times_at_the_same_answer() -> None:
    """The answer "deeper" takes exp(0.3) as long, and is given more often in one condition: times mix."""
    rng = np.random.default_rng(3)
    who, where = np.repeat(np.arange(10), 120), np.tile(["pinhole", "blurred"], 600)
    deeper = rng.random(1200) < np.where(where == "blurred", 0.8, 0.2)
    time = np.exp(0.2 * rng.normal(size=10)[who] + 0.3 * deeper + 0.1 * rng.normal(size=1200))
    answer = np.where(deeper, "deeper", "flatter")
    table = {"participant_id": who, "condition": where, "answer": answer, "response_time": time}
    found = response_times(table)
    same, mixed = found.effects["blurred less pinhole"], found.unadjusted["blurred less pinhole"]
    choice = found.effects["answer flatter less deeper"]
    assert isinstance(same, Effect)
    assert isinstance(mixed, Effect)
    assert isinstance(choice, Effect)
    assert abs(same.estimate) < 0.02
    assert same.low < 0 < same.high
    assert mixed.estimate == pytest.approx(0.6 * 0.3, abs=0.03)
    assert choice.estimate == pytest.approx(-0.3, abs=0.02)
    assert choice.p_holm is not None
    assert choice.p_holm >= choice.p
    assert not found.diffusion  # which answers were right is not known


@pytest.mark.parametrize("unit", [0.01, 60.0])
def test_a_unit_of_time_changes_no_difference_of_log_time(unit: float) -> None:
    rng = np.random.default_rng(1)
    table = {"participant_id": np.repeat([0, 1, 2], 20), "correct": rng.random(60) < 0.7}
    time = rng.gamma(4.0, 0.2, 60)
    one, other = (response_times(table | {"response_time": time * by}) for by in (1.0, unit))
    first, second = one.effects["answer wrong less right"], other.effects["answer wrong less right"]
    assert isinstance(first, Effect)
    assert isinstance(second, Effect)
    assert second.estimate == pytest.approx(first.estimate, rel=1e-6)
    assert other.times[""].estimate == pytest.approx(unit * one.times[""].estimate, rel=1e-9)


def test_gaps_confounded_answers_and_chance_are_no_errors() -> None:
    times = [0.4, 0.5, np.nan, 0.7] * 12
    table = {"participant_id": np.repeat(["a", "b"], 24), "response_time": times, "condition": ["x", "y"] * 24}
    table["response_time"] = np.where(np.arange(48) == 0, 0.6, times)
    confounded = response_times(table | {"answer": ["x", "y"] * 24})
    assert (confounded.trials, confounded.left_out) == (36, 12)
    assert isinstance(confounded.effects["y less x"], NotComputed)
    assert isinstance(confounded.unadjusted["y less x"], Effect)
    right = response_times(
        {"participant_id": ["a"] * 40, "response_time": np.linspace(0.3, 0.9, 40), "correct": [1, 0] * 20}
    )
    at_chance = right.diffusion[""]
    assert isinstance(at_chance, EzDiffusion)
    assert at_chance.drift.estimate == pytest.approx(0.0, abs=1e-9)
    assert "drift 0" in right.summary()


@pytest.mark.parametrize(("share", "drift"), [(0.5, 0.0), (0.5001, 4e-4 / 1.2), (0.501, 4e-3 / 1.2)])
def test_at_chance_the_diffusion_model_is_brownian_motion_between_two_bounds(share: float, drift: float) -> None:
    """Halfway between bounds 1.2 apart, exit times have mean a^2 / 4 and variance a^4 / 24 (Darling & Siegert 1953)."""
    found = _ez(share, 1.2**4 / 24, 0.3 + 1.2**2 / 4)
    assert found == pytest.approx((drift, 1.2, 0.3), abs=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"response_time": [-1.0, 0.5]}, "above 0 s"),
        ({"response_time": ["fast", "slow"]}, "must be numbers"),
        ({"response_time": [np.nan, np.nan]}, "No trial has a response time"),
        ({"correct": ["yes", "no"]}, "true or false"),
    ],
)
def test_wrong_tables_are_refused(change: dict[str, list[object]], message: str) -> None:
    table: dict[str, list[object]] = {"participant_id": ["a", "b"], "response_time": [0.5, 0.6], "correct": [1, 0]}
    with pytest.raises(InputError, match=message):
        response_times(table | change)
    with pytest.raises(InputError, match="needs participant_id"):
        response_times({"participant_id": ["a"], "response_time": [0.5]})
