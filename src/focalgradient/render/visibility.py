"""Which part of the lens a point is seen from: the nearer surfaces, projected from the point onto the lens.

A pixel of a nearer surface, higher by h pixels of vergence and d pixels aside, hides the point from the part of the
lens about d / h (in units of its radius) whose side is 1 / h. These parts are added up on a grid over the lens. A
surface whose slope is less than 1 hides no part of itself, and what hides little counts little: visibility is a
continuous function of depth.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["CELL", "LENS", "SHARE", "highest", "sees_all"]

LENS = 9
"""Cells of the grid across the lens."""

CELL = 8
"""Side in pixels of the cells of the picture whose nearest point is kept, to pass over those that hide nothing."""

FEWEST = 6.0
"""Samples of a nearer surface, at least, across the radius of the lens: far above, not every pixel is one."""

FADES, APART, SHARP = 1.0, 0.5, 0.1
"""Pixels of vergence above a visible point's own surface, continued, from which on another hides it, wholly from one
pixel more; the same above a hidden point; and how much more there."""

_compiled = njit(nogil=True, cache=True, error_model="numpy", fastmath=True)


def highest(vergence: NDArray[np.float32]) -> NDArray[np.float32]:
    """Nearest vergence in each cell of the picture."""
    height, width = vergence.shape
    wide = np.pad(vergence, ((0, -height % CELL), (0, -width % CELL)), mode="edge")
    return wide.reshape(wide.shape[0] // CELL, CELL, -1, CELL).max(axis=(1, 3))


def _parts() -> NDArray[np.float32]:
    """Share of the lens in each cell of its grid."""
    fine = (np.arange(32 * LENS) + 0.5) / (16 * LENS) - 1
    inside = np.hypot(*np.meshgrid(fine, fine)) < 1
    share = inside.reshape(LENS, 32, LENS, 32).mean(axis=(1, 3))
    return (share / share.sum()).astype(np.float32).reshape(-1)


SHARE = _parts()


@_compiled
def sees_all(  # type: ignore[no-untyped-def]
    vergence, cover, gradient_y, gradient_x, cells, top, i, j, here, visible, down, right, lens, scale, half, blocked
):
    """Add to `blocked` (side x side, in one line) the parts of the lens that are hidden from a point; True if none is.

    The point lies at row `i` and column `j`, at vergence `here`, on the visible surface or behind it. `cells` is
    `highest(vergence)`, `top` its maximum. `lens` is the radius to which the lens is looked at; the lens's radius is
    `scale` cells of the grid, whose side is 2 `half` + 1.
    """
    height, width = vergence.shape
    side = 2 * half + 1
    whole = True
    # From a slope of 1 on a surface hides parts of itself.
    down, right = min(max(down, np.float32(-1)), np.float32(1)), min(max(right, np.float32(-1)), np.float32(1))
    steep = np.float32(1) / lens
    own = np.float32(FADES if visible else APART)
    steepness = np.float32(1 if visible else 1 / SHARP)
    reach = int((top - here) * lens) // CELL + 1
    for p in range(max(i // CELL - reach, 0), min(i // CELL + reach + 1, cells.shape[0])):
        below = max(max(p * CELL - i, i - (p * CELL + CELL - 1)) - np.float32(0.5), np.float32(0)) * steep
        for q in range(max(j // CELL - reach, 0), min(j // CELL + reach + 1, cells.shape[1])):
            most = cells[p, q] - here
            if most <= below:
                continue
            aside = max(max(q * CELL - j, j - (q * CELL + CELL - 1)) - np.float32(0.5), np.float32(0)) * steep
            if most * most <= below * below + aside * aside:
                continue
            stride = 1
            while stride < CELL and (2 * stride) * max(abs(scale), np.float32(FEWEST)) <= most:
                stride *= 2
            shift = np.float32(0 if stride == 1 else 0.5)
            for a in range(p * CELL + stride // 2, min(p * CELL + CELL, height), stride):
                for b in range(q * CELL + stride // 2, min(q * CELL + CELL, width), stride):
                    above = vergence[a, b] - here
                    if above <= 0:
                        continue
                    y, x = a - i - shift, b - j - shift
                    excess = above - (np.sqrt(y * y + x * x) - np.float32(0.5)) * steep
                    excess = min(excess, above - down * y - right * x - own) * steepness
                    if excess <= 0:
                        continue
                    whole = False
                    # A slanted surface is seen foreshortened.
                    tilt = np.float32(1) - (y * gradient_y[a, b] + x * gradient_x[a, b]) / above
                    excess = min(excess, np.float32(1)) * cover[a, b] * max(tilt, np.float32(0))
                    ratio = scale / above
                    broad = np.float32(stride) * abs(ratio) / 2
                    y, x = y * ratio + half + np.float32(0.5), x * ratio + half + np.float32(0.5)
                    for v in range(max(int(y - broad), 0), min(int(y + broad), side - 1) + 1):
                        part = min(y + broad, np.float32(v + 1)) - max(y - broad, np.float32(v))
                        part *= excess
                        for w in range(max(int(x - broad), 0), min(int(x + broad), side - 1) + 1):
                            blocked[v * side + w] += max(
                                part * (min(x + broad, np.float32(w + 1)) - max(x - broad, np.float32(w))),
                                np.float32(0),
                            )
    return whole
