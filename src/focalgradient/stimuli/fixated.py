"""Positions and distances of the nearest and farthest parts of a picture, from its depth map."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import distance_transform_edt

from focalgradient.errors import InputError
from focalgradient.stimuli.sets import Fixation

__all__ = ["innermost", "target_of"]

EXTREME_FRACTION = 0.02
"""Fraction of the pixels counted as nearest, or farthest, to exclude outliers of measured depth (a design choice)."""


def target_of(
    distance: ArrayLike, fixation: Fixation, position: tuple[float, float] | None = None
) -> tuple[tuple[float, float], float]:
    """Return the position of the nearest or farthest part of a picture, and its distance.

    Parameters
    ----------
    distance
        Distance in metres along the axis, H x W; ``inf`` for sky, which is never fixated.
    fixation
        ``"nearest"`` or ``"farthest"``: the innermost pixel of the region of the nearest or farthest 2 % of the pixels.
    position
        Position to use instead, in pixels from the upper left corner, right and down.

    Returns
    -------
    tuple
        The position, and the distance there in metres.

    Raises
    ------
    InputError
        If the distance is infinite there, or everywhere.

    Examples
    --------
    >>> wall = np.full((9, 9), 2.0)
    >>> wall[3:6, 2:5] = 1.0
    >>> target_of(wall, "nearest")
    ((3.5, 4.5), 1.0)
    """
    metres = np.asarray(distance, float)
    if position is None:
        finite = np.isfinite(metres)
        if not finite.any():
            raise InputError("distance is infinite everywhere, so that nothing can be in focus: give another depth.")
        if fixation == "nearest":
            region = finite & (metres <= np.quantile(metres[finite], EXTREME_FRACTION))
        else:
            region = finite & (metres >= np.quantile(metres[finite], 1 - EXTREME_FRACTION))
        position = innermost(region)
    found = float(metres[int(position[1]), int(position[0])])
    if not np.isfinite(found):
        raise InputError(
            f"the distance at {position[0]:g}, {position[1]:g} px is infinite, so that it cannot be in focus: "
            "give another position."
        )
    return position, found


def innermost(region: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the centre of the pixel of a region that is farthest from its border, in pixels, right and down.

    >>> innermost(np.ones((5, 5), bool))
    (2.5, 2.5)
    """
    inside = distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1]
    row, column = np.unravel_index(int(np.argmax(inside)), region.shape)
    return float(column) + 0.5, float(row) + 0.5
