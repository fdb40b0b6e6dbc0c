"""Quanta that cones catch, against numbers from radiometry that use none of its code."""

import numpy as np
import pytest

from focalgradient.eye import Eye, Oscillation, Photons, accommodation_views

MINUTE = np.radians(1 / 60)


def test_a_troland_is_some_1240000_quanta_of_green_light() -> None:
    """Of 555 nm, per second and square degree at the eye: 1 / 683 W a lumen, 3.58e-19 J a quantum."""
    trolands = 100 * np.pi / 4 * 4**2
    caught = Photons(100.0, integration_time=1.0, efficiency=1.0).caught("L+M", 0.004, np.radians(1))
    # L and M cones together catch a broader band than luminance weighs: a little more.
    assert 0.8 < caught / (1.24e6 * trolands) < 1.3


def test_it_grows_with_light_and_area_and_time() -> None:
    base = Photons(100.0).caught("S", 0.004, MINUTE)
    assert Photons(200.0).caught("S", 0.004, MINUTE) == pytest.approx(2 * base)
    assert Photons(100.0, integration_time=0.1).caught("S", 0.004, MINUTE) == pytest.approx(base / 2)
    assert Photons(100.0).caught("S", 0.002, 2 * MINUTE) == pytest.approx(base)
    assert Photons(100.0, illuminant="A").caught("S", 0.004, MINUTE) < 0.5 * base  # a bulb is poor in blue


def test_light_through_the_rim_counts_less() -> None:
    """Rings of the pupil, each with its area and 10^(-rho r^2): 0.62 of the light of 6 mm, and noisier views."""
    edges = np.linspace(0, 3, 3001)  # mm
    middle = (edges[1:] + edges[:-1]) / 2
    share = np.diff(edges**2) @ 10 ** (-0.05 * middle**2) / 9
    photons = Photons(5.0)
    assert photons.caught("L+M", 0.006, MINUTE, 0.05) == pytest.approx(share * photons.caught("L+M", 0.006, MINUTE))
    noise = []
    for rho in (0.0, 0.05):
        eye = Eye(0.006, 1.0, stiles_crawford=rho)
        (lit,), (clean,) = (
            accommodation_views(1.0, eye, [0.0], Oscillation(), (64, 64), MINUTE, noise=n) for n in (photons, 0.0)
        )
        noise.append(np.std(lit.view.image - clean.view.image))
    assert noise[1] / noise[0] == pytest.approx(share**-0.5, rel=0.02)
