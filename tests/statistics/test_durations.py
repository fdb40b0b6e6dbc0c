"""Durations of percepts: fits to simulated ones, some cut off, and to published ones where they are at hand."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate, stats

from focalgradient.errors import InputError
from focalgradient.statistics.durations import fit_durations, fit_durations_of_people
from focalgradient.statistics.records import NotComputed

PEOPLE = Path(__file__).parents[2].parent / "shared" / "data" / "necker_people" / "passive.csv"


def simulated(seed, people=22, each=40, shape=1.8, mean=5.4, log_sd=0.5, end=15.0):
    random = np.random.default_rng(seed)
    who = np.repeat(np.arange(people), each)
    means = mean * np.exp(log_sd * random.standard_normal(people))[who]
    lasted = random.gamma(shape, means / shape)
    return np.minimum(lasted, end), lasted > end, who


@pytest.mark.slow
def test_what_was_simulated_is_recovered_within_its_standard_errors():
    """Over 12 sets, a seventh cut off, standard scores have about unit spread and no bias that shows; on the logs."""
    scores = []
    for seed in range(100, 112):
        fit = fit_durations_of_people(*simulated(seed))
        scores.append(
            (
                math.log(fit.geometric_mean / 5.4) / fit.geometric_mean_log_se,
                math.log(fit.shape / 1.8) * fit.shape / fit.shape_se,
                math.log(fit.log_sd / 0.5) * fit.log_sd / fit.log_sd_se,
            )
        )
    scores = np.array(scores)
    assert (np.abs(scores.mean(0)) < 3 / math.sqrt(12)).all()
    assert (scores.std(0) > 0.5).all()
    assert (scores.std(0) < 1.6).all()


def test_the_likelihood_is_that_of_the_integral_over_people():
    durations, censored, who = simulated(2, people=4, each=8)
    fit = fit_durations_of_people(durations, censored, who)
    total = 0.0
    for person in range(4):
        seen, cut = durations[(who == person) & ~censored], durations[(who == person) & censored]

        def joint(log_mean, seen=seen, cut=cut):
            one = stats.gamma(fit.shape, scale=math.exp(log_mean) / fit.shape)
            prior = stats.norm(math.log(fit.geometric_mean), fit.log_sd).pdf(log_mean)
            return math.exp(one.logpdf(seen).sum() + one.logsf(cut).sum()) * prior

        total += math.log(integrate.quad(joint, -1, 4, epsabs=0, epsrel=1e-9, limit=200)[0])
    assert fit.log_likelihood == pytest.approx(total, abs=1e-5)


def test_people_who_do_not_differ_have_the_mean_and_errors_of_one_distribution():
    """By the same gamma variates for each of 6 people, so that their means agree more than by chance."""
    quantiles = stats.gamma(2.0, scale=2.5).ppf((np.arange(15) + 0.5) / 15)
    durations, who = np.tile(quantiles, 6), np.repeat(np.arange(6), 15)
    fit = fit_durations_of_people(np.minimum(durations, 12.0), durations > 12.0, who)
    one = fit_durations(np.minimum(durations, 12.0), durations > 12.0, "gamma")
    assert (fit.log_sd, fit.log_sd_se) == (0.0, None)
    assert (fit.geometric_mean, fit.shape, fit.shape_se) == (one.mean, one.shape, one.shape_se)
    assert fit.geometric_mean_log_se == pytest.approx(1 / math.sqrt(90 * fit.shape), rel=0.1)
    assert fit.log_likelihood == pytest.approx(one.log_likelihood)


def test_standard_errors_of_one_person_are_those_of_the_information():
    """Of the gamma's mean: mean / sqrt(n shape), whatever the shape is."""
    random = np.random.default_rng(0)
    durations = random.gamma(2.0, 2.0, 400)
    fit = fit_durations(durations, np.zeros(400, bool), "gamma")
    assert fit.mean_se == pytest.approx(fit.mean / math.sqrt(400 * fit.shape), rel=1e-3)
    normal = fit_durations(np.exp(random.normal(1.0, 0.6, 400)), np.zeros(400, bool), "lognormal")
    assert normal.shape_se == pytest.approx(normal.shape / math.sqrt(800), rel=1e-3)


def test_who_has_seen_no_end_counts_and_is_said_to_have_no_fit_alone():
    durations, censored, who = simulated(3, people=6)
    fit = fit_durations_of_people([*durations, 15.0], [*censored, True], [*who, 99])
    assert fit.people[-1].participant_id == "99"
    assert isinstance(fit.people[-1].fit, NotComputed)


@pytest.mark.parametrize(
    ("durations", "who", "sentence"),
    [
        ([1.0, 2.0], [1], "differ in length"),
        ([1.0, 0.0], [1, 1], "not positive"),
        ([1.0, math.nan], [1, 1], "not positive"),
    ],
)
def test_wrong_durations_are_refused(durations, who, sentence):
    with pytest.raises(InputError, match=sentence):
        fit_durations_of_people(durations, [False] * 2, who)


@pytest.mark.skipif(not PEOPLE.exists(), reason="the published durations of people are not at hand")
def test_published_people_give_the_constants_of_the_simulated_observers():
    """22 people, a lattice, blocks of a minute: each percept lasts to the next report, the last is cut off."""
    blocks: dict[tuple[str, str], list[tuple[float, str]]] = {}
    with PEOPLE.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["display"] == "necker_lattice":
                blocks.setdefault((row["participant"], row["block"]), []).append((float(row["time_s"]), row["percept"]))
    lasted = [
        (end[0] - start[0], end[1] == "end of the block", who)
        for (who, _), reports in blocks.items()
        for start, end in zip(sorted(reports), sorted(reports)[1:], strict=False)
        if start[1] != "unclear" and end[0] - start[0] >= 0.3
    ]
    fit = fit_durations_of_people(*zip(*lasted, strict=True))
    assert len(fit.people) == 22
    assert fit.geometric_mean == pytest.approx(5.46, abs=0.01)
    assert fit.shape == pytest.approx(1.71, abs=0.01)
    assert fit.log_sd == pytest.approx(0.63, abs=0.01)


def test_too_many_censored_durations_have_no_maximum_whatever_the_rounding():
    lasted, cut = np.array([1.0, 1.001, 0.999, *[3.0] * 400]), np.array([False] * 3 + [True] * 400)
    kinds = {type(fit_durations(lasted * (1 + rounding), cut, "gamma")) for rounding in (0, 1e-15, -1e-14, 1e-13)}
    assert len(kinds) == 1
