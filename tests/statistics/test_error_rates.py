"""A small form of benchmarks/statistics_error_rates.py: no test finds far too often what is not there."""

import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

FILE = Path(__file__).parents[2] / "benchmarks" / "statistics_error_rates.py"
SPEC = importlib.util.spec_from_file_location("statistics_error_rates", FILE)
study = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(study)

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
