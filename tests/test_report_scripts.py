"""The R scripts of a report, run in R where it is installed: they find what the report says."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from focalgradient.report.export import trial_files
from focalgradient.statistics import Effect, compare_pictures, depth_rating

REFERENCE = Path(__file__).parent / "statistics" / "reference"
APERTURES = {"pinhole": 0.0, "f/11": 4.5, "f/5.6": 8.9}

needs_r = pytest.mark.skipif(shutil.which("Rscript") is None, reason="Rscript is not installed")


def run(folder: Path, files: dict[str, bytes], script: str, *packages: str) -> str:
    """What the script prints, in the report's folder."""
    for package in packages:
        command = ["Rscript", "-e", f'quit(status = !requireNamespace("{package}", quietly = TRUE))']
        if subprocess.run(command, capture_output=True, check=False).returncode:
            pytest.skip(f"the R package {package} is not installed")
    for name, content in files.items():
        (folder / name).write_bytes(content)
    done = subprocess.run(["Rscript", script], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


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


@needs_r
def test_r_finds_the_rises_of_own_fixations_and_their_differences(tmp_path: Path) -> None:
    table = three_fixations()
    result = depth_rating(table, equivalence_bound=1.2)
    said = run(tmp_path, trial_files(table, table, result), "headline.R", "lmerTest")
    tests = {each.fixation: each.rise for each in result.fixations}
    tests |= {f"{one} less {other}": test for (one, other), (test, _) in result.differences.items()}
    assert len(tests) == 6
    for block in said.split("rise: ")[1:]:
        name, rest = block.split(" \n", 1)
        test = tests.pop(name)
        assert isinstance(test, Effect)
        by_lmer, by_squares = rest.split("log_ratio", 1)
        found = numbers(by_squares)
        assert found[:6] == pytest.approx(
            [test.estimate, test.low, test.high, test.statistic, test.df, test.p], rel=2e-5
        )
        estimate, _, df, t, p = numbers(by_lmer.split("(Intercept)")[1])
        assert (estimate, df, t, p) == pytest.approx((test.estimate, test.df, test.statistic, test.p), rel=2e-3)
    assert not tests


@needs_r
@pytest.mark.parametrize(("scenes", "kept"), [(6, 0.7), (3, 0.8)])
def test_r_finds_the_rises_where_cells_are_empty(tmp_path: Path, scenes: int, kept: float) -> None:
    table = three_fixations()
    table = table[table["scene"] < "abcdefg"[scenes]]
    empty = table[["participant_id", "scene", "fixation"]].apply(tuple, axis=1)
    chosen = np.random.default_rng(1).random(empty.nunique()) < kept
    table = table[empty.isin(pd.unique(empty)[chosen])]
    result = depth_rating(table, equivalence_bound=1.2)
    for script in ("headline.R", "headline_jasp.R"):
        files = trial_files(table, table, result)
        files["headline_jasp.R"] = files["headline_jasp.R"].replace(
            b"d <- data", b"d <- read.csv('depth_rating_trials.csv')"
        )
        said = run(tmp_path, files, script, "lmerTest")
        for each in result.fixations:
            found = numbers(said.split(f"rise: {each.fixation} \n")[1].split("rise:")[0])
            test = each.rise
            assert isinstance(test, Effect)
            assert found[-7:-1] == pytest.approx(
                [test.estimate, test.low, test.high, test.statistic, test.df, test.p], rel=2e-3
            )


@needs_r
@pytest.mark.parametrize(("kind", "column"), [("bipolar", "steps"), ("choice", "choice")])
def test_r_finds_the_slopes_of_comparisons(kind: str, column: str, tmp_path: Path) -> None:
    table = pd.read_csv(REFERENCE / "comparisons.csv", dtype={"participant_id": str})
    table = table.assign(rating=table[column])
    result = compare_pictures(table, kind)
    files = trial_files(table, table, result)
    packages = ("clubSandwich",) if kind == "choice" else ()
    said = run(tmp_path, files, "headline_comparisons.R", *packages)
    slopes, largest = said.split("largest_of")
    rows = [numbers(line) for line in slopes.splitlines()[1:] if line.strip()]
    tests = [*result.slopes, *([result.interaction] if kind == "bipolar" else [])]
    assert rows == [pytest.approx([test.estimate, test.statistic, test.p, test.p_holm], rel=2e-4) for test in tests]
    rows = [numbers(line)[1:] for line in largest.splitlines()[1:] if line.strip()]
    assert rows == [pytest.approx([test.statistic, test.p, test.p_holm], rel=2e-4) for test in result.against_reference]
    wide = pd.read_csv(tmp_path / "depth_rating_wide.csv")
    own = table[(table["fixation"] == "farthest") & (table["aperture"] == "f/11")]
    means = own.groupby("participant_id")["rating"].mean()
    assert wide["farthest f/11"].to_numpy() == pytest.approx(means.to_numpy())


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
@pytest.mark.parametrize("kind", ["bipolar", "choice"])
def test_r_finds_comparisons_over_subjects_and_scenes(kind: str, tmp_path: Path) -> None:
    table = eight_scenes(kind)
    result = compare_pictures(table, kind)
    packages = ("clubSandwich",) if kind == "choice" else ()
    said = run(tmp_path, trial_files(table, table, result), "headline_comparisons.R", *packages)
    slopes, largest = said.split("over_both")[1:]
    for text, tests in ((slopes, [*result.slopes, result.interaction]), (largest, result.against_reference)):
        rows = [numbers(line) for line in text.splitlines()[1:] if line.strip()]
        done = [test for test in tests if isinstance(test, Effect)]
        assert all("Satterthwaite" in test.method for test in done)
        assert rows == [
            pytest.approx([test.estimate, test.statistic, test.df, test.p, test.p_holm], rel=2e-4) for test in done
        ]


@needs_r
@pytest.mark.slow
def test_r_finds_the_odds_of_steps_over_subjects_and_scenes(tmp_path: Path) -> None:
    """Scenes by maximum likelihood and Laplace there, Cochran's Q here: R's error is .371, ours .306."""
    table = eight_scenes("ordinal")
    table = table[table["fixation"] == "nearest"]  # with both it takes R a minute and more
    result = depth_rating(table, equivalence_bound=1.2, scale="ordinal")
    said = run(tmp_path, trial_files(table, table, result), "headline_ordinal.R", "ordinal")
    rows = [numbers(line) for line in said.split("over subjects and scenes:")[1].splitlines()[2:] if line.strip()]
    (row,), (rise,), (fixed,) = rows, result.ordinal.rises, result.ordinal.these_scenes
    assert rise.standard_error > 1.1 * fixed.standard_error
    assert row[0] == pytest.approx(rise.estimate, abs=0.25 * rise.standard_error)
    assert row[1] == pytest.approx(rise.standard_error, rel=0.25)


@needs_r
def test_r_finds_the_odds_of_steps(tmp_path: Path) -> None:
    """By Laplace's method, so to some percent; the wide table has the mean steps."""
    table = pd.read_csv(REFERENCE / "ordinal.csv", dtype={"participant_id": str}).assign(catch=False)
    result = depth_rating(table, equivalence_bound=1.2, scale="ordinal")
    said = run(tmp_path, trial_files(table, table, result), "headline_ordinal.R", "ordinal")
    (row,) = [numbers(line) for line in said.splitlines()[1:]]
    rise = result.ordinal.rises[0]
    assert row[:4] == pytest.approx([rise.estimate, rise.standard_error, rise.statistic, rise.p], rel=0.05)
    wide = pd.read_csv(tmp_path / "depth_rating_wide.csv")
    assert list(wide) == ["participant_id", "nearest pinhole", "nearest f/22", "nearest f/11", "nearest f/5.6"]
    assert len(wide) == 8
