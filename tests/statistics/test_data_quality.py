"""Exclusions: by rule, counted, and never of the data themselves."""

import numpy as np
import pandas as pd
import pytest

from focalgradient import InputError
from focalgradient.statistics import Rules, quality

APERTURES = {"pinhole": 0.0, "f/22": 2.0, "f/11": 4.0, "f/5.6": 8.0}


def ratings(spread: dict[str, float], catch: dict[str, float] | None = None) -> pd.DataFrame:
    """Ratings of subjects with a log spread each, and catch trials answered as stated."""
    rng = np.random.default_rng(1)
    rows = []
    for name, sd in spread.items():
        rows += [
            (name, fixation, aperture, mm, "room", np.exp(rng.normal(0, sd)), False)
            for fixation in ("nearest", "farthest")
            for aperture, mm in APERTURES.items()
            for _ in range(6)
        ]
        rows += [(name, "nearest", "pinhole", 0.0, "room", (catch or {}).get(name, 1.0), True)] * 4
    names = ["participant_id", "fixation", "aperture", "aperture_mm", "scene", "rating", "catch"]
    table = pd.DataFrame(rows, columns=names)
    return table.assign(trial=table.groupby("participant_id").cumcount(), response_time=1.5, dropped_frames=0)


def test_good_data_are_kept_whole() -> None:
    table = ratings({"01": 0.1, "02": 0.2})
    before = table.copy(deep=True)
    kept, found = quality(table)
    pd.testing.assert_frame_equal(table, before)
    pd.testing.assert_frame_equal(kept, before)
    assert found.exclusions == ()
    assert (found.subjects_before, found.subjects_after, found.trials_before, found.trials_after) == (2, 2, 96, 96)
    assert [each.catch_passed for each in found.subjects] == [1.0, 1.0]
    assert [each.repeat_factor for each in found.subjects] == pytest.approx(np.exp([0.1, 0.2]), rel=0.15)
    assert [each.lapses for each in found.subjects] == [0, 0]


def test_those_who_guess_lapse_or_fail_the_standard_are_left_out() -> None:
    table = ratings({"fails": 0.1, "good": 0.1, "guesses": 1.0, "lapses": 0.1}, {"fails": 2.5})
    lapse = (table["participant_id"] == "lapses") & ~table["catch"] & (table["trial"] % 3 == 0)
    table["rating"] = table["rating"].mask(lapse, 4.0)
    kept, found = quality(table)
    assert set(kept["participant_id"]) == {"good"}
    assert (found.subjects_before, found.subjects_after, found.trials_after) == (4, 1, 48)
    rules = {name: [e.rule for e in found.exclusions if e.participant_id == name] for name in table["participant_id"]}
    assert rules["fails"] == ["passed less than 70% of the catch trials"]
    assert rules["guesses"][0] == "answers to one picture spread by more than a factor 2"
    assert "more than 20% lapses" in rules["lapses"]
    assert all(each.whole_subject and each.trials == 48 for each in found.exclusions)


def test_single_trials() -> None:
    table = ratings({"01": 0.1, "02": 0.1})
    table.loc[[0, 1], "response_time"] = [0.1, 100.0]
    table.loc[[2, 3], "dropped_frames"] = [1, 7]
    kept, found = quality(table, Rules(dropped_frames=3))
    assert set(table.index) - set(kept.index) == {0, 1, 3}
    assert (found.trials_before, found.trials_after, found.subjects_after) == (96, 93, 2)
    assert {each.rule: each.trials for each in found.exclusions} == {
        "answered in less than 0.3 s": 1,
        "answered in more than 60 s": 1,
        "more than 3 dropped frames": 1,
    }
    first = found.subjects[0]
    assert (first.too_fast, first.too_slow, first.dropped) == (1, 1, 2)
    assert len(quality(table, Rules(response_time=None))[0]) == len(table)


def test_a_limit_itself_is_kept() -> None:
    """Rules say "less than" and "more than": what lies at a limit stays."""
    table = ratings({"01": 0.1, "02": 0.1})
    passes = table["catch"] & (table["participant_id"] == "01") & (table["trial"] % 2 == 0)
    table.loc[table["catch"] & (table["participant_id"] == "01"), "rating"] = 2.5
    table.loc[passes, "rating"] = 1.0  # two of four
    assert quality(table, Rules(catch_passed=0.5))[1].exclusions == ()
    assert quality(table, Rules(catch_passed=0.51))[1].exclusions[0].participant_id == "01"
    table = ratings({"01": 0.1, "02": 0.1})
    table.loc[[0, 1, 2], "response_time"] = [0.3, 60.0, 60.001]
    table.loc[[3, 4], "dropped_frames"] = [3, 4]
    kept, _ = quality(table, Rules(dropped_frames=3))
    assert set(table.index) - set(kept.index) == {2, 4}


def test_lapses_are_judged_from_three_answers_of_a_condition_on() -> None:
    for count, judged in ((2, False), (3, True)):
        table = ratings({"01": 0.1, "02": 0.1})
        table = table[table["catch"] | (table.groupby(["participant_id", "fixation", "aperture"]).cumcount() < count)]
        assert [each.lapses is not None for each in quality(table)[1].subjects] == [judged, judged]


def test_the_cube() -> None:
    row = {"gradient": "none", "strength": 0.0, "censored": False, "trial_duration": 10.0}
    reported = {
        "good": {"plain": [("rigid", 7.0), ("nonrigid", 3.0)], "catch": [("rigid", 2.0), ("nonrigid", 8.0)]},
        "blind": {"plain": [("rigid", 9.0), ("nonrigid", 1.0)], "catch": [("rigid", 9.0), ("nonrigid", 1.0)]},
        "silent": {"plain": [("rigid", 4.0), ("none", 6.0)], "catch": [("nonrigid", 10.0)]},
    }
    rows = []
    for name, trials in reported.items():
        for trial, seen in trials.items():
            onset = 0.0
            for percept, lasts in seen:
                about = {"participant_id": name, "trial": trial, "catch": trial == "catch", "onset": onset}
                rows.append({**row, **about, "duration": lasts, "percept": percept})
                onset += lasts
    kept, found = quality(pd.DataFrame(rows))
    assert set(kept["participant_id"]) == {"good"}
    assert {each.participant_id: each.rule for each in found.exclusions} == {
        "blind": "passed less than 70% of the catch trials",
        "silent": "more than 20% lapses",
    }
    assert (found.trials_before, found.trials_after) == (3, 1)
    assert [each.lapses for each in found.subjects] == pytest.approx([0, 0, 0.6])


def test_bad_rules_and_tables() -> None:
    for bad, sentence in (
        ({"response_time": (3.0, 1.0)}, "a shortest and a longest time"),
        ({"catch_passed": 70}, "catch_passed is 70, but must be from 0 to 1"),
        ({"repeat_factor": 0.5}, "repeat_factor is 0.5, but must be a factor above 1"),
        ({"dropped_frames": -1}, "dropped_frames is -1"),
    ):
        with pytest.raises(InputError, match=sentence):
            Rules(**bad)
    with pytest.raises(InputError, match="neither a column rating nor a column percept"):
        quality(pd.DataFrame({"participant_id": ["01"]}))
