"""Screen size by a card and distance by the blind spot: estimated with the error that they have, and carried on."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from focalgradient.display import CARD, Display
from focalgradient.web.screen import gamma_of, measure

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import viewing_distance


@pytest.mark.parametrize("hz", [60.0, 120.0])
def test_simulated_people_are_as_far_off_as_is_said(hz: float) -> None:
    """600 people measure a share within one standard error to .02, and the median error to .4 % of the distance."""
    bias, within_one, within_two, error, plugin = viewing_distance.run(600, hz, 3)
    assert abs(bias) < 1.0
    assert 0.62 < within_one < 0.8
    assert 0.93 < within_two < 0.99
    assert 7 < error < 10
    assert abs(plugin) > abs(bias)  # it takes one angle for all displays


def test_a_perfect_participant_is_found_where_they_sit() -> None:
    pixel, distance, hz = 0.25e-3, 0.65, 60.0
    at = distance * math.tan(math.radians(12.5)) / pixel + 0.3 * 2 * hz
    found = measure(CARD[0] / pixel, [at] * 5, hz)
    assert found.distance_m == pytest.approx(distance, rel=1e-9)
    assert found.pixel_m == pytest.approx(pixel)
    assert found.distance_sd_m == pytest.approx(distance * math.hypot(0.074, 0.5 / 85.6), rel=1e-9)


@pytest.mark.parametrize("gamma", [1.8, 2.2, 2.6])
def test_two_standard_errors_of_a_matched_gamma_cover_nineteen_of_twenty(gamma: float) -> None:
    draws = np.random.default_rng(8)
    errors, off = [], []
    for _ in range(2000):
        matches = []
        for share in (0.5, 0.25, 0.5, 0.25):
            level = 255 * share ** (1 / gamma)
            matches.append((share, round(level * draws.normal(1, 0.02))))
        found = gamma_of(matches)
        assert found
        errors.append(found[0] - gamma)
        off.append(abs(errors[-1]) / found[1])
    assert abs(np.mean(errors)) < 0.02
    assert 0.93 < np.mean(np.array(off) < 2) < 0.97


def test_the_light_of_a_match_is_that_of_its_rows() -> None:
    """Against the package's own curve of a display, which knows nothing of matches."""
    display = Display(gamma=2.4)
    for share in (0.5, 0.25):
        level = int(display.encode(share))
        assert (gamma_of([(share, level)] * 2) or (0, 0))[0] == pytest.approx(2.4, abs=0.03)
