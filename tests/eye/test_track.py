"""Depth as a running estimate: its filter against closed forms, and simulated series against what is stated of them."""

import sys

import numpy as np
import pytest

from focalgradient.eye import Cones, Eye, Microfluctuations, Motion, Oscillation, Target, track
from focalgradient.eye.track import Tracker

STILL = Motion(drift=0.0, jumps=0.0, speed=0.0)


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


def blind(monkeypatch):
    """Let views show nothing of the target's vergence."""
    module = sys.modules[Tracker.__module__]
    count = lambda transfers: len(transfers[0])  # noqa: E731
    monkeypatch.setattr(module, "likelihood_of_transfers", lambda views, transfers, **_: np.zeros(count(transfers)))
    monkeypatch.setattr(module, "ring_transfer", lambda view, at, **_: np.zeros((len(at), 1)))


def moved(motion, seconds, steps=1, count=200_000, velocity=None):
    """Samples that begin at 3 D with the stationary velocity, or the one given, after that many seconds."""
    random = np.random.default_rng(4)
    if velocity is None:
        velocity = motion.speed * random.standard_normal(count)
    state = np.full(count, 3.0), velocity
    for _ in range(steps):
        state = motion.after(*state, seconds / steps, random)
    return state


def test_motion_without_velocity_is_a_random_walk():
    vergence, velocity = moved(Motion(rest=3.0, spread=50.0, drift=0.3, speed=0.0), 2.0)
    assert vergence.mean() == pytest.approx(3.0, abs=3e-3)
    assert vergence.var() == pytest.approx(0.3**2 * 2, rel=0.02)
    assert not velocity.any()


@pytest.mark.parametrize("steps", [1, 8])
def test_motion_has_the_covariance_of_an_integrated_ornstein_uhlenbeck_process(steps):
    """Stationary velocity: mean square displacement 2 s^2 tau^2 (t/tau - 1 + exp(-t/tau)), however time is cut."""
    motion = Motion(rest=3.0, spread=100.0, drift=0.0, speed=0.8, persistence=0.4)
    vergence, velocity = moved(motion, 1.2, steps)
    share = 1.2 / 0.4
    assert vergence.var() == pytest.approx(2 * 0.8**2 * 0.4**2 * (share - 1 + np.exp(-share)), rel=0.02)
    assert velocity.std() == pytest.approx(0.8, rel=0.01)
    expected = 0.8**2 * 0.4 * (1 - np.exp(-share))  # cov of displacement and velocity at its end
    assert np.cov(vergence, velocity)[0, 1] == pytest.approx(expected, rel=0.03)


def test_without_evidence_the_posterior_returns_to_what_is_expected():
    motion = Motion(rest=2.5, spread=0.8)
    vergence, _ = moved(motion, 60.0, 600, count=20_000)
    assert vergence.mean() == pytest.approx(2.5, abs=0.03)
    assert vergence.std() == pytest.approx(0.8, rel=0.05)


@pytest.mark.parametrize("fixation", [0.1, 0.5, 10.0])
def test_without_evidence_a_target_drifts_as_long_as_time_passes(monkeypatch, fixation):
    """Two seconds of 0.3 D a root second, however they are cut into fixations."""
    blind(monkeypatch)
    motion = Motion(rest=3.0, spread=50.0, drift=0.3, jumps=0.0, speed=0.0)
    tracker = Tracker(0.1, motion=motion, samples=4000)
    tracker.start(3.0, 0.2)
    for number in range(21):
        _, sd = tracker.update(0.1 * number, [None], int(0.1 * number / fixation + 1e-9))
    assert sd**2 == pytest.approx(0.2**2 + 0.3**2 * 2, rel=0.05)


def test_jumps_are_as_frequent_as_expected(monkeypatch):
    """Where views show nothing, the share of the posterior that jumped is 1 - exp(-rate x time)."""
    blind(monkeypatch)
    motion = Motion(rest=6.0, spread=0.1, drift=0.0, jumps=0.5, speed=0.0)
    tracker = Tracker(0.1, motion=motion, samples=4000)
    tracker.update(0.0, [None], 0)
    tracker.start(1.0, 0.01)
    mean, _ = tracker.update(1.0, [None], 0)
    assert mean == pytest.approx(1.0 + 5.0 * (1 - np.exp(-0.5)), abs=0.05)


def test_a_target_where_none_was_expected_is_found():
    """Expected at 0 +- 0.1 D, which is 0 to rounding at 6 D, where it stands in full view."""
    cones = [Cones.of(Eye(0.004, 6.0), band) for band in ("L+M", "S")]
    views = Target().views(cones, 6.0, noise=0.01, random=np.random.default_rng(1))
    expected = Motion(rest=0.0, spread=0.1, drift=0.0, jumps=0.0, speed=0.0)
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


@pytest.mark.slow
def test_both_cues_are_no_worse_than_either_on_a_moving_target():
    """0.5 D at 0.5 Hz, with one texture for half a second: a still target within the fixation was off by .14 D."""
    times = np.arange(0, 3, 0.125)
    where = lambda t: 2.0 + 0.5 * np.sin(np.pi * t)  # noqa: E731
    rms, inside = {}, {}
    for name, bands, fixation in (
        ("both", ("L+M", "S"), 0.5),
        ("bands", ("L+M", "S"), 0.125),
        ("moments", ("L+M",), 0.5),
    ):
        views, at = series(where, times, seed=5, bands=bands, noise=0.2, fixation=fixation)
        correlation = 0.95 if len(bands) > 1 else 1.0
        found = track(views, at, noise=0.2, correlation=correlation, fixation=fixation, wraps=True)
        error = (found.vergence - where(found.times))[8:]
        rms[name] = np.sqrt(np.mean(error**2))
        inside[name] = np.mean(np.abs(error) < 2 * found.vergence_sd[8:])
    assert rms["both"] < 1.1 * min(rms.values())
    assert rms["both"] < 0.07
    assert inside["both"] >= 0.75  # of 16 moments


@pytest.mark.slow
def test_stated_errors_of_series_cover():
    """8 series of 8 s: within two stated standard deviations in 90 to 99 % of the moments."""
    times = np.arange(0, 8, 0.25)
    where = lambda t: 1.5 + 0.3 * np.sin(2 * np.pi * 0.1 * t)  # noqa: E731
    inside = []
    for seed in range(8):
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
