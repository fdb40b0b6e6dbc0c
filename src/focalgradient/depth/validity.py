"""When an estimate of depth is valid: limits that every method shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["BLUR_ERROR", "SECONDARY_MINIMUM", "blur_is_known"]

LEAST_BLUR_SD, LEAST_SHARE = 0.3, 0.1
"""Standard deviation of a blur radius, in pixels and as a share of it, up to which depth is valid: the greater holds.

A choice: at 0.3 pixel the side of a blur from zero is still known by three standard deviations at one pixel.
"""

SECONDARY_MINIMUM = 9.0
"""Difference of cost (chi-square of one degree) within which a second minimum leaves depth ambiguous: three standard
deviations."""

BLUR_ERROR = 0.03
"""Error of real lenses' blur against the model, as a share of its radius, that is not yet a contradiction of views.

A choice: about twice the 1.5 % by which calibrated lenses' edges depart from the law (`calibration.Priors`).
"""


def blur_is_known(sd: ArrayLike, radius: ArrayLike, share: float = LEAST_SHARE) -> NDArray[np.bool_]:
    """Test whether a blur `radius` in pixels is known well enough: to 0.3 pixel, or to a `share` of it; broadcasts.

    >>> blur_is_known([0.2, 0.4, 0.4], [1.0, 1.0, 5.0]).tolist()
    [True, False, True]
    """
    return np.asarray(sd) <= np.maximum(LEAST_BLUR_SD, share * np.asarray(radius))
