"""A small form of benchmarks/statistics_error_rates.py: no test finds far too often what is not there."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from focalgradient.statistics import compare_pictures
from focalgradient.statistics.ordinal import ordinal_rating


def benchmark(name: str):
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parents[2] / "benchmarks" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


study = benchmark("statistics_error_rates")
scales = benchmark("scales_error_rates")
robust = benchmark("robust_tests")

EXPERIMENTS = 20
SETS = 10_000


def test_the_benchmark_analyses_as_the_package_does() -> None:
    study.compare(seed=3)


@pytest.mark.parametrize("subjects", [4, 10])
@pytest.mark.parametrize("curve", list(study.CURVES))
def test_rates_and_coverage_of_normal_subjects_and_scenes_that_differ(subjects: int, curve: str) -> None:
    """2000 sets measure a rate of .05 to .005."""
    rates = study.cell((5, 2000, subjects, "much", 0.1, curve))["rates"]
    covered = {name: rate for name, rate in rates.items() if name.startswith("coverage")}
    fixed = {name for name in rates if "these scenes" in name}
    found = {name: rate for name, rate in rates.items() if name not in covered and name not in fixed}
    assert all(0.002 < rate < 0.065 for rate in found.values()), found
    assert 0.03 < found["rise"] < 0.065
    assert all(0.93 < rate < 0.995 for name, rate in covered.items() if name not in fixed), covered


def test_very_skewed_subjects_are_found_as_often_as_by_student_t_of_their_means() -> None:
    """The limit that the documents state: Student's t is not corrected for skewness.

    The expected level is that of Student's t for the means of as many gamma-distributed subjects, whose noise is that
    of a mean of twelve differences of two answers each: `robust_tests` draws those without scenes or apertures.
    """
    rates = study.cell((5, SETS, 10, "very skewed", 0.0, "linear"))["rates"]
    noise = study.NOISE * np.sqrt(2 / study.REPETITIONS / study.SCENES) / 0.2
    means = robust.drawn(np.random.default_rng(1), "gamma, skewness 4", noise, (50_000, 10))
    expected = robust.level(robust.student, means)
    standard_error = np.sqrt(expected * (1 - expected) * (1 / SETS + 1 / 50_000))
    assert rates["rise, for these scenes"] == pytest.approx(expected, abs=3 * standard_error)
    assert expected > 0.1


@pytest.mark.slow
def test_incomplete_tables_hold_their_level_by_t() -> None:
    """400 sets measure .05 to .011."""
    rates = study.incomplete((5, 400, "4 of 12 scenes each", "much", 6))
    assert rates["rejected"] < 0.1
    assert rates["coverage"] > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("middle", [0.0, study.RARE])
def test_false_positives_of_the_cube_with_six_subjects(middle: float) -> None:
    """As many as one experiment in twenty makes likely; a rate of .4 would not pass."""
    p = pd.DataFrame([study.cube((2, 6, each, middle)) for each in range(EXPERIMENTS)])
    most = stats.binom.isf(0.005, EXPERIMENTS, 0.05)
    assert middle or not p.isna().to_numpy().any()
    assert ((p < 0.05).sum() <= most).all()
    assert most < stats.binom.ppf(0.1, EXPERIMENTS, 0.4)


def test_an_effect_is_found() -> None:
    rng = np.random.default_rng(1)
    cells = study.answers(rng, 1, 6, "little", 0.0, "linear", 1.6)
    assert study.rated(cells[..., -1] - cells[..., 0])["p"][0] < 0.01


def test_the_benchmark_of_the_other_scales_analyses_as_the_package_does() -> None:
    scales.compare(seed=3)


@pytest.mark.parametrize(("scale", "kind"), [("bipolar", "normal"), ("bipolar", "skewed"), ("choice", "normal")])
def test_rates_of_comparisons_over_scenes_that_differ(scale: str, kind: str) -> None:
    """2000 sets measure a rate of .05 to .005: over both it holds, for these scenes it does not hold for others."""
    found = scales.comparisons(5, scales.Cell(scale, kind, 0.5, 0.0, 20), 2000)
    assert 0.01 < (found.p < 0.05).mean() < 0.065
    assert (found.p_these < 0.05).mean() > 0.075
    assert 0.93 < found.largest.mean() < 0.985


def test_choices_are_decided_by_a_t_test_over_subjects_without_correction() -> None:
    """Six subjects and six scenes: the test over scenes, which decided, found .215 of effects, this one .256."""
    (answers,) = scales.answered(np.random.default_rng(1), scales.Cell("choice", "normal", 0.5, 1.0, 6), 1)
    found = compare_pictures(scales.as_rows(answers, "choice"), "choice")
    assert (found.slopes[0].df, found.slopes[0].p_holm) == (5, None)
    assert "Satterthwaite" in found.answers.to("slope on aperture, subjects and scenes")["nearest"].method


def test_choices_find_an_effect_as_often_as_a_t_test_over_subjects() -> None:
    """Six subjects and six scenes: within a quarter of it over scenes, too. GEE's Wald test found half as many."""
    found = scales.comparisons(5, scales.Cell("choice", "normal", 0.0, 1.0, 6), 2000)
    power, best = (found.p < 0.05).mean(), (found.p_these < 0.05).mean()
    assert best > 0.2
    assert power > 0.75 * best


def test_steps_find_what_scenes_differ_by() -> None:
    """Their standard deviation is 1.5: the variance that the error gains by them, times 6 scenes, is 2.25 on the mean.

    Of a single experiment it scatters as chi-squared of 5, by .63 of itself, and more by the answers' own noise; of the
    mean of twelve by about a quarter.
    """
    cell = scales.Cell("steps", "normal", 1.5, 0.0, 10)
    gained = []
    for seed in range(12):
        (answers,) = scales.answered(np.random.default_rng(seed), cell, 1)
        found = ordinal_rating(scales.as_rows(answers, "steps"), [])
        both, here = found.rises[0], found.these_scenes[0]
        assert both.estimate == here.estimate
        gained.append(6 * (both.standard_error**2 - here.standard_error**2))
    assert np.mean(gained) == pytest.approx(2.25, rel=0.6)


@pytest.mark.parametrize("kind", ["bipolar", "choice"])
def test_with_four_scenes_comparisons_hold_for_these_only(kind: str) -> None:
    (answers,) = scales.answered(np.random.default_rng(1), scales.Cell(kind, "normal", 0.5, 1.0, 8), 1)
    rows = scales.as_rows(answers, kind)
    end = ", subjects and scenes" if kind == "choice" else ", these scenes"
    random = compare_pictures(rows, kind).answers.to("slope on aperture" + (end if kind == "choice" else ""))
    assert "Satterthwaite" in random["nearest"].method
    few = compare_pictures(rows[rows["scene"] < "s4"], kind)
    assert few.answers.to(f"slope on aperture{end}") == {"nearest": few.slopes[0]}
    largest = few.answers.to(f"largest aperture against identical pictures{end}")
    assert largest == {"nearest": replace(few.against_reference[0], p_holm=None)}
