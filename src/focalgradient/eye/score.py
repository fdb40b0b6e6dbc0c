"""Scores of an eye's depth about its fixation: errors in dioptres, and whether the side of focus is right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["CLEAR", "score"]

CLEAR = 0.1
"""Minimum distance from fixation in dioptres at which the side of focus is scored."""


def score(
    vergence: NDArray[np.floating],
    valid: NDArray[np.bool_],
    distance: NDArray[np.floating],
    fixation: float,
    clear: float = CLEAR,
) -> dict[str, float]:
    """Score a map of `vergence` (D) where `valid` against the true `distance` (m) about a `fixation` (D).

    Returns
    -------
    dict
        ``valid``: share of the pixels; ``median_error_D``: median size of the error; ``rms_error_D``; ``bias_D``:
        its median, positive where too near; ``side_right``: share on the right side of the fixation, of the pixels
        that truly lie more than `clear` from it. NaN where nothing is to be counted.

    Examples
    --------
    >>> read, seen = np.array([1.2, 0.7, 1.4]), np.array([1.0, 1 / 0.8, 2.0])
    >>> found = score(read, read > 0, seen, fixation=1.0)
    >>> [round(found[name], 2) for name in ("median_error_D", "side_right")]
    [0.2, 0.5]
    """
    truth = 1 / distance
    error = (vergence - truth)[valid]
    off = valid & (np.abs(truth - fixation) > clear)
    right = np.sign(vergence - fixation)[off] == np.sign(truth - fixation)[off]
    return {
        "valid": float(np.mean(valid)),
        "median_error_D": float(np.median(np.abs(error))) if error.size else np.nan,
        "rms_error_D": float(np.sqrt(np.mean(error**2))) if error.size else np.nan,
        "bias_D": float(np.median(error)) if error.size else np.nan,
        "side_right": float(np.mean(right)) if right.size else np.nan,
    }
