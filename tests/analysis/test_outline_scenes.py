"""Scenes with outlines of `analysis/outline_scenes.py`: as much is claimed, and as little of it wrong, as is stated."""

from dataclasses import replace

import numpy as np
import pytest
from outline_scenes import (
    BACK,
    BACK_LIMIT,
    HELD_BACK,
    MADE_WITH,
    UNCERTAINTY,
    Case,
    drawn,
    lens,
    near_outlines,
    recovered,
    score,
    views_and_truth,
)

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
def test_bars_whose_blur_contradicts_everywhere_are_not_taken_for_blank_paper() -> None:
    check("bars", *found("bars, back", MADE_WITH["bars, back"]))


@pytest.mark.slow
def test_a_jump_beside_a_wall_in_focus_is_found() -> None:
    near, _ = found("spheres 8, back", Case(BACK, seed=8, noise=0.005, limits=BACK_LIMIT))
    assert near["off_10_percent"] < 8  # 10 where none is looked for
    assert near["valid"] > 55


@pytest.mark.slow
@pytest.mark.parametrize("name", ["three things, apertures", "three things, 3 foci", "lamps, apertures"])
def test_the_stated_uncertainty_is_not_wider_than_the_errors(name: str) -> None:
    """Windows that reach over boundaries, and clipped lamps, widened whole frames: z was 0.15, 0.09 and 0.09."""
    whole = whole_frame(UNCERTAINTY[name])
    assert 0.45 < whole["z"] < 1.1
    assert whole["within_2_sd"] > 93
    assert whole["beyond_5_sd"] < 0.2


def whole_frame(case: Case) -> dict[str, float]:
    views, vergence = views_and_truth("", case)
    return score(recovered(case, views, outlines=True)[0], vergence, np.ones(case.size, bool))


@pytest.mark.slow
def test_three_foci_tell_more_than_two() -> None:
    """What noise does in one comparison was counted against the others: three foci were refused."""
    _, case = drawn(3)
    noise, two, three = 0.015, (0.7, 1.5), (0.7, 1.0, 1.5)
    fewer, more = (
        whole_frame(replace(case, lenses=tuple(lens(8, focus) for focus in foci), limits={}, noise=noise))
        for foci in (two, three)
    )
    assert more["valid"] > fewer["valid"] - 1 > 90
    assert more["median_percent"] < 0.8 * fewer["median_percent"]
    assert more["within_2_sd"] > 94


@pytest.mark.slow
def test_no_scene_drawn_by_chance_is_refused() -> None:
    scores = [whole_frame(drawn(number)[1]) for number in range(100, 124)]
    assert min(one["valid"] for one in scores) > 40
    assert np.mean([one["valid"] for one in scores]) > 85
    assert np.mean([one["within_2_sd"] for one in scores]) > 94
    assert np.mean([one["beyond_5_sd"] for one in scores]) < 1


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_depth_about_outlines_is_as_stated(name: str) -> None:
    check(name, *found(name, SCENES[name]))
