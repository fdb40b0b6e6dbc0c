"""The table of other rules and constants, on made-up stimuli whose blur is known."""

import numpy as np
import observers_sensitivity
import pytest

from focalgradient.observers import EncodedStimulus
from focalgradient.observers.perception import SD_PER_RADIUS


@pytest.fixture(scope="module")
def encoded():
    """A ground plane: what is higher is farther, 16 x 16 places."""
    depth = np.repeat(np.linspace(1.6, 0.0, 16), 16)
    found = {}
    for f, aperture in (("pinhole", 0.0), ("f/22", 0.0023), ("f/11", 0.0045), ("f/5.6", 0.0089)):
        for end, focus in (("nearest", 0.0), ("farthest", 1.6)):
            radius = np.degrees(aperture / 2 * np.abs(depth - focus)) * 60
            found["scene", f, end] = EncodedStimulus(np.hypot(SD_PER_RADIUS * radius, 1.0), 1.0, depth - focus)
    return found


def test_each_rule_does_as_its_name_says(encoded):
    rules, constants = observers_sensitivity.rows(encoded)
    by_name = {row.name.split(":")[0].split(" (")[0]: row for row in rules}
    shipped = by_name["as shipped"]
    assert shipped.near > 1.2
    assert shipped.far == pytest.approx(1, abs=0.02)
    assert by_name["sign from layout"].far > 1.2
    assert by_name["no discounting"].far < 0.9
    assert by_name["no prior"].near == pytest.approx(1, abs=0.02)
    assert by_name["opposite prior"].far > 1.2
    assert by_name["layout by height in the picture"].near == pytest.approx(shipped.near, rel=0.05)
    assert len(constants) == 2 * len(observers_sensitivity.CONSTANTS)
    assert min(row.smallest_step for row in constants) > 0.99
