"""Flat sheets of known distance, photographed and stored: the standard deviation covers what compression errs."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from sheets import TILE, natural, views

from focalgradient import recover_depth
from focalgradient.errors import FocalGradientWarning


def strewn(random: np.random.Generator) -> NDArray[np.float64]:
    """Small dark squares strewn over blank paper."""
    sheet = np.full((TILE, TILE), 0.8)
    for down, right in random.integers(0, TILE, (120, 2)):
        side = random.integers(4, 14)
        sheet[down : down + side, right : right + side] = random.uniform(0.05, 0.5)
    return sheet


PLACE = np.arange(TILE) % 80 < 24
PAPER = np.where(np.outer(PLACE, PLACE), 0.05, 0.8)
"""Even rows of dark squares on blank paper."""


def over_sd(sheet: NDArray[np.float64], distance: float, quality: int | None) -> tuple[float, NDArray[np.float64]]:
    """Share that is valid, and the errors of what is, over their standard deviations."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        depth = recover_depth(views(sheet, distance, quality), near=0.85)
    off = np.abs(depth.vergence - 1 / distance)[depth.valid] / depth.vergence_sd[depth.valid]
    return float(depth.valid.mean()), off


@pytest.mark.parametrize("distance", [1.1, 1.4])
def test_natural_texture_in_jpeg_is_covered(distance: float) -> None:
    valid, off = over_sd(natural(np.random.default_rng(11)), distance, 90)
    assert valid > 0.4
    assert (off < 2).mean() > 0.9
    assert (off > 5).mean() < 0.005


def test_natural_and_sparse_texture_without_compression_are_covered() -> None:
    valid, off = over_sd(natural(np.random.default_rng(11)), 1.1, None)
    assert valid > 0.95
    assert (off < 2).mean() > 0.9
    assert np.median(off) > 0.5  # 0.67 where errors are normal and their sd right
    valid, off = over_sd(strewn(np.random.default_rng(11)), 0.88, None)
    assert valid > 0.2  # blank paper beside the squares is not claimed
    assert (off < 2).mean() > 0.9
    assert (off > 5).mean() < 0.005


@pytest.mark.parametrize("quality", [90, 95])
def test_blank_paper_in_jpeg_claims_no_depth(quality: int) -> None:
    valid, off = over_sd(PAPER, 1.4, quality)
    assert valid > 0.15  # on the squares' edges, and as far beside them as these reach
    assert (off > 5).mean() < 0.005
    assert (off < 2).mean() > 0.92
