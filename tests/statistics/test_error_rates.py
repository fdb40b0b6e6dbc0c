"""A small form of benchmarks/statistics_error_rates.py: tests keep their level and find the effects they should."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from focalgradient.statistics import compare_pictures
from focalgradient.statistics.crossed import crossed_effect
from focalgradient.statistics.ordinal import ordinal_rating

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import simulated_experiments as simulated
import statistics_error_rates as study

SETS = 10_000


def random() -> np.random.Generator:
    return np.random.default_rng(5)


def test_the_benchmark_analyses_as_the_package_does() -> None:
    study.compare(seed=3)


@pytest.mark.parametrize("subjects", [6, 12, 20])
def test_rates_of_normal_subjects_and_scenes_that_differ(subjects: int) -> None:
    """10,000 sets measure a rate of .05 to .002."""
    rates = simulated.ratings(random(), SETS, "normal", 0.1, subjects)
    assert rates["rejected"] == pytest.approx(0.05, abs=0.01)
    assert 0.03 < rates["false equivalence"] < 0.06


def test_very_skewed_subjects_are_found_as_often_as_by_student_t_of_their_means() -> None:
    """The limit that the documents state: Student's t is not corrected for skewness.

    The expected level is that of Student's t for the means of as many gamma-distributed subjects, whose noise is that
    of a mean of twelve depth effects.
    """
    table = simulated.effects_of(random(), SETS, 10, "skewness 4", 0.0)
    rate = simulated.rejected(simulated.student(*simulated.over_people(table)))
    means = simulated.drawn(np.random.default_rng(1), "skewness 4", simulated.NOISE[1], (50_000, 10))
    expected = simulated.rejected(stats.ttest_1samp(means, 0, axis=1).pvalue)
    standard_error = np.sqrt(expected * (1 - expected) * (1 / SETS + 1 / 50_000))
    assert rate == pytest.approx(expected, abs=3 * standard_error)
    assert expected > 0.1


@pytest.mark.slow
def test_incomplete_tables_hold_their_level_by_t() -> None:
    """400 sets measure .05 to .011."""
    tables = simulated.effects_of(random(), 400, 6)
    for table in tables:
        simulated.gaps(random(), table, "4 of 12 scenes each")
    assert np.mean([crossed_effect(table).p < 0.05 for table in tables]) < 0.1


@pytest.mark.parametrize("level", [0.0, simulated.RARE])
def test_false_positives_of_the_cube_with_six_subjects(level: float) -> None:
    """2000 sets measure a rate of .05 to .005."""
    assert 0.03 < simulated.cube(random(), 2000, level, 6)["rejected"] < 0.065


@pytest.mark.parametrize("scenes", ["same scenes", "new scenes"])
@pytest.mark.parametrize("studies", [3, 5, 8])
def test_pooled_data_sets_keep_the_level(scenes: str, studies: int) -> None:
    """4000 sets measure a rate of .05 to .0034; as if independent, the same scenes give .12 to .41."""
    assert simulated.pooled(random(), 4000, scenes, 0.1, studies)["rejected"] == pytest.approx(0.05, abs=0.015)


@pytest.mark.parametrize(("scale", "kind"), [("bipolar", "normal"), ("bipolar", "skewness 1.4"), ("choice", "normal")])
def test_rates_of_comparisons_over_scenes_that_differ(scale: str, kind: str) -> None:
    """2000 sets measure a rate of .05 to .005: over both it holds, for these scenes it does not hold for others."""
    rates = simulated.comparisons(random(), 2000, scale, kind, 0.5, 20)
    assert 0.01 < rates["rejected, subjects and scenes"] < 0.065
    assert rates["rejected, subjects"] > 0.075
    assert 0.93 < rates["coverage, subjects and scenes"] < 0.985


def test_choices_are_decided_by_a_t_test_over_subjects_without_correction() -> None:
    """Six subjects and six scenes: the test over scenes, which decided, found .215 of effects, this one .256."""
    (answers,) = simulated.answered(np.random.default_rng(1), 1, "choice", "normal", 0.5, 6, 1.0)
    found = compare_pictures(simulated.as_rows(answers, "choice"), "choice")
    assert (found.slopes[0].df, found.slopes[0].p_holm) == (5, None)
    assert "Satterthwaite" in found.answers.to("slope on aperture, subjects and scenes")["nearest"].method


def test_choices_find_an_effect_as_often_as_a_t_test_over_subjects() -> None:
    """Six subjects and six scenes: within a quarter of it over scenes, too."""
    rates = simulated.comparisons(random(), 2000, "choice", "normal", 0.0, 6)
    assert rates["power, subjects"] > 0.2
    assert rates["power, subjects and scenes"] > 0.75 * rates["power, subjects"]


def test_steps_find_what_scenes_differ_by() -> None:
    """Their standard deviation is 1.5: the variance that the error gains by them, times 6 scenes, is 2.25 on the mean.

    Of a single experiment it scatters as chi-squared of 5, by .63 of itself, and more by the answers' own noise; of the
    mean of twelve by about a quarter.
    """
    gained = []
    for seed in range(12):
        (answers,) = simulated.answered(np.random.default_rng(seed), 1, "steps", "normal", 1.5, 10, 0.0)
        found = ordinal_rating(simulated.as_rows(answers, "steps"), [])
        both, here = found.rises[0], found.these_scenes[0]
        assert both.estimate == here.estimate
        gained.append(6 * (both.standard_error**2 - here.standard_error**2))
    assert np.mean(gained) == pytest.approx(2.25, rel=0.6)


@pytest.mark.parametrize("kind", ["bipolar", "choice"])
def test_with_four_scenes_comparisons_hold_for_these_only(kind: str) -> None:
    (answers,) = simulated.answered(np.random.default_rng(1), 1, kind, "normal", 0.5, 8, 1.0)
    rows = simulated.as_rows(answers, kind)
    end = ", subjects and scenes" if kind == "choice" else ", these scenes"
    random = compare_pictures(rows, kind).answers.to("slope on aperture" + (end if kind == "choice" else ""))
    assert "Satterthwaite" in random["nearest"].method
    few = compare_pictures(rows[rows["scene"] < "s4"], kind)
    assert few.answers.to(f"slope on aperture{end}") == {"nearest": few.slopes[0]}
    largest = few.answers.to(f"largest aperture against identical pictures{end}")
    assert largest == {"nearest": replace(few.against_reference[0], p_holm=None)}
