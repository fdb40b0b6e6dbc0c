"""Completed depth: unchanged where it is measured, covered where it is not, and classified by its evidence."""

import numpy as np
import pytest
from blurred import lens, wall

from focalgradient import DepthMap, recover_depth
from focalgradient.depth.dense import BEND, _bends, complete

SHAPE = (120, 160)


def surfaces(seed):
    """Two slanted surfaces that meet at an edge of the picture, measured in a third of the frame's squares."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    left = x < 70 + 0.1 * y
    true = np.where(left, 0.5 + 0.0005 * y, 0.35 + 0.0003 * x)
    picture = np.where(left, 0.6, 0.2) + 0.005 * random.standard_normal(SHAPE)
    squares = np.kron(random.random((6, 8)) < 0.33, np.ones((20, 20), bool))
    measured = true + np.kron(0.01 * random.standard_normal((6, 8)), np.ones((20, 20)))
    return true, picture, measured, squares


@pytest.mark.parametrize(
    ("bent", "energy"),
    [(lambda y, x: x * y, 2), (lambda y, x: x**2, 4), (lambda y, x: y**2, 4)],
    ids=["xy", "xx", "yy"],
)
def test_the_layout_bends_as_a_thin_plate(bent, energy):
    """The integral of z_xx^2 + 2 z_xy^2 + z_yy^2 over a frame one wide and 0.75 high, but for its rim."""
    cells, aspect, scale = (31, 41), 0.75, 0.5
    y, x = np.meshgrid(aspect * np.linspace(-0.5, 0.5, 31), np.linspace(-0.5, 0.5, 41), indexing="ij")
    rows = _bends(cells, aspect, scale)[:-3]  # but for mean and slopes
    found = np.sum((rows @ bent(y, x).ravel()) ** 2) * (BEND * scale) ** 2
    assert found == pytest.approx(energy * aspect, rel=0.1)


@pytest.mark.parametrize("seed", range(2))
def test_what_is_completed_is_covered_and_what_is_measured_stays(seed):
    true, picture, measured, squares = surfaces(seed)
    vergence, sd, evidence = complete(measured, np.full(SHAPE, 0.01), squares, picture, window=8.0)
    np.testing.assert_array_equal(vergence[squares], measured[squares].astype(np.float32))
    assert ((evidence == 2) == squares).all()
    off = np.abs(vergence - true)
    assert (off < 2 * sd)[~squares].mean() > 0.9
    constant = np.abs(np.median(measured[squares]) - true)
    assert off[~squares].mean() < 0.6 * constant[~squares].mean()


def test_uncertainty_grows_from_what_is_measured():
    valid = np.zeros(SHAPE, bool)
    valid[:, :20] = True
    _, sd, _ = complete(np.full(SHAPE, 0.5), np.full(SHAPE, 0.005), valid, np.ones(SHAPE), window=8.0)
    beside, far, farthest = (sd[:, at].mean() for at in (30, 80, 150))
    assert 0.005 < beside < far < farthest


def test_an_edge_of_the_picture_parts_surfaces():
    valid = np.zeros(SHAPE, bool)
    valid[:, 60:80] = True
    for edge, least, most in ((False, 0.8, 1.25), (True, 1.15, 10.0)):
        picture = np.ones(SHAPE) + 0.003 * np.random.default_rng(1).standard_normal(SHAPE)
        picture[:, 86:] += 1.0 * edge
        _, sd, evidence = complete(np.full(SHAPE, 0.5), np.full(SHAPE, 0.005), valid, picture, window=8.0)
        left, right = np.s_[20:-20, 54:57], np.s_[20:-20, 88:91]
        assert least < sd[right].mean() / sd[left].mean() < most
        assert evidence[left].mean() > 0.5
        assert evidence[right].mean() == 0 or not edge


@pytest.mark.parametrize("unit", [0.3, 5.0])
def test_a_plane_is_continued(unit):
    """The vergence of a plane is linear in the picture: two measured stripes show it on both of their sides."""
    valid = np.zeros(SHAPE, bool)
    valid[:, 50:65] = valid[:, 95:110] = True
    plane = unit * (1 + 0.002 * (np.arange(SHAPE[1]) - 80) * np.ones(SHAPE))
    vergence, _, _ = complete(plane, np.full(SHAPE, 0.005 * unit), valid, np.ones(SHAPE), window=8.0)
    for beyond in (30, 130):
        assert np.abs(vergence / plane - 1)[:, beyond].max() < 0.03
        assert np.abs(np.median(plane) / plane - 1)[:, beyond].min() > 0.08


def test_a_surface_that_shows_no_depth_is_covered():
    """Textured things before or behind a blank wall, of which nothing is measured."""
    random = np.random.default_rng(0)
    thing = np.hypot(*np.mgrid[-60:60, -80:80]) < 40
    off, size = [], []
    for _ in range(20):
        there, wall = 0.6 * np.exp(0.35 * random.standard_normal(2))
        vergence, sd, _ = complete(np.full(SHAPE, there), np.full(SHAPE, 0.01), thing, 0.2 + 0.3 * thing, window=8.0)
        off.append((np.abs(vergence - wall) / sd)[~thing])
        size.append(sd[~thing].max() / there)
    assert (np.concatenate(off) < 2).mean() > 0.88
    assert max(size) < 0.7


def test_what_is_searched_bounds_the_uncertainty():
    valid = np.zeros(SHAPE, bool)
    valid[:, :20] = True
    given = np.full(SHAPE, 0.5), np.full(SHAPE, 0.005), valid, np.ones(SHAPE), 8.0
    free, narrow = complete(*given)[1], complete(*given, searched=(0.4, 0.6))[1]
    assert free.max() > 0.2
    assert narrow.max() < 0.2 / np.sqrt(12) + 0.02


def test_recovered_depth_is_completed_on_request(tmp_path):
    views = wall([lens(16), lens(4)], 1.1, seed=1)
    plain, dense = (recover_depth(views, near=0.85, dense=one) for one in (False, True))
    assert plain.evidence is None
    assert ((dense.evidence == 2) == dense.valid).all()
    np.testing.assert_array_equal(plain.vergence[plain.valid], dense.vergence[plain.valid])
    assert np.abs(dense.vergence - 1 / 1.1).max() < 0.05
    dense.save(tmp_path / "depth.npz")
    np.testing.assert_array_equal(DepthMap.load(tmp_path / "depth.npz").evidence, dense.evidence)
