"""Depth as a running estimate: its filter against closed forms, and simulated series against what is stated of them."""

import sys

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import Cones, Eye, Microfluctuations, Motion, Oscillation, Target, track
from focalgradient.eye.track import GRID, Tracker

STILL = Motion(drift=0.0, jumps=0.0)


def series(vergence, times, *, seed, course=None, bands=("L+M", "S"), noise=0.4, fixation=0.25):
    """Views of a target whose vergence is a function of time, its texture new at every fixation."""
    random = np.random.default_rng([seed, 99])
    course = course or Microfluctuations(rms=0.15, seed=seed)
    views, at = [], []
    for time in times:
        eye = Eye(0.004, 1.0).at(float(time), course)
        texture = 1000 * seed + int(time / fixation + 1e-9)
        cones = [Cones.of(eye, band) for band in bands]
        views += Target().views(cones, vergence(time), noise=noise, random=random, texture=texture)
        at += [time] * len(bands)
    return views, at


def test_motion_spreads_a_posterior_as_a_random_walk_does():
    motion = Motion(rest=2.0, spread=50.0, drift=0.3, jumps=0.0)
    posterior = np.exp(-((GRID - 3.0) ** 2) / (2 * 0.2**2))
    after = motion.after(posterior / posterior.sum(), GRID, 2.0)
    mean = after @ GRID
    assert mean == pytest.approx(3.0, abs=1e-3)
    assert after @ (GRID - mean) ** 2 == pytest.approx(0.2**2 + 0.3**2 * 2, rel=0.01)


def test_without_evidence_the_posterior_returns_to_what_is_expected():
    motion = Motion(rest=2.5, spread=0.8)
    posterior = np.zeros(GRID.size)
    posterior[150] = 1.0
    for _ in range(400):
        posterior = motion.after(posterior, GRID, 0.5)
    assert posterior == pytest.approx(motion.expected(GRID), abs=2e-3)
    jumped = Motion(drift=0.0, jumps=1.0).after(np.eye(GRID.size)[150], GRID, 0.7)
    assert jumped[150] == pytest.approx(np.exp(-0.7), abs=0.01)


@pytest.mark.parametrize("fixation", [0.1, 0.5, 10.0])
def test_without_evidence_a_target_drifts_as_long_as_time_passes(monkeypatch, fixation):
    """Two seconds of 0.3 D a root second, however they are cut into fixations."""
    monkeypatch.setattr(
        sys.modules[Tracker.__module__], "vergence_likelihood", lambda views, at, **_: np.zeros(at.size)
    )
    tracker = Tracker(0.1, motion=Motion(rest=3.0, spread=50.0, jumps=0.0))
    tracker.start(3.0, 0.2)
    for number in range(21):
        _, sd = tracker.update(0.1 * number, [], int(0.1 * number / fixation + 1e-9))
    assert sd**2 == pytest.approx(0.2**2 + 0.3**2 * 2, rel=0.02)


def test_a_target_where_none_was_expected_is_found():
    """Expected at 0 +- 0.1 D, which is 0 to rounding at 6 D, where it stands in full view."""
    cones = [Cones.of(Eye(0.004, 6.0), band) for band in ("L+M", "S")]
    views = Target().views(cones, 6.0, noise=0.01, random=np.random.default_rng(1))
    expected = Motion(rest=0.0, spread=0.1, drift=0.0, jumps=0.0)
    found = track(views, [0.0, 0.0], noise=0.01, correlation=0.95, motion=expected, wraps=True)
    assert found.vergence[0] == pytest.approx(6.0, abs=0.05)


@pytest.mark.slow
def test_error_falls_with_time_as_predicted():
    """A still target, every moment a new texture: the error falls by the root of the number of moments."""
    times = np.arange(0, 3, 0.25)
    found = []
    for seed in range(12):
        views, at = series(lambda _: 1.64, times, seed=seed, noise=1.0)
        found.append(track(views, at, noise=1.0, correlation=0.95, fixation=0.25, motion=STILL, wraps=True))
    error = np.array([one.vergence - 1.64 for one in found])
    sd = np.array([one.vergence_sd for one in found])
    rms = np.sqrt((error**2).mean(axis=0))
    # Information adds up: the sd after the first three moments predicts the rest's.
    predicted = np.sqrt((sd[:, 2] ** 2).mean()) * np.sqrt(3 / np.arange(1, 13))
    assert rms[8:].mean() == pytest.approx(predicted[8:].mean(), rel=0.5)  # 12 series: 20 % is one deviation
    assert sd[:, 11].mean() == pytest.approx(predicted[11], rel=0.25)
    assert np.mean(np.abs(error) < 2 * sd) >= 0.88


def test_a_moving_target_is_followed():
    """2.0 + 0.7 sin(2 pi 0.1 t) D by colour and time: as far off as stated, and less than a still estimate would be."""
    times = np.arange(0, 10, 0.25)
    where = lambda t: 2.0 + 0.7 * np.sin(2 * np.pi * 0.1 * t)  # noqa: E731
    views, at = series(where, times, seed=3)
    found = track(views, at, noise=0.4, correlation=0.95, fixation=0.25, wraps=True)
    error = found.vergence - where(found.times)
    assert np.sqrt(np.mean(error**2)) < 0.15
    assert np.mean(np.abs(error) < 2 * found.vergence_sd) >= 0.85


@pytest.mark.slow
def test_stated_errors_of_series_cover():
    """12 series of 10 s: within two stated standard deviations in 90 to 99 % of the moments."""
    times = np.arange(0, 10, 0.25)
    where = lambda t: 1.5 + 0.3 * np.sin(2 * np.pi * 0.1 * t)  # noqa: E731
    inside = []
    for seed in range(12):
        views, at = series(where, times, seed=seed)
        found = track(views, at, noise=0.4, correlation=0.95, fixation=0.25, wraps=True)
        inside.append(np.abs(found.vergence - where(found.times)) < 2 * found.vergence_sd)
    assert 0.90 <= np.mean(inside) <= 0.99


def test_moments_of_one_waveband_tell_the_side():
    """By one waveband alone, the views of a swinging focus within a fixation are compared with each other."""
    times = np.arange(0, 1, 0.125)
    for vergence in (0.5, 1.5):
        views, at = series(
            lambda _, v=vergence: v, times, seed=2, course=Oscillation(), bands=("L+M",), noise=0.1, fixation=0.5
        )
        found = track(views, at, noise=0.1, fixation=0.5, motion=STILL, wraps=True)
        assert found.vergence[-1] == pytest.approx(vergence, abs=0.1)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"times": [0.0]}, "views holds 2 and times 1"),
        ({"times": [1.0, 0.0]}, "none before the last"),
        ({"fixation": 0}, "fixation is 0"),
        ({"noise": -1.0}, "noise is -1"),
        ({"views": ["a", "b"]}, "views must hold View"),
    ],
)
def test_bad_input(change, sentence):
    views, at = series(lambda _: 1.0, [0.0], seed=1)
    settings = {"views": views, "times": at, "noise": 0.4} | change
    with pytest.raises(InputError, match=sentence):
        track(settings.pop("views"), settings.pop("times"), **settings)


def test_motion_out_of_range():
    for bad in ({"drift": -1}, {"spread": 0}, {"jumps": -1}, {"rest": np.nan}):
        with pytest.raises(InputError, match=f"{next(iter(bad))} is "):
            Motion(**bad)


def test_a_fixation_lasts_as_long_as_is_said(monkeypatch):
    """Moments 0.1 s apart from 0.2 s on, in fixations of 0.5 s: five in each, though 0.7 - 0.2 is less than 0.5."""
    seen = []

    def update(self, time, views, fixation):
        seen.append(fixation)
        return 1.0, 0.1

    monkeypatch.setattr(Tracker, "update", update)
    times = [round(0.2 + 0.1 * number, 1) for number in range(15)]
    views, _ = series(lambda _: 1.0, [0.0], seed=1, bands=("L+M",))
    track(views * 15, times, noise=0.4)
    assert seen == [0] * 5 + [1] * 5 + [2] * 5
