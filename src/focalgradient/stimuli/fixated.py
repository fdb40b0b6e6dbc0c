"""Where the nearest and the farthest things of a picture lie, from its depth."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import distance_transform_edt

from focalgradient.errors import InputError
from focalgradient.stimuli.sets import Fixation

__all__ = ["target_of"]

SHARE = 0.02
"""Share of the pixels that are nearest, and that are farthest, not outliers of a measured depth. Our choice."""


def target_of(
    distance: ArrayLike, fixation: Fixation, position: tuple[float, float] | None = None
) -> tuple[tuple[float, float], float]:
    """Where the nearest or farthest thing is, and how far away.

    Parameters
    ----------
    distance
        In metres along the axis, H x W; ``inf`` for sky, which is never fixated.
    fixation
        ``"nearest"`` or ``"farthest"``: of the 2 % of the pixels that are, the one deepest inside its region.
    position
        In its place, in pixels from the upper left corner, right and down.

    Returns
    -------
    tuple
        The position, and the distance there in metres.

    Raises
    ------
    InputError
        If the distance there is infinite, or everywhere.

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
            region = finite & (metres <= np.quantile(metres[finite], SHARE))
        else:
            region = finite & (metres >= np.quantile(metres[finite], 1 - SHARE))
        inside = distance_transform_edt(np.pad(region, 1))[1:-1, 1:-1]
        row, column = np.unravel_index(int(np.argmax(inside)), region.shape)
        position = (float(column) + 0.5, float(row) + 0.5)
    found = float(metres[int(position[1]), int(position[0])])
    if not np.isfinite(found):
        raise InputError(
            f"the distance at {position[0]:g}, {position[1]:g} px is infinite, so that it cannot be in focus: "
            "give another position."
        )
    return position, found
