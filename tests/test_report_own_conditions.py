"""Reports on ratings by any condition: no fixation, scene, catch trial or repetition is needed."""

from __future__ import annotations

import io
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from scipy import stats
from statsmodels.api import OLS  # type: ignore[import-untyped]

from focalgradient import InputError
from focalgradient.plotting.conditions import draw_condition
from focalgradient.report import make_report
from focalgradient.report.conditions import conditions_of_table
from focalgradient.statistics import Effect, Rules, quality, read_ratings
from focalgradient.statistics.rating_conditions import rating_tests
from focalgradient.user_tables.conditions import read_conditions
from focalgradient.user_tables.files import UserTable, text_table

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture
def table(tmp_path: Path) -> Path:
    rng = np.random.default_rng(1)
    rows = [
        [f"S{who}", mm, "young" if who < 4 else "old", round(float(np.exp(slope * mm + rng.normal(0, 0.1))), 3)]
        for who, slope in enumerate(rng.normal(0.05, 0.02, 8))
        for mm in (2.0, 4.0, 8.0)
    ]
    path = tmp_path / "mine.csv"
    pd.DataFrame(rows, columns=["subject", "aperture_mm", "group", "rating"]).to_csv(path, index=False)
    return path


def test_the_slope_per_millimetre_is_the_headline(table: Path) -> None:
    """The slope is the t over subjects of each subject's least-squares line, computed here by SciPy."""
    made = make_report(table)
    text = made.files["report.md"].decode()
    own = pd.read_csv(table)
    slopes = [stats.linregress(rows["aperture_mm"], np.log(rows["rating"])).slope for _, rows in own.groupby("subject")]
    expected = stats.ttest_1samp(slopes, 0)
    [test] = rating_tests(read_conditions(table))
    assert test.effect.estimate == pytest.approx(np.mean(slopes))
    assert test.effect.statistic == pytest.approx(expected.statistic)
    assert f"Each millimetre of aperture changes ratings by a factor of {np.exp(np.mean(slopes)):.3f} (95" in text
    assert "not tested" not in text
    assert "f/100" not in text
    assert any('by=["' in notice for notice in made.notices)
    assert "--by" in text  # the page names options, as most people use the command
    assert "by=[" not in text


def test_means_of_the_levels_stand_beside_the_tests(table: Path) -> None:
    made = make_report(table, by=["group=young", "aperture_mm"])
    shown = pd.read_csv(io.BytesIO(made.files["ratings_by_condition_means.csv"]))
    assert [*zip(shown["condition"], shown["level"], strict=True)] == [
        *(("group", level) for level in ("young", "old")),
        *(("aperture_mm", level) for level in ("2", "4", "8")),
    ]
    logs = pd.read_csv(table).assign(log=lambda rows: np.log(rows["rating"]))
    own = logs[logs["group"] == "old"].groupby("subject")["log"].mean()
    low, high = stats.t.interval(0.95, len(own) - 1, own.mean(), stats.sem(own))
    assert shown.iloc[1][["mean", "low", "high"]].tolist() == pytest.approx(np.exp([own.mean(), low, high]).tolist())
    assert "Geometric means of the ratings over subjects" in made.files["report.md"].decode()


def test_a_condition_that_is_not_there_or_does_not_vary_is_refused(table: Path) -> None:
    with pytest.raises(InputError, match="has no column blur_D: give by, one or more of subject, aperture_mm, group"):
        read_conditions(table, by=["blur_D"])
    with pytest.raises(InputError, match="by names rating, which is the column of the rating"):
        read_conditions(table, by=["rating"])
    one = pd.read_csv(table).assign(light="dim")
    one.to_csv(table, index=False)
    with pytest.raises(InputError, match="light has the one level dim"):
        read_conditions(table, by=["light"])


@pytest.fixture
def people(tmp_path: Path) -> Path:
    """Two groups and ages between subjects, blur within; two answers are too fast."""
    rng = np.random.default_rng(2)
    rows = []
    for who in range(16):
        age, old = 20 + 3 * who + int(rng.integers(0, 3)), who % 2
        base, slope = rng.normal(0, 0.1) + 0.004 * age + 0.1 * old, rng.normal(0.2, 0.05) + 0.05 * old
        rows += [
            [f"S{who}", ("young", "old")[old], age, blur, float(np.exp(base + slope * blur + rng.normal(0, 0.05))), 1.2]
            for blur in (0, 0.25, 0.5, 1)
        ]
    frame = pd.DataFrame(rows, columns=["subject", "group", "age", "blur_D", "rating", "rt"])
    frame.loc[[3, 30], "rt"] = 0.1
    path = tmp_path / "people.csv"
    frame.to_csv(path, index=False)
    return path


def own_values(path: Path) -> pd.DataFrame:
    """Mean log rating, slope on blur, group and age of each subject."""
    frame = pd.read_csv(path).assign(log=lambda rows: np.log(rows["rating"]))
    groups = frame.groupby("subject")
    slopes = groups.apply(lambda rows: stats.linregress(rows["blur_D"], rows["log"]).slope)
    return pd.DataFrame(
        {
            "mean": groups["log"].mean(),
            "slope": slopes,
            "old": (groups["group"].first() == "old").astype(float),
            "age": groups["age"].first(),
        }
    )


def partial(values: pd.DataFrame, y: str, x: str, other: str) -> tuple[float, float]:
    """Coefficient of x adjusted for another, and its t with errors that allow for unequal variances (HC2)."""
    fit = OLS(values[y], values[[x, other]].assign(one=1.0)).fit(cov_type="HC2")
    return fit.params[x], fit.tvalues[x]


def test_conditions_between_subjects_are_covariates_of_one_another(people: Path) -> None:
    tests = rating_tests(read_conditions(people, by=["blur_D", "group=young", "age"]))
    values = own_values(people)
    expected = [
        ("log rating, group old less young", "mean", "old", "age"),
        ("slope of log rating on age", "mean", "age", "old"),
        ("(slope of log rating on blur_D), group old less young", "slope", "old", "age"),
        ("slope of (slope of log rating on blur_D) on age", "slope", "age", "old"),
    ]
    assert [test.name for test in tests] == ["slope of log rating on blur_D", *(name for name, *_ in expected)]
    for test, (_, y, x, other) in zip(tests[1:], expected, strict=True):
        estimate, t = partial(values, y, x, other)
        assert (test.effect.estimate, test.effect.statistic) == (pytest.approx(estimate), pytest.approx(t))
        assert test.effect.df < 13
        assert f"adjusted for {'age' if x == 'old' else 'group'}" in test.effect.method
        assert f"by a factor of {np.exp(estimate):.3g}" in test.sentence
        assert "log" not in test.sentence


def test_the_figure_of_groups_says_that_its_means_are_not_adjusted(people: Path) -> None:
    """An adjusted effect may have the other sign than the means drawn."""
    captions = {
        (len(by), figure.name): figure.caption
        for by in (["group"], ["blur_D", "group", "age"])
        for figure in conditions_of_table(read_conditions(people, by=by), Rules()).figures
    }
    adjusted = {key: "these means are not adjusted for" in caption for key, caption in captions.items()}
    prefix = "ratings_by_condition"
    expected = {(1, "group"): False, (3, "blur_D"): False, (3, "group"): True, (3, "age"): True}
    assert adjusted == {(count, f"{prefix}_{name}"): says for (count, name), says in expected.items()}


@pytest.mark.parametrize("years", [1e-9, 1.0, 1e5])
def test_a_level_of_a_single_subject_is_not_tested_whatever_the_unit_of_another_condition(
    people: Path, years: float
) -> None:
    frame = pd.read_csv(people).assign(age=lambda rows: rows["age"] * years)
    frame.loc[frame["subject"] == "S3", "group"] = "child"
    frame.to_csv(people, index=False)
    child, old, age = rating_tests(read_conditions(people, by=["group=young", "age"]))
    assert "a single subject" in str(child.effect)
    assert old.effect.subjects == age.effect.subjects == 16


def test_conditions_between_subjects_that_vary_together_are_not_told_apart(people: Path) -> None:
    pd.read_csv(people).assign(eye=lambda rows: rows["group"].map({"old": "left", "young": "right"})).to_csv(people)
    tests = rating_tests(read_conditions(people, by=["group", "eye"]))
    assert all("cannot be separated" in str(test.effect) for test in tests)


def test_rules_on_trials_apply_to_ratings_by_condition(people: Path) -> None:
    made = make_report(people, by=["blur_D"])
    text = made.files["report.md"].decode()
    assert "16 subjects with 62 ratings; 2 ratings left out by the rules on trials." in text
    assert "ratings given in less than 0.3 s or more than 60 s were left out" in text
    assert b"response_time" in made.files["rules.toml"]
    frame = pd.read_csv(people)
    frame[frame["rt"] >= 0.3].to_csv(people, index=False)
    [expected] = rating_tests(read_conditions(people, by=["blur_D"]))
    kept, everyone = (
        next(row for row in made.results if row["exclusions"] == f"{which} exclusions") for which in ("with", "without")
    )
    assert kept["estimate"] == pytest.approx(expected.effect.estimate)
    assert everyone["estimate"] != kept["estimate"]


def test_a_column_of_repetitions_is_no_part_of_a_trial():
    """Three answers to one condition in turn are three trials, where a column numbers them as repetitions."""
    trials = itertools.product((1, 2, 3), (1, 2, 4), (1, 2, 3))
    rows = [f"{who},{blur},{rep},{blur + rep / 10 + who}" for who, blur, rep in trials]
    own = read_conditions(text_table("\n".join(["vp,blur,rep,depth_rating", *rows])), by=["blur"])
    assert len(own.table) == len(rows)
    assert own.notices == ()


def test_unused_columns_are_exported_with_the_trials(table: Path, tmp_path: Path) -> None:
    """Also those with the name of a column that the report adds, and of a table with a column for each condition."""
    theirs = pd.read_csv(table).assign(light="dim", shift=-1.5, included="perhaps")
    theirs.to_csv(table, index=False)
    [trials] = [content for name, content in make_report(table).files.items() if name.endswith("_trials.csv")]
    exported = pd.read_csv(io.BytesIO(trials))
    assert exported["light"].eq("dim").all()
    assert exported["shift"].eq(-1.5).all()
    assert exported["included (file)"].eq("perhaps").all()
    assert exported["included"].all()
    wide = text_table("subject,light,near_pinhole,near_f5.6\nA,dim,1.0,1.4\nB,bright,1.1,1.5\n")
    assert [*read_ratings(wide).exported["light"]] == ["dim", "dim", "bright", "bright"]
    assert "near_pinhole" not in read_ratings(wide).exported


def test_the_figure_shows_the_tested_means() -> None:
    """With unequal numbers of trials at the levels of a second condition, too."""
    rows = [("A", 0, "L", 1.0), ("A", 1, "L", 2.0), *[("A", 1, "R", 4.0)] * 9, ("A", 0, "R", 2.0)]
    rows += [("B", blur, eye, 2.0 + blur) for blur in (0, 1) for eye in "LR"]
    own = read_conditions(frame_table(rows), by=["blur", "eye"])
    test, *_ = rating_tests(replace(own, log=False))
    ax = Figure().subplots()
    draw_condition(ax, test, units={})
    means = next(line.get_ydata() for line in ax.lines if line.get_linewidth() == 2)
    assert isinstance(test.effect, Effect)
    assert means[1] - means[0] == pytest.approx(test.effect.estimate)


def test_the_effect_of_a_condition_is_compared_between_the_levels_of_another_within_people() -> None:
    """Of seven people: the slope on blur is 2 with the left eye, 3 and more with the right one."""
    rng = np.random.default_rng(3)
    more = rng.normal(1, 0.5, 7)
    rows = [
        (who, blur, eye, 10 + blur * (2 + more[at] * (eye == "R")) + at)
        for at, who in enumerate("ABCDEFG")
        for blur in (0, 1, 3)
        for eye in "LR"
    ]
    own = replace(read_conditions(frame_table(rows), by=["blur", "eye"]), log=False)
    found = {test.name: test.effect for test in rating_tests(own)}["(slope of rating on blur), eye R less L"]
    expected = stats.ttest_1samp(more, 0)
    assert isinstance(found, Effect)
    assert (found.estimate, found.statistic, found.p) == pytest.approx(
        (more.mean(), expected.statistic, expected.pvalue)
    )
    made = conditions_of_table(own, Rules())
    [cells] = [sheet.digits for sheet in made.sheets if sheet.file == "ratings_by_condition_cells.csv"]
    at = [rating for who, blur, eye, rating in rows if (blur, eye) == (3, "R")]
    assert cells[["blur", "eye", "subjects"]].to_numpy().tolist()[-1] == ["3", "R", 7]
    assert cells["mean"].iloc[-1] == pytest.approx(np.mean(at))
    nested = [(who, blur, eye, rating) for who, blur, eye, rating in rows if (blur > 0) == (eye == "R")]
    tests = rating_tests(replace(read_conditions(frame_table(nested), by=["blur", "eye"]), log=False))
    assert all(test.answer == "rating" for test in tests)


@pytest.mark.parametrize(("people", "lines"), [(("ABC", "DEF"), 0), (("ABC", "ABC"), 4)])
def test_the_figure_joins_levels_only_within_people(people: tuple[str, str], lines: int) -> None:
    """Each person's own line and that of the means."""
    rows = [(who, 0, eye, 1.0 + ord(who) % 5) for eye, group in zip("LR", people, strict=True) for who in group]
    own = read_conditions(frame_table(rows), by=["eye"])
    [test] = rating_tests(replace(own, log=False))
    ax = Figure().subplots()
    draw_condition(ax, test, units={})
    assert len([line for line in ax.lines if line.get_linestyle() == "-" and len(line.get_xdata()) == 2]) == lines


def test_the_figure_begins_with_the_reference_as_the_table_does(tmp_path: Path) -> None:
    shown = {"much": 2, "little": 1.5, "sharp": 1}
    rows = [f"{who},{blur},{rating + who}" for who in (1, 2, 3) for blur, rating in shown.items()]
    path = tmp_path / "ratings.csv"
    path.write_text("\n".join(["subject,blur,rating", *rows]))
    own = read_conditions(path, by=["blur"])
    [drawing] = conditions_of_table(own, Rules()).figures
    [ax] = drawing.draw(simulated=False).axes
    levels = [label.get_text() for label in ax.get_xticklabels()]
    assert levels == [*own.conditions["blur"]] == ["sharp", "little", "much"]
    assert ax.lines[0].get_ydata() == pytest.approx([2, 2.5, 3])  # of subject 1


def frame_table(rows: list[tuple[str, int, str, float]]) -> UserTable:
    return text_table("\n".join(["subject,blur,eye,rating", *(",".join(map(str, row)) for row in rows)]))


@pytest.mark.parametrize(
    ("cells", "by", "said"),
    [
        ("A,0,L,1.2\nA,1,l,1.4\nB,0,L,1.1\nB,1,R,1.3", "eye", "levels that differ only in case \\(L, l\\)"),
        ("A,0,L,1.2\nA,1,R,1.4\nB,0,L,1.1\nB,1,R,1.3", "catch", "by names catch, which is the column of the catch"),
    ],
)
def test_conditions_that_would_be_misread_are_refused(cells: str, by: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_conditions(text_table(f"subject,catch,eye,rating\n{cells}"), by=[by])


def test_a_rating_without_logarithm_is_named() -> None:
    """One slip of the sign changes the analysis of all ratings."""
    own = read_conditions(frame_table([("A", 0, "L", 1.2), ("A", 1, "R", -1.4), ("B", 0, "L", 1.1)]), by=["eye"])
    assert any("0 or less (1 of 3)" in notice for notice in own.notices)
    assert not own.log


def test_people_with_one_of_two_levels_are_counted(tmp_path: Path) -> None:
    """A paired test is of the people with both levels, which the report says beside the number of all."""
    seen = {"A": "low high", "B": "low high", "C": "low high", "D": "low", "E": "high"}
    rows = [
        f"{who},{level},{1 + number / 9 + (level == 'high') / (3 + number):.3f}"
        for number, (who, levels) in enumerate(seen.items())
        for level in levels.split()
    ]
    path = tmp_path / "mine.csv"
    path.write_text("\n".join(["participant,contrast,rating", *rows]))
    text = make_report(path, by=["contrast"]).files["report.md"].decode()
    assert "contrast high less low is of 3 of the 5 subjects: the others lack answers at one of its levels." in text


@pytest.mark.parametrize("levels", ["low medium high", "sharp weak strong", "pre post", "L R"])
def test_levels_in_words_are_ordered_by_degree_else_by_the_alphabet(levels: str) -> None:
    words = levels.split()
    own = read_conditions(frame_table([("A", 0, word, 1.2) for word in reversed(words)]), by=["eye"])
    assert own.conditions["eye"] == words


def test_a_starting_place_of_a_slider_judges_answers_left_there(tmp_path: Path) -> None:
    """The name is that of jsPsych; B moves the marker, A does not."""
    rng = np.random.default_rng(1)
    rows = [
        (who, scene, aperture, "near", start if who == "A" else rng.integers(1, 99), start)
        for who in "ABC"
        for scene in "stuv"
        for aperture in ("pinhole", "f/5.6")
        for start in rng.integers(1, 99, 3)
    ]
    names = ["subject", "scene", "aperture", "fixation", "response", "slider_start"]
    pd.DataFrame(rows, columns=names).to_csv(tmp_path / "own.csv", index=False)
    judged = quality(read_ratings(tmp_path / "own.csv").table)[1].subjects
    assert [one.first_press == 1.0 for one in judged] == [True, False, False]


def test_a_heading_repeated_below_leaves_numbers_amounts() -> None:
    """As in files that were joined."""
    text = "subject,blur,rating\n" + "\nsubject,blur,rating\n".join(f"{who},0,1.0\n{who},2,1.4" for who in "AB")
    assert read_conditions(text_table(text), by=["blur"]).conditions["blur"] == [0.0, 2.0]
