"""Response times with the answer as a covariate."""

import numpy as np
import pytest

from focalgradient.errors import InputError
from focalgradient.statistics import Effect, NotComputed, response_times


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
    assert abs(same.estimate) < 0.02
    assert same.low < 0 < same.high
    assert mixed.estimate == pytest.approx(0.6 * 0.3, abs=0.03)
    assert choice.estimate == pytest.approx(-0.3, abs=0.02)
    assert choice.p_holm is not None
    assert choice.p_holm >= choice.p
    scored = {"participant_id": who, "correct": ~deeper, "response_time": time}
    assert response_times(scored).effects["answer wrong less right"].estimate == pytest.approx(0.3, abs=0.02)


def test_gaps_and_confounded_answers_are_no_errors() -> None:
    times = [0.4, 0.5, np.nan, 0.7] * 12
    table = {"participant_id": np.repeat(["a", "b"], 24), "response_time": times, "condition": ["x", "y"] * 24}
    table["response_time"] = np.where(np.arange(48) == 0, 0.6, times)
    confounded = response_times(table | {"answer": ["x", "y"] * 24})
    assert (confounded.trials, confounded.left_out) == (36, 12)
    assert isinstance(confounded.effects["y less x"], NotComputed)
    assert isinstance(confounded.unadjusted["y less x"], Effect)


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
