"""Signal detection: analytic truth, recovery from simulated observers, and wrong counts."""

import numpy as np
import pytest
from scipy import stats

from focalgradient.errors import InputError
from focalgradient.statistics import NotComputed, detection_by_person, rating_roc, sensitivity, type2_area
from focalgradient.statistics.detection import roc_area


def counted(mean: float, sd: float, cuts: list[float], trials: float) -> np.ndarray:
    """Expected counts of ratings of a normal variable."""
    edges = stats.norm.cdf((np.array([-np.inf, *cuts, np.inf]) - mean) / sd)
    return trials * np.diff(edges)


def test_d_prime_and_criterion_are_those_of_the_rates_of_many_trials():
    hits, alarms = stats.norm.sf(0.3 - 1.5), stats.norm.sf(0.3)
    counts = np.round(np.array([hits, 1 - hits, alarms, 1 - alarms]) * 1e7)
    found = sensitivity(*map(int, counts))
    assert found.d_prime.estimate == pytest.approx(1.5, abs=1e-5)
    assert found.criterion.estimate == pytest.approx(0.3 - 0.75, abs=1e-5)
    two = sensitivity(*map(int, counts), intervals=2)
    assert two.d_prime.estimate == pytest.approx(1.5 / np.sqrt(2), abs=1e-5)


def test_perfect_answers_have_a_finite_d_prime_and_intervals_cover():
    assert 3 < sensitivity(20, 0, 0, 20).d_prime.estimate < 5
    rng = np.random.default_rng(1)
    found = [
        sensitivity(hits, 100 - hits, alarms, 100 - alarms).d_prime
        for hits, alarms in zip(rng.binomial(100, 0.8, 2000), rng.binomial(100, 0.3, 2000), strict=True)
    ]
    truth = stats.norm.ppf(0.8) - stats.norm.ppf(0.3)
    assert np.mean([one.low <= truth <= one.high for one in found]) == pytest.approx(0.95, abs=0.02)


def test_unequal_variances_are_recovered_from_expected_counts():
    cuts = [-0.5, 0.2, 0.8, 1.5]
    found = rating_roc(counted(1.2, 1.4, cuts, 1e5), counted(0, 1, cuts, 1e5))
    assert found.sd_ratio.estimate == pytest.approx(1.4, rel=2e-3)
    assert found.d_a.estimate == pytest.approx(1.2 / np.sqrt((1 + 1.4**2) / 2), rel=2e-3)
    assert found.criteria == pytest.approx(cuts, abs=3e-3)
    assert found.area < found.area_normal == pytest.approx(stats.norm.cdf(1.2 / np.sqrt(1 + 1.4**2)), rel=1e-3)
    assert found.equal_p < 1e-6


@pytest.mark.parametrize(("experiments", "within"), [(15, 0.6), pytest.param(300, 0.12, marks=pytest.mark.slow)])
def test_standard_errors_of_ratings_are_those_of_repeated_experiments(experiments, within):
    """The half-widths of the intervals, over the standard deviation of the estimates in drawn experiments."""
    rng = np.random.default_rng(5)
    shares = [counted(mean, sd, [0.2, 1.0], 1.0) for mean, sd in ((2.0, 1.5), (0.0, 1.0))]
    drawn = [rating_roc(*(rng.multinomial(400, share) for share in shares)) for _ in range(experiments)]
    stated = rating_roc(*(400 * share for share in shares))
    z = stats.norm.ppf(0.975)
    assert (stated.d_a.high - stated.d_a.estimate) / z == pytest.approx(
        np.std([one.d_a.estimate for one in drawn]), rel=within
    )
    assert np.log(stated.sd_ratio.high / stated.sd_ratio.estimate) / z == pytest.approx(
        np.std([np.log(one.sd_ratio.estimate) for one in drawn]), rel=within
    )


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_the_type_2_area_is_the_share_of_pairs_in_which_the_correct_answer_is_surer(noise):
    rng = np.random.default_rng(2)
    signal = np.repeat([1, 0], 2000)
    evidence = rng.standard_normal(4000) + 1.5 * (signal - 0.5)
    yes = evidence > 0.1
    level = np.digitize(np.abs(evidence + noise * rng.standard_normal(4000) - 0.1), [0.4, 0.9, 1.5])
    rating = np.where(yes, 4 + level, 3 - level)
    area = type2_area(*(np.bincount(rating[signal == one], minlength=8) for one in (1, 0)))
    correct = yes == (signal == 1)
    pairs = np.sign(level[correct][:, None] - level[~correct])
    assert area == pytest.approx(0.5 + pairs.mean() / 2, abs=2e-3)
    assert (area > 0.65) == (not noise)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: sensitivity(-1, 2, 3, 4), "whole numbers of 0 or more"),
        (lambda: sensitivity(0, 0, 3, 4), "must each have been shown"),
        (lambda: sensitivity(1, 2, 3, 4, intervals=3), "intervals is 3, but must be 1"),
        (lambda: rating_roc([1, 2], [2, 1]), "3 or more ratings"),
        (lambda: type2_area([1, 2, 3], [3, 2, 1]), "2 K ratings"),
    ],
)
def test_wrong_counts_are_named(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call()


@pytest.mark.parametrize("column", ["signal", "answer"])
@pytest.mark.parametrize(("cell", "said"), [(np.nan, "nan"), ("no", "'no'"), (2, "2")])
def test_an_answer_that_is_neither_yes_nor_no_is_refused(column: str, cell: object, said: str) -> None:
    """Each of them is true to Python, and so would count as a hit or a false alarm."""
    table = {"participant_id": ["a"] * 4, "signal": [1, 1, 0, 0], "answer": [1, 0, 1, 0]}
    table[column] = [*table[column][:3], cell]  # type: ignore[list-item]
    with pytest.raises(InputError, match=f"{column} is {said}.*, but must be True or False"):
        detection_by_person(table)


@pytest.mark.parametrize(
    ("signal", "noise"),
    [
        ([0, 0, 5, 5], [6, 0, 2, 2]),  # points (.2, .5) and (.4, 1): any steeper line fits better
        ([5, 0, 1, 14], [13, 0, 0, 7]),  # two hit rates at one false-alarm rate
        ([2, 3, 3, 2, 6, 23], [38, 1, 0, 0, 0, 0]),  # two false-alarm rates at one hit rate, if rates of 0 count
        ([0, 0, 6, 14], [12, 4, 3, 1]),
        ([9, 0, 0], [0, 0, 9]),
    ],
)
def test_a_ratio_of_deviations_of_which_every_larger_or_smaller_one_fits_better_is_not_stated(
    signal: list[int], noise: list[int]
) -> None:
    """The likelihood of the line through all points is reached only in the limit, 0 or infinity."""
    assert isinstance(rating_roc(signal, noise), NotComputed)
    compared = np.sign(np.subtract.outer(np.arange(len(signal)), np.arange(len(noise))))
    wins = np.array(signal) @ (0.5 + compared / 2) @ np.array(noise)
    assert roc_area(signal, noise) == pytest.approx(wins / sum(signal) / sum(noise))


def test_a_single_point_between_0_and_1_with_one_on_either_side_determines_the_curve() -> None:
    """Points (0, .3), (.2, .5) and (.4, 1): both a steep and a flat line miss one."""
    found = rating_roc([0, 50, 20, 30], [60, 20, 20, 0])
    assert 0.5 < found.sd_ratio.estimate < 2
