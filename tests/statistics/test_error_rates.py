"""A small form of benchmarks/statistics_error_rates.py: no test finds far too often what is not there."""

import importlib.util
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

EXPERIMENTS = 20


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
    assert all(0.01 < rate < 0.065 for rate in found.values()), found
    assert all(0.93 < rate < 0.985 for name, rate in covered.items() if name not in fixed), covered
    assert rates["rise, for these scenes"] > 0.05


def test_equivalence_of_few_skewed_subjects_holds_its_level() -> None:
    """By Student's t alone .09 of 2000 sets are falsely equivalent; .06 and three standard errors are .076."""
    rates = study.cell((5, 2000, 6, "skewed", 0.0, "linear"))["rates"]
    assert rates["equivalence, true rise at the bound"] < 0.076


@pytest.mark.slow
def test_false_positives_of_the_cube_with_six_subjects() -> None:
    """As many as one experiment in twenty makes likely; a rate of .4 would not pass."""
    p = pd.DataFrame([study.cube((2, 6, each)) for each in range(EXPERIMENTS)])
    most = stats.binom.isf(0.005, EXPERIMENTS, 0.05)
    assert not p.isna().to_numpy().any()
    assert ((p < 0.05).sum() <= most).all()
    assert most < stats.binom.ppf(0.1, EXPERIMENTS, 0.4)


def test_an_effect_is_found() -> None:
    rng = np.random.default_rng(1)
    cells = study.answers(rng, 1, 6, "little", 0.0, "linear", 1.6)
    assert study.rated(cells[..., -1] - cells[..., 0])["p"][0] < 0.01


def test_the_benchmark_of_the_other_scales_analyses_as_the_package_does() -> None:
    scales.compare(seed=3)


@pytest.mark.parametrize("kind", ["normal", "skewed"])
def test_rates_of_comparisons_in_steps_over_scenes_that_differ(kind: str) -> None:
    """2000 sets measure a rate of .05 to .005: over both it holds, for these scenes it does not hold for others."""
    found = scales.comparisons(5, scales.Cell("bipolar", kind, 0.5, 0.0, 20), 2000)
    assert 0.01 < (found.p < 0.05).mean() < 0.065
    assert (found.p_these < 0.05).mean() > 0.075
    assert 0.93 < found.largest.mean() < 0.985


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
    assert "Satterthwaite" in compare_pictures(rows, kind).slopes[0].method
    few = compare_pictures(rows[rows["scene"] < "s4"], kind)
    assert few.slopes == few.these_scenes.slopes
    assert few.against_reference == few.these_scenes.against_reference
