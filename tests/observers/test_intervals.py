"""Thresholds of observers who look at the pictures: the dip, the rule, the kept encodings, and a whole data set."""

import math
from dataclasses import replace

import numpy as np
import pytest

from focalgradient.dataset import read_dataset, validate
from focalgradient.design import BlurThresholdDesign
from focalgradient.observers import OBSERVERS, choose, encoded_levels, intervals, pictures, simulate
from focalgradient.observers.thresholds import seen_threshold

DEFAULT = replace(OBSERVERS["default"], lapses=0.0)


@pytest.fixture(scope="module")
def seen(stimuli, cache):
    """What is seen of one scene without a pedestal and upon one of half a dioptre."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(pictures.CACHE, str(cache))
        patch.setattr(intervals, "ENCODED", 6)
        designs = [BlurThresholdDesign(scenes=["spheres-01"], pedestal=pedestal) for pedestal in (0.0, 0.5)]
        return [(design, encoded_levels(design, stimuli)) for design in designs]


def threshold(one, observer=DEFAULT):
    levels, share = one.levels, one.right_shares(observer)
    return math.exp(np.interp(0.75, np.maximum.accumulate(share), np.log(levels)))


@pytest.mark.slow
def test_the_more_is_added_the_more_are_right_and_the_least_is_not_seen(seen):
    for _, levels in seen:
        share = levels["spheres-01"].right_shares(DEFAULT)
        assert (np.diff(share) > -0.02).all()
        assert share[0] == pytest.approx(0.5, abs=0.05)
        assert share[-1] > 0.98


@pytest.mark.slow
def test_thresholds_dip_upon_a_pedestal_and_rise_with_the_weber_fraction(seen):
    (_, none), (_, half) = seen
    assert threshold(half["spheres-01"]) < 0.8 * threshold(none["spheres-01"])
    keen = replace(DEFAULT, weber=0.2)
    for levels in (none, half):
        assert threshold(levels["spheres-01"], keen) < threshold(levels["spheres-01"])


@pytest.mark.slow
def test_answers_are_right_as_often_as_is_seen(seen):
    design, levels = seen[0]
    known = seen_threshold(design, DEFAULT, "01", 1, levels)
    given = [answer for seed in range(1, 9) for answer in choose(design, DEFAULT, "01", seed, seen=levels)]
    above = [one.correct for one in given if one.level > 3 * known]
    assert np.mean(above) > 0.9
    right = np.mean([one.correct for one in given])
    assert 0.6 < right < 0.95
    blind = [one.correct for one in choose(design, OBSERVERS["blur-blind"], "01", 1, seen=levels)]
    assert 0.3 < np.mean(blind) < 0.7


@pytest.mark.slow
def test_levels_are_kept_and_a_data_set_has_the_threshold_that_is_seen(seen, stimuli, cache, tmp_path, monkeypatch):
    design, levels = seen[0]
    monkeypatch.setenv(pictures.CACHE, str(cache))
    monkeypatch.setattr(intervals, "ENCODED", 6)
    monkeypatch.setattr(intervals, "_pair", lambda job: pytest.fail("encoded again"))
    again = encoded_levels(design, stimuli)
    assert np.array_equal(again["spheres-01"].added[3].blur, levels["spheres-01"].added[3].blur)
    assert simulate(design, tmp_path / "data", observers=1, seed=1, encoded=again, stimuli=stimuli.folder) == 1
    assert not validate(tmp_path / "data", stimuli.folder).problems
    (sidecar,) = read_dataset(tmp_path / "data").sidecars.values()
    assert sidecar["Participant"]["threshold"] == seen_threshold(design, OBSERVERS["default"], "01", 1, again)
