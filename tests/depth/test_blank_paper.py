"""Dark squares on blank paper, photographed and stored as JPEG: paper far from any square claims no depth."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from sheets import TILE, views

from focalgradient import recover_depth
from focalgradient.errors import FocalGradientWarning

SIDE, GAP = 24, 80
DISTANCE = 1.4

PLACE = np.arange(TILE) % GAP < SIDE
PAPER = np.where(np.outer(PLACE, PLACE), 0.05, 0.8)
"""Even rows of squares."""


@pytest.mark.parametrize("quality", [90, 95])
def test_blank_paper_in_jpeg_claims_no_depth(quality: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        depth = recover_depth(views(PAPER, DISTANCE, quality), near=0.85)
    off = np.abs(depth.vergence - 1 / DISTANCE)[depth.valid] / depth.vergence_sd[depth.valid]
    assert depth.valid.mean() > 0.15  # on the squares' edges, and as far beside them as these reach
    assert (off > 5).mean() < 0.005
    assert (off < 2).mean() > 0.92
