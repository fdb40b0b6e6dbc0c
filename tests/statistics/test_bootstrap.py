"""The bootstrap-t: against the enumeration of all resamples, its level, and its record."""

from itertools import product

import numpy as np
import pytest

from focalgradient.statistics.bootstrap import FEWEST_SUBJECTS, bootstrap_t


def test_it_is_the_distribution_over_all_resamples() -> None:
    """5^5 samples with replacement, each with its own t about the mean of the values."""
    values = np.array([0.1, 0.15, 0.3, 0.2, 0.9])
    drawn = np.array([values[list(index)] for index in product(range(5), repeat=5) if len(set(index)) > 1])
    t = (drawn.mean(axis=1) - values.mean()) / drawn.std(axis=1, ddof=1) * np.sqrt(5)
    error = values.std(ddof=1) / np.sqrt(5)
    observed = values.mean() / error
    found = bootstrap_t(values)
    assert found.p == pytest.approx(2 * min((t >= observed).mean(), (t <= observed).mean()), abs=0.01)
    low, high = values.mean() - np.quantile(t, [0.975, 0.025], method="inverted_cdf") * error
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.1 * error)
    assert found.significant == (found.low > 0 or found.high < 0)


def test_it_keeps_its_level_for_normal_subjects() -> None:
    """Of 600 sets of eight: .05 +- .009 (standard error)."""
    sets = np.random.default_rng(3).normal(size=(600, 8))
    assert np.mean([bootstrap_t(values, 999).p < 0.05 for values in sets]) == pytest.approx(0.05, abs=0.025)


def test_few_subjects_have_none() -> None:
    found = bootstrap_t([0.1, 0.3, 0.2, 0.5])
    assert f"needs {FEWEST_SUBJECTS} or more subjects" in found.reason
