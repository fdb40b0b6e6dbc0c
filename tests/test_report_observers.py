"""Observers fitted in the report: what is printed, written and refused."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from focalgradient.cli import main
from focalgradient.observers import ObserverComparison, ObserverFit
from focalgradient.report.document import Paragraph
from focalgradient.report.observers import FittedObservers, Observed, observed_ratings, observed_thresholds
from focalgradient.report.parts import Output
from focalgradient.scales import analysis_named

pytestmark = pytest.mark.usefixtures("unrendered")


def levels(people=4):
    """Answers at levels by people with a threshold of 0.15, simulated."""
    rng = np.random.default_rng(5)
    level = np.tile(np.repeat([0.05, 0.1, 0.2, 0.4], 25), people)
    share = 0.5 + 0.49 * (1 - 0.5 ** ((level / 0.15) ** 3))
    who = np.repeat([f"P{person}" for person in range(people)], 100)
    return pd.DataFrame({"participant": who, "level": level, "correct": (rng.random(len(level)) < share).astype(int)})


@pytest.mark.slow
def test_the_command_writes_the_comparison_and_repeats_it_in_the_page(tmp_path):
    pytest.importorskip("psignifit", reason="the extra thresholds is not installed")
    levels().to_csv(tmp_path / "own.csv", index=False)
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["report", str(tmp_path / "own.csv"), "--observers", "--out", str(tmp_path / "out")])
    found = pd.read_csv(tmp_path / "out" / "threshold_observers.csv")
    assert set(found["observer"]) == {"guessing", "linear transducer", "square transducer", "power transducer"}
    assert found["observer"].iloc[-1] == "guessing"
    assert found["held out"].is_monotonic_decreasing
    assert found["exceedance"].sum() == pytest.approx(1, abs=1e-6)
    guessing = found.set_index("observer").loc["guessing"]
    assert guessing["held out"] == pytest.approx(400 * np.log(0.5), abs=1e-6)
    people = pd.read_csv(tmp_path / "out" / "threshold_observer_people.csv")
    assert people["guessing"].sum() == pytest.approx(guessing["held out"])
    for row in found.to_dict("records"):
        each = people[found["observer"].iloc[0]] - people[row["observer"]]
        assert row["behind best"] == pytest.approx(each.sum())
        assert row["SE"] == pytest.approx(2 * each.std())  # a sum over 4 people
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "predicts the answers of people held out best" in page
    assert "Observers were fitted by maximum likelihood" in page


def test_the_next_observer_is_behind_by_the_sum_over_people_with_its_standard_error():
    fit = ObserverFit({"d": 1.0}, {"d": 0.1}, -10.0, {}, 1, 30)
    held_out = {"best": [-1.0, -2.0, -3.0], "next": [-2.0, -4.0, -6.0], "last": [-9.0, -9.0, -9.0]}
    compared = [
        ObserverComparison(name, fit, dict(zip("abc", people, strict=True)), 0.9) for name, people in held_out.items()
    ]
    section = FittedObservers(SimpleNamespace(name="threshold"), Observed(None, {}, ""), compared)
    [said] = [block.text for block in section.findings(Output()) if isinstance(block, Paragraph)]
    assert "The next, “next”, is 6.0 ± 1.7 behind" in said  # differences 1, 2, 3: sum 6, SD 1 times the root of 3


def test_too_few_people_and_ordinal_steps_are_refused_with_the_reason():
    few = observed_thresholds(levels(2).rename(columns={"participant": "participant_id"}).assign(catch=False))
    assert few.reason == "Observers are compared by people held out, which needs 3 of them, and there are 2."
    steps = observed_ratings(pd.DataFrame(), analysis_named("ordinal"))
    assert steps.reason.startswith("Steps of a scale have no observer to fit")


@pytest.mark.parametrize(("names", "codes"), [(None, [0.0]), (["far", "by"], [1.0, 0.0]), ([10, 9], [0.0, 1.0])])
def test_conditions_of_thresholds_are_distinguished_by_name(names: list[object] | None, codes: list[float]) -> None:
    """In the order of their names as texts; answers of catch trials are not those of an observer of levels."""
    table = levels(3).rename(columns={"participant": "participant_id"})
    table["catch"] = table.index < 2
    if names is not None:
        table["condition"] = np.resize(np.array(names, object), len(table))
    found = observed_thresholds(table)
    assert found.answers.conditions["condition"].tolist() == np.resize(codes, len(table) - 2).tolist()
    assert found.answers.answer.tolist() == table["correct"].iloc[2:].tolist()
