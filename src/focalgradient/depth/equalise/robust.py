"""Depth without the pixels whose views contradict each other, and without what blur carries in from beyond the frame.

Contradicting pixels mislead the windows around them, so they are found, left out, and looked for again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.depth.equalise.likelihood import Equalised, Nodes, ResidualStatistics
from focalgradient.depth.equalise.signal import informative_nodes
from focalgradient.depth.equalise.texture import OwnTexture, own_texture, rests_on_texture
from focalgradient.depth.equalise.tiles import Tile
from focalgradient.depth.filters import FloatArray, Image
from focalgradient.depth.numerics import HELD_APART, SMOOTH, Growth
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.validity import BLUR_ERROR

__all__ = ["Part", "Robust", "read_again", "robust_depth"]

CHECK_SIDE = 5
"""Side in pixels of the squares in which the views' agreement is tested."""

ERRS = 1.1
"""Median of what is left of the views, over the noise's power, from which more than noise is left: right models leave
0.99 to 1.01, JPEG of quality 90 about 1.5."""

SPECK = 3
"""Nodes across which depth must rest on texture for any of them to count: as far as two sd of a window reach."""

REACH = 1.2
"""How far into the frame the light from beyond it is felt, in radii of blur: filters reach little beyond one. On
walls, planes and steps with a lamp beyond the frame, or without one, 95 to 98 % of the rim lies within two sd with 1.0,
1.2, 1.5 and 2.0."""

ROUNDS = 6
"""Times that contradicting pixels are looked for, at most."""

SETTLED = 2e-3
"""Share of the pixels that changes in a round, below which the search for contradicting pixels ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Views of a frame or of a part of it, and what depth in them is estimated by."""

    views: RegisteredViews
    inward: NDArray[Any]  # H x W: pixels to the border of the whole frame
    false_alarm: float
    blur: FloatArray  # L: the largest blur radius in pixels at each level
    levels_per_pixel: float
    compressed: bool = False  # whether noise rises with contrast, as compression makes it

    def of(self, tile: Tile) -> Part:
        """A tile of it, with its overlap."""
        return replace(self, views=tile.of(self.views), inward=self.inward[tile.outer])

    def rim(self, equalised: Equalised) -> int:
        """Pixels from the border within which nothing is used."""
        return min(round(equalised.window), min(self.views.shape) // 8)

    def usable(self, equalised: Equalised) -> NDArray[np.bool_]:
        """Pixels that may be used at first (H x W)."""
        return self.views.usable & (self.inward >= self.rim(equalised))


@dataclass(frozen=True, slots=True, eq=False)
class Robust:
    """Depth as estimated without contradicting pixels."""

    nodes: Nodes
    agrees: NDArray[np.bool_]  # H x W: whether a pixel's views agree
    scale: float  # noise variance in units of the one assumed
    used: NDArray[np.bool_]  # H x W: pixels that depth rests on
    energy: Image  # L x h x w: their squared residuals, summed over each node's block
    within: NDArray[np.bool_]  # H x W: usable pixels that light from beyond the frame does not reach
    textured: OwnTexture
    images: list[tuple[Image, Image]]  # each comparison's residual at depth in the first windows, and its derivative


def robust_depth(
    equalised: Equalised, part: Part, used: NDArray[np.bool_], energy: Image, scale: float, growth: Growth = SMOOTH
) -> Robust:
    """Depth from pixels that do not contradict each other.

    Parameters
    ----------
    equalised, part
        The views, compared at every level, and what is known of them.
    used, energy
        Pixels to begin with (H x W), and their squared residuals summed over each node's block (L x h x w); changed.
    scale
        Noise variance in units of the one assumed.
    growth
        How planes grow.
    """
    tolerance = BLUR_ERROR * part.blur * part.levels_per_pixel
    usable, shape = part.views.usable, part.views.shape
    # Blur carries light in from beyond the frame: its rim is left out, and takes the depth of what lies next to it.
    rim = part.rim(equalised)
    middle = (slice(rim, -rim), slice(rim, -rim))
    weight = used.astype(np.float32)
    nodes = equalised.minima(*equalised.averages(energy, weight), scale)
    for _ in range(ROUNDS):
        local, before = equalised.evaluate(nodes), used
        agreement = equalised.agreement(local, scale, CHECK_SIDE, part.false_alarm, tolerance)
        agrees = usable & np.pad(agreement[middle], rim, mode="edge")
        reach = REACH * np.interp(local.level, np.arange(equalised.levels), part.blur)
        within = usable & (part.inward >= np.clip(reach, rim, min(shape) / 6))
        used = agrees & within
        weight, changed = used.astype(np.float32), before ^ used
        if changed.mean() < SETTLED:
            break
        equalised.sum_again(energy, weight, changed)
        nodes = equalised.minima(*equalised.averages(energy, weight), scale)
    first = equalised.refine(nodes, equalised.evaluate_to_refine(nodes, local), weight, scale, growth.first)
    first = replace(first, sd=nodes.sd)
    local, images = equalised.evaluate_images(first)
    nodes = equalised.refine(first, equalised.evaluate_to_refine(first, local), weight, scale, growth)
    nodes = _with_texture_of_its_own(equalised, nodes, local, weight, scale)
    summed = before if changed.mean() < SETTLED else used
    textured = own_texture(equalised, local, weight, scale, part.compressed)
    return Robust(nodes, agrees, scale, summed, energy, within, textured, images)


def read_again(
    robust: Robust, equalised: Equalised, tile: Tile, kept: NDArray[np.bool_]
) -> tuple[Nodes, NDArray[np.bool_]]:
    """Depth at a tile's nodes from its pixels of `kept` (H x W) alone, and the nodes where it rests on signal."""
    before = robust.used[tile.outer]
    weight, energy = (before & kept).astype(np.float32), robust.energy[:, *tile.outer_nodes(equalised.step)].copy()
    equalised.sum_again(energy, weight, before & ~kept)
    nodes = equalised.minima(*equalised.averages(energy, weight), robust.scale)
    sd = nodes.sd
    for growth in (HELD_APART.first, HELD_APART):
        beside = equalised.evaluate_to_refine(nodes, equalised.evaluate(nodes))
        nodes = equalised.refine(replace(nodes, sd=sd), beside, weight, robust.scale, growth)
    return nodes, informative_nodes(nodes)


def _with_texture_of_its_own(
    equalised: Equalised, nodes: Nodes, local: ResidualStatistics, weight: Image, scale: float
) -> Nodes:
    """The same nodes, without texture where it lies far away, or shows in hardly a node among others without any."""
    near, by_depth = rests_on_texture(equalised, nodes, local, weight, scale)
    nodes = replace(nodes, texture=np.where(near, nodes.texture, 0), curved_by_depth=by_depth)
    found = informative_nodes(nodes)
    if not found.any() or np.median(nodes.misfit[found]) < ERRS:
        return nodes
    # Windows overlap, so that texture shows in several nodes side by side; compression of blank paper, in one or two.
    specks = found & ~ndimage.binary_opening(found, np.ones((SPECK, SPECK), np.bool_))
    return replace(nodes, texture=np.where(specks, 0, nodes.texture))
