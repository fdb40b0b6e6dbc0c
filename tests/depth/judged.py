"""Depth recovered, with what is said meanwhile, and how it lies against a known distance."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from focalgradient import DepthMap, View, recover_depth


def said(views: Sequence[View], **how: Any) -> tuple[DepthMap, str]:
    """Return depth, and the warnings, joined."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        depth = recover_depth(views, **how)
    return depth, "\n".join(str(one.message) for one in caught)


def over_sd(depth: DepthMap, distance: ArrayLike) -> np.ndarray:
    """Return the errors of the valid pixels, over their standard deviations; `distance` is one, or that of each."""
    return ((depth.vergence - 1 / np.asarray(distance, float)) / depth.vergence_sd)[depth.valid]


def covered(depth: DepthMap, distance: ArrayLike) -> float:
    """Return the share of the valid pixels that lie within two standard deviations of the truth."""
    return float((np.abs(over_sd(depth, distance)) < 2).mean())


def check(depth: DepthMap, distance: float, *, valid: float = 0.95, rel: float = 0.01) -> None:
    """Assert that this share of a wall is valid, and its median distance right."""
    assert depth.valid.mean() > valid
    assert abs(np.median(depth.distance[depth.valid]) / distance - 1) < rel
