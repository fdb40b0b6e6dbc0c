"""Answers of yes and no to signal and noise from tables of one's own, as the report takes them."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from focalgradient.errors import InputError
from focalgradient.report import make_report
from focalgradient.report.detection import detection_part
from focalgradient.statistics import read_detection
from focalgradient.user_tables.files import text_table

pytestmark = pytest.mark.usefixtures("unrendered")

D_PRIME = {"fovea": 1.8, "10 deg": 0.9}


def answers(people: int = 6, trials: int = 300, steps: int = 3) -> pd.DataFrame:
    """Trials of people of known d' and criterion .2; confidence by distance from the criterion."""
    random = np.random.default_rng(3)
    tables = []
    for person in range(people):
        for condition, d in D_PRIME.items():
            signal = random.random(trials) < 0.5
            seen = random.normal(size=trials) + (signal - 0.5) * (d + 0.2 * (person - (people - 1) / 2) / people)
            answer = seen > 0.2
            sure = 1 + np.digitize(np.abs(seen - 0.2), np.linspace(0.5, 1.2, steps - 1))
            columns = {"subject": f"P{person}", "where": condition, "signal": signal.astype(int)}
            tables.append(pd.DataFrame(columns | {"response": np.where(answer, "yes", "no"), "confidence": sure}))
    return pd.concat(tables, ignore_index=True)


def write(folder: Path, table: pd.DataFrame) -> Path:
    table.to_csv(folder / "own.csv", index=False)
    return folder / "own.csv"


def test_the_report_recovers_known_sensitivity(tmp_path: Path) -> None:
    report = make_report(write(tmp_path, answers(trials=900)), columns={"condition": "where"})
    found = {row["what"]: row for row in report.results}
    for condition, d in D_PRIME.items():
        assert found[f"mean d′, {condition}"]["estimate"] == pytest.approx(d, abs=0.12)
        assert found[f"mean criterion c, {condition}"]["estimate"] == pytest.approx(0.2, abs=0.08)
        # an observer of equal variances: the SDs agree
        assert found[f"mean SD of signal over noise, {condition}"]["estimate"] == pytest.approx(1, abs=0.12)
    text = report.files["report.md"].decode()
    less = float(text.split("d′ in 10 deg less that in fovea: ")[1].split()[0].replace("−", "-"))
    assert less == pytest.approx(D_PRIME["10 deg"] - D_PRIME["fovea"], abs=0.15)
    assert {"detection.png", "detection.csv", "detection_trials.csv", "detection.R"} <= set(report.files)


def test_who_guesses_has_all_values_and_whose_ratings_hardly_overlap_no_ratio_of_deviations(tmp_path: Path) -> None:
    """P8 has as many hits as false alarms: d' is 0, and confidence tells nothing about being right.

    P9: of noise 6 sure "no", 2 unsure and 2 sure "yes"; of signal 5 unsure "yes", above .6 of the noise and equal to
    .2 of it, and 5 sure "yes", above .8 and equal to .2.
    """
    guessed = {"signal": [0, 1] * 60, "response": [0, 0, 1, 1] * 30, "confidence": [1, 2] * 60}
    sure = {"signal": [0] * 10 + [1] * 10, "response": [0] * 6 + [1] * 14, "confidence": [2] * 6 + [1, 1, 2, 2]}
    sure["confidence"] += [1] * 5 + [2] * 5
    others = answers(3, 200, 2).query("where == 'fovea'").drop(columns="where")
    odd = [pd.DataFrame({"subject": who, **given}) for who, given in (("P8", guessed), ("P9", sure))]
    report = make_report(write(tmp_path, pd.concat([others, *odd])))
    each = pd.read_csv(io.BytesIO(report.files["detection.csv"]), index_col=0)
    assert {each[name].dtype.kind for name in each if name != "condition"} == {"f"}  # numbers, negative ones too
    guesser = each.loc["P8"]
    assert guesser[["hit rate", "false-alarm rate", "area"]].tolist() == pytest.approx([0.5, 0.5, 0.5])
    assert guesser[["d′", "c"]].tolist() == pytest.approx([0, 0], abs=1e-9)
    assert guesser["low"] == pytest.approx(-guesser["high"])
    assert guesser["type-2 area"] == pytest.approx(0.5)
    assert (each.loc[["P0", "P1", "P2"], "type-2 area"] > 0.5).all()
    assert each.loc["P9", "area"] == pytest.approx((0.6 + 0.1 + 0.8 + 0.1) / 2)
    assert np.isnan(each.loc["P9", ["d_a", "SD ratio"]].astype(float)).all()
    found = {row["what"]: row for row in report.results}
    assert found["mean area under the ROC"]["estimate"] == pytest.approx(each["area"].mean(), rel=1e-6)
    json.loads(report.files["results.json"])


def test_ratings_from_the_surest_no_to_the_surest_yes_are_answers_and_confidence(tmp_path: Path) -> None:
    table = answers(people=2)
    rating = np.where(table["response"] == "yes", 3 + table["confidence"], 4 - table["confidence"])
    given = read_detection(write(tmp_path, table))
    rated = read_detection(write(tmp_path, table.drop(columns=["response", "confidence"]).assign(rating=rating)))
    pd.testing.assert_frame_equal(rated.table[[*given.table]], given.table)
    with pytest.raises(InputError, match=r"from 1 to 5, but must be .* from 1 .* to an even number up to 20"):
        read_detection(text_table("subject,signal,rating\nA,1,5\nA,0,1\n"))


def test_without_confidence_there_is_no_curve(tmp_path: Path) -> None:
    table = answers(2, 60).drop(columns="confidence").query("where == 'fovea'").drop(columns="where")
    report = make_report(write(tmp_path, table))
    assert [row["what"] for row in report.results] == ["mean d′", "mean criterion c"]
    assert "type-2" not in report.files["report.md"].decode().lower()
    json.loads(report.files["results.json"])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"response": "maybe"}, "row 2: response is 'maybe', but must be 1 or 0"),
        ({"signal": "1"}, "has trials with signals only"),
        ({"confidence": range(60)}, "has 60 values of confidence, but may have 10 at most"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, change: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_detection(write(tmp_path, answers(1, 30).assign(**change)), {"condition": "where"})


@pytest.mark.parametrize("signal", [0, 1])
def test_a_person_without_signal_or_without_noise_is_left_out_and_named(signal: int) -> None:
    table = answers()
    first = table["subject"] == table["subject"].iloc[0]
    part = detection_part(read_detection(text_table(table[~first | (table["signal"] == signal)].to_csv(index=False))))
    assert "P0 was left out: there must be trials with signal and trials without." in part.notices[0]


def test_criteria_that_make_rates_extreme_are_noted() -> None:
    """Of tables with a d' of 2, criteria of 0 and 1.2, and 20 trials of each, .42 had a difference (bias -.4)."""
    random = np.random.default_rng(2)
    rows = [
        (f"P{who}", where, signal, int(random.random() < norm.cdf((signal - 0.5) * 2 - criterion)))
        for who in range(12)
        for where, criterion in (("near", 0.0), ("far", 1.2))
        for signal in (0, 1)
        for _ in range(20)
    ]
    table = pd.DataFrame(rows, columns=["subject", "condition", "signal", "response"])
    part = detection_part(read_detection(text_table(table.to_csv(index=False))))
    [notice] = part.notices
    rates = table.groupby(["condition", "subject", "signal"])["response"].mean()
    far, near = rates.isin([0, 1]).groupby("condition").mean()
    assert notice.startswith(f"Of the rates of hits and false alarms {far:.0%} in far, {near:.0%} in near are 0 or 1")
    assert not detection_part(read_detection(text_table(answers().to_csv(index=False)))).notices
