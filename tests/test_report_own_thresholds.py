"""Answers at levels and choices of intervals from tables of one's own, as the report takes them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from focalgradient.cli import main
from focalgradient.errors import InputError
from focalgradient.plotting.thresholds import draw_functions, person_figure
from focalgradient.report import make_report
from focalgradient.report.document import Paragraph
from focalgradient.report.parts import Output
from focalgradient.report.thresholds import thresholds_of_table
from focalgradient.statistics import (
    ThresholdResult,
    fit_threshold,
    read_ratings,
    read_thresholds,
)
from focalgradient.statistics.threshold_questions import MEAN
from focalgradient.statistics.thresholds import SubjectThreshold
from focalgradient.user_tables.schema import THRESHOLDS
from focalgradient.user_tables.source import holds

pytestmark = pytest.mark.usefixtures("unrendered")

pytest.importorskip("psignifit", reason="the extra thresholds is not installed")

TRUE = {"fovea": 0.15, "10 deg": 0.3}


def answers(people: int = 4, repeats: int = 30) -> pd.DataFrame:
    """Trials of people whose thresholds are known, by Weibull's function of slope 3 and 2 % lapses."""
    random = np.random.default_rng(5)
    levels = np.repeat([0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8], repeats)
    tables = []
    for person in range(people):
        own = np.exp(0.1 * (person - (people - 1) / 2))
        for condition, threshold in TRUE.items():
            chance = 0.5 + 0.48 * (1 - 0.5 ** ((levels / (threshold * own)) ** 3))
            interval = random.integers(1, 3, len(levels))
            right = random.random(len(levels)) < chance
            tables.append(
                pd.DataFrame(
                    {
                        "subject": f"P{person}",
                        "where": condition,
                        "level": levels,
                        "correct": right.astype(int),
                        "interval": interval,
                        "response": np.where(right, interval, 3 - interval),
                    }
                )
            )
    return pd.concat(tables, ignore_index=True)


def write(folder: Path, table: pd.DataFrame, name: str = "own.csv", **how: object) -> Path:
    table.to_csv(folder / name, index=False, **how)  # type: ignore[call-overload]
    return folder / name


def test_the_report_recovers_known_thresholds(tmp_path: Path) -> None:
    path = write(tmp_path, answers(people=3).drop(columns=["interval", "response"]))
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["report", str(path), "--columns", "condition=where", "--out", str(tmp_path / "out")])
    results = json.loads((tmp_path / "out" / "results.json").read_text())["results"]
    found = {row["what"].rpartition(", ")[2]: row for row in results}
    for condition, threshold in TRUE.items():
        assert found[condition]["low"] < threshold < found[condition]["high"]
        assert found[condition]["estimate"] == pytest.approx(threshold, rel=0.15)
    each = pd.read_csv(tmp_path / "out" / "thresholds.csv")
    assert len(each) == 6
    assert each["threshold"].map(lambda value: len(repr(value)) > 8).all()  # as computed, not as displayed
    table = pd.read_csv(tmp_path / "out" / "results.csv")
    (ratio,) = table[table["name"] == "log ratio of thresholds"].itertuples()
    assert ratio.level == "10 deg over fovea"
    assert np.exp(ratio.estimate) == pytest.approx(found["10 deg"]["estimate"] / found["fovea"]["estimate"])
    assert ratio.low < np.log(2) < ratio.high
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "Threshold of" in page
    assert "psignifit" in page
    assert "from the guess rate of 0.5 upwards" in page
    assert "At threshold 0.75 of the answers are right" in page


def test_ratios_are_over_the_stated_reference(tmp_path: Path) -> None:
    path = write(tmp_path, answers(people=2).drop(columns=["interval", "response"]))
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["report", str(path), "--by", "where=10 deg", "--out", str(tmp_path / "out")])
    ratio = pd.read_csv(tmp_path / "out" / "results.csv").set_index("name").loc["log ratio of thresholds"]
    assert ratio["level"] == "fovea over 10 deg"
    assert ratio["estimate"] == pytest.approx(np.log(TRUE["fovea"] / TRUE["10 deg"]), abs=0.2)
    with pytest.raises(InputError, match=r"by states where=near, but no level is near: give one of"):
        read_thresholds(path, by=["where=near"])


def test_conditions_that_are_numbers_keep_their_column_and_order(tmp_path: Path) -> None:
    table = answers(1, 1).drop(columns=["interval", "response"]).rename(columns={"where": "ecc_deg"})
    path = write(tmp_path, table.assign(ecc_deg=[(10, 0, 5)[at % 3] for at in range(len(table))]))
    assert read_thresholds(path, by=["ecc_deg"]).conditions == ["ecc_deg 0", "ecc_deg 5", "ecc_deg 10"]
    assert read_thresholds(path, by=["ecc_deg=5"]).conditions[-1] == "ecc_deg 5"


def test_words_counts_and_intervals_are_the_same_answers(tmp_path: Path) -> None:
    table = answers(people=1, repeats=4)
    plain = read_thresholds(write(tmp_path, table[["subject", "level", "correct"]])).table
    pairs = table[["subject", "level", "interval", "response"]].rename(columns={"level": "Level (D)"})
    own = read_thresholds(write(tmp_path, pairs, "b.csv", sep=";", decimal=","))
    assert own.unit == "D"
    pd.testing.assert_frame_equal(own.table.reset_index(drop=True), plain.reset_index(drop=True))
    words = table[["subject", "level"]].assign(hit=table["correct"].map({1: "richtig", 0: "daneben"}))
    said = read_thresholds(write(tmp_path, words, "c.csv"), conditions={"daneben": "0"}).table
    assert said["correct"].tolist() == plain["correct"].tolist()
    counts = table.groupby(["subject", "level"])["correct"].agg(["sum", "size"]).reset_index()
    counts.columns = ["subject", "level", "n_correct", "n"]
    whole = read_thresholds(write(tmp_path, counts, "d.csv")).table
    for one in (plain, whole):
        one["correct"] = one["correct"].astype(int)
    expected = plain.groupby("level")["correct"].agg(["sum", "size"])
    pd.testing.assert_frame_equal(whole.groupby("level")["correct"].agg(["sum", "size"]), expected)


def test_table_and_figure_show_the_same_thresholds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A hierarchical model drew other thresholds than the table's, and in one set of data the other way round."""
    path = write(tmp_path, answers(people=3, repeats=6))
    drawn = {}
    monkeypatch.setattr(Output, "figure", lambda _, name, figure, caption: drawn.setdefault(name, figure))
    part = thresholds_of_table(read_thresholds(path, columns={"condition": "where"}))
    blocks = [*part.findings(Output())]
    at = {float(x) for line in drawn["thresholds"].axes[1].lines for x in line.get_xdata()}
    table = part.sheets[0].digits
    assert len(table) == 6
    assert {*table[["threshold", "low", "high"]].to_numpy().flat} <= at
    assert {mean.estimate for mean in part.answers.to(MEAN).values()} <= at
    assert len(drawn["threshold_people"].axes) >= 3
    said = [one.text for one in blocks if isinstance(one, Paragraph)]
    assert sum(text.startswith("Threshold of 10 deg over that of fovea: ") for text in said) == 1


def test_a_fit_of_four_alternatives_begins_at_a_quarter() -> None:
    """At the threshold half of the answers that are not guessed are right, 62.5 % in all; far above, all but lapses."""
    levels = np.repeat([0.05, 0.1, 0.2, 0.4], 20)
    right = np.concatenate([np.arange(20) < count for count in (5, 8, 15, 20)])
    fit = fit_threshold(levels, right, least=0.02, most=2.0, guess=0.25)
    assert fit.correct([1e-6, fit.threshold, 1e6]) == pytest.approx(
        [0.25, 0.25 + (0.75 - fit.lapse) / 2, 1 - fit.lapse], abs=1e-6
    )
    assert fit.correct_at_threshold == 0.625
    ax = Figure().subplots()
    draw_functions(ax, ThresholdResult("D", (SubjectThreshold("a", "", 0, 0, True, fit),)))
    assert any(list(line.get_ydata()) == [0.625, 0.625] for line in ax.lines)


def test_panels_of_people_name_the_conditions_of_all() -> None:
    """Groups: the first person has one of the conditions."""
    levels = np.repeat([0.05, 0.1, 0.2, 0.4], 20)
    fit = fit_threshold(levels, np.arange(80) % 20 < np.repeat([10, 12, 16, 20], 20), least=0.02, most=2.0)
    groups = {name: ThresholdResult("D", (SubjectThreshold(name, "", 0, 0, True, fit),)) for name in ("old", "young")}
    [legend] = person_figure(groups, simulated=False).legends
    assert [text.get_text() for text in legend.get_texts()] == ["old", "young"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("subject,level,correct\nA,-3,1\nA,0.2,1\n", "row 2: level is -3, but must be above 0"),
        ("subject,level,correct\nA,0.1,1\nA,0.1,0\n", "one level 0.1"),
        ("subject,level,interval,response\nA,0.1,1,2\nA,0.2,2,left\n", "response is 'left', but the intervals are 1"),
        ("subject,level,interval,response\nA,1,a,a\nA,2,b,b\nA,3,c,c\n", "intervals a, b, c, but must have two"),
        ("subject,level,correct,n\nA,0.1,9,5\nA,0.2,3,5\n", "9 of 5 trials"),
    ],
)
def test_a_slip_is_named_with_its_row(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "own.csv"
    path.write_text(text)
    assert holds(THRESHOLDS, path)
    with pytest.raises(InputError) as error:
        make_report(path)
    assert said in str(error.value)


@pytest.mark.slow
def test_choices_of_intervals_are_ratings_of_0_and_1(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    lines = ["subject,aperture,focus,scene,interval,chosen"]
    for person in range(8):
        for aperture, depth in (("pinhole", 0.0), ("f/5.6", 2.0)):
            for focus in ("nearest", "farthest"):
                for scene in "abcd":
                    interval = random.integers(1, 3)
                    deeper = random.random() < 1 / (1 + np.exp(-depth * (focus == "nearest")))
                    lines.append(
                        f"P{person},{aperture},{focus},{scene},{interval},{interval if deeper else 3 - interval}"
                    )
    path = tmp_path / "own.csv"
    path.write_text("\n".join(lines))
    own = read_ratings(path)
    assert own.choices
    assert set(own.table["rating"]) == {0.0, 1.0}
    made = make_report(path)
    assert "chosen" in made.files["report.md"].decode() or "choice" in made.files["report.md"].decode()
    assert any("0 or 1" in one for one in made.notices)


def two_contrasts() -> pd.DataFrame:
    """Answers of three people at two contrasts, whose thresholds differ."""
    chance = np.random.default_rng(1)
    rows = [
        {"subject": who, "contrast": contrast, "level": level, "correct": int(chance.random() < 0.5 + level / 4)}
        for who in "abc"
        for contrast in (0.05, 0.5)
        for level in (0.5, 1.0, 2.0)
        for _ in range(10)
    ]
    return pd.DataFrame(rows)


def test_an_unused_condition_is_named_with_its_call(tmp_path: Path) -> None:
    two_contrasts().to_csv(tmp_path / "own.csv", index=False)
    own = read_thresholds(tmp_path / "own.csv", guess=0.5)
    [notice] = own.notices
    assert notice.startswith("Each threshold is over all levels of contrast (0.05, 0.5)")
    assert notice.endswith('columns={"condition": "contrast"}.')
    assert read_thresholds(tmp_path / "own.csv", {"condition": "contrast"}, guess=0.5).notices == ()


@pytest.mark.parametrize(("cell", "is_simulated"), [("TRUE", True), ("FALSE", False)])
def test_a_column_simulated_keeps_the_banner(tmp_path: Path, cell: str, is_simulated: bool) -> None:
    few = two_contrasts()[::5]  # too few to be fitted
    few.assign(simulated=cell).to_csv(tmp_path / "own.csv", index=False)
    page = make_report(tmp_path / "own.csv", guess_rate=0.5).files["report.md"].decode()
    assert ("Simulated observers, not people" in page) is is_simulated


def test_a_table_of_no_known_kind_is_refused_with_what_each_kind_needs(tmp_path: Path) -> None:
    two_contrasts().rename(columns={"correct": "ok"}).to_csv(tmp_path / "own.csv", index=False)
    with pytest.raises(
        InputError, match=r"thresholds need columns for level and correct \(or level, interval and resp"
    ):
        make_report(tmp_path / "own.csv")


def test_a_session_is_named_only_where_somebody_has_two(tmp_path: Path) -> None:
    """PsychoPy writes session 001 into every file."""
    table = answers(2, 12)
    table = table[table["where"] == "fovea"].drop(columns=["where", "interval", "response"])
    half = np.where(np.arange(len(table)) % 2, "1", "2")
    for sessions, levels in (("001", {"P0", "P1"}), (half, {"P0, 1", "P0, 2", "P1, 1", "P1, 2"})):
        table.assign(session=sessions).to_csv(tmp_path / "own.csv", index=False)
        assert {*thresholds_of_table(read_thresholds(tmp_path / "own.csv")).answers.to("threshold")} == levels
