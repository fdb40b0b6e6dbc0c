"""The filters that compare views: they keep noise as it is and let no scene of the right depth through."""

import numpy as np
import pytest
from blurred import PIXEL, lens, wall
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from focalgradient.depth.equalise.likelihood import Equalised, equalise
from focalgradient.depth.equalise.residuals import Residuals, whitened_filters
from focalgradient.depth.numerics import block_sum
from focalgradient.depth.search import Search
from focalgradient.psf import Disc

COUNTS = st.tuples(st.integers(2, 5), st.integers(1, 3), st.integers(1, 4))
TRANSFERS = hnp.arrays(float, COUNTS, elements=st.floats(-1, 1)).filter(lambda h: (np.abs(h).max(axis=0) > 1e-2).all())


def equalised_wall() -> Equalised:
    """Part of a wall's views at two apertures, 64 x 80 pixels, compared at every level."""
    views = wall([lens(16), lens(4)], 1.25)
    images = [np.ascontiguousarray(view.image[:64, :80], np.float32) for view in views]
    search = Search.over([view.optics for view in views], PIXEL, 1.0, None)
    return equalise(images, search.blurs(Disc()), [0.01, 0.01], window=8)


def residual_filters(transfers: np.ndarray) -> list[np.ndarray]:
    """Those of views in white noise, every frequency and view weighed alike."""
    white = np.zeros((0, *transfers.shape))
    return whitened_filters(transfers, white, np.ones_like(transfers), np.ones(transfers.shape[1:]))


@given(TRANSFERS)
@settings(deadline=None)  # the first call compiles
def test_orthonormal_and_blind_to_the_scene(transfers: np.ndarray) -> None:
    filters = residual_filters(transfers)
    assert len(filters) == len(transfers) - 1
    products = np.einsum("aiLF,biLF->LFab", filters, filters)
    assert products == pytest.approx(np.broadcast_to(np.eye(len(filters)), products.shape), abs=1e-3)
    for rows in filters:
        assert np.abs((rows * transfers).sum(axis=0)).max() < 1e-5


@pytest.mark.parametrize("at_a_time", [1, 4_000_000], ids=["one block at a time", "all at once"])
@pytest.mark.parametrize("low_rank", [True, False])
def test_blocks_whose_weight_changed_are_summed_again_and_no_others(
    low_rank: bool, at_a_time: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("focalgradient.depth.equalise.residuals.BAND", at_a_time)
    rng = np.random.default_rng(3)
    count, levels, step, shape = 4, 9, 3, (20, 31)  # neither side is a multiple of the block's
    coefficients = rng.normal(size=(levels, count)) if low_rank else None
    images = rng.normal(size=(count if low_rank else levels, *shape)).astype(np.float32)
    residuals = Residuals(images, coefficients, *(np.ones(levels) for _ in range(7)))
    before, after = (rng.random(shape) < 0.8).astype(np.float32), np.ones(shape, np.float32)
    after[:, :17] = before[:, :17]

    each = images if coefficients is None else np.tensordot(coefficients, images, 1)
    truth = np.zeros((levels, 7, 11))
    for (y, x), weight in np.ndenumerate(after):
        truth[:, y // step, x // step] += weight * each[:, y, x] ** 2
    assert residuals.energy(after, step) == pytest.approx(truth, rel=1e-5)

    energy = residuals.energy(before, step)
    blocks = block_sum((before != after).astype(np.float32), step) > 0
    assert 0 < blocks.mean() < 0.6
    energy[:, blocks] = residuals.energy_of_blocks(blocks, after, step)
    assert energy == pytest.approx(truth, rel=1e-5)
    assert residuals.energy_of_blocks(np.zeros_like(blocks), after, step).shape == (levels, 0)


def test_a_window_averages_the_squared_residual_of_the_pixels_that_are_usable() -> None:
    """Against the mean under a Gaussian of 8 pixels about a node; half of the pixels leave half of the window."""
    equalised = equalised_wall()
    step, weight = equalised.step, np.ones((64, 80), np.float32)
    mean, support = equalised.averages(equalised.energy(weight), weight)
    row, column = (side // 2 for side in support.shape)
    assert support[row, column] == pytest.approx(1, abs=0.01)
    down, across = ((np.arange(n) + 0.5 - (at + 0.5) * step) / 8 for n, at in ((64, row), (80, column)))
    under = np.exp(-(down[:, None] ** 2 + across**2) / 2)
    for number, level in enumerate(equalised.summed):
        residual = np.asarray(equalised.residuals[0].by_level())[level]
        assert mean[number, row, column] == pytest.approx((under * residual**2).sum() / under.sum(), rel=0.03)
    weight[:, ::2] = 0
    _, half = equalised.averages(equalised.energy(weight), weight)
    assert half[row, column] == pytest.approx(0.5, abs=0.02)
