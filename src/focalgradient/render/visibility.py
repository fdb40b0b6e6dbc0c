"""Visibility: the parts of the lens from which a point is seen past nearer surfaces.

A pixel of a nearer surface, h pixels of vergence nearer and d pixels aside, hides the point from a part of the lens
centred on d / h (in lens radii) with side 1 / h. These parts are accumulated on a grid over the lens. A surface with
slope below 1 does not hide itself, and small occlusions have small weight: visibility is a continuous function of
depth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focalgradient.loops import reordered

__all__ = ["CELL", "LENS", "SHARE", "highest", "sees_all"]

LENS = 9
"""Number of grid cells across the lens."""

CELL = 8
"""Side in pixels of the picture's cells, whose nearest vergences allow skipping cells that hide nothing."""

MIN_SAMPLES = 6.0
"""Minimum number of samples of a nearer surface across the lens radius; far above it, pixels are subsampled."""

VISIBLE_OFFSET_PX, HIDDEN_OFFSET_PX, HIDDEN_TRANSITION_PX = 1.0, 0.5, 0.1
"""Vergence differences in pixels. A surface begins to hide a visible point at the first above that point's extrapolated
surface (complete one pixel later); it begins to hide a hidden point at the second, over a transition of the third."""


def highest(vergence: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the nearest vergence in each cell of the picture."""
    height, width = vergence.shape
    wide = np.pad(vergence, ((0, -height % CELL), (0, -width % CELL)), mode="edge")
    return wide.reshape(wide.shape[0] // CELL, CELL, -1, CELL).max(axis=(1, 3))


def _parts() -> NDArray[np.float32]:
    """Return the fraction of the lens in each cell of its grid."""
    fine = (np.arange(32 * LENS) + 0.5) / (16 * LENS) - 1
    inside = np.hypot(*np.meshgrid(fine, fine)) < 1
    share = inside.reshape(LENS, 32, LENS, 32).mean(axis=(1, 3))
    return (share / share.sum()).astype(np.float32).reshape(-1)


SHARE = _parts()


@reordered
def sees_all(  # type: ignore[no-untyped-def]
    vergence, cover, gradient_y, gradient_x, cells, top, i, j, here, visible, down, right, lens, scale, half, blocked
):
    """Add the parts of the lens that are hidden from a point to `blocked` (side x side, flattened); True if none is.

    The point lies at row `i` and column `j`, at vergence `here`, on the visible surface or behind it. `cells` is
    `highest(vergence)`, `top` its maximum. `lens` is the radius up to which the lens is considered; the lens's
    radius is `scale` cells of the grid, whose side is 2 `half` + 1.
    """
    height, width = vergence.shape
    side = 2 * half + 1
    whole = True
    # A surface hides parts of itself from a slope of 1.
    down, right = min(max(down, np.float32(-1)), np.float32(1)), min(max(right, np.float32(-1)), np.float32(1))
    steep = np.float32(1) / lens
    own = np.float32(VISIBLE_OFFSET_PX if visible else HIDDEN_OFFSET_PX)
    steepness = np.float32(1 if visible else 1 / HIDDEN_TRANSITION_PX)
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
            while stride < CELL and (2 * stride) * max(abs(scale), np.float32(MIN_SAMPLES)) <= most:
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
                    # Account for foreshortening of slanted surfaces.
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
