"""Kernels against their definitions, written out in NumPy, and minima of costs that are known in closed form."""

import numpy as np
import pytest

from focalgradient.depth import numerics, planes
from focalgradient.depth.noise import QUANTUM, NoiseLaw, noise_from_differences
from focalgradient.depth.read import parabola_minimum, read_minima
from focalgradient.depth.validity import SECONDARY_MINIMUM

RANDOM = np.random.default_rng(2)
IMAGES, WEIGHT, STEP = RANDOM.normal(size=(3, 20, 31)).astype(np.float32), RANDOM.random((20, 31), np.float32), 4


def in_blocks(values: np.ndarray) -> np.ndarray:
    """Sums over blocks of STEP x STEP pixels, of which the last are partial."""
    padded = np.pad(np.float64(values), [(0, -n % STEP) for n in values.shape])
    return padded.reshape(5, STEP, 8, STEP).sum(axis=(1, 3))


def test_sums_over_blocks_are_those_of_their_definitions() -> None:
    pairs = [(k, other) for k in range(3) for other in range(k + 1)]
    products = [in_blocks(WEIGHT * IMAGES[k] * IMAGES[other]) for k, other in pairs]
    assert numerics.block_products(IMAGES, WEIGHT, STEP) == pytest.approx(np.array(products), abs=1e-5)
    squares = np.array([in_blocks(WEIGHT * image**2) for image in IMAGES])
    assert numerics.block_squares(IMAGES, WEIGHT, STEP) == pytest.approx(squares, abs=1e-5)
    some = numerics.block_squares(IMAGES, WEIGHT, STEP, np.array([2, 0]))
    assert some == pytest.approx(squares[[2, 0]], abs=1e-5)
    mixed = RANDOM.normal(size=(5, 3)).astype(np.float32)
    sums = [in_blocks(WEIGHT * np.tensordot(one, IMAGES, 1) ** 2) for one in mixed]
    assert numerics.block_squares_of_sums(IMAGES, mixed, WEIGHT, STEP) == pytest.approx(np.array(sums), abs=1e-4)
    value, slope, coarse = IMAGES
    low, low_slope = coarse, 0.5 * coarse[::-1]
    found = numerics.half_sums(value, slope, (low + 1j * low_slope).astype(np.complex64), WEIGHT, STEP)
    high, high_slope = value - low, slope - low_slope
    halves = [-low * low_slope, low_slope**2, -high * high_slope, high_slope**2]
    assert found == pytest.approx(np.array([in_blocks(WEIGHT * one) for one in halves]), abs=1e-5)


def test_a_parabola_over_levels_and_its_slope_are_interpolated_exactly() -> None:
    """Of images a + b l + c l^2 at level l; beyond the last but one the same parabola goes on."""
    at, (a, b, c) = np.arange(6.0)[:, None], np.array([1.0, -0.7, 0.3])
    basis = np.concatenate([at**0, at, at**2], axis=1).astype(np.float32)
    images = np.stack([np.full((2, 50), value, np.float32) for value in (a, b, c)])
    level = np.tile(np.linspace(-0.4, 5.4, 50, dtype=np.float32), (2, 1))
    truth, slope = a + b * level + c * level**2, b + 2 * c * level
    stack = np.tensordot(basis, images, 1)
    for value, rise in (numerics.combine_levels(images, basis, level), numerics.select_levels(stack, level)):
        assert value == pytest.approx(truth, abs=1e-5)
        assert rise == pytest.approx(slope, abs=1e-5)


@pytest.mark.parametrize(("jump", "is_apart"), [(7.9, False), (8.1, True)])
def test_nodes_further_apart_than_two_levels_and_six_sd_are_not_mixed(jump: float, is_apart: bool) -> None:
    values = np.array([[0.0, jump], [0.0, jump]])
    pixels = numerics.interpolate_nodes(values, np.ones((2, 2)), 5, (10, 10))
    share = np.clip((np.arange(10) + 0.5) / 5 - 0.5, 0, 1)
    expected = np.where(share > 0.5, jump, 0.0) if is_apart else jump * share
    assert pixels == pytest.approx(np.tile(expected, (10, 1)))


LEVELS, SIZE, NOISE = np.arange(40.0), 50.0, 0.3


def minimum(cost: np.ndarray, misfit: float = 1.0, noise_slope: float = 0.0):
    """Level, sd, misfit, texture and both flags of a cost, in units of the noise of a window of 50 pixels."""
    expected = np.full(40, 2 * NOISE)
    energy = (misfit * expected + cost * NOISE / SIZE)[None]
    values, flags = read_minima(energy, expected, np.full(40, noise_slope / SIZE), NOISE, np.array([SIZE]))
    return (*values[:, 0], *flags[:, 0])


@pytest.mark.parametrize("sd", [0.2, 1.5, 4.0])
@pytest.mark.parametrize("place", [17.0, 17.3, 21.8])
def test_a_parabola_s_minimum_has_its_place_and_the_sd_of_its_curvature(place: float, sd: float) -> None:
    cost = ((LEVELS - place) / sd) ** 2
    level, found, misfit, texture, unambiguous, inside = minimum(cost)
    assert level == pytest.approx(place, abs=2e-4)
    assert found == pytest.approx(sd, rel=0.03)  # between levels the cost is taken for straight
    assert misfit == pytest.approx(1, abs=1e-9)
    assert texture == 0  # nothing is known of what noise adds
    assert unambiguous
    assert inside
    # What noise adds to the variance of the score, s, and a misfit m: sd^2 m (1 + s sd^2).
    _, wider, misfit, texture, *_ = minimum(cost, 1.4, 3.0)
    assert misfit == pytest.approx(1.4, abs=1e-6)
    if sd < 1:
        assert texture == pytest.approx(1 / sd**2 / 3.0, rel=1e-6)
        assert wider == pytest.approx(sd * np.sqrt(1.4 * (1 + 3.0 * sd**2)), rel=0.03)


def test_where_blur_vanishes_the_minimum_of_a_quartic_is_exact() -> None:
    level, *_ = minimum(0.02 * ((LEVELS - 20) ** 2 - 2.7**2) ** 2 + 30 * (LEVELS < 20))
    assert level == pytest.approx(22.7, abs=2e-4)


@pytest.mark.parametrize(("deeper", "alone"), [(0.9, False), (1.1, True)])
def test_a_second_minimum_beyond_a_barrier_is_named_unless_it_fits_worse(deeper: float, alone: bool) -> None:
    cost = np.minimum(4 * (LEVELS - 10) ** 2, 4 * (LEVELS - 30) ** 2 + deeper * SECONDARY_MINIMUM)
    assert minimum(cost)[4] == alone


def test_minima_beyond_the_ends_and_of_even_candidates() -> None:
    for place, inside in ((-4.0, False), (0.0, True), (39.0, True), (43.0, False)):
        assert minimum(((LEVELS - place) / 0.5) ** 2)[5] == inside
    at = np.arange(9.0)[:, None, None]
    place = np.array([[3.2, 5.9], [0.4, 7.9]])
    found, value, curvature = parabola_minimum(1.5 + 0.7 * (at - place) ** 2)
    assert found == pytest.approx(place)
    assert value == pytest.approx(1.5)
    assert curvature == pytest.approx(1.4)


def test_the_finest_detail_is_that_of_the_noise() -> None:
    """Second differences down and across have 36 times its variance; a slant leaves none of them."""
    slant = np.add.outer(np.arange(60.0), 2 * np.arange(80.0))
    assert noise_from_differences(slant) == pytest.approx(QUANTUM * (59 + 158))
    noise = 3.0 * RANDOM.standard_normal((400, 400))
    assert noise_from_differences(noise) == pytest.approx(3.0, rel=0.02)
    assert NoiseLaw(0.5, 2.0).variance(np.array([-3.0])) == 0.5  # no light is negative


def test_a_plane_with_and_without_a_jump_is_that_of_least_squares() -> None:
    """Of 30 values, their slopes with a prior; by the normal equations."""
    y, x, value = RANDOM.normal(size=(3, 30))
    weight, side = RANDOM.random(30), np.where(RANDOM.random(30) < 0.4, -0.5, 0.5)
    sums = planes.NOTHING
    for at in zip(weight, y, x, weight * value, side, strict=True):
        sums = planes.add(sums, *at)
    columns = np.stack([np.ones(30), y, x, side])
    normal = (weight * columns) @ columns.T + np.diag([0, 0.5**-2, 0.5**-2, 0])
    known = columns @ (weight * value)
    plane, explained = planes.fit_plane(sums, 0.5)
    assert plane == pytest.approx(np.linalg.solve(normal[:3, :3], known[:3]), rel=1e-6)
    assert explained == pytest.approx(plane @ known[:3])
    assert planes.fit_jump(sums, 0.5) == pytest.approx(np.linalg.solve(normal, known)[[0, 3]], rel=1e-6)
    one_side = planes.add(planes.add(planes.NOTHING, 1.0, 0.0, 0.0, 2.0, 0.5), 1.0, 1.0, 0.0, 3.0, 0.5)
    assert planes.fit_jump(one_side, 0.5) == (0.0, 0.0)


def test_a_plane_grows_to_itself_and_its_sd_is_that_of_the_weighted_mean() -> None:
    down, across = np.indices((25, 31))
    plane, weight = 3 + 0.4 * down - 0.3 * across, np.full((25, 31), 4.0)
    for windows in ([1.5], [0.8, 1.2, 1.5]):
        value, sd = planes.grow_planes(weight, weight * plane, plane, np.full((25, 31), 0.5), windows, 1e3, 49.0)
        assert value == pytest.approx(plane, abs=1e-6)
        fall = np.exp(-(np.arange(-4, 5) ** 2) / (2 * 1.5**2))
        assert sd[12, 15] == pytest.approx(0.5 / 2 * (fall**2).sum() / fall.sum() ** 2, rel=1e-6)
