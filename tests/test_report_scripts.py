"""The R scripts of a report, run in R where it is installed: they find what the report says."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import test_report_own_detection
from r_process import has_package, needs_r, run_r

from focalgradient.report.conditions import condition_part, conditions_of_table
from focalgradient.report.detection import detection_part
from focalgradient.report.export import report_files, safe_csv, trial_files
from focalgradient.report.parts import Plan
from focalgradient.report.thresholds import threshold_part
from focalgradient.statistics import (
    Effect,
    NotComputed,
    Rules,
    SubjectThreshold,
    ThresholdFit,
    ThresholdResult,
    compare_pictures,
    condition_tests,
    depth_rating,
    necker,
    planned_tests,
    read_detection,
)
from focalgradient.statistics.cells import cells, slopes
from focalgradient.statistics.conditions import condition_questions
from focalgradient.statistics.questions import Answers
from focalgradient.user_tables.conditions import read_conditions

pytestmark = pytest.mark.usefixtures("unrendered")

REFERENCE = Path(__file__).parent / "statistics" / "reference"
APERTURES = {"pinhole": 0.0, "f/11": 4.5, "f/5.6": 8.9}


def run(folder: Path, files: dict[str, bytes], script: str, *packages: str) -> str:
    """What the script prints, in the report's folder."""
    for package in packages:
        if not has_package(package):
            pytest.skip(f"the R package {package} is not installed")
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return run_r(folder, script)


def numbers(text: str) -> list[float]:
    return [float(each) for each in re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]\d+)?(?![\w.])", text)]


def three_fixations() -> pd.DataFrame:
    """Ratios by six subjects of six scenes, with objects in focus whose names are one's own."""
    rng = np.random.default_rng(4)
    rise = {"door": 0.4, "lamp": 0.1, "vase": 0.0}
    scenes = dict(zip("abcdef", rng.normal(0, 0.2, 6), strict=True))
    rows = [
        (f"{who:02}", scene, name, mm, fixation, np.exp((rise[fixation] + own + of) * mm / 8.9 + rng.normal(0, 0.2)))
        for who in range(6)
        for fixation in rise
        for own in [rng.normal(0, 0.2)]
        for scene, of in scenes.items()
        for name, mm in APERTURES.items()
    ]
    names = ["participant_id", "scene", "aperture", "aperture_mm", "fixation", "rating"]
    return pd.DataFrame(rows, columns=names).assign(trial=range(len(rows)), catch=False)


Printed = dict[tuple[str, str], dict[str, float] | None]


def printed(said: str) -> Printed:
    """What `show` prints: the values of each question and level, None where R gives the reason why there is no test."""
    found: Printed = {}
    lines = [*said.splitlines(), "", ""]
    for header, first, second in zip(lines, lines[1:], lines[2:], strict=False):
        if name := re.fullmatch(r"([a-z(].*): (.*)", header):
            values = (
                None if first.startswith("[1]") else dict(zip(first.split(), map(float, second.split()), strict=True))
            )
            found[name[1], name[2]] = values
    return found


def agree(said: str, answers: Answers, rel: float = 1e-6, absolute: float = 1e-9) -> None:
    """Compare what a script prints with the rows of results.csv of all questions that have R code."""
    found = printed(said)
    wanted = {(one.name.replace("′", "'"), one.level): one for one in answers if one.question.r_code}
    assert {*found} == {*wanted}
    for key, answer in wanted.items():
        row, values = answer.row(), found[key]
        assert (values is None) == isinstance(answer.outcome, NotComputed)
        for name, value in (values or {}).items():
            assert value == pytest.approx(row[name], rel=rel, abs=absolute), (key, name)


@needs_r
def test_r_finds_all_effects_of_own_fixations(tmp_path: Path) -> None:
    table = three_fixations()
    result = depth_rating(table, equivalence_bound=1.3)
    said = run(tmp_path, trial_files(table, table, result), "headline.R", "lmerTest")
    agree(said, result.answers)
    assert len({name for name, _ in printed(said)}) == 8
    by_lmer = [numbers(line.removeprefix("(Intercept)")) for line in said.splitlines() if line.startswith("(Interc")]
    tests = [
        one for name in ("depth effect", "difference of the depth effects") for one in result.answers.to(name).values()
    ]
    for (estimate, _, df, t, p), test in zip(by_lmer, tests[:3], strict=True):
        assert (estimate, df, t, p) == pytest.approx((test.estimate, test.df, test.statistic, test.p), rel=2e-3)


@pytest.mark.fast_cases(2)
@needs_r
@pytest.mark.parametrize("with_lmertest", [True, False])
@pytest.mark.parametrize(("scenes", "kept"), [(6, 0.7), (3, 0.8), (6, 0.0)])
def test_r_finds_the_effects_where_cells_are_empty(
    tmp_path: Path, scenes: int, kept: float, with_lmertest: bool
) -> None:
    """Lost cells, and (0 kept) scenes nested in subjects; without lmerTest by REML in base R."""
    table = three_fixations()
    table = table[table["scene"] < "abcdefg"[scenes]]
    empty = table[["participant_id", "scene", "fixation"]].apply(tuple, axis=1)
    chosen = np.random.default_rng(1).random(empty.nunique()) < kept
    table = (
        table[empty.isin(pd.unique(empty)[chosen])] if kept else table.assign(scene=table.participant_id + table.scene)
    )
    result = depth_rating(table, equivalence_bound=1.2)
    files = trial_files(table, table, result)
    script = "headline.R" if with_lmertest else "headline_jasp.R"
    files[script] = files[script].replace(b"d <- data\n", b"d <- read.csv('depth_rating_trials.csv')\n")
    if not with_lmertest:
        files[script] = files[script].replace(b'requireNamespace("lmerTest", quietly = TRUE)', b"FALSE")
    said = run(tmp_path, files, script, *(["lmerTest"] if with_lmertest else []))
    agree(said, result.answers, rel=2e-3 if with_lmertest else 1e-4, absolute=1e-4)


EMPTY = {
    "one subject lacks the pinhole": "participant_id == '00' and fixation == 'nearest' and aperture == 'pinhole'",
    "one subject lacks the largest aperture": "participant_id == '00' and aperture == 'f/5.6'",
    "one subject lacks an object in focus": "participant_id == '00' and fixation == 'farthest'",
    "all but one lack an object in focus": "participant_id != '00' and fixation == 'farthest'",
    "one object in focus is at the pinhole only": "fixation == 'farthest' and aperture != 'pinhole'",
    "one object in focus lacks the pinhole": "fixation == 'farthest' and aperture == 'pinhole'",
    "one object in focus lacks the largest aperture": "fixation == 'farthest' and aperture == 'f/5.6'",
    "one object in focus is missing": "fixation == 'farthest'",
    "no pinhole": "aperture == 'pinhole'",
    "each object in focus has scenes of its own": "(scene < 'd') != (fixation == 'nearest')",
    "each scene has one aperture": "(scene in ['a', 'd'] and aperture != 'pinhole') or "
    "(scene in ['b', 'e'] and aperture != 'f/11') or (scene in ['c', 'f'] and aperture != 'f/5.6')",
}
"""Which trials of `three_fixations` (door and lamp as nearest and farthest) are missing."""


@pytest.mark.fast_cases(3)
@needs_r
@pytest.mark.parametrize("missing", EMPTY)
def test_r_repeats_the_tests_where_conditions_are_empty(tmp_path: Path, missing: str) -> None:
    table = three_fixations().replace({"fixation": {"door": "nearest", "lamp": "farthest"}})
    table = table[table["fixation"] != "vase"]
    table = table.drop(table.query(EMPTY[missing]).index)
    result = depth_rating(table, equivalence_bound=1.2)
    files = trial_files(table, table, result)
    agree(run(tmp_path, files, "headline.R", "lmerTest"), result.answers, rel=2e-3, absolute=1e-4)


@pytest.mark.fast_cases(2)
@needs_r
@pytest.mark.parametrize("kept", [1.0, 0.7])
@pytest.mark.parametrize("kind", ["bipolar", "choice"])
def test_r_finds_comparisons(kind: str, kept: float, tmp_path: Path) -> None:
    """Over subjects and scenes, and for these scenes; complete tables and tables with lost cells."""
    table = eight_scenes(kind)
    empty = table[["participant_id", "scene", "fixation"]].apply(tuple, axis=1)
    table = table[empty.isin(pd.unique(empty)[np.random.default_rng(2).random(empty.nunique()) < kept])]
    result = compare_pictures(table, kind)
    said = run(tmp_path, trial_files(table, table, result), "headline_comparisons.R")
    agree(said, result.answers, *((1e-6, 1e-9) if kept == 1 else (5e-3, 1e-4)))  # lmerTest’s own df
    wide = pd.read_csv(tmp_path / "depth_rating_wide.csv")
    own = table[(table["fixation"] == "farthest") & (table["aperture"] == "f/11")]
    assert wide["farthest f/11"].to_numpy() == pytest.approx(own.groupby("participant_id")["rating"].mean().to_numpy())


OF_ONE_SCENE = " or ".join(
    f"(scene in {list(scenes)} and aperture != '{aperture}')"
    for scenes, aperture in (("adg", "f/22"), ("beh", "f/11"), ("cf", "f/5.6"))
)
"""Trials without which each scene of `eight_scenes` has one aperture only."""


@pytest.mark.fast_cases(2)
@needs_r
@pytest.mark.parametrize(
    "missing",
    [
        "participant_id == '00' and fixation == 'farthest' and aperture == 'f/11'",
        "participant_id == '00' and fixation == 'farthest'",
        "participant_id != '00' and fixation == 'farthest'",
        "fixation == 'farthest' and scene == 'a'",
        "fixation == 'farthest' and aperture != 'f/5.6'",
        "(scene < 'd') != (fixation == 'nearest')",
        OF_ONE_SCENE,
        f"{OF_ONE_SCENE} or (participant_id == '00' and aperture == 'f/11')",
    ],
)
def test_r_repeats_comparisons_where_conditions_are_empty(tmp_path: Path, missing: str) -> None:
    table = eight_scenes("bipolar")
    table = table.drop(table.query(missing).index)
    result = compare_pictures(table, "bipolar")
    said = run(tmp_path, trial_files(table, table, result), "headline_comparisons.R")
    agree(said, result.answers, rel=5e-3, absolute=1e-4)


def test_a_subject_without_answers_at_an_aperture_has_no_slope_of_means_over_scenes() -> None:
    """A missing mean does not count as an answer of 0."""
    table = eight_scenes("bipolar")
    table = table.drop(table.query(OF_ONE_SCENE).index).assign(rating=lambda rows: 3 - (rows["aperture_mm"] > 4))
    lacking = table.drop(table.query("participant_id == '00' and aperture == 'f/11'").index)
    whole, less = (slopes(cells(_nearest(each))).to_numpy() for each in (table, lacking))
    assert np.isnan(less[0]).all()
    assert less[1:] == pytest.approx(whole[1:])


def _nearest(table: pd.DataFrame) -> pd.DataFrame:
    return table[table["fixation"] == "nearest"].rename(columns={"rating": "answer"})


def eight_scenes(kind: str) -> pd.DataFrame:
    """Answers by six subjects of eight scenes that differ in their rises, with both fixations."""
    rng = np.random.default_rng(7)
    apertures = {"f/22": 2.27, "f/11": 4.5, "f/5.6": 8.9} | ({} if kind != "ordinal" else {"pinhole": 0.0})
    scenes = dict(zip("abcdefgh", rng.normal(0, 1.5, 8), strict=True))
    rows = [
        (f"{who:02}", scene, name, mm, fixation, (rise + own + of) * mm / 8.9 + rng.logistic())
        for who in range(6)
        for fixation, rise in (("nearest", 1.2), ("farthest", 0.0))
        for own in [rng.normal(0, 0.8)]
        for scene, of in scenes.items()
        for name, mm in apertures.items()
        for _ in range(2)
    ]
    names = ["participant_id", "scene", "aperture", "aperture_mm", "fixation", "felt"]
    table = pd.DataFrame(rows, columns=names).assign(trial=range(len(rows)), catch=False)
    made = {
        "bipolar": table["felt"].round().clip(-3, 3),
        "choice": (table["felt"] > 0).astype(float),
        "ordinal": 1 + np.digitize(table["felt"], [-1.5, 0.0, 1.5]),
    }
    return table.assign(rating=made[kind])


@needs_r
@pytest.mark.slow
def test_r_finds_the_odds_of_steps_over_subjects_and_scenes(tmp_path: Path) -> None:
    """Scenes by maximum likelihood and Laplace there, Cochran's Q here: R's error is .371, ours .306."""
    table = eight_scenes("ordinal")
    table = table[table["fixation"] == "nearest"]  # with both it takes R a minute and more
    result = depth_rating(table, equivalence_bound=1.2, scale="ordinal")
    said = run(tmp_path, trial_files(table, table, result), "headline_ordinal.R", "ordinal")
    (rise,), (fixed,) = result.ordinal.rises, result.ordinal.these_scenes
    assert rise.standard_error > 1.1 * fixed.standard_error
    found = printed(said)
    assert {*found} == {(one.name, one.level) for one in result.answers}
    for one in result.answers:
        values = found[one.name, one.level]
        assert values is not None
        assert values["estimate"] == pytest.approx(one.outcome.estimate, abs=0.25 * one.outcome.standard_error)
        assert values["standard_error"] == pytest.approx(one.outcome.standard_error, rel=0.25)


PINHOLE, ONE_CELL = "aperture == 'pinhole'", "aperture == 'f/11' and participant_id == '01'"


@pytest.mark.fast_cases(1)
@needs_r
@pytest.mark.parametrize(
    ("missing", "confounded"),
    [("rating < 0", False), (PINHOLE, False), (PINHOLE, True), (ONE_CELL, False), (ONE_CELL, True)],
)
def test_r_finds_the_odds_of_steps(tmp_path: Path, missing: str, confounded: bool) -> None:
    """By Laplace's method, so to some percent; the wide table has the mean steps."""
    table = pd.read_csv(REFERENCE / "ordinal.csv", dtype={"participant_id": str}).assign(catch=False)
    table = table.drop(table.query(missing).index)
    table = table.assign(scene=table["aperture"]) if confounded else table
    result = depth_rating(table, equivalence_bound=1.2, scale="ordinal")
    assert not result.ordinal.by_people
    said = run(tmp_path, trial_files(table, table, result), "headline_ordinal.R", "ordinal")
    found = printed(said)
    for one in result.answers:
        row, values = one.row(), found[one.name, one.level]
        assert values is not None
        for name in ("estimate", "standard_error", "statistic", "p"):
            assert values[name] == pytest.approx(row[name], rel=0.05, abs=2e-3)
    wide = pd.read_csv(tmp_path / "depth_rating_wide.csv")
    apertures = table.sort_values("aperture_mm")["aperture"].unique()
    assert list(wide) == ["participant_id", *(f"nearest {aperture}" for aperture in apertures)]
    assert len(wide) == 8


def reports_on_the_cube(*, complete: bool = False) -> pd.DataFrame:
    """Two reports in each trial of six subjects: one lacks the trials without blur, one alone has the rigid blur."""
    rng = np.random.default_rng(5)
    rows = []
    for who in range(6):
        for gradient in ("none", "nonrigid", "rigid"):
            if not complete and ((gradient == "none" and who == 0) or (gradient == "rigid" and who != 3)):
                continue
            lasts = rng.uniform(15, 25) - 5 * (gradient == "nonrigid")
            rows.append(
                (f"{who:02}", f"{gradient}0", gradient, 10.0 * (gradient != "none"), 0.0, lasts, "rigid", False)
            )
            rows.append((*rows[-1][:4], lasts, 40.0 - lasts, "nonrigid", True))
    names = ["participant_id", "trial", "gradient", "strength", "onset", "duration", "percept", "censored"]
    return pd.DataFrame(rows, columns=names).assign(catch=False, trial_duration=40.0)


@needs_r
def test_r_finds_the_odds_of_the_cube_where_conditions_are_empty(tmp_path: Path) -> None:
    table = reports_on_the_cube()
    result = necker(table, durations=False)
    agree(run(tmp_path, report_files(table, table, result), "necker_headline.R"), result.answers)
    (odds,) = [each.odds_of_time for each in result.effects if isinstance(each.odds_of_time, Effect)]
    assert odds.subjects == 5


@needs_r
def test_r_corrects_the_secondary_gradients_of_the_cube_only(tmp_path: Path) -> None:
    table = reports_on_the_cube(complete=True)
    weak = table[table["gradient"] != "none"]
    weak = weak.assign(strength=5.0, trial="weak " + weak["trial"], duration=weak["duration"] * 0.9)
    table = pd.concat([table, weak], ignore_index=True)
    result = necker(table, durations=False)
    said = run(tmp_path, report_files(table, table, result), "necker_headline.R")
    agree(said, result.answers)
    levels = [f"{effect.gradient} gradient, {effect.strength:g} mm" for effect in result.effects]
    assert [level for _, level in printed(said)] == levels
    assert ["p_corrected" in (values or {}) for values in printed(said).values()] == [False, True, True, True]


@needs_r
def test_r_finds_the_effects_of_the_conditions_of_a_task(tmp_path: Path) -> None:
    """A slope, a difference within people, and one between groups, of ratios and of other answers."""
    rng = np.random.default_rng(3)
    conditions = [
        (f"sub-{who}", mm, eye, who > 4) for who in range(9) for mm in (0.5, 1.0, 4.0) for eye in ("left", "right")
    ]
    table = pd.DataFrame(conditions * 2, columns=["participant_id", "mm", "eye", "expert"])
    table = table.assign(blur=np.exp(rng.normal(0, 1, len(table)) + 0.2 * table["mm"]), catch=False, kind="human")
    table = table.assign(correct=rng.random(len(table)) < 0.7)[rng.random(len(table)) < 0.9]
    factors = {"mm": [0.5, 1.0, 4.0], "eye": ["left", "right"], "expert": [False, True]}
    tests = condition_tests(table, planned_tests({"blur": True, "correct": False}, factors))
    names = ("Own", "own", "trial")
    questions = condition_questions(tests)
    part = condition_part(names, Plan(questions), table, table, tests, questions.answers(tests))
    said = run(tmp_path, {**part.files}, "conditions.R")
    agree(said, part.answers)
    assert len(printed(said)) == 6


@pytest.mark.fast_cases(2)
@needs_r
@pytest.mark.parametrize("by", [("mm", "group", "age", "eye"), ("mm", "eye", "group"), ("age",), ("mm=factor",)])
def test_r_finds_the_effects_of_conditions_of_a_table(by: tuple[str, ...], tmp_path: Path) -> None:
    """Slopes over subjects and scenes with empty cells, conditions between subjects, and trials left out by rules."""
    rng = np.random.default_rng(5)
    rows = [
        (
            f"S{who}",
            mm,
            eye,
            scene,
            ("young", "old")[who % 2],
            20 + who * who % 17,
            np.exp(0.05 * mm * rng.normal()),
            rt,
        )
        for who in range(9)
        for mm in (2.0, 4.0, 8.0)
        for eye in ("left", "right")
        for scene in "abcde"
        for rt, noise in [(rng.choice([0.1, 1.0], p=[0.1, 0.9]), rng.normal(0, 0.05))]
    ]
    names = ["subject", "mm", "eye", "scene", "group", "age", "rating", "rt"]
    table = pd.DataFrame(rows, columns=names)[rng.random(len(rows)) < 0.9]
    table.to_csv(tmp_path / "own.csv", index=False)
    part = conditions_of_table(read_conditions(tmp_path / "own.csv", by=by), Rules())
    said = run(tmp_path, {**part.files}, "conditions.R")
    agree(said, part.answers.of_roles("main"), rel=1e-5)  # degrees of freedom of REML by numerical derivatives
    assert len(printed(said)) == {4: 9, 3: 6, 1: 1 + ("mm=factor" in by)}[len(by)]


@needs_r
@pytest.mark.parametrize("by", ["eye", "group"])
def test_r_adds_the_error_of_scenes_that_differ_between_levels(by: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    rows = [
        (f"S{who}", eye, "ab"[who % 2], scene, np.exp(rng.normal()))
        for who in range(8)
        for eye in ("left", "right")
        for scene in range(6)
        if scene % 2 == (eye == "right" if by == "eye" else who % 2)
    ]
    pd.DataFrame(rows, columns=["subject", "eye", "group", "scene", "rating"]).to_csv(tmp_path / "own.csv", index=False)
    part = conditions_of_table(read_conditions(tmp_path / "own.csv", by=[by]), Rules())
    agree(run(tmp_path, {**part.files}, "conditions.R"), part.answers)
    assert "min F'" in part.answers.of_roles("main").frame()["method"].iloc[0]


@needs_r
def test_r_finds_d_prime_and_criterion(tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    test_report_own_detection.answers(3, 80).to_csv(file, index=False)
    part = detection_part(read_detection(file, {"condition": "where"}))
    agree(run(tmp_path, {**part.files}, "detection.R"), part.answers)


@needs_r
@pytest.mark.parametrize("groups", ["same", "other"])
def test_r_finds_mean_thresholds_and_their_ratios(tmp_path: Path, groups: str) -> None:
    """Sessions are averaged within people; conditions are compared within people, or between groups."""

    def of(people: str, *thresholds: float) -> ThresholdResult:
        fits = [ThresholdFit(at, 0.1, 0.9, 3.5, 0.0, (0.2,), (8,), (10,)) for at in thresholds]
        sessions = zip(people, "111112", fits, strict=True)
        return ThresholdResult(
            "D", tuple(SubjectThreshold(who, number, 0, 0, True, fit) for who, number, fit in sessions)
        )

    dim = of("abcdea", 0.4, 0.6, 0.5, 0.3, 0.7, 0.45)
    bright = of("abcdfb" if groups == "same" else "ghijkh", 0.2, 0.3, 0.2, 0.25, 0.3, 0.31)
    table = pd.DataFrame({"level": [0.1], "participant_id": "a", "kind": "human"})
    part = threshold_part(table, {"dim": dim, "bright": bright}, "D")
    files = {**part.files, "thresholds.csv": safe_csv(part.sheets[0].digits)}
    agree(run(tmp_path, files, "thresholds.R"), part.answers)


def at_the_floor(fixations: tuple[str, ...], cuts: list[float]) -> pd.DataFrame:
    """Answers in steps by six subjects, most of them the lowest one."""
    rng = np.random.default_rng(2)
    rows = [
        (f"{who:02}", scene, f"f/{mm:g}" if mm else "pinhole", mm, fixation, own + rise * mm / 8 + rng.logistic())
        for who in range(6)
        for own in [rng.normal()]
        for rise, fixation in zip((1.5, 0.0, 0.0), fixations, strict=False)
        for scene in "ab"
        for mm in (0.0, 2.0, 4.0, 8.0)
        for _ in range(3)
    ]
    names = ["participant_id", "scene", "aperture", "aperture_mm", "fixation", "felt"]
    table = pd.DataFrame(rows, columns=names).assign(trial=range(len(rows)), catch=False)
    return table.assign(rating=1 + np.digitize(table["felt"], cuts))


@pytest.mark.fast_cases(2)
@needs_r
@pytest.mark.parametrize("fixations", [("nearest",), ("nearest", "farthest"), ("door", "lamp", "vase")])
@pytest.mark.parametrize("cuts", [[2.5, 3.5, 4.2], [2.5]])
def test_r_finds_subjects_own_rises_at_the_floor(tmp_path: Path, fixations: tuple[str, ...], cuts: list[float]) -> None:
    table = at_the_floor(fixations, cuts)
    result = depth_rating(table, equivalence_bound=1.2, scale="ordinal")
    said = run(tmp_path, trial_files(table, table, result), "headline_ordinal.R")
    agree(said, result.answers, rel=1e-4, absolute=1e-4)
    assert {name for name, _ in printed(said)} == {one.name for one in result.answers}
