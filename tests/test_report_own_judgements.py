"""Judgements by two cues and of differences from tables of one's own, as the report takes them."""

from __future__ import annotations

import dataclasses
import html
import re
from io import BytesIO

import numpy as np
import pandas as pd
import pytest

from focalgradient.errors import InputError
from focalgradient.report import make_report, other_than_ratings
from focalgradient.statistics import (
    NotComputed,
    draw_quadruples,
    fit_cue_combination,
    fit_difference_scale,
    simulate_cue_judgements,
)
from focalgradient.statistics.own_judgements import read_cue_judgements, read_difference_judgements


def cues() -> pd.DataFrame:
    """Judgements of one simulated person who combines optimally."""
    level = np.random.default_rng(4).choice(np.linspace(-2.5, 2.5, 9), 300)
    cue = np.repeat([0, 1, 2], 100)
    first, second = np.where(cue == 1, np.nan, level), np.where(cue == 0, np.nan, level)
    deeper = simulate_cue_judgements(first, second, (1.0, 1.4), "optimal", seed=5)
    return pd.DataFrame({"subject": "A", "first": first, "second": second, "deeper": deeper.astype(int)})


def differences() -> tuple[pd.DataFrame, np.ndarray, np.ndarray]:
    """Judgements of one simulated person of 6 stimuli, with their numbers and answers."""
    shown = draw_quadruples(6, 150, seed=1)
    scale = 5 * np.linspace(0, 1, 6) ** 1.5
    difference = np.diff(np.abs(np.diff(scale[shown].reshape(-1, 2, 2)))[..., 0])[:, 0]
    larger = difference + np.random.default_rng(2).standard_normal(150) > 0
    stimuli = np.array([0.5, 1, 2, 4, 8, 16])[shown]
    table = pd.DataFrame(stimuli, columns=["s1", "s2", "s3", "s4"])
    return table.assign(subject="A", response=larger.astype(int)), shown, larger


def test_a_table_of_cues_is_recognised_and_its_rules_compared(tmp_path) -> None:
    cues().to_csv(tmp_path / "own.csv", index=False)
    assert other_than_ratings(tmp_path / "own.csv") == "judgements by two cues"
    report = make_report(tmp_path / "own.csv")
    assert {"cues_rules.csv", "cues_people.csv", "cues_trials.csv"} <= set(report.files)
    rules = pd.read_csv(BytesIO(report.files["cues_rules.csv"])).set_index("rule")
    assert {"optimal", "best single cue", "average", "switching", "free"} == set(rules.index)
    table = read_cue_judgements(tmp_path / "own.csv").table
    found = fit_cue_combination(table["first"], table["second"], table["larger"], table["participant_id"])
    assert not isinstance(found, NotComputed)
    for one in found.models:
        assert rules.loc[one.name, ["AIC", "weight"]].tolist() == pytest.approx([one.aic, one.weight], rel=1e-12)
    people = pd.read_csv(BytesIO(report.files["cues_people.csv"]))
    for one, row in zip(found.people, people.to_dict("records"), strict=True):
        assert row["SD first"] == pytest.approx(one.first.sd, rel=1e-12)
        assert row["weight SE"] == pytest.approx(one.weight_se, rel=1e-12, nan_ok=True)
    assert b"of the rules of combination" in report.files["report.md"]


def test_a_table_of_differences_gives_the_scale_that_the_library_gives(tmp_path) -> None:
    table, shown, larger = differences()
    table.to_csv(tmp_path / "own.csv", index=False)
    report = make_report(tmp_path / "own.csv")
    found = fit_difference_scale(shown, larger)
    scales = pd.read_csv(BytesIO(report.files["differences_scales.csv"]))
    assert scales["stimulus"].tolist() == [0.5, 1, 2, 4, 8, 16]
    assert scales["value"].to_numpy() == pytest.approx(found.values, rel=1e-12)
    fit = pd.read_csv(BytesIO(report.files["differences_people.csv"])).iloc[0]
    assert [fit["noise"], fit["log likelihood"]] == pytest.approx([found.sigma, found.log_likelihood], rel=1e-12)
    assert "differences.png" in report.files


@pytest.mark.parametrize(
    ("p", "said"), [(4e-5, "rejects it (p <\xa0.001)"), (0.0612, "does not reject it (p =\xa0.061)")]
)
def test_a_small_p_of_optimal_combination_is_worded(p: float, said: str, tmp_path, monkeypatch) -> None:
    cues().to_csv(tmp_path / "own.csv", index=False)

    def fitted(*answers: np.ndarray):
        return dataclasses.replace(fit_cue_combination(*answers, bootstrap=0), p_optimal=p)

    monkeypatch.setattr("focalgradient.report.own_judgements.fit_cue_combination", fitted)
    page = make_report(tmp_path / "own.csv").files["report.html"].decode()
    assert f"combination {said}" in html.unescape(re.sub("<.*?>", "", page))


@pytest.mark.parametrize(("p", "said"), [(0.0005, "allows (p <\xa0.001)"), (0.06, None)])
def test_only_violations_of_the_six_point_condition_at_the_level_are_named(
    p: float, said: str | None, tmp_path, monkeypatch
) -> None:
    table, shown, larger = differences()
    table.to_csv(tmp_path / "own.csv", index=False)
    fit = dataclasses.replace(fit_difference_scale(shown, larger), six_point_p=p)
    monkeypatch.setattr("focalgradient.report.own_judgements.fit_difference_scale", lambda *_, **__: fit)
    page = make_report(tmp_path / "own.csv").files["report.md"].decode().replace("*p*", "p").replace("&lt;", "<")
    assert ("violate the six-point condition" in page) == (said is not None)
    assert said is None or said in page.replace("\\<", "<")


def test_wrong_cells_are_named(tmp_path) -> None:
    (tmp_path / "a.csv").write_text("subject,first,second,larger\nA,,,1\n")
    with pytest.raises(InputError, match="row 2: neither cue was offered"):
        read_cue_judgements(tmp_path / "a.csv")
    for cells, pair in (
        ("s1,s2,s3,larger\nA,1,1,2,1\n", "s1 and s2"),
        ("s1,s2,s3,larger\nA,1,2,2,1\n", "s2 and s3"),
        ("s1,s2,s3,s4,larger\nA,1,2,3,3,1\n", "s3 and s4"),
    ):
        (tmp_path / "b.csv").write_text(f"subject,{cells}")
        with pytest.raises(InputError, match=f"row 2: {pair} are the same stimulus"):
            read_difference_judgements(tmp_path / "b.csv")
    (tmp_path / "c.csv").write_text("subject,s1,s2,s3,larger\nA,1,x,2,1\n")
    with pytest.raises(InputError, match="must be a number"):
        read_difference_judgements(tmp_path / "c.csv")
