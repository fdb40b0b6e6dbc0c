"""The figure of colour and depth: red is misjudged where it is taken for white, and not where its spectrum is seen."""

import pytest
from colour_and_depth import COLOURS, as_white, reported, seen


@pytest.mark.slow
def test_a_red_surface_is_seen_nearer_by_an_eye_that_takes_it_for_white() -> None:
    views = seen("bands", dict(COLOURS)["red"], seed=3)
    (known, _), (white, _) = reported(views), reported([as_white(view) for view in views])
    assert abs(known) < 0.03
    assert white > 0.1
