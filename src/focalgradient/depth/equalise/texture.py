"""Distinguish depths that rest on texture from minima of the cost that are not depths."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient.depth import numerics
from focalgradient.depth.equalise.levels import CHANGING
from focalgradient.depth.equalise.likelihood import Equalised, Nodes, ResidualStatistics
from focalgradient.depth.filters import Image, smoothed

__all__ = ["OwnTexture", "own_texture", "rests_on_texture"]

NARROW = 0.5
"""Size of the window for nearby texture relative to the window of depth. Chosen by hand, with `NEAR`."""

NEAR = 0.02
"""Minimum proportion of the information in the wide window that the narrow one must contain: a quarter for uniform
texture, less than this for an isolated edge more than 1.6 standard deviations of the wide window away."""

OWN_SD, OWN = 2.0, 0.1
"""Standard deviation in pixels of a pixel's own window; and minimum information per pixel there, relative to that in
the window of depth, for depth to be based on texture at the pixel: 1 on uniform texture, 0.4 at 2 pixels beyond the end
of texture, 0.07 at 4."""

MAX_GAP = 8
"""Maximum width in pixels of a gap in texture that still counts as textured, as texture is uneven: about the default
window. Chosen by hand."""

SEEN_LACK = 0.6
"""Expected information, relative to the contribution of noise to the derivative's power, above which its absence is
detectable: two standard deviations of the mean over a pixel's own window (0.28)."""

LACKING = 0.3
"""Information at a pixel, relative to the contribution of noise to the derivative's power, below which it has none: the
error of its mean over a pixel's own window (0.28)."""

LACK_SD, EVEN_CHANCE = 4.0, 0.1
"""Standard deviation in pixels of the window in which untextured pixels are counted; and proportion of these at which
the pixel is equally likely to belong to the untextured and to the textured surface. Blur and windows carry texture
about 5 pixels beyond its end, so that the proportion is 0.1 at the end itself."""

MOST_CURVATURE = 5.0
"""Ratio of the curvature of the cost to that implied by the residual's derivative above which the minimum is not a
depth: 0.5 to 3.2 at the true depth, 8 to thousands if the truth lies outside the search range (walls through eyes and
lenses, 5th to 95th percentile)."""


def rests_on_texture(
    equalised: Equalised, nodes: Nodes, local: ResidualStatistics, weight: Image, noise: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Test whether each node's depth rests on texture near it, and whether depth curves its cost.

    A blank surface beside a strong edge would take the edge's depth, with all that compression, the model and the
    linearised fit err there: its texture is in the window's tail. And a minimum must be a depth: the cost's curvature,
    from which `nodes` have their texture, must be the power of the residual's derivative beyond noise (White 1982).

    Parameters
    ----------
    equalised, nodes
        The views, compared at every level, and their depth.
    local
        Residual statistics of each pixel at that depth.
    weight
        H x W, 0 or 1: the pixels that are used.
    noise
        Noise variance in units of the one assumed.

    Returns
    -------
    near, curved_by_depth
        Both h x w.
    """
    by_noise, unit = (
        numerics.at_levels(noise * sum(getattr(r, name) for r in equalised.residuals), local.level)
        for name in ("noise_derivative", "noise_slope")
    )
    power, unit = (
        numerics.block_sum(weight * image, equalised.step).astype(np.float32)[None]
        for image in (local.slope - by_noise, unit)
    )
    window = equalised.window / equalised.step
    wide, narrow = (numerics.gather(power, size)[0] for size in (window, NARROW * window))
    curvature = nodes.texture * numerics.gather(unit, window)[0]
    by_depth = curvature <= MOST_CURVATURE * np.maximum(wide, 0)
    # At a focus that all views share, the derivative vanishes, and the cost goes by the fourth power of blur.
    return np.asarray(narrow >= NEAR * wide), by_depth | (equalised.even.rate_at(nodes.level) < CHANGING)


@dataclass(frozen=True, slots=True, eq=False)
class OwnTexture:
    """Where depth rests on texture at the pixel itself, H x W each."""

    is_present: NDArray[np.bool_]
    other_surface: Image  # probability that a pixel belongs to a surface without texture, beside that which is seen


def own_texture(
    equalised: Equalised, local: ResidualStatistics, weight: Image, noise: float, compressed: bool
) -> OwnTexture:
    """Test whether information about depth lies at each pixel, and not only beside it in its window.

    A blank surface beside a textured one is given the other's depth by every window that reaches over both. Where that
    with texture ends, blur leaves open to a few pixels. In `compressed` views small gaps in texture count as such, too:
    compression takes away what is weak, and leaves lone edges. The other arguments are those of `rests_on_texture`.
    """
    derivative = np.sum([r.noise_derivative for r in equalised.residuals], axis=0)
    by_noise = numerics.at_levels(noise * derivative, local.level)
    power = weight * (local.slope - by_noise)
    count, own_count = (smoothed(weight, sd) + 1e-6 for sd in (equalised.window, OWN_SD))
    around = smoothed(power, equalised.window) / count
    own = smoothed(power, OWN_SD) / own_count
    at_focus = equalised.even.rate_at_pixels(local.level) < CHANGING
    has = (own >= OWN * around) | (OWN * around < SEEN_LACK * by_noise) | at_focus
    shows = (own >= np.maximum(OWN * around, LACKING * by_noise)) | at_focus
    lacks = weight * ~(shows if compressed else _without_gaps(shows))
    share = smoothed(lacks, LACK_SD) / (smoothed(weight, LACK_SD) + 1e-6)
    return OwnTexture(_without_gaps(has), (share / (share + EVEN_CHANCE)).astype(np.float32))


def _without_gaps(textured: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Close gaps up to `MAX_GAP` pixels wide."""
    reach = MAX_GAP // 2
    disc = np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1]) <= MAX_GAP / 2
    wide = np.pad(textured, MAX_GAP, mode="edge").view(np.uint8)
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disc.view(np.uint8), borderValue=0)
    return closed[MAX_GAP:-MAX_GAP, MAX_GAP:-MAX_GAP].astype(np.bool_)
