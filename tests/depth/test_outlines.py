"""Depth about outlines: each surface goes on to where it ends, and nothing changes where nothing ends."""

import numpy as np
import pytest
from scipy import ndimage

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.depth.equalise.outline_places import moved_to_edges
from focalgradient.depth.planes import HELD_APART, SMOOTH, STEEP, departure_from_planes, grow_planes, surface_planes
from focalgradient.render import cast, noisy
from focalgradient.scenes import Scene, slant, step

SHAPE = (160, 240)
PIXEL = 3.2e-4
FOCI = tuple(Lens(focal_length=0.025, f_number=8, focus_distance=distance) for distance in (0.7, 1.5))


def views_of(scene: Scene, seed: int = 0) -> tuple[list[View], np.ndarray]:
    casts = [cast(scene, lens, SHAPE, PIXEL, samples=128) for lens in FOCI]
    noise = 0.01 * float(casts[0].view.image.mean())
    return [noisy(one.view, noise, 10 * seed + n) for n, one in enumerate(casts)], 1 / casts[0].distance


@pytest.fixture(scope="module")
def jump() -> tuple[list[View], np.ndarray]:
    return views_of(step(0.72, 1.3, seed=4))


@pytest.fixture(scope="module")
def found(jump: tuple[list[View], np.ndarray]) -> DepthMap:
    return recover_depth(jump[0])


@pytest.fixture(scope="module")
def windows(jump: tuple[list[View], np.ndarray]) -> DepthMap:
    return recover_depth(jump[0], outlines=False)


def near_the_step(truth: np.ndarray) -> np.ndarray:
    jumps = np.abs(np.diff(truth, axis=1, append=truth[:, -1:])) > 0.1
    inside = np.zeros(SHAPE, bool)
    inside[16:-16] = True
    return (ndimage.distance_transform_edt(~jumps) <= 10) & inside


def test_depth_goes_on_to_a_step(jump: tuple[list[View], np.ndarray], found: DepthMap, windows: DepthMap) -> None:
    truth = jump[1]
    near = near_the_step(truth)
    assert windows.valid[near].mean() < 0.3
    assert found.valid[near].mean() > 0.6
    use = found.valid & near
    error = np.abs(found.vergence - truth)[use]
    assert (error > 5 * found.vergence_sd[use]).mean() <= 0.02
    assert (error / truth[use] > 0.1).mean() <= 0.06
    assert (error <= 2 * found.vergence_sd[use]).mean() >= 0.9


def test_the_outline_lies_where_the_step_is(found: DepthMap) -> None:
    (curve,) = found.details["outlines"]
    column, row = np.array(curve).T
    middle = (SHAPE[1] - 1) / 2
    inside = (row > 16) & (row < SHAPE[0] - 16)
    assert inside.sum() > 100
    assert np.abs(column[inside] - middle).mean() < 2
    assert row[-1] > row[0]  # the near side, on the left of the picture, is on the right of the way


def test_away_from_the_step_windows_decide(found: DepthMap, windows: DepthMap) -> None:
    away = np.abs(np.arange(SHAPE[1]) - SHAPE[1] / 2) > 50
    assert (found.vergence == windows.vergence)[:, away].all()
    assert (found.valid == windows.valid)[:, away].all()
    # Where depth is not plane, it is less certain; both walls are plane, but for noise.
    assert (found.vergence_sd >= windows.vergence_sd)[:, away].all()
    assert (found.vergence_sd == windows.vergence_sd)[:, away].mean() > 0.9
    assert "outlines" not in windows.details


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("near", "far"), [(0.75, 1.4), (1.0, 1.0001)])
def test_no_outline_where_there_is_none(near: float, far: float) -> None:
    views, _ = views_of(slant(near, far, SHAPE[1] * PIXEL, seed=2), seed=2)
    with_outlines, windows = recover_depth(views), recover_depth(views, outlines=False)
    assert with_outlines.details["outlines"] == []
    for name in ("vergence", "vergence_sd", "valid"):
        assert (getattr(with_outlines, name) == getattr(windows, name)).all()


def test_a_jump_that_no_pixel_contradicts_is_an_outline_too() -> None:
    # Both walls are much blurred, and alike: windows go from one to the other over some twenty pixels.
    lenses = [Lens(focal_length=0.025, f_number=f_number, focus_distance=0.55) for f_number in (16, 5.6)]
    casts = [cast(step(1.6, 2.6, seed=6), lens, SHAPE, PIXEL, samples=128) for lens in lenses]
    noise = 0.005 * float(casts[0].view.image.mean())
    views = [noisy(one.view, noise, 60 + n) for n, one in enumerate(casts)]
    truth, across = 1 / casts[0].distance, np.abs(np.arange(SHAPE[1]) - (SHAPE[1] - 1) / 2)
    beside = np.zeros(SHAPE, bool)
    beside[16:-16] = (across > 5) & (across < 15)
    share, claimed = [], []
    for outlines in (False, True):
        depth = recover_depth(views, near=0.55, outlines=outlines)
        use = beside & depth.valid
        claimed.append(depth.valid[beside].mean())
        share.append((np.abs(depth.vergence - truth) > 2 * depth.vergence_sd)[use].mean())
    assert share[0] > 0.2
    assert share[1] <= 0.05
    assert claimed[1] > max(0.8, claimed[0])
    longest = np.array(max(depth.details["outlines"], key=len))
    assert np.abs(longest[:, 0] - (SHAPE[1] - 1) / 2).mean() < 4


def test_surfaces_close_to_each_other_are_held_apart() -> None:
    """Two levels, four standard deviations of a block apart: growing planes mix them less where they are held apart."""
    random = np.random.default_rng(0)
    true = np.where(np.arange(60) < 30, 10.0, 10.8) + np.zeros((40, 1))
    level = true + 0.2 * random.standard_normal(true.shape)
    weight, noise_sd = np.full(true.shape, 25.0), np.ones(true.shape)
    beside = np.zeros(true.shape, np.bool_)
    beside[:, 26:34] = True
    off = []
    for growth in (SMOOTH, HELD_APART):
        windows = [2 * size for size in growth.windows]
        found, _ = grow_planes(weight, weight * level, level, noise_sd, windows, STEEP, growth.separate)
        off.append(np.abs(found - true)[beside].mean())
    assert off[1] < 0.8 * off[0]


def test_what_is_not_plane_is_uncertain_and_planes_are_not() -> None:
    random = np.random.default_rng(3)
    place = np.indices((30, 40))
    plane, sd = 0.4 * place[0] - 0.3 * place[1], np.full((30, 40), 0.2)
    noise = 0.2 * ndimage.gaussian_filter(random.standard_normal((30, 40)), 1)
    good, reach = np.ones((30, 40), bool), np.full((30, 40), 2.0)
    assert (departure_from_planes(plane + noise, sd, good, reach, 6.0) == 0).all()
    jump = 3.0 * (place[1] >= 20)  # smaller than is found, and blurred over six nodes
    blurred = ndimage.gaussian_filter1d(jump, 2, axis=1)
    level = plane + blurred + noise
    departure = departure_from_planes(level, sd, good, reach, 6.0)
    mirrored = departure_from_planes(np.flip(level).copy(), sd, good, reach, 6.0)
    np.testing.assert_allclose(np.flip(mirrored), departure, rtol=1e-6, atol=1e-9)
    total, error = np.sqrt(sd**2 + departure), np.abs(blurred + noise - jump)
    assert (error > 5 * sd).mean() > 0.04
    assert (error <= 5 * total).all()


def test_flat_surfaces_are_continued_from_wide_windows_and_curved_ones_are_not() -> None:
    random = np.random.default_rng(4)
    place = np.indices((41, 41)) - 20.0
    sd, good = np.full((41, 41), 0.3), np.ones((41, 41), bool)
    noise = 0.3 * random.standard_normal((41, 41))
    for surface, spans in ((0.2 * place[0], 4.0), (0.1 * (place**2).sum(axis=0), 1.0)):
        found = surface_planes(surface + noise, sd, good, 4.0)
        assert np.median(found[3, 15:26, 15:26]) == spans
    flat = surface_planes(0.2 * place[0] + noise, sd, good, 4.0)
    assert np.median(np.abs(flat[1, 15:26, 15:26] - 0.2)) < 0.3 / 40  # a single window of two nodes: 0.3 / 10


@pytest.mark.parametrize("rows", [[20], [20, 21], [10, 20, 21, 22, 30]])
def test_pixels_of_a_border_find_the_edge_alone_and_beside_others(rows: list[int]) -> None:
    across = np.arange(50.0) + np.zeros((40, 1))
    border = np.zeros(across.shape, np.bool_)
    border[rows, 25] = True
    moved = moved_to_edges(across - 24.5, border, [(across > 26.5) * 1.0], np.ones((1, *across.shape)))
    assert moved[border] == pytest.approx(2, abs=0.05)
    assert not moved[~border].any()


@pytest.mark.parametrize("image", [lambda column: column > 26.5, lambda column: 1000.0 * (column < 26.5)])
def test_a_border_moves_to_an_edge_of_any_contrast_sign_and_direction(image) -> None:
    column, blur = np.arange(50.0) + np.zeros((50, 1)), np.ones((1, 50, 50))
    inward, light = column - 24.5, 1.0 * image(column)
    across = moved_to_edges(inward, np.abs(inward) < 1, [light], blur)
    assert across[20, 25] == pytest.approx(2.0, abs=0.1)
    down = moved_to_edges(inward.T, np.abs(inward.T) < 1, [light.T], blur)
    np.testing.assert_allclose(down.T, across, atol=1e-5)
