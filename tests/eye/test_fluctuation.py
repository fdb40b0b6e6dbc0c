"""Microfluctuations of accommodation: its power where it should be, and how much focus changes over a delay."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.signal import periodogram

from focalgradient.eye import Microfluctuations, Oscillation

SETTINGS = [
    Microfluctuations(),
    Microfluctuations(rms=0.5, high_share=0.5, beta=1.1, lowest=0.05),
    Microfluctuations(rms=0.3, high_share=0.3, beta=1.0),  # where the integral of the power law is a logarithm
]


def many(setting: Microfluctuations, times: np.ndarray, count: int = 400) -> np.ndarray:
    """Courses of `count` seeds at `times`."""
    fields = (setting.rms, setting.high_share, setting.beta, setting.lowest)
    return np.array([Microfluctuations(*fields, seed=seed).at(times) for seed in range(count)])


def test_change_over_a_delay_by_adaptive_quadrature() -> None:
    for setting in SETTINGS:
        for delay in (0.1, 0.25, 7.3):
            squares = [
                quad(lambda f: float(setting.spectrum(f)) * 4 * np.sin(np.pi * f * delay) ** 2, *band, limit=300)[0]  # noqa: B023
                for band in ((setting.lowest, 1.0), (1.0, 2.3))
            ]
            assert float(setting.change_rms(delay)) == pytest.approx(np.sqrt(sum(squares)), rel=1e-6)


@pytest.mark.parametrize("setting", SETTINGS)
def test_power_is_what_was_asked_for(setting: Microfluctuations) -> None:
    low = quad(setting.spectrum, setting.lowest, 1 - 1e-12, limit=200)[0]
    high = quad(setting.spectrum, 1 + 1e-12, 2.3)[0]
    assert low + high == pytest.approx(setting.rms**2)
    assert high == pytest.approx(setting.high_share * setting.rms**2, abs=1e-9)
    assert not setting.spectrum([0.0, 0.5 * setting.lowest, 2.4, 10.0]).any()
    assert setting.spectrum([1.0, 2.3]) == pytest.approx(setting.high_share * setting.rms**2 / 1.3)  # one band's alone
    assert many(setting, np.array([12.3])).std() == pytest.approx(setting.rms, rel=0.12)


def test_spectrum_of_the_courses() -> None:
    """Periodograms of 30 courses of 150 s: the low band as steep as asked for, up to the high one."""
    setting = Microfluctuations(rms=0.3, high_share=0.2, beta=1.3)
    courses = many(setting, np.arange(0, 150, 0.15), 30)
    f, power = periodogram(courses, fs=1 / 0.15, window="hann", axis=-1)
    power = power.mean(axis=0)
    within = (f > 0.06) & (f < 0.95)
    slope = np.polyfit(np.log(f[within]), np.log(power[within]), 1)[0]
    assert slope == pytest.approx(-1.3, abs=0.1)
    high = power[(f > 1.05) & (f < 2.25)].mean()
    assert high == pytest.approx(0.2 * 0.09 / 1.3, rel=0.15)


def test_a_course_is_a_function_of_time() -> None:
    """The same seed gives the same course, whichever moments are asked for; another seed, another."""
    fluctuation = Microfluctuations(seed=5)
    times = np.array([0.0, 0.3, 1.7, 900.0])
    assert fluctuation.at(times) == pytest.approx([float(fluctuation.at(time)) for time in times])
    assert np.abs(fluctuation.at(times) - Microfluctuations(seed=6).at(times)).max() > 0.01
    assert fluctuation.at(np.arange(5000) * 0.01)[4321] == pytest.approx(float(fluctuation.at(43.21)))


@given(st.floats(0, 1), st.floats(0.1, 10), st.floats(-10, 10), st.floats(0, 3))
def test_an_oscillation_changes_by_the_same_law(amplitude: float, frequency: float, phase: float, delay: float) -> None:
    """Over all phases; here over 64 of them."""
    phases = phase + 2 * np.pi * np.arange(64) / 64
    changes = [np.diff(Oscillation(amplitude, frequency, p).at([1.0, 1.0 + delay + 1e-9])) for p in phases]
    expected = float(Oscillation(amplitude, frequency).change_rms(delay))
    assert np.sqrt(np.mean(np.square(changes))) == pytest.approx(expected, abs=1e-6)


def low_and_high(setting: Microfluctuations) -> tuple[float, float]:
    """Power in D^2 below 0.6 Hz (without drift), and from 1.0 to 2.3 Hz."""
    low = quad(setting.spectrum, setting.lowest * (1 + 1e-12), 0.6, limit=200)[0]
    return low, quad(setting.spectrum, 1.0, 2.3)[0]


def test_pupil_light_and_effort() -> None:
    """What is published: below about 2 mm and at 0.002 cd/m^2 low frequencies grow, high ones stay; effort adds."""
    usual = low_and_high(Microfluctuations.of(0.005, 600.0, 2.0))
    by_pupil = [low_and_high(Microfluctuations.of(1e-3 * mm, 600.0, 2.0)) for mm in (4, 3, 2, 1, 0.5)]
    assert all(high == pytest.approx(usual[1]) for _, high in by_pupil)
    growth = [low / usual[0] for low, _ in by_pupil]
    assert growth == sorted(growth)
    assert growth[1] < 1.15  # Gray et al. 1993a, Day et al. 2009
    assert growth[3] > 1.5
    assert growth[4] > 4
    by_light = [low_and_high(Microfluctuations.of(0.005, light, 2.0)) for light in (6, 0.2, 0.002)]
    assert by_light[1][0] / usual[0] < 1.05  # Gray et al. 1993b, Day et al. 2009
    assert by_light[2][0] / usual[0] > 1.5
    assert all(high == pytest.approx(usual[1]) for _, high in by_light)
    rms = [Microfluctuations.of(0.005, 100.0, effort).rms for effort in (0, 2, 4)]
    assert rms == sorted(rms)
    assert 0.1 <= rms[0] < 0.12  # Charman & Heron 1988: 0.1 to 0.5 D
    assert 0.25 < rms[2] < 0.5


def test_drift_is_a_random_walks() -> None:
    """Over 400 courses: its own variance and spectrum, slow changes, and the other bands left as they are."""
    with_drift = [Microfluctuations(rms=0.1, drift=0.2, seed=seed) for seed in range(400)]
    times = np.array([0.0, 2.0, 8.0])
    apart = np.array([w.at(times) - Microfluctuations(rms=0.1, seed=w.seed).at(times) for w in with_drift])
    assert apart.std() == pytest.approx(0.2, rel=0.15)  # 400 courses: 3.5 % is one deviation
    change = np.sqrt(np.mean((apart[:, 1:] - apart[:, :1]) ** 2, axis=0))
    alone = Microfluctuations(rms=0.0, drift=0.2)
    assert change == pytest.approx(alone.change_rms([2.0, 8.0]), rel=0.12)
    assert alone.spectrum(0.016) / alone.spectrum(0.004) == pytest.approx(1 / 16)
    assert not alone.spectrum([0.003, 0.03, 2.0]).any()
