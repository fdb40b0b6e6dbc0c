"""Observers in whole experiments: what they write, on whatever it runs, and what the analysis makes of it."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, ttest_1samp

from focalgradient.dataset import Apparatus, Files, Session, bids_problems, read_dataset, validate
from focalgradient.design import NeckerDesign
from focalgradient.errors import InputError
from focalgradient.observers import OBSERVERS, cubes, looks, pictures, rate, simulate, watch
from focalgradient.parallel import processes, scheduler
from focalgradient.statistics import depth_rating

SMALL = NeckerDesign(trial_s=30.0, repetitions=1, catch_trials=1, practice_trials=2)
DEFAULT = OBSERVERS["default"]


@pytest.fixture(scope="module")
def cube():
    return cubes(SMALL)


def tables(root):
    return {path.name: path.read_text() for path in sorted(root.glob("sub-*/beh/*.tsv"))}


def ratings(design, observer, people, seen, seed=1):
    """What `people` observers answer, as a data frame."""
    rows = []
    for number in range(1, people + 1):
        answers = rate(design, observer, f"{number:02}", seed, seen)
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


def test_the_data_set_is_valid_and_says_that_it_is_simulated(design, stimuli, seen, cube, tmp_path):
    root = tmp_path / "data"
    assert simulate(design, root, observers=2, seed=3, seen=seen, stimuli=stimuli.folder) == 2
    assert simulate(SMALL, root, observers=2, seed=3, seen=cube) == 2
    found = validate(root, stimuli.folder)
    assert not found.problems
    assert found.sessions == 4
    assert not bids_problems(root)
    data = read_dataset(root)
    assert data.simulated
    assert json.loads((root / "dataset_description.json").read_text())["Simulated"] is True
    assert all(sidecar["Simulated"] for sidecar in data.sidecars.values())
    assert {sitting["Versions"]["simulated observer"] for s in data.sidecars.values() for sitting in s["Sittings"]} == {
        "default, seed 3"
    }


def test_answers_are_the_same_whoever_computes_them(design, stimuli, seen, cube, tmp_path):
    distributed = pytest.importorskip("distributed")
    written = {}
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
        processes(2) as pool,
        scheduler(cluster.scheduler_address) as dask,
    ):
        for name, executor in (("here", None), ("processes", pool), ("dask", dask)):
            how = {"observers": 3, "seed": 5, "executor": executor}
            simulate(design, tmp_path / name, seen=seen, stimuli=stimuli.folder, **how)
            simulate(SMALL, tmp_path / name, seen=cube, **how)
            written[name] = tables(tmp_path / name)
    assert len(written["here"]) == 6
    assert written["here"] == written["processes"] == written["dask"]


def test_another_seed_another_answer_and_more_observers_change_none(design, stimuli, seen, tmp_path):
    for name, observers, seed in (("a", 1, 1), ("b", 3, 1), ("c", 1, 2)):
        simulate(design, tmp_path / name, observers=observers, seed=seed, seen=seen, stimuli=stimuli.folder)
    assert simulate(design, tmp_path / "a", observers=3, seed=1, seen=seen, stimuli=stimuli.folder) == 2
    a, b, c = (tables(tmp_path / name) for name in "abc")
    assert a == b
    first = next(iter(c))
    assert a[first] != c[first]


def test_a_run_that_was_cut_off_goes_on_to_the_same_answers(design, stimuli, seen, tmp_path):
    how = {"observers": 2, "seed": 1, "seen": seen, "stimuli": stimuli.folder}
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
        (
            {"observer": "blind"},
            "is of observer default, seed 1, not of what is asked for .blind, seed 1.: give",
        ),
        ({"seed": 2}, "is of observer default, seed 1"),
        ({"observer": "ghost"}, "observer is 'ghost', but must be one of default, blind"),
        ({"design": {"answer": "typed"}}, "is of another design"),
    ],
)
def test_other_observers_do_not_mix(design, stimuli, seen, tmp_path, change, sentence):
    how = {"observers": 1, "seed": 1, "seen": seen, "stimuli": stimuli.folder}
    simulate(design, tmp_path / "data", **how)
    other = design.model_copy(update=change.pop("design", {}))
    with pytest.raises(InputError, match=sentence):
        simulate(other, tmp_path / "data", **(how | change))


def test_they_do_not_join_people(design, stimuli, seen, tmp_path):
    with Session.begin(tmp_path, design, "09", apparatus=Apparatus("s"), stimuli=stimuli.folder):
        pass
    with pytest.raises(InputError, match="a data set of people, which a simulated observer cannot join"):
        simulate(design, tmp_path, observers=1, seed=1, seen=seen, stimuli=stimuli.folder)


def test_looks_are_kept_and_taken_again(stimuli, seen, cache, monkeypatch):
    monkeypatch.setenv(pictures.CACHE, str(cache))
    monkeypatch.setattr(pictures, "_look", lambda job: pytest.fail("looked again"))
    again = looks(stimuli)
    assert again.keys() == seen.keys()
    assert all(np.array_equal(again[one][1].blur, seen[one][1].blur) for one in seen)


def test_pictures_with_more_blur_look_deeper_with_the_near_in_focus_only(design, seen):
    many = replace(DEFAULT, lapses=0.0)
    table = ratings(design, many, 12, seen)
    assert largest_over_pinhole(table, "nearest") > 1.2
    assert largest_over_pinhole(table, "farthest") == pytest.approx(1.0, abs=0.12)


def test_what_counts_is_in_the_picture_and_not_in_its_name(design, seen):
    """Shown the one picture under the other's name, an observer answers by the picture."""
    swap = {"nearest": "farthest", "farthest": "nearest"}
    swapped = {(scene, f, end): seen[scene, f, swap[end]] for scene, f, end in seen}
    sharp = {one: seen[one[0], "pinhole", one[2]] for one in seen}
    observer = replace(DEFAULT, lapses=0.0)
    other = ratings(design, observer, 12, swapped)
    assert largest_over_pinhole(other, "farthest") > 1.2
    assert largest_over_pinhole(other, "nearest") == pytest.approx(1.0, abs=0.12)
    for end in swap:
        assert largest_over_pinhole(ratings(design, observer, 12, sharp), end) == pytest.approx(1.0, abs=0.12)


def test_the_analysis_tells_observers_apart(design, seen):
    double = design.model_copy(update={"repetitions": 2})
    found = {}
    for name, observer in OBSERVERS.items():
        result = depth_rating(ratings(double, observer, 20, seen), equivalence_bound=1.2)
        near, far = result.fixations
        found[name] = [one.rise.significant and one.rise.estimate > 0 for one in (near, far)]
        found[name] += [one.equivalence.equivalent for one in (near, far)]
    rises, flat = [True, False], [False, True]
    assert found["default"] == [rises[0], flat[0], rises[1], flat[1]]
    assert found["lapsing"][:2] == [True, False]
    assert found["opposite"] == [False, True, True, False]
    assert found["blind"] == [False, False, True, True]
    assert found["guessing"][:2] == [False, False]


def test_for_the_blind_the_analysis_errs_as_often_as_it_says(design, seen):
    """Slopes of a blind observer differ from none at the 5 % level in about 5 % of experiments."""
    blind, experiments, found = OBSERVERS["blind"], 80, 0
    lean = design.model_copy(update={"catch_trials": 0, "practice_trials": 0})
    for seed in range(experiments):
        table = ratings(lean, blind, 6, seen, seed)
        table = table[table.fixation == "nearest"]
        slopes = [np.polyfit(own.aperture_mm, np.log(own.rating), 1)[0] for _, own in table.groupby("participant_id")]
        found += ttest_1samp(slopes, 0).pvalue < 0.05
    assert binom.ppf(0.001, experiments, 0.05) <= found <= binom.ppf(0.999, experiments, 0.05)


def share_rigid(observer, seen, gradient, people=8):
    """Share of time with the key for rigid held, of the ambiguous cube with this gradient at its greatest strength."""
    held = {"rigid": 0.0, "nonrigid": 0.0}
    for number in range(1, people + 1):
        label = f"{number:02}"
        keys = {key: percept for percept, key in SMALL.keys_of(label).items()}
        for trial, answer in zip(SMALL.trials(label), watch(SMALL, observer, label, 1, seen), strict=True):
            if trial.shape == "ambiguous" and trial.gradient == gradient and trial.strength in (0.0, 4.0):
                downs = [press for press in answer.presses if press.down]
                ends = [press.time for press in downs[1:]] + [answer.trial_duration]
                for press, end in zip(downs, ends, strict=True):
                    held[keys[press.key]] += end - press.time
    return held["rigid"] / sum(held.values())


def test_blur_tips_the_cube_as_the_prior_has_it(cube):
    shares = {
        name: [share_rigid(OBSERVERS[name], cube, gradient) for gradient in ("nonrigid", "none", "rigid")]
        for name in ("default", "blind", "opposite", "guessing")
    }
    against, without, along = shares["default"]
    assert 0.65 < without < 0.95  # mostly rigid
    assert against < without - 0.08 < along - 0.08
    assert against < 0.72
    assert np.ptp(shares["blind"]) < 0.08
    assert shares["opposite"][0] > shares["opposite"][2] + 0.08
    assert shares["guessing"] == pytest.approx([0.5] * 3, abs=0.08)


def test_a_shape_that_wobbles_is_seen_to(cube):
    held = 0.0
    for trial, answer in zip(SMALL.trials("01"), watch(SMALL, DEFAULT, "01", 1, cube), strict=True):
        if trial.shape == "nonrigid":
            first = next(press for press in answer.presses if press.down)
            held += SMALL.keys_of("01")["nonrigid"] == first.key
    assert held >= 1


def test_percepts_last_gamma_distributed_times(cube):
    """Mean and spread of the times are those asked for: of shape 3.5 the spread is 53 % of the mean."""
    long = SMALL.model_copy(update={"trial_s": 600.0, "catch_trials": 0, "practice_trials": 0})
    observer = replace(DEFAULT, lapses=0.0, guesses=True)
    times = []
    for label in ("01", "02"):
        person_times = []
        for answer in watch(long, observer, label, 2, cube):
            downs = [press.time for press in answer.presses if press.down]
            person_times += np.diff(downs).tolist()
        times.append(np.array(person_times) / np.mean(person_times))
    spread = float(np.std(np.concatenate(times)))
    assert spread == pytest.approx(3.5**-0.5, rel=0.08)
