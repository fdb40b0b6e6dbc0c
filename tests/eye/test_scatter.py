"""Scatter: published straylight, its transform against the integral, and what cones make of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from focalgradient.eye import Cones, Eye, Scatter


@pytest.mark.parametrize(("age", "log_s"), [(20, 0.87), (70, 1.24)])
def test_straylight_of_van_den_berg_et_al(age, log_s):
    """log10(theta^2 L / E) at 7 degrees, from 0.87 at 20 years by 1 + (age / 65)^4 (2007, Am. J. Ophth. 144, 358)."""
    found = float(np.log10(49 * Scatter(age, 0.5).veil(7.0)))
    assert found == pytest.approx(log_s, abs=0.08)


def test_stiles_and_holladay_between_3_and_30_degrees():
    """The classic 10 E / theta^2 is within a factor of 2 of young and old."""
    theta = np.array([3.0, 10.0, 30.0])
    for age in (25, 70):
        ratio = Scatter(age).veil(theta) * theta**2 / 10
        assert np.all((ratio > 0.5) & (ratio < 2))


def test_the_transform_is_the_hankel_integral():
    one = Scatter(50, 1.0)
    for cpd in (0.0, 0.05):
        weight = lambda t, f=cpd: float(one.veil(t)) * 2 * np.pi * np.sin(np.radians(t)) * j0(2 * np.pi * f * t)  # noqa: E731
        whole = sum(quad(weight, a, b, limit=400)[0] for a, b in ((0.1, 1), (1, 10), (10, 89.999))) * np.pi / 180
        assert 1 - one.share + whole == pytest.approx(float(one.transfer(np.degrees(cpd))), abs=2e-3)


def test_cones_lose_contrast_by_scatter():
    cones = Cones.of(Eye(0.003, 1.0), "luminance", wavelengths=3)
    old = replace(cones, scatter=Scatter(75))
    f = np.degrees([0.0, 5.0, 20.0])
    assert old.transfer(f, 1.0) == pytest.approx(cones.transfer(f, 1.0) * Scatter(75).transfer(f))
    assert old.transfer(0.0, 1.0) == pytest.approx(1.0)
    assert old.optical_transfer(f[1], 0.0, 1.0) == pytest.approx(old.transfer(f[1], 1.0))
