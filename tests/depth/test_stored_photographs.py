"""Flat sheets of known distance, photographed and stored: the standard deviation covers what compression errs."""

from __future__ import annotations

import judged
import numpy as np
from numpy.typing import NDArray
from sheets import TILE, natural, views


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
    depth, _ = judged.said(views(sheet, distance, quality), near=0.85)
    return float(depth.valid.mean()), np.abs(judged.over_sd(depth, distance))


def test_natural_texture_in_jpeg_is_covered() -> None:
    valid, off = over_sd(natural(np.random.default_rng(11)), 1.4, 90)
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


def test_blank_paper_in_jpeg_claims_no_depth() -> None:
    valid, off = over_sd(PAPER, 1.4, 90)
    assert valid > 0.15  # on the squares' edges, and as far beside them as these reach
    assert (off > 5).mean() < 0.005
    assert (off < 2).mean() > 0.92
