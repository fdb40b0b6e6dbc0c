"""The filters that compare views: they keep noise as it is and let no scene of the right depth through."""

import numpy as np
import pytest
from blurred import PIXEL, lens
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from focalgradient.depth.equalise.residuals import residual_filters
from focalgradient.psf import transfer

COUNTS = st.tuples(st.integers(2, 5), st.integers(1, 3), st.integers(1, 4))
TRANSFERS = hnp.arrays(float, COUNTS, elements=st.floats(-1, 1)).filter(lambda h: (np.abs(h).max(axis=0) > 1e-2).all())


@given(TRANSFERS)
def test_orthonormal_and_blind_to_the_scene(transfers: np.ndarray) -> None:
    filters = residual_filters(transfers)
    assert len(filters) == len(transfers) - 1
    products = np.einsum("aiLF,biLF->LFab", filters, filters)
    # `tiny` guards against division by zero where all the views but one have lost everything.
    lost = np.minimum.accumulate(np.sort(np.abs(transfers), axis=0), axis=0)[0] < 1e-4
    assert products[~lost] == pytest.approx(np.broadcast_to(np.eye(len(filters)), products.shape)[~lost], abs=1e-3)
    for rows in filters:
        assert np.abs((rows * transfers).sum(axis=0)).max() < 1e-5


@pytest.mark.parametrize("psf", ["disc", "gaussian"])
def test_what_is_left_of_a_scene_is_nothing_and_of_noise_all_that_is_unexplained(psf: str) -> None:
    """n views hold one scene and n - 1 comparisons: together, projection onto what the scene cannot explain."""
    lenses = [lens(16), lens(8), lens(5.6, 1.1), lens(np.inf)]
    frequency, vergence = np.linspace(0, 0.5, 60), np.linspace(0.3, 1.6, 30)[:, None]
    transfers = np.stack(
        [
            transfer(frequency, one.aperture_diameter / 2 / PIXEL * abs(one.focus_vergence - vergence), psf)
            for one in lenses
        ]
    )
    filters = np.stack(residual_filters(transfers))
    random = np.random.default_rng(0)
    scene = random.standard_normal(transfers.shape[1:])
    assert np.abs((filters * transfers * scene).sum(axis=1)).max() < 1e-4
    noise = random.standard_normal(transfers.shape)
    explained = (noise * transfers).sum(axis=0) ** 2 / (transfers**2).sum(axis=0)
    left = ((filters * noise).sum(axis=1) ** 2).sum(axis=0)
    assert left == pytest.approx((noise**2).sum(axis=0) - explained, abs=1e-3)
