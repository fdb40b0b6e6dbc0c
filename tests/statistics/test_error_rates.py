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


@pytest.mark.parametrize("kind", ["rating", "necker"])
def test_false_positives_with_six_subjects(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as one experiment in twenty makes likely; a rate of .4, as without random slopes, would not pass."""
    monkeypatch.setattr("focalgradient.statistics.cube._dominance", lambda *_: None)  # slow, and no test
    p = pd.DataFrame([study.cell((kind, 6, "large", 2, each)) for each in range(EXPERIMENTS)])
    most = stats.binom.isf(0.005, EXPERIMENTS, 0.05)
    found = (p < 0.05).sum()
    assert not p.isna().to_numpy().any()
    assert (found <= most).all(), found
    assert most < stats.binom.ppf(0.1, EXPERIMENTS, 0.4)


def test_what_is_there_is_found() -> None:
    rng = np.random.default_rng(1)
    result = study.depth_rating(study.ratings(rng, 6, 0.05, np.log(1.6)), equivalence_bound=1.2)
    assert result.fixations[0].rise.p < 0.01
