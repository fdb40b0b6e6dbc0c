"""Walls that lie outside the range searched, or are blurred beyond detail: rejected, with the range as the cause."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from blurred import lens, wall
from judged import covered, over_sd

from focalgradient import View, recover_depth
from focalgradient.eye import Cones, Eye, Photons, eye_views
from focalgradient.eye.cones import S_FINEST_CPD

MINUTE = np.radians(1 / 60)
NEAR, FAR = 0.7, 2.0


def eye_depth(mm: float, bands: tuple[str, ...], vergence: float, side: int = 144, seed: int = 1):
    """Depth of a wall from the views of each band at two moments, with the photon noise of 200 cd/m^2."""
    cones = [
        Cones.of(Eye(1e-3 * mm, focus), band, finest_cpd=S_FINEST_CPD if band == "S" else np.inf)
        for focus in (0.75, 0.25)
        for band in bands
    ]
    views = eye_views(1 / vergence, cones, (side, side), MINUTE, noise=Photons(200.0), seed=seed)
    return recover_depth([one.view for one in views])


@pytest.mark.filterwarnings("ignore:view")
@pytest.mark.parametrize(("mm", "bands", "vergence"), [(4, ("L+M", "S"), 4.0), (6, ("L+M",), 2.5)])
@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_walls_far_out_of_an_eyes_focus_are_rejected(mm, bands, vergence) -> None:
    depth = eye_depth(mm, bands, vergence)
    assert depth.valid.mean() < 0.005
    assert "outside the range searched" in depth.details["rejected"]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("mm", "vergence"), [(4, 1.5), (6, 0.5)])
def test_walls_within_the_range_stay_right(mm, vergence) -> None:
    depth = eye_depth(mm, ("L+M", "S"), vergence)
    assert depth.valid.mean() > 0.8
    assert covered(depth, 1 / vergence) > 0.93


@pytest.mark.filterwarnings("ignore")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("foci", "distance"), [((0.7, 1.0), 0.2), ((0.7, 0.85, 1.1), 2.4)])
def test_walls_outside_near_and_far_are_rejected(foci, distance) -> None:
    depth = recover_depth(wall([lens(2.8, focus) for focus in foci], distance, seed=2), near=NEAR, far=FAR)
    assert depth.valid.mean() < 0.005


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_wall_just_beyond_the_default_range_is_rejected() -> None:
    """Blur of 16.5 pixels at 3 m; the search ends at 16."""
    views = wall([lens(8), lens(2)], 3.0)
    depth = recover_depth(views)
    assert depth.valid.mean() < 0.005
    assert "outside the range searched" in depth.details["rejected"]
    wider = recover_depth(views, near=0.85, far=4.0)
    assert np.median(wider.distance[wider.valid]) == pytest.approx(3.0, rel=0.02)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the views share one plane")
def test_walls_at_an_end_of_the_range_are_kept() -> None:
    """At a limit that is given, at infinity and at a shared focus."""
    for lenses, distance, asked in (
        ([lens(2.8, 0.7), lens(2.8, 1.0)], 0.8, {"near": 0.8, "far": 2.0}),
        ([lens(8, 0.85), lens(2.8, 0.85)], 0.85, {}),
        ([lens(8, 10.0), lens(8, 4.0)], 1e6, {}),
    ):
        depth = recover_depth(wall(lenses, distance, seed=3), **asked)
        assert depth.valid.mean() > 0.7
        assert np.mean(np.abs(over_sd(depth, distance)) <= 3) > 0.93


@pytest.mark.fast_cases(2)
@pytest.mark.filterwarnings("ignore:the views contradict the optics")
@pytest.mark.parametrize(
    ("lenses", "distance", "limits", "side", "words"),
    [
        ([lens(5.6, 0.8), lens(5.6, 1.3)], 0.55, {"near": NEAR, "far": FAR}, 1, "nearer than the search: "),
        ([lens(5.6, 0.8), lens(5.6, 1.3)], 3.5, {"near": NEAR, "far": FAR}, -1, "farther than the search: "),
        ([lens(16, 0.55), lens(5.6, 0.55)], 0.65, {"near": 0.8}, 1, "nearer than the search: "),
        ([lens(16, 0.55), lens(5.6, 0.55)], 2.5, {"near": 0.56, "far": 1.5}, -1, "search, or nearer than 0.34 m: "),
    ],
)
def test_a_surface_outside_the_search_is_reported(lenses, distance, limits, side, words) -> None:
    """Beside a wall within the limits: in the map, its summary and its picture, and it is not claimed."""
    outside, within = wall(lenses, distance, seed=3), wall(lenses, 1.0, seed=4)
    views = [
        View(np.hstack([one.image, other.image]), one.optics, one.pixel_angle)
        for one, other in zip(outside, within, strict=True)
    ]
    depth = recover_depth(views, **limits)
    middle = depth.shape[1] // 2
    assert depth.beyond is not None
    assert (depth.beyond[:, : middle - 40] == side).mean() > 0.95
    assert not depth.beyond[:, middle + 40 :].any()
    assert depth.valid[:, middle + 40 :].mean() > 0.8
    assert not depth.valid[:, : middle - 40].any()
    assert words in depth.summary()
    figure = depth.plot().figure
    assert words.removesuffix(": ") in " ".join(figure.axes[0].get_title("left").split())
    figure.canvas.draw()
    plt.close(figure)


@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_a_wall_in_focus_is_not_said_to_lie_beyond_an_end_that_hardly_blurs() -> None:
    """At 0.88 m the views differ by 0.2 pixels of blur: less is neither claimed nor called nearer."""
    depth = recover_depth(wall([lens(16, 0.85), lens(5.6, 0.85)], 0.85, seed=3), near=0.88, far=2.0)
    assert not depth.valid.any()
    assert depth.beyond is not None
    assert not depth.beyond.any()


@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_what_is_blurred_alike_on_the_other_side_of_focus_is_stated() -> None:
    """Two apertures focused at 1 m: a wall at 0.8 m is given the 1.33 m with the same blur, and the map says so."""
    depth = recover_depth(wall([lens(16, 1.0), lens(5.6, 1.0)], 0.8, seed=5), near=1.02, far=2.0)
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1 / (2 - 1 / 0.8), rel=0.01)
    assert depth.details["blurred_alike_D"] == pytest.approx([2 - 1 / 1.02, 1.5])
    assert "same blur nearer than the focus: 0.67 to 0.98 m" in depth.summary()
    foci = recover_depth(wall([lens(5.6, 0.8), lens(5.6, 1.3)], 1.0, seed=5), near=NEAR, far=FAR)
    assert "blurred_alike_D" not in foci.details
