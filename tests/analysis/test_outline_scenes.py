"""Scenes with outlines of `analysis/outline_scenes.py`: as much is claimed, and as little of it wrong, as is stated."""

import numpy as np
import pytest
from outline_scenes import HELD_BACK, MADE_WITH, UNCERTAINTY, Case, near_outlines, recovered, score, views_and_truth

SCENES = {**MADE_WITH, **HELD_BACK}

# Least percentage of the whole frame valid, and most percent off by more than 10 % and beyond 5 sd near outlines: the
# table in docs/report/photographs.md, by kinds of scenes, and 2 percentage points.
STATED = {
    "spheres, apertures": (77.5, 14, 3),
    "spheres, foci": (86, 10, 2.7),
    "step": (95, 5, 2.1),
    "slanted": (95, 10, 2.1),
    "blob": (86, 8, 2.2),
    "leaves": (94, 9, 2.9),
    "spheres 2, back": (77, 9.1, 2.3),
    "spheres 2, foci": (82, 7.2, 2.6),
    "bars": (67, 19, 2.3),
}


def found(name: str, case: Case) -> tuple[dict[str, float], dict[str, float]]:
    """Scores near outlines and over the whole frame."""
    views, vergence = views_and_truth(name, case)
    depth, _ = recovered(case, views, outlines=True)
    near = near_outlines(vergence)
    return score(depth, vergence, near), score(depth, vergence, np.ones_like(near))


def check(name: str, near: dict[str, float], whole: dict[str, float]) -> None:
    valid, off, beyond = next(limits for kind, limits in STATED.items() if name.startswith(kind))
    assert whole["valid"] > valid
    assert near["off_10_percent"] < off
    assert near["beyond_5_sd"] < beyond


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["three things, apertures", "three things, 3 foci", "three things, 5 foci", "lamps, apertures"]
)
def test_the_stated_uncertainty_is_not_wider_than_the_errors(name: str) -> None:
    """Windows that reach over boundaries, and clipped lamps, widened whole frames: z was 0.15, 0.09 and 0.09."""
    whole = whole_frame(UNCERTAINTY[name])
    assert 0.45 < whole["z"] < 1.1
    assert whole["within_2_sd"] > 93
    assert whole["beyond_5_sd"] < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("width", [5, 14])
def test_dark_bars_before_texture_are_covered(width: int) -> None:
    whole = whole_frame(UNCERTAINTY[f"bars of {width} px, apertures"])
    assert whole["valid"] > 50
    assert whole["beyond_5_sd"] < 1


def whole_frame(case: Case) -> dict[str, float]:
    views, vergence = views_and_truth("", case)
    return score(recovered(case, views, outlines=True)[0], vergence, np.ones(case.size, bool))


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SCENES][::2])
def test_depth_about_outlines_is_as_stated(name: str) -> None:
    check(name, *found(name, SCENES[name]))
