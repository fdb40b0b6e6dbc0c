"""Depth from the blur of edges, on views from the ray caster: cards before a wall, and a card that recedes."""

import numpy as np
import pytest
from judged import over_sd
from scipy.ndimage import distance_transform_edt, minimum_filter

from focalgradient import FocalGradientWarning, Lens, recover_depth
from focalgradient.render import cast, noisy
from focalgradient.scenes import Plane, Scene, Texture

PIXEL = 3.2e-4
SHAPE = (120, 160)
NOISE = 0.005


def lens(focus, f_number=5.6):
    return Lens(focal_length=0.025, f_number=f_number, focus_distance=focus)


def view(scene, optics, seed):
    """Focusing moves the lens: the pixel angle goes with it."""
    pixel = PIXEL * lens(1.0).sensor_distance / optics.sensor_distance
    return noisy(cast(scene, optics, SHAPE, pixel, samples=256).view, NOISE, seed)


def card(distance, size, *, normal=(0.0, 0.0, -1.0), mean=0.7):
    return Plane((0.0, 0.0, distance), normal, Texture(mean=mean, contrast=0.0), size)


WALL = card(3.0, (np.inf, np.inf), mean=0.3)


def cards(distance):
    """A card that fills half the frame's width and height."""
    return Scene((card(distance, (80 * PIXEL * distance, 60 * PIXEL * distance)), WALL))


@pytest.mark.parametrize(("distance", "limits"), [(2.5, {"near": 1.0}), (0.7, {"far": 1.0})])
def test_one_view_tells_distance_on_the_stated_side(distance, limits):
    depth = recover_depth([view(cards(distance), lens(1.0), 1)], method="edges", **limits)
    valid = depth.valid
    assert valid.sum() > 300
    assert np.median(depth.distance[valid]) == pytest.approx(distance, rel=0.01)
    assert np.mean(np.abs(over_sd(depth, distance)) < 3) > 0.8
    assert depth.side_known.all()
    assert ("beyond" in depth.details["side"]) == (distance > 1.0)


def test_only_edges_are_drawn_some_three_pixels_wide():
    scene = cards(1.4)
    depth = recover_depth([view(scene, lens(1.0), 1)], method="edges", near=1.0)
    truth = cast(scene, lens(1.0), SHAPE, PIXEL, samples=1).distance
    outline = (truth < 2) & (minimum_filter(-truth, 3) < -2)
    assert distance_transform_edt(~outline)[depth.valid].max() < 3.5
    assert 2.4 < depth.valid.sum() / outline.sum() < 4.0
    assert np.isfinite(depth.vergence).all()
    assert np.isfinite(depth.vergence_sd).all()


def test_one_plane_of_focus_leaves_the_side_open_and_says_so():
    with pytest.warns(FocalGradientWarning, match="share one plane of focus"):
        depth = recover_depth([view(cards(2.0), lens(1.0), 1)], method="edges")
    assert not depth.side_known.any()
    assert np.median(depth.distance[depth.valid]) == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("distance", [0.75, 2.0])
def test_two_planes_of_focus_tell_the_side(distance):
    scene = cards(distance)
    depth = recover_depth([view(scene, lens(1.4), 1), view(scene, lens(0.6), 2)], method="edges")
    valid = depth.valid
    assert valid.sum() > 300
    assert depth.side_known[valid].all()
    assert np.median(depth.distance[valid]) == pytest.approx(distance, rel=0.015)


def test_more_views_are_more_precise_and_a_pinhole_adds_nothing():
    scene = cards(2.0)
    views = [view(scene, lens(1.0, number), seed) for seed, number in enumerate((5.6, 8.0))]
    both = recover_depth(views, method="edges", near=1.0)
    one = recover_depth(views[:1], method="edges", near=1.0)
    shared = both.valid & one.valid
    assert np.median(both.vergence_sd[shared] / one.vergence_sd[shared]) < 0.95
    with_pinhole = recover_depth([views[0], view(scene, lens(1.0, np.inf), 9)], method="edges", near=1.0)
    assert with_pinhole.vergence[one.valid] == pytest.approx(one.vergence[one.valid])


def test_edges_of_views_that_contradict_each_other_are_rejected():
    views = [view(cards(2.0), lens(1.0, 5.6), 1), view(cards(1.4), lens(1.0, 4.0), 2)]
    with pytest.warns(FocalGradientWarning, match="view 2 shows finer detail than view 1"):
        depth = recover_depth(views, method="edges", near=1.0)
    one = recover_depth(views[:1], method="edges", near=1.0)
    assert one.valid.sum() > 300
    assert (depth.valid & one.valid).sum() < 0.3 * one.valid.sum()
