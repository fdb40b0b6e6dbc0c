"""Error of the blur model, estimated from the difference of depth between coarse and fine detail.

The difference of two halves of the detail, beyond their noise, is attributed to an error in proportion to the blur:
random effects, as in meta-analysis (DerSimonian & Laird 1986). Every method that splits its detail states it so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["DOUBTFUL", "LARGEST_TAU", "LEAST_BLUR", "LEAST_NODES", "TRIMMED", "random_effects"]

LEAST_BLUR = 0.5
"""Minimum blur radius in pixels to which model error is relative: smaller blur is dominated by the pixel, which is one
pixel wide."""

DOUBTFUL = 0.05
"""Model error relative to the blur radius above which a warning is issued: 0 to 0.01 for correct models, up to 0.04 if
a part of one view was replaced."""

LARGEST_TAU = 0.25
"""Model error relative to the blur radius above which no depth is valid: a wrong blur shape gives up to 0.2."""

TRIMMED = 0.05
"""Proportion of grid points with the largest differences that is excluded: occlusion boundaries and contradictions are
not model error. Chosen by hand."""

LEAST_NODES = 30
"""Minimum number of grid points required to judge a model. Chosen by hand."""


def random_effects(
    difference: NDArray[np.floating], variance: NDArray[np.floating], unit: NDArray[np.floating]
) -> tuple[float, float]:
    """Estimate the sd of differences in excess of their noise, as a share of `unit`, and their mean share.

    Parameters
    ----------
    difference, variance
        N: what two halves of the detail differ by at each node, and the variance that noise gives it.
    unit
        N: the same as if the model erred by the whole blur.

    Examples
    --------
    >>> random = np.random.default_rng(0)
    >>> tau, mean = random_effects(random.normal(0.1, 0.02, 1000), np.full(1000, 0.02**2), np.full(1000, 2.0))
    >>> round(tau, 2), round(mean, 2)
    (0.05, 0.05)
    """
    ratio = difference**2 / variance
    kept = ratio <= np.quantile(ratio, 1 - TRIMMED)
    excess = (ratio[kept] - 1).sum() / (unit[kept] ** 2 / variance[kept]).sum()
    # An error of the whole blur at most.
    return float(np.sqrt(np.clip(excess, 0.0, 1.0))), float(np.mean((difference / unit)[kept]))
