"""Unmixing of pixels at occlusion boundaries into the radiance of the near and of the far surface.

A pixel averages radiance over its area but has one depth. Where a near surface covers part of it, the radiance of the
far surface would be blurred as if near, or vice versa, which leaves a line along the boundary. The covered fraction is
estimated, as in matting, from the radiance of the two surfaces beside the pixel, of which the pixel's radiance is a
weighted mean; where the two look alike the fraction cannot be estimated and has no effect.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from focalgradient.arrays import FloatImage
from focalgradient.loops import reordered
from focalgradient.parallel import share_rows

__all__ = ["NOTHING", "parted"]

NEIGHBOURHOOD_PX = 2
"""Radius in pixels of the neighbourhood from which the radiance of the two surfaces is taken."""

SAME_SURFACE_PX, SEPARATE_SURFACES_PX = 1.0, 2.0
"""Vergence differences (px) between neighbours: up to the first they belong to one surface, from the second to two; in
between, the unmixing is weighted linearly. The whole lens sees a surface whose slope is less than 1."""

NOTHING = -1e30
"""Vergence that marks the absence of a hidden point."""

MAX_COVER = 0.5
"""Maximum fraction of a pixel covered by the other surface, since depth is that of the pixel's centre."""

PRIOR_MEAN, PRIOR_VARIANCE = 1 / 8, 0.03
"""Prior mean and variance of the fraction of a pixel covered by the other surface: a boundary at a random position
between two pixel centres covers 0 to 1/2 of one of them, and none of the other."""


def parted(
    image: FloatImage, vergence: FloatImage
) -> tuple[FloatImage, FloatImage, FloatImage, FloatImage, FloatImage]:
    """Unmix the pixels that an occlusion boundary crosses.

    The input is radiance (H x W x channels) and vergence in pixels (H x W). Returns radiance and vergence of the near
    surface; its coverage of each pixel, 1 away from boundaries; and radiance and vergence of the far surface in unmixed
    pixels (`NOTHING` elsewhere).
    """
    light, near = image.copy(order="C"), vergence.copy(order="C")
    cover = np.ones_like(near)
    behind, far = np.zeros_like(light), np.full_like(near, NOTHING)
    share_rows(len(vergence), partial(_part, image, vergence, light, near, cover, behind, far))
    return light, near, cover, behind, far


@reordered
def _jumps(vergence, i, j):  # type: ignore[no-untyped-def]
    """Return the vergence differences of the nearest and the farthest neighbour from a pixel."""
    height, width = vergence.shape
    up, down = np.float32(0), np.float32(0)
    for a in range(max(i - 1, 0), min(i + 2, height)):
        for b in range(max(j - 1, 0), min(j + 2, width)):
            jump = vergence[a, b] - vergence[i, j]
            up, down = max(up, jump), max(down, -jump)
    return up, down


@reordered
def _part(image, vergence, light, near, cover, behind, far, first, last):  # type: ignore[no-untyped-def]
    height, width, channels = image.shape
    sums = np.empty((2, channels), np.float32)
    for i in range(first, last):
        for j in range(width):
            up, down = _jumps(vergence, i, j)
            jump = max(up, down)
            if jump <= SAME_SURFACE_PX:
                continue
            here = vergence[i, j]
            other = here + up if up > down else here - down
            # Mean radiance of both surfaces over pixels that no boundary crosses, and its variance.
            sums[:] = 0
            count0, count1, squares = np.float32(0), np.float32(0), np.float32(0)
            for a in range(max(i - NEIGHBOURHOOD_PX, 0), min(i + NEIGHBOURHOOD_PX + 1, height)):
                for b in range(max(j - NEIGHBOURHOOD_PX, 0), min(j + NEIGHBOURHOOD_PX + 1, width)):
                    own, its = abs(vergence[a, b] - here), abs(vergence[a, b] - other)
                    if min(own, its) > jump / 4:
                        continue
                    above, below = _jumps(vergence, a, b)
                    if max(above, below) > SAME_SURFACE_PX:
                        continue
                    side = 0 if own < its else 1
                    if side == 0:
                        count0 += 1
                    else:
                        count1 += 1
                    for c in range(channels):
                        sums[side, c] += image[a, b, c]
                        squares += image[a, b, c] ** 2
            if count0 == 0 or count1 == 0:
                continue
            along, apart = np.float32(0), np.float32(0)
            for c in range(channels):
                sums[0, c] /= count0
                sums[1, c] /= count1
                squares -= count0 * sums[0, c] ** 2 + count1 * sums[1, c] ** 2
                step = sums[1, c] - sums[0, c]
                along += step * (image[i, j, c] - sums[0, c])
                apart += step * step
            noise = max(squares, np.float32(0)) / max(count0 + count1 - 2, np.float32(1))
            share = (along + noise * np.float32(PRIOR_MEAN / PRIOR_VARIANCE)) / (
                apart + noise / np.float32(PRIOR_VARIANCE) + np.float32(1e-20)
            )
            share = min(max(share, np.float32(0)), np.float32(MAX_COVER))
            share *= min(
                (jump - np.float32(SAME_SURFACE_PX)) / np.float32(SEPARATE_SURFACES_PX - SAME_SURFACE_PX), np.float32(1)
            )
            if up > down:
                near[i, j], far[i, j], cover[i, j] = other, here, share
            else:
                far[i, j], cover[i, j] = other, 1 - share
            # The residual is texture: attributed to the two surfaces by coverage.
            own = (1 - share) / ((1 - share) ** 2 + share**2)
            its = share / ((1 - share) ** 2 + share**2)
            for c in range(channels):
                left = image[i, j, c] - (1 - share) * sums[0, c] - share * sums[1, c]
                if up > down:
                    behind[i, j, c], light[i, j, c] = sums[0, c] + own * left, sums[1, c] + its * left
                else:
                    behind[i, j, c], light[i, j, c] = sums[1, c] + its * left, sums[0, c] + own * left
