"""Limits of the search that leave too much, or nothing, to search."""

import blurred
import numpy as np
import pytest
from blurred import lens, wall

from focalgradient import recover_depth


@pytest.mark.parametrize("near", [0.1, *(pytest.param(near, marks=pytest.mark.slow) for near in (0.02, 1e-6))])
def test_limits_that_leave_all_open_do_no_harm(near: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blur of hundreds of pixels passes next to nothing, which any views would fit."""
    monkeypatch.setattr(blurred, "SHAPE", (96, 128))
    depth = recover_depth(wall([lens(4, 0.8), lens(4, 1.25)], 1.0), near=near)
    assert depth.valid.mean() > 0.95
    assert np.median(depth.vergence[depth.valid]) == pytest.approx(1.0, abs=0.003)
