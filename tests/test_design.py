"""Designs: every condition as often as asked, orders that are fair and the same everywhere, and what is refused."""

import hashlib
import json
from collections import Counter
from dataclasses import asdict
from itertools import groupby

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats

from focalgradient.design import DepthRatingDesign, NeckerDesign, Pinhole, check_design, design_text, load_design
from focalgradient.design.draws import Draws
from focalgradient.design.order import in_order
from focalgradient.errors import InputError

DEFAULTS = {"depth-rating": DepthRatingDesign(), "necker": NeckerDesign(), "pinhole": Pinhole()}

labels = st.text("0123456789abcXYZ", min_size=1, max_size=4)


def main(trials):
    return [trial for trial in trials if trial.phase == "main"]


def ordinary(trials):
    return [trial for trial in main(trials) if not trial.catch]


def fingerprint(trials) -> str:
    return hashlib.sha256(json.dumps([asdict(trial) for trial in trials]).encode()).hexdigest()[:16]


# What these lists are does not matter; that they never change does: a session that was cut off is resumed by its list.
GOLDEN = {
    ("depth-rating", "01", None): "135aaeb12c198dd9",
    ("depth-rating", "02", None): "8a0171b58611d10e",
    ("depth-rating", "ab3", None): "77b628d07a8a9ae0",
    ("depth-rating", "01", "2"): "957a7531df0e6059",
    ("necker", "01", None): "68527ac6ff126366",
    ("necker", "17", None): "8a8a79ac9de7c151",
    ("pinhole", "01", None): "2e5c128a5cc9e079",
}


@pytest.mark.parametrize(("name", "participant", "session"), GOLDEN)
def test_lists_are_the_same_on_every_machine(name, participant, session):
    trials = DEFAULTS[name].trials(participant, session)
    assert fingerprint(trials) == GOLDEN[name, participant, session]


@pytest.mark.parametrize("name", DEFAULTS)
def test_the_files_hold_the_defaults(name, tmp_path):
    text = design_text(name)
    (tmp_path / "mine.toml").write_text(text)
    assert load_design(tmp_path / "mine.toml") == DEFAULTS[name]
    elsewhere = ("catch_trials", "practice_trials", "factors", "also", "given_trials", "smallest_screen")
    settable = {key for key in type(DEFAULTS[name]).model_fields if key not in elsewhere}
    assert all(f"\n{key} = " in text for key in settable), "every setting can be found, and changed, in the file"


def test_the_experiments_of_the_paper_are_the_default():
    trials = ordinary(DepthRatingDesign().trials("01"))
    counts = Counter((trial.aperture, trial.fixation) for trial in trials)
    assert counts == {
        (aperture, fixation): 24
        for aperture in ("pinhole", "f/22", "f/11", "f/5.6")
        for fixation in ("nearest", "farthest")
    }
    assert {trial.aperture: round(trial.aperture_mm, 3) for trial in trials} == {
        "pinhole": 0.0,
        "f/22": 2.273,
        "f/11": 4.545,
        "f/5.6": 8.929,
    }
    cubes = ordinary(NeckerDesign().trials("01"))
    assert Counter(trial.gradient for trial in cubes) == {"none": 4, "rigid": 8, "nonrigid": 8}
    assert all(30 <= trial.trial_s <= 60 and trial.shape == "ambiguous" for trial in cubes)
    assert {(trial.gradient == "none") == (trial.strength == 0) for trial in cubes} == {True}
    assert {trial.viewing for trial in Pinhole().trials("01")} == {"pinhole", "natural", "tube"}


def longest_runs(trials) -> list[int]:
    return [
        max(len(list(run)) for _, run in groupby(column))
        for column in zip(*(trial.condition for trial in trials), strict=True)
    ]


@settings(max_examples=40, deadline=None)
@given(st.data(), labels, st.one_of(st.none(), labels))
def test_every_list_keeps_to_its_design(data, participant, session):
    design = DepthRatingDesign(
        seed=data.draw(st.integers(0, 10**12)),
        scenes=[f"s{number}" for number in range(data.draw(st.integers(2, 6)))],
        apertures=data.draw(st.sampled_from([["pinhole", "f/8"], ["pinhole", "f/22", "f/11", "f/5.6"]])),
        repetitions=data.draw(st.integers(1, 3)),
        longest_run=data.draw(st.integers(2, 4)),
        catch_trials=data.draw(st.integers(0, 3)),
        practice_trials=data.draw(st.integers(0, 12)),
        break_every=data.draw(st.integers(0, 9)),
        standard_every=data.draw(st.integers(0, 9)),
    )
    trials = design.trials(participant, session)
    shown = main(trials)
    assert [trial.trial for trial in shown] == list(range(1, len(shown) + 1))
    assert [trial.trial for trial in trials[: -len(shown)]] == list(range(1, design.practice_trials + 1))
    counts = Counter(trial.condition for trial in ordinary(trials))
    assert len(counts) == len(design.scenes) * len(design.apertures) * 2
    assert set(counts.values()) == {design.repetitions}
    assert Counter((trial.condition, trial.repetition) for trial in ordinary(trials)).most_common(1)[0][1] == 1
    # Every repetition is complete before the next begins.
    assert [trial.repetition for trial in ordinary(trials)] == sorted(trial.repetition for trial in ordinary(trials))
    assert max(longest_runs(ordinary(trials))) <= design.longest_run
    catches = [trial for trial in shown if trial.catch]
    assert len(catches) == design.catch_trials
    assert not shown[0].catch
    assert all(trial.aperture == "pinhole" for trial in catches)
    assert {trial.scene for trial in catches} <= {design.standard_scene, "example-flat", "example-deep"}
    every = design.break_every
    assert {trial.trial for trial in shown if trial.break_before} == (
        set(range(1 + every, len(shown) + 1, every)) if every else set()
    )
    assert shown[0].standard_before
    assert trials == design.trials(participant, session)


@pytest.mark.parametrize("design", DEFAULTS.values(), ids=DEFAULTS)
def test_each_trial_stands_in_the_middle_over_a_pair_of_participants(design):
    one, other = (ordinary(design.trials(label)) for label in ("07", "08"))
    assert [trial.condition for trial in one] == [trial.condition for trial in other][::-1]
    assert fingerprint(one) != fingerprint(ordinary(design.trials("05")))
    assert fingerprint(one) != fingerprint(ordinary(design.trials("07", "2")))


def test_keys_are_counterbalanced_and_apart_from_the_order():
    given_keys = Counter(tuple(NeckerDesign().keys_of(f"{number:02}").values()) for number in range(1, 41))
    assert given_keys == {("f", "j"): 20, ("j", "f"): 20}
    assert [NeckerDesign().keys_of(f"{number}")["rigid"] for number in (1, 2, 3, 4)] == ["f", "f", "j", "j"]
    named = Counter(NeckerDesign().keys_of(f"p{number}")["rigid"] for number in range(400))
    assert 160 < named["f"] < 240


@pytest.mark.parametrize("repetitions", [1, 2])
def test_a_choice_shows_the_picture_equally_often_first_and_second_in_each_condition(repetitions):
    design = DepthRatingDesign(scale="choice", repetitions=repetitions, apertures=["pinhole", "f/8", "f/4"])
    both = Counter()
    for label in ("01", "02"):
        trials = design.trials(label)
        cells = Counter((trial.aperture, trial.fixation, trial.interval) for trial in ordinary(trials))
        assert {*cells.values()} == {len(design.scenes) * repetitions // 2}
        both += Counter((*trial.condition, trial.interval) for trial in ordinary(trials))
        for phase, catch in (("practice", False), ("main", True)):
            shown = [trial.interval for trial in trials if (trial.phase, trial.catch) == (phase, catch)]
            assert sorted(shown) == [1, 1, 1, 2, 2, 2]
    assert {*both.values()} == {repetitions}


def test_blocked_fixations_come_one_after_the_other_in_turn_over_participants():
    design = DepthRatingDesign(fixation_order="blocked", repetitions=1, longest_run=3)
    first = {}
    for label in ("01", "02"):
        fixations = [trial.fixation for trial in ordinary(design.trials(label))]
        assert [len(list(run)) for _, run in groupby(fixations)] == [48, 48]
        first[label] = fixations[0]
    assert set(first.values()) == {"nearest", "farthest"}


def test_draws_are_fair():
    draws = Draws("fair", 1)
    assert stats.chisquare(np.bincount([draws.below(7) for _ in range(7000)])).pvalue > 0.001
    orders = Counter("".join(draws.shuffled("abcd")) for _ in range(4800))
    assert len(orders) == 24
    assert stats.chisquare(list(orders.values())).pvalue > 0.001
    starts = Counter(in_order(["aabb"], lambda item: [item], longest=2, draws=draws)[0] for _ in range(400))
    assert 150 < starts["a"] < 250


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(1, 6), min_size=2, max_size=4), st.integers(2, 4), st.integers(0, 999))
def test_an_order_is_found_wherever_there_is_one(counts, longest, seed):
    items = [level for level, count in enumerate(counts) for _ in range(count)]
    others = sum(counts) - max(counts)
    if max(counts) > longest * (others + 1):
        with pytest.raises(InputError, match=r"cannot be ordered .* raise longest_run"):
            in_order([items], lambda item: [item], longest=longest, draws=Draws(seed))
        return
    assume(max(counts) < longest * (others + 1))  # with no freedom at all, chance may not hit the one order
    order = in_order([items], lambda item: [item], longest=longest, draws=Draws(seed))
    assert Counter(order) == Counter(items)
    assert max(len(list(run)) for _, run in groupby(order)) <= longest


REFUSED = {
    "no task": ({}, r"task is missing: give one of 'depthrating', 'necker', 'pinhole'"),
    "misspelt": ({"task": "necker", "repetition": 2}, r"repetition is not a known key: did you mean repetitions\?"),
    "half a trial": ({"task": "necker", "catch_trials": 0.5}, r"catch_trials is 0\.5, but must be a whole number"),
    "more catches than trials": (
        {"task": "necker", "catch_trials": 20},
        r"catch_trials is 20, but must be less than the number of other trials, which is 20",
    ),
    "unknown level": ({"task": "necker", "gradients": ["soft"]}, r"gradients is 'soft', but must be a list of 'none'"),
    "no aperture": ({"task": "depthrating", "apertures": ["f22"]}, r"aperture is 'f22', but must be 'pinhole' or an"),
    "three keys": ({"task": "necker", "keys": ["f", "g", "h"]}, r"keys names 3, but must name two"),
    "impossible order": (
        {"task": "necker", "gradients": ["none", "rigid"], "strengths_mm": [1, 2, 3, 4, 5, 6, 7, 8], "longest_run": 2},
        r"32 trials have 'rigid' and only 4 another",
    ),
    "infinite": ({"task": "necker", "trial_s": float("inf")}, r"trial_s is inf, but must be a number of seconds"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_run_is_refused_in_one_sentence(name):
    data, sentence = REFUSED[name]
    with pytest.raises(InputError, match=sentence) as refused:
        check_design("mine.toml", data)
    assert str(refused.value).startswith("mine.toml: ")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("label", ["", "0 1", "01_a", "é", "../01", "0-1"])
def test_labels_that_cannot_be_file_names_are_refused(label):
    with pytest.raises(InputError, match=r"participant label is .* letters and digits only"):
        NeckerDesign().trials(label)
    with pytest.raises(InputError, match="session label is"):
        NeckerDesign().trials("01", label)
