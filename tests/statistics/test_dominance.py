"""The log-normal model of percept durations over people: analytic limits, recovery, held-out people."""

import csv
import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from focalgradient.errors import InputError
from focalgradient.statistics import (
    DominanceModel,
    NotComputed,
    PerceptDurations,
    fit_dominance,
    fit_durations_of_people,
    log_likelihood_of_people,
)

PEOPLE = Path(__file__).parents[3] / "shared" / "data" / "necker_people" / "passive.csv"

TRUE = DominanceModel(5.0, 0.5, 0.75, 0.2, -0.3, 0.25, 1.3, -0.25, 0.25)


def simulated(model, people, seed, trials=5, trial_s=60.0):
    rng = np.random.default_rng(seed)
    rows = []
    for person in range(people):
        log_median = math.log(model.median) + model.median_log_sd * rng.standard_normal()
        spread = model.spread * math.exp(model.spread_log_sd * rng.standard_normal())
        preference = model.preference + model.preference_sd * rng.standard_normal()
        for trial in range(1, trials + 1):
            now, residual, first, reading = 0.0, 0.0, True, rng.choice([-0.5, 0.5])
            while now < trial_s:
                residual = model.serial * residual * (not first) + spread * rng.standard_normal()
                mean = log_median + preference * reading + math.log(model.first_ratio) * first
                lasts = math.exp(mean + model.drift * math.log(trial) + residual)
                cut = now + lasts > trial_s
                rows.append((min(lasts, trial_s - now), cut, person, reading, trial, first))
                now, first, reading = now + lasts, False, -reading
    return PerceptDurations(*(np.array(column) for column in zip(*rows, strict=True)))


def test_without_differences_the_likelihood_is_the_log_normal_density_and_survival():
    model = DominanceModel(4.0, 0.0, 0.8, 0.0)
    data = PerceptDurations(
        [2.0, 5.0, 9.0, 3.0], [0, 0, 1, 0], [1, 1, 1, 2], [0.5, -0.5, 0.5, 0.5], [1] * 4, [1, 0, 0, 1]
    )
    law = stats.lognorm(s=0.8, scale=4.0)
    expected = {"1": law.logpdf([2.0, 5.0]).sum() + law.logsf(9.0), "2": law.logpdf(3.0)}
    assert log_likelihood_of_people(model, data) == pytest.approx(expected, abs=1e-9)


def test_one_percept_a_person_has_the_variance_of_both_levels():
    model = DominanceModel(4.0, 0.6, 0.8, 0.0)
    data = PerceptDurations([7.0], [0], ["a"], [0.5], [1], [1])
    expected = stats.lognorm(s=1.0, scale=4.0).logpdf(7.0)
    assert log_likelihood_of_people(model, data)["a"] == pytest.approx(expected, abs=1e-6)


def test_parameters_are_recovered_within_their_standard_errors():
    fit = fit_dominance(simulated(TRUE, 30, seed=3))
    logarithmic = ("median", "median_log_sd", "spread", "spread_log_sd", "preference_sd", "first_ratio")
    for name in fit.standard_errors:
        estimate, true = getattr(fit, name), getattr(TRUE, name)
        if name in logarithmic:
            estimate, true = math.log(estimate), math.log(true)
        assert estimate == pytest.approx(true, abs=3 * fit.standard_errors[name]), name
    assert len(fit.standard_errors) == 9


def test_a_preference_is_not_fitted_where_one_reading_was_seen():
    data = simulated(replace(TRUE, preference=0.0, preference_sd=0.0), 8, seed=1, trials=2)
    fit = fit_dominance(replace(data, reading=np.full(len(data.seconds), 0.5)))
    assert {"median", "spread"} <= {*fit.standard_errors}
    assert not {"preference", "preference_sd"} & {*fit.standard_errors}


def test_the_true_model_predicts_new_people_better_than_one_without_serial_correlation():
    fresh = simulated(TRUE, 20, seed=4)
    without = replace(TRUE, serial=0.0)
    gain = sum(log_likelihood_of_people(TRUE, fresh).values()) - sum(log_likelihood_of_people(without, fresh).values())
    assert gain > 0


def test_what_cannot_be_fitted_says_why_and_wrong_data_are_refused():
    few = simulated(TRUE, 2, seed=1)
    assert fit_dominance(few) == NotComputed("How people differ needs 3 of them, and there are 2.")
    assert isinstance(fit_dominance(simulated(TRUE, 3, seed=1)), DominanceModel)
    with pytest.raises(InputError, match="differ in length"):
        PerceptDurations([1.0], [0, 0], [1], [0.5], [1], [1])
    with pytest.raises(InputError, match="positive"):
        PerceptDurations([-1.0], [0], [1], [0.5], [1], [1])


def people():
    rows = {}
    with PEOPLE.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["display"] == "necker_lattice":
                rows.setdefault((row["participant"], int(row["block"])), []).append(
                    (float(row["time_s"]), row["percept"])
                )
    found = []
    for (who, block), reports in rows.items():
        first = True
        for (start, percept), (end, then) in itertools.pairwise(reports):
            if percept != "unclear" and end - start >= 0.3:
                cut = then == "end of the block"
                found.append((end - start, cut, who, 0.5 if percept == "left" else -0.5, block // 3, first))
                first = False
    return [np.array(column) for column in zip(*found, strict=True)]


@pytest.mark.slow
@pytest.mark.skipif(not PEOPLE.exists(), reason="the published durations of people are not at hand")
def test_held_out_people_are_predicted_better_than_by_the_gamma_model():
    """People in six groups, each predicted by the others; the gamma model of one shape is fitted to all of them."""
    columns = people()
    who = np.unique(columns[2])
    total = 0.0
    for held_out in np.array_split(np.random.default_rng(0).permutation(who), 6):
        out = np.isin(columns[2], held_out)
        fit = fit_dominance(PerceptDurations(*(column[~out] for column in columns)))
        total += sum(log_likelihood_of_people(fit, PerceptDurations(*(column[out] for column in columns))).values())
    gamma = fit_durations_of_people(columns[0], columns[1], columns[2])
    assert total > gamma.log_likelihood + 100
