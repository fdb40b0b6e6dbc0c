"""When an estimate of depth is valid, limits that every method shares, and the error of the blur model.

The difference of depth between two halves of the detail, beyond their noise, is attributed to an error in proportion to
the blur: random effects, as in meta-analysis (DerSimonian & Laird 1986).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import Mask

__all__ = [
    "BLUR_ERROR",
    "DOUBTFUL",
    "LARGEST_TAU",
    "LEAST_BLUR",
    "LEAST_BLUR_SD",
    "LEAST_NODES",
    "MIN_SUPPORT",
    "NEARLY_NOTHING",
    "OUTSIDE",
    "SECONDARY_MINIMUM",
    "TRIMMED",
    "blur_is_known",
    "random_effects",
]

LEAST_BLUR_SD, LEAST_SHARE = 0.3, 0.1
"""Maximum standard deviation of the blur radius for valid depth, in pixels and relative to the radius: whichever is
larger (our choice; with 0.3 pixel, the sign of one pixel of defocus is known to three standard deviations)."""

SECONDARY_MINIMUM = 9.0
"""Difference of cost (chi-square with one degree of freedom) within which a second minimum makes depth ambiguous: three
standard deviations."""

MIN_SUPPORT = 0.1
"""Minimum proportion of a window that must be usable. Chosen by hand."""

OUTSIDE = 0.3
"""Proportion of textured places outside the range searched, or the stack, above which none of them is valid, and above
which, in the whole frame, the range is named as the cause (our choice)."""

NEARLY_NOTHING = 0.01
"""Proportion of valid pixels below which a map counts as empty (our choice)."""

BLUR_ERROR = 0.03
"""Deviation of real lenses' blur from the model, relative to its radius, that is tolerated when views are compared (our
choice): about twice the 1.5 % by which edges of calibrated lenses depart from the law (`calibration.Priors`)."""


def blur_is_known(sd: ArrayLike, radius: ArrayLike, share: float = LEAST_SHARE) -> Mask:
    """Test whether a blur `radius` in pixels is known well enough: to 0.3 pixel, or to a `share` of it; broadcasts.

    >>> blur_is_known([0.2, 0.4, 0.4], [1.0, 1.0, 5.0]).tolist()
    [True, False, True]
    """
    return np.asarray(sd) <= np.maximum(LEAST_BLUR_SD, share * np.asarray(radius))


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
