"""Screen size by a card and distance by the blind spot: estimated with the error that they have, and carried on."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import pytest

from focalgradient.display import CARD
from focalgradient.web.screen import measure

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import viewing_distance


@pytest.mark.parametrize("hz", [60.0, 120.0])
def test_simulated_people_are_as_far_off_as_is_said(hz: float) -> None:
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


def test_presses_before_the_ball_has_moved_are_no_distance() -> None:
    found = measure(320.0, [10.0, -5.0], 60.0)
    assert found.distance_m is None
    assert found.distance_sd_m is None
