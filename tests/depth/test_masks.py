"""Pixels outside a view's mask: whatever they hold, they neither count nor are valid, in any method."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from blurred import lens, wall
from judged import check, covered
from scipy import ndimage
from stepped import image_of, step

from focalgradient import View, recover_depth
from focalgradient.depth.edges import measure_edges

HOLE = np.s_[60:90, 100:150]
AROUND = np.s_[40:110, 80:170]


def with_hole(views: Sequence[View], value: float) -> list[View]:
    """The views with bad pixels of one `value` in the last of them, masked there."""
    image, mask = views[-1].image.copy(), np.ones(views[-1].shape, bool)
    image[HOLE], mask[HOLE] = value, False
    return [*views[:-1], replace(views[-1], image=image, mask=mask)]


@pytest.mark.parametrize(("method", "value"), [("equalise", 1e4), ("spectra", 0.0), ("ratio", 1e4)])
def test_bad_pixels_do_not_count(method: str, value: float) -> None:
    views = wall([lens(16), lens(5.6)], 1.3, noise=0.005)
    depth = recover_depth(with_hole(views, value), method=method, near=0.85)  # type: ignore[arg-type]
    assert not depth.valid[HOLE].any()
    assert depth.valid.mean() > 0.4
    error = (depth.vergence - 1 / 1.3)[AROUND][depth.valid[AROUND]]
    assert np.median(np.abs(error)) < 0.02
    assert depth.details["gain"] == pytest.approx([1, 1], abs=0.01)


def test_bad_pixels_of_a_stack_do_not_count() -> None:
    views = with_hole(wall([lens(2.8, 1 / v) for v in (0.5, 0.65, 0.8, 0.95)], 1.4), 1e4)
    depth = recover_depth(views, method="autofocus")
    assert not depth.valid[HOLE].any()
    check(depth, 1.4, valid=0.4)


def test_edges_are_measured_beside_bad_pixels_and_not_of_them() -> None:
    image = image_of(step(2.0), 0.0, (96, 96))
    mask = np.ones(image.shape, bool)
    mask[40:56, 30:44] = False
    bad = np.where(mask, image, np.float32(7.0))
    edges = measure_edges(bad, mask=mask)
    at_step = np.abs(edges.column - 47.5) < 3
    assert edges.valid[at_step].mean() > 0.8
    assert np.median(edges.radius[at_step & edges.valid]) == pytest.approx(2.0, rel=0.02)
    outline = (np.abs(edges.column - 30) < 3) & (np.abs(edges.row - 48) < 6)
    assert not edges.valid[outline].any()


def test_a_saturated_photograph_says_so_by_its_mask_and_not_by_its_highest_value() -> None:
    """Where there is a mask, many pixels of one highest value are what the scene is."""
    views = wall([lens(16), lens(5.6)], 1.3)
    flat = []
    for view in views:
        image = view.image.copy()
        image[:40, :60] = image.max() + 0.1  # a bright plain surface
        flat.append(replace(view, image=image, mask=np.ones(image.shape, bool)))
    trusted = recover_depth(flat, near=0.85)
    guessed = recover_depth([replace(view, mask=None) for view in flat], near=0.85)
    assert trusted.details["share_disagreeing"] < guessed.details["share_disagreeing"]


def test_hot_and_dead_pixels_reach_nothing_beside_them() -> None:
    views = wall([lens(16), lens(5.6)], 1.3, noise=0.005)
    image, random = views[-1].image.copy(), np.random.default_rng(1)
    places = tuple(random.integers(20, n - 20, 30) for n in image.shape)
    image[places] = random.choice([0.0, image.max() * 1.5], 30)
    is_bad = np.zeros(image.shape, bool)
    is_bad[places] = True
    depth = recover_depth([*views[:-1], replace(views[-1], image=image)], near=0.85)
    beside = ndimage.distance_transform_edt(~is_bad)
    assert not depth.valid[is_bad].any()
    assert depth.valid[(beside > 3) & (beside < 8)].mean() > 0.95
    assert covered(depth, 1.3) > 0.93
