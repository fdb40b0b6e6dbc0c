"""Cue combination: the simulated rule and thresholds are recovered."""

import numpy as np
import pandas as pd
import pytest
from cue_combination import RULES, compare, optimal, simulate

SDS = (1.0, 1.4)


def judged(rule: str, people: int, trials: int = 200, conflict: float = 0.8) -> pd.DataFrame:
    """Return simulated trials: each cue alone, both, and both with two conflicts."""
    tables = []
    for person in range(people):
        level = np.random.default_rng(person).choice(np.linspace(-2.5, 2.5, 9), 5 * trials)
        condition = np.repeat(np.arange(5), trials)
        shift = np.array([0, 0, 0, conflict, -conflict])[condition] / 2
        first, second = np.where(condition == 1, np.nan, level + shift), np.where(condition == 0, np.nan, level - shift)
        larger = simulate(first, second, SDS, rule, seed=person + 7).astype(int)
        tables.append(pd.DataFrame({"participant": person, "first": first, "second": second, "larger": larger}))
    return pd.concat(tables)


@pytest.mark.parametrize(
    ("rule", "other"),
    [
        ("optimal", "best single cue"),
        ("best single cue", "average"),
        ("average", "switching"),
        ("switching", "optimal"),
    ],
)
def test_the_simulated_rule_and_thresholds_are_recovered(rule: str, other: str) -> None:
    rules, people, p = compare(judged(rule, 3), samples=0)
    weight = rules.set_index("rule")["weight"]
    assert weight[rule] > 0.1 * weight.max()  # by chance another can be a little ahead
    assert weight[other] < 1e-3
    for name, sd in zip(("first_sd", "second_sd"), SDS, strict=True):
        assert ((people[name] - sd).abs() < 3.5 * people[f"{name}_se"]).all()
    assert (p < 1e-3) == (rule in ("best single cue", "switching"))
    if rule == "optimal":
        assert ((people["first_weight"] - optimal(*SDS)[0]).abs() < 3 * people["first_weight_se"]).all()


def test_without_conflicts_the_weight_is_unknown_and_the_correction_changes_p() -> None:
    table = judged("optimal", 1, trials=60, conflict=0.0)
    (rules, people, plain), (_, _, corrected) = compare(table, samples=0), compare(table, samples=20)
    assert people["first_weight"].isna().all()
    parameters = rules.set_index("rule")["parameters"]
    assert parameters["free"] - parameters["optimal"] == 1
    assert plain != corrected
    assert corrected == pytest.approx(plain, abs=0.25)
    assert set(parameters.index) == set(RULES)
