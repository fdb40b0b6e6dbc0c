"""Power by simulation against Student's t in closed form."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.stats.meta_analysis import combine_effects  # type: ignore[import-untyped]

from focalgradient.design import DepthRatingDesign, NeckerDesign
from focalgradient.errors import InputError
from focalgradient.power import Model, Study, cube, latent, quick_power
from focalgradient.power.cube import CubeModel, _reports, quick_cube_power
from focalgradient.power.latent import SIZES, LatentModel, _by_size
from focalgradient.power.running import power, subjects_needed
from focalgradient.statistics import Effect, analyse, meta_analysis
from focalgradient.statistics.crossed import FEWEST_SCENES
from focalgradient.statistics.meta_analysis import random_effects


@pytest.mark.parametrize(("noise", "repetitions", "subjects"), [(0.3, 1, 8), (0.3, 4, 8), (0.9, 2, 20)])
def test_power_is_that_of_the_noncentral_t(noise: float, repetitions: int, subjects: int) -> None:
    """Where people and scenes do not differ, the effect's standard error follows from the noise of one rating.

    A rise is the difference of two means of `repetitions` ratings.
    """
    scenes = ("spheres-01", "spheres-02")
    design = DepthRatingDesign(scenes=scenes, fixations=("nearest",), repetitions=repetitions)
    error = noise * math.sqrt(2 / (repetitions * len(scenes) * subjects))
    effect = 2.2 * error
    model = Model(effect=math.exp(effect), between=0.0, between_scenes=0.0, noise=noise)
    found = quick_power(Study(model, design), subjects, 4000)
    df = subjects - 1
    upper = float(stats.nct.sf(stats.t.isf(0.025, df), df, effect / error))
    assert upper - 0.03 < found["near_rise"] < upper + 0.03


def test_rises_that_differ_by_nothing_are_found_to_differ_in_no_more_than_the_level() -> None:
    design = DepthRatingDesign(scenes=("spheres-01", "spheres-02"), repetitions=2)
    model = Model(effect=1.3, far_effect=1.3, between=0.1, between_scenes=0.0, noise=0.3)
    found = quick_power(Study(model, design), 10, 2000)
    assert found["near_rise"] > 0.5
    assert found["interaction"] < 0.05


@pytest.mark.parametrize(("scenes", "least", "most"), [(FEWEST_SCENES - 1, 0.3, 1.0), (FEWEST_SCENES, 0.0, 0.08)])
def test_scenes_are_random_from_their_fewest_on(scenes: int, least: float, most: float) -> None:
    """Scenes that differ by much and people by little: without an effect, a test for these scenes finds one often."""
    design = DepthRatingDesign(scenes=tuple(f"spheres-{n:02}" for n in range(scenes)), fixations=("nearest",))
    model = Model(effect=1.0, between=0.05, between_scenes=0.5, noise=0.1)
    assert least <= quick_power(Study(model, design), 12, 1000)["near_rise"] <= most


def test_simulated_durations_have_the_stated_correlation_and_first_percept() -> None:
    model = CubeModel(serial=0.4, first_ratio=2.0, duration_spread=0.6)
    logs = np.log([lasts for _, lasts, _ in _reports(20_000.0, 0.0, 2.0, model, np.random.default_rng(2))][:-1])
    assert logs.std() == pytest.approx(0.6, abs=0.03)
    assert np.corrcoef(logs[1:-1], logs[2:])[0, 1] == pytest.approx(0.4, abs=0.04)
    rng = np.random.default_rng(3)
    first = [np.log(_reports(50.0, 0.0, 2.0, model, rng)[0][1]) for _ in range(400)]
    assert np.exp(np.mean(first) - logs.mean()) == pytest.approx(2.0, abs=0.3)


def test_pooling_is_the_t_test_where_data_sets_are_alike_in_error_and_differ() -> None:
    """With equal errors every weight is equal: Hartung and Knapp's interval is Student's over the estimates."""
    estimates = np.array([0.1, 0.35, 0.2, 0.6, 0.42])
    found = random_effects(estimates, np.full(5, 0.05))
    exact = stats.ttest_1samp(estimates, 0)
    assert found.estimate == pytest.approx(estimates.mean())
    assert (found.statistic, found.p) == pytest.approx((exact.statistic, exact.pvalue))
    assert (found.low, found.high) == pytest.approx(tuple(exact.confidence_interval()))
    assert found.tau**2 == pytest.approx(estimates.var(ddof=1) - 0.05**2, rel=1e-6)
    # Q is the sum of squares over the variance of an estimate, so that this variance is that sum over chi-square.
    rng = np.random.default_rng(7)
    variance = np.maximum(4 * estimates.var(ddof=1) / rng.chisquare(4, 400_000), 0.05**2)
    error = np.sqrt(np.maximum(estimates.var(ddof=1), variance) / 5)
    new = rng.normal(found.estimate, np.sqrt(variance - 0.05**2)) + error * rng.standard_t(4, variance.size)
    width = found.predicted_high - found.predicted_low
    assert (found.predicted_low, found.predicted_high) == pytest.approx(
        np.quantile(new, [0.025, 0.975]), abs=width / 40
    )
    assert random_effects(estimates[:2], [0.05, 0.05]).predicted_low is None


def test_the_prediction_interval_covers_effects_of_new_data_sets() -> None:
    """Where 20 data sets differ by less than their errors; by the estimated variance alone .85 of them are covered."""
    rng, covered = np.random.default_rng(2), []
    for _ in range(200):
        errors = rng.uniform(0.08, 0.2, 20)
        found = random_effects(rng.normal(rng.normal(0.3, 0.1, 20), errors), errors)
        covered.append(stats.norm.cdf([found.predicted_low, found.predicted_high], 0.3, 0.1) @ [-1, 1])
    assert np.mean(covered) > 0.9


def test_pooling_covers_and_agrees_with_statsmodels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meta_analysis, "_prediction", lambda y, se: (0.0, 0.0))  # slow, and not looked at
    rng, covered = np.random.default_rng(4), []
    for _ in range(300):
        errors = rng.uniform(0.05, 0.2, 5)
        estimates = 0.3 + rng.normal(0, 0.15, 5) + rng.normal(0, errors)
        found = random_effects(estimates, errors)
        covered.append(found.low <= 0.3 <= found.high)
    assert np.mean(covered) > 0.92
    other = combine_effects(estimates, errors**2, method_re="iterated", use_t=True)
    assert found.tau**2 == pytest.approx(other.tau2, abs=1e-5)
    assert found.estimate == pytest.approx(other.mean_effect_re, abs=1e-6)


def test_the_variance_at_any_size_has_a_part_that_more_subjects_do_not_reduce() -> None:
    own, shared = np.array([3.0, 0.0, 2.0]), np.array([0.1, 0.2, 0.0])
    at = _by_size([own / size + shared for size in SIZES])
    for subjects in (4, *SIZES, 500):
        np.testing.assert_allclose(at(subjects), own / subjects + shared, atol=1e-12)
    growing = _by_size([np.array([0.1]), np.array([0.3])])  # by chance: no variance is negative
    assert growing(3) == growing(500) == 0.3


OWN, SHARED = 4.0, 0.03
"""Variance of an estimate: a part over the number of subjects, and a part that all share."""


def of_known_variance(means, monkeypatch):
    """Replace simulated experiments by tests whose estimates, errors and degrees of freedom are known exactly."""

    def tests(study, subjects, number):
        runs = study.design.response_scale.analysis.experiments
        variance = OWN / subjects + SHARED
        off = (1 - 2 * (number % 2)) * math.sqrt(variance * (runs - 1) / runs)  # has this sample variance
        found = [(mean + off, math.sqrt(variance)) for mean in means]
        nothing = {"low": 0.0, "high": 0.0, "statistic": 0.0, "p": 0.0, "dz": None, "method": "", "subjects": subjects}
        return [Effect(estimate=one, standard_error=sd, df=subjects - 1.0, **nothing) for one, sd in found]

    monkeypatch.setattr(latent, "_tests", tests)


def noncentral(mean: float, subjects: int, level: float = 0.05) -> float:
    """Power, upwards, of a two-sided t-test at `level`."""
    df = subjects - 1
    return float(stats.nct.sf(stats.t.isf(level / 2, df), df, mean / math.sqrt(OWN / subjects + SHARED)))


@pytest.mark.parametrize("scale", ["steps", "choice"])
def test_power_of_answers_in_steps_and_choices_is_that_of_the_noncentral_t(scale, monkeypatch) -> None:
    mean = math.log(3.0)  # of steps it is the model's own, whatever was simulated
    of_known_variance([mean + (0.0 if scale == "choice" else 5.0)], monkeypatch)
    study = Study(LatentModel(effect=3.0), DepthRatingDesign(scale=scale, fixations=("nearest",)))
    for subjects, shares in latent.latent_power(study, (6, *SIZES, 60)).items():
        assert shares["near_rise"] == pytest.approx(noncentral(mean, subjects), abs=0.015)
        assert "interaction" not in shares


def test_power_of_a_difference_of_slopes_is_that_after_holms_correction(monkeypatch) -> None:
    near, far = math.log(90.0), math.log(3.0)
    of_known_variance([0.0, 0.0, 0.0], monkeypatch)  # of steps the means are the model's own
    study = Study(LatentModel(effect=90.0, far_effect=3.0), DepthRatingDesign(scale="steps"))
    found, apart = latent.latent_power(study, SIZES), near - far
    for subjects, shares in found.items():
        assert noncentral(apart, subjects, 0.05 / 2) - 0.01 < shares["interaction"] < noncentral(apart, subjects) + 0.01
        assert shares["near_rise"] >= shares["interaction"]


@pytest.mark.parametrize(
    ("people", "design"),
    [
        (Model, DepthRatingDesign()),
        (LatentModel, DepthRatingDesign(scale="steps")),
        (CubeModel, NeckerDesign()),
    ],
)
def test_a_fall_which_no_test_would_count_is_refused(people, design) -> None:
    with pytest.raises(InputError, match="a fall has the power of its inverse"):
        Study(people(effect=0.2), design)


def test_quick_power_of_the_cube_is_that_of_the_noncentral_t(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 4 people drawn from a pool with normal changes of share and known mean and standard deviation."""
    pool = pd.DataFrame({"nonrigid gradient, 4 mm": 1.2 + stats.norm.ppf((np.arange(4000) + 0.5) / 4000)})
    monkeypatch.setattr(cube, "_pool", lambda study, people, rng: pool)
    design = NeckerDesign(gradients=("none", "nonrigid"), strengths_mm=(4.0,), repetitions=1)
    found = quick_cube_power(Study(CubeModel(), design), [4], 20_000, 1)[4]["nonrigid_longer"]
    assert found == pytest.approx(stats.nct.sf(stats.t.isf(0.025, 3), 3, 1.2 * 2), abs=0.015)


def test_widths_are_those_of_the_intervals_and_the_first_object_is_the_primary_test() -> None:
    design = DepthRatingDesign(scale="choice")
    latent_study = Study(LatentModel(effect=20.0, far_effect=1.0), design)
    table = latent_study.table(8, np.random.default_rng(1))
    primary = analyse(table, design.response_scale.analysis).answers.primary[0].outcome
    outcome = latent_study.outcome(table)
    assert primary.low > 0
    assert outcome["left_out"] == 0
    assert outcome["width"] == pytest.approx(primary.high - primary.low)

    study = Study(Model(effect=2.0, far_effect=1.0), DepthRatingDesign(scenes=("spheres-01", "spheres-02")))
    table = study.table(8, np.random.default_rng(1))
    near, far = study.analysis.asked(table).to("depth effect").values()
    outcome = study.outcome(table)
    assert near.estimate == pytest.approx(math.log(2.0), abs=0.35)
    assert abs(far.estimate) < 0.35
    assert outcome["left_out"] == 0
    for name, rise in (("width", near), ("far_width", far)):
        assert outcome[name] == pytest.approx(rise.high - rise.low)


def test_two_standard_errors_cover_the_share_of_a_few_experiments() -> None:
    """Exactly, over all counts of 20; twice the root of p (1 - p) / n covers .86 on average, and .18 at .01."""
    shares, errors = [], []
    for count in range(21):
        rows = pd.DataFrame({"subjects": 8, "a": [1.0] * count + [0.0] * (20 - count)})
        [one] = power(rows.assign(width=2.0, far_width=3.0, left_out=0.0), logs=False)
        shares.append(one.found["a"])
        errors.append(one.standard_error["a"])
    true = np.linspace(0.01, 0.99, 99)[:, None]
    within = np.abs(np.array(shares) - true) <= 2 * np.array(errors)
    covered = (within * stats.binom.pmf(np.arange(21), 20, true)).sum(axis=1)
    assert covered.mean() > 0.93
    assert covered.min() > 0.88


@pytest.mark.parametrize(
    ("shares", "needed"),
    [
        ({6: 0.5, 10: 0.9}, 9),
        ({6: 0.5, 10: 0.8, 20: 0.9}, 10),
        ({6: 0.85, 10: 0.75, 20: 0.95}, 13),  # from which on, as power does not fall
        ({6: 0.85, 10: 0.9}, None),
        ({6: 0.2, 10: 0.7}, None),
    ],
)
def test_the_number_of_subjects_for_a_power_is_interpolated(shares: dict[int, float], needed: int | None) -> None:
    assert subjects_needed(shares, 0.8) == needed


def test_shares_of_experiments_are_summed_over_tests_and_people() -> None:
    found = pd.DataFrame({"subjects": 8, "a": [1.0, 0, 0, 0] * 4, "b": [1.0, 1, 0, 0] * 4})
    [one] = power(found.assign(width=2.0, far_width=3.0, left_out=0.5), logs=False)
    assert (one.found["a"], one.found["b"], one.joint) == (0.25, 0.5, 0.25)
    assert one.joint_error == one.standard_error["a"] < one.standard_error["b"]
    assert (one.experiments, one.left_out) == (16, 0.5)
