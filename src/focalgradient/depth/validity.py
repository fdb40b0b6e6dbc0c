"""When an estimate of depth is valid: limits that every method shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["BLUR_ERROR", "LEAST_BLUR_SD", "MIN_SUPPORT", "OUTSIDE", "SECONDARY_MINIMUM", "blur_is_known"]

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

BLUR_ERROR = 0.03
"""Deviation of real lenses' blur from the model, relative to its radius, that is tolerated when views are compared (our
choice): about twice the 1.5 % by which edges of calibrated lenses depart from the law (`calibration.Priors`)."""


def blur_is_known(sd: ArrayLike, radius: ArrayLike, share: float = LEAST_SHARE) -> NDArray[np.bool_]:
    """Test whether a blur `radius` in pixels is known well enough: to 0.3 pixel, or to a `share` of it; broadcasts.

    >>> blur_is_known([0.2, 0.4, 0.4], [1.0, 1.0, 5.0]).tolist()
    [True, False, True]
    """
    return np.asarray(sd) <= np.maximum(LEAST_BLUR_SD, share * np.asarray(radius))
