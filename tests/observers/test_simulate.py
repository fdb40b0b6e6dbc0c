"""Observers in whole experiments: what they write, on whatever it runs, and what the analysis makes of it."""

import json
import math
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, ttest_1samp

from focalgradient.dataset import Files, bids_problems, read_dataset, validate
from focalgradient.design import DepthRatingDesign, NeckerDesign
from focalgradient.errors import InputError
from focalgradient.observers import OBSERVERS, encoded_cubes, rate, simulate, watch
from focalgradient.observers.rotation import log_odds
from focalgradient.statistics import PerceptDurations, depth_rating, fit_dominance

SMALL = NeckerDesign(trial_s=30.0, repetitions=1, catch_trials=1, practice_trials=2)
DEFAULT = OBSERVERS["default"]


@pytest.fixture(scope="module")
def encoded_cube():
    return encoded_cubes(SMALL)


def tables(root):
    return {path.name: path.read_text() for path in sorted(root.glob("sub-*/beh/*.tsv"))}


def ratings(design, observer, people, encoded, seed=1):
    """What `people` observers answer, as a data frame."""
    rows = []
    for number in range(1, people + 1):
        answers = rate(design, observer, f"{number:02}", seed, encoded)
        for trial, answer in zip(design.trials(f"{number:02}"), answers, strict=True):
            if trial.phase == "main":
                names = ("trial", "scene", "aperture", "aperture_mm", "fixation", "catch")
                rows.append(
                    {name: getattr(trial, name) for name in names}
                    | {"participant_id": f"sub-{number:02}", "rating": answer.rating}
                )
    return pd.DataFrame(rows)


def largest_over_pinhole(table, fixation):
    own = table[table.fixation == fixation]
    means = np.log(own.rating).groupby(own.aperture_mm).mean()
    return float(np.exp(means.iloc[-1] - means.iloc[0]))


def test_the_data_set_is_valid_and_says_that_it_is_simulated(design, stimuli, encoded, encoded_cube, tmp_path):
    root = tmp_path / "data"
    assert simulate(design, root, observers=2, seed=3, encoded=encoded, stimuli=stimuli.folder) == 2
    assert simulate(SMALL, root, observers=2, seed=3, encoded=encoded_cube) == 2
    found = validate(root, stimuli.folder)
    assert not found.problems
    assert found.sessions == 4
    assert not bids_problems(root)
    data = read_dataset(root)
    assert data.simulated
    assert json.loads((root / "dataset_description.json").read_text())["Simulated"] is True
    assert all(sidecar["Simulated"] for sidecar in data.sidecars.values())
    assert {sitting["Versions"]["simulated observer"] for s in data.sidecars.values() for sitting in s["Sittings"]} == {
        "default, seed 3, model 5"
    }


def test_another_seed_another_answer_and_more_observers_change_none(design, stimuli, encoded, tmp_path):
    for name, observers, seed in (("a", 1, 1), ("b", 3, 1), ("c", 1, 2)):
        simulate(design, tmp_path / name, observers=observers, seed=seed, encoded=encoded, stimuli=stimuli.folder)
    assert simulate(design, tmp_path / "a", observers=3, seed=1, encoded=encoded, stimuli=stimuli.folder) == 2
    a, b, c = (tables(tmp_path / name) for name in "abc")
    assert a == b
    first = next(iter(c))
    assert a[first] != c[first]


def test_a_run_that_was_cut_off_goes_on_to_the_same_answers(design, stimuli, encoded, tmp_path):
    how = {"observers": 2, "seed": 1, "encoded": encoded, "stimuli": stimuli.folder}
    simulate(design, tmp_path / "whole", **how)
    shutil.copytree(tmp_path / "whole", tmp_path / "cut")
    files = Files(tmp_path / "cut", design.task, "02")
    lines = files.journal.read_bytes().splitlines(keepends=True)
    files.journal.write_bytes(b"".join(lines[:5]) + lines[5][:20])
    files.table.unlink()
    assert simulate(design, tmp_path / "cut", **how) == 1
    assert not validate(tmp_path / "cut").problems
    whole, cut = (read_dataset(tmp_path / name).depth_rating for name in ("whole", "cut"))
    assert set(cut["sitting"]) == {1, 2}
    pd.testing.assert_frame_equal(
        whole.drop(columns="sitting").reset_index(drop=True), cut.drop(columns="sitting").reset_index(drop=True)
    )


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"observer": "blur-blind"}, "is of observer default, seed 1, model 5, not of the simulated one .blur-blind"),
        ({"seed": 2}, "is of observer default, seed 1"),
        ({"observer": "ghost"}, "observer is 'ghost', but must be one of default, blur-blind"),
        ({"design": {"answer": "typed"}}, "is of another design"),
    ],
)
def test_other_observers_do_not_mix(design, stimuli, encoded, tmp_path, change, sentence):
    how = {"observers": 1, "seed": 1, "encoded": encoded, "stimuli": stimuli.folder}
    simulate(design, tmp_path / "data", **how)
    other = design.model_copy(update=change.pop("design", {}))
    with pytest.raises(InputError, match=sentence):
        simulate(other, tmp_path / "data", **(how | change))


def test_what_counts_is_in_the_picture_and_not_in_its_name(design, encoded):
    """Shown the one picture under the other's name, an observer answers by the picture."""
    swap = {"nearest": "farthest", "farthest": "nearest"}
    swapped = {(scene, f, end): encoded[scene, f, swap[end]] for scene, f, end in encoded}
    sharp = {one: encoded[one[0], "pinhole", one[2]] for one in encoded}
    observer = replace(DEFAULT, lapses=0.0)
    other = ratings(design, observer, 12, swapped)
    assert largest_over_pinhole(other, "farthest") > 1.2
    assert largest_over_pinhole(other, "nearest") == pytest.approx(1.0, abs=0.12)
    for end in swap:
        assert largest_over_pinhole(ratings(design, observer, 12, sharp), end) == pytest.approx(1.0, abs=0.12)


def test_the_analysis_tells_observers_apart(design, encoded):
    double = design.model_copy(update={"repetitions": 2})
    found = {}
    for name in ("default", "opposite", "blur-blind", "guessing"):
        result = depth_rating(ratings(double, OBSERVERS[name], 20, encoded), equivalence_bound=1.2)
        near, far = result.fixations
        found[name] = [one.rise.significant and one.rise.estimate > 0 for one in (near, far)]
        found[name] += [one.equivalence.equivalent for one in (near, far)]
    rises, flat = [True, False], [False, True]
    assert found["default"] == [rises[0], flat[0], rises[1], flat[1]]
    assert found["opposite"] == [False, True, True, False]
    assert found["blur-blind"] == [False, False, True, True]
    assert found["guessing"][:2] == [False, False]


@pytest.mark.slow
def test_lapses_weaken_the_rise_and_do_not_end_it(design, encoded):
    """Of one experiment chance decides; of four together it does not."""
    double = design.model_copy(update={"repetitions": 2})
    rises = {
        name: np.mean(
            [largest_over_pinhole(ratings(double, OBSERVERS[name], 20, encoded, seed), "nearest") for seed in range(4)]
        )
        for name in ("default", "lapsing")
    }
    assert 1.1 < rises["lapsing"] < rises["default"]


@pytest.mark.slow
def test_for_the_blind_the_analysis_errs_as_often_as_it_says(design, encoded):
    """Slopes of a blind observer differ from none at the 5 % level in about 5 % of experiments."""
    blind, experiments, found = OBSERVERS["blur-blind"], 80, 0
    lean = design.model_copy(update={"catch_trials": 0, "practice_trials": 0})
    for seed in range(experiments):
        table = ratings(lean, blind, 6, encoded, seed)
        table = table[table.fixation == "nearest"]
        slopes = [np.polyfit(own.aperture_mm, np.log(own.rating), 1)[0] for _, own in table.groupby("participant_id")]
        found += ttest_1samp(slopes, 0).pvalue < 0.05
    assert binom.ppf(0.001, experiments, 0.05) <= found <= binom.ppf(0.999, experiments, 0.05)


def share_rigid(observer, encoded, gradient, people=8):
    """Share of time with the key for rigid held, of the ambiguous cube with this gradient at its greatest strength."""
    held = {"rigid": 0.0, "nonrigid": 0.0}
    for number in range(1, people + 1):
        label = f"{number:02}"
        keys = {key: percept for percept, key in SMALL.keys_of(label).items()}
        for trial, answer in zip(SMALL.trials(label), watch(SMALL, observer, label, 1, encoded), strict=True):
            if trial.shape == "ambiguous" and trial.gradient == gradient and trial.strength in (0.0, 4.0):
                downs = [press for press in answer.presses if press.down]
                ends = [press.time for press in downs[1:]] + [answer.trial_duration]
                for press, end in zip(downs, ends, strict=True):
                    held[keys[press.key]] += end - press.time
    return held["rigid"] / sum(held.values())


def test_blur_tips_the_cube_as_the_prior_has_it(encoded_cube):
    shares = {
        name: [share_rigid(OBSERVERS[name], encoded_cube, gradient) for gradient in ("nonrigid", "none", "rigid")]
        for name in ("default", "blur-blind", "opposite", "guessing")
    }
    against, without, along = shares["default"]
    assert 0.65 < without < 0.95  # mostly rigid
    assert against < without - 0.08 < along - 0.08
    assert against < 0.72
    assert np.ptp(shares["blur-blind"]) < 0.12  # chance: few percepts of long and irregular durations
    assert shares["opposite"][0] > shares["opposite"][2] + 0.08
    assert shares["guessing"] == pytest.approx([0.5] * 3, abs=0.08)


@pytest.mark.slow
def test_percepts_last_as_those_of_the_people_that_they_were_fitted_to(encoded_cube):
    """Fitted as the people were: 22 observers, 15 trials of 60 s; the shortest percepts cut a little off the tail."""
    long = SMALL.model_copy(update={"trial_s": 60.0, "catch_trials": 0, "practice_trials": 0, "repetitions": 3})
    observer = replace(DEFAULT, lapses=0.0, guesses=True)
    lasted, censored, who, first = [], [], [], []
    for number in range(1, 23):
        for answer in watch(long, observer, f"{number:02}", 2, encoded_cube):
            downs = [press.time for press in answer.presses if press.down]
            lasted += np.diff([*downs, answer.trial_duration]).tolist()
            censored += [False] * (len(downs) - 1) + [True] * bool(downs)
            who += [number] * len(downs)
            first += [True] * bool(downs) + [False] * (len(downs) - 1)
    ones = np.ones(len(who))
    fit = fit_dominance(PerceptDurations(lasted, censored, who, 0.5 * ones, ones, first))
    errors = fit.standard_errors
    assert fit.spread == pytest.approx(0.77, rel=3 * errors["spread"] + 0.03)
    assert math.log(fit.median) == pytest.approx(math.log(3.82), abs=3 * errors["median"])
    assert math.log(fit.median_log_sd) == pytest.approx(math.log(0.54), abs=3 * errors["median_log_sd"])


def test_the_default_gradient_makes_nonrigid_almost_as_frequent(encoded_cube):
    """The paper's finding: at 2 mm, by the derived likelihood and no constant fitted to it."""
    trial = next(one for one in SMALL.trials("01") if (one.gradient, one.strength) == ("nonrigid", 2.0))
    assert 0.4 < 1 / (1 + math.exp(log_odds(SMALL, trial, encoded_cube, DEFAULT))) < 0.5


def test_ordinal_ratings_are_whole_categories_in_the_order_of_the_ratios(design, encoded):
    observer = replace(OBSERVERS["ordinal"], lapses=0.0)
    stepped = DepthRatingDesign.model_validate(design.model_dump() | {"scale": "steps", "steps": observer.categories})
    # Their catch trials differ: of the standard no step is right.
    lists = zip(design.trials("01"), stepped.trials("01"), strict=True)
    same = [one.condition == other.condition for one, other in lists]
    assert sum(same) > len(same) / 2
    ratio = np.array([one.rating for one in rate(design, observer, "01", 1, encoded)])[same]
    steps = np.array([one.rating for one in rate(stepped, observer, "01", 1, encoded)])[same]
    assert set(steps) <= set(range(1, 8))
    assert len(set(steps)) > 2
    order = np.argsort(ratio)
    assert (np.diff(steps[order]) >= 0).all()
