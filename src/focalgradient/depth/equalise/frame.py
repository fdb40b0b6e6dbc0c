"""Depth of a whole frame at nodes, joined from its tiles; and what it is uncertain by near jumps of depth."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.outline_jumps import between_surfaces
from focalgradient.depth.equalise.outline_places import Conditions
from focalgradient.depth.equalise.outlines import Outlines, curvature_variance
from focalgradient.depth.equalise.robust import Refined
from focalgradient.depth.equalise.signal import informative_nodes
from focalgradient.depth.equalise.split_band import SplitBand
from focalgradient.depth.equalise.texture import OwnTexture
from focalgradient.depth.equalise.tiles import Tile, join_nodes, join_splits
from focalgradient.depth.equalise.wavebands import BandGains, common_error
from focalgradient.depth.filters import FloatArray
from focalgradient.depth.model_error import LEAST_BLUR
from focalgradient.depth.search import Blurs

__all__ = ["Frame", "NodeDepth", "depth_at_nodes"]

FILTER_REACH = 2.0
"""Distance over which filters carry one surface over another in different wavebands, in radii of blur: chosen by
hand."""


@dataclass(slots=True, eq=False)
class Frame:
    """What the tiles of a frame give, H x W each."""

    is_consistent: NDArray[np.bool_]  # whether a pixel's views agree
    texture: OwnTexture
    outlines: Outlines | None = None
    tiles: list[tuple[Tile, Nodes]] = field(default_factory=list)
    splits: list[SplitBand] = field(default_factory=list)

    @classmethod
    def empty(cls, shape: tuple[int, int]) -> Frame:
        """A frame of `shape`, to be filled."""
        texture = OwnTexture(np.empty(shape, np.bool_), np.empty(shape, np.float32))
        return cls(np.empty(shape, np.bool_), texture)

    def fill(self, tile: Tile, refined: Refined, split: SplitBand, outlines: Outlines | None) -> None:
        """Take what one tile gives."""
        self.is_consistent[tile.core] = refined.inliers.is_consistent[tile.within]
        self.texture.is_present[tile.core] = refined.texture.is_present[tile.within]
        self.texture.other_surface[tile.core] = refined.texture.other_surface[tile.within]
        self.tiles.append((tile, refined.nodes))
        self.splits.append(split)
        if outlines is not None:
            self.outlines = self.outlines or Outlines.none(self.is_consistent.shape)
            self.outlines.fill(tile, outlines)


@dataclass(frozen=True, slots=True, eq=False)
class NodeDepth:
    """Depth of a whole frame at nodes."""

    nodes: Nodes
    split: SplitBand
    jump_variance: FloatArray  # h x w, levels squared: of depth where it is not plane, or near jumps


def depth_at_nodes(
    frame: Frame,
    equalised: Equalised,
    blurs: Blurs,
    levels_per_pixel: float,
    gains: BandGains | None,
    outlines: bool,
) -> NodeDepth:
    """Join the tiles' depth at nodes, and raise its uncertainty near jumps of depth.

    Parameters
    ----------
    frame
        What the tiles give. In different wavebands, pixels between two surfaces are made inconsistent.
    equalised
        The step, the window and the levels that all tiles share.
    blurs, levels_per_pixel
        The views' blur at each level, and levels to a pixel of blur radius.
    gains
        What views in different wavebands share; None: all are in one.
    outlines
        Whether outlines were looked for.
    """
    shape = frame.is_consistent.shape
    nodes = join_nodes(frame.tiles, shape, equalised.step)
    given, split = Conditions(blurs.radius, levels_per_pixel), join_splits(frame.splits)
    if gains is None:
        variance = np.zeros(nodes.level.shape)
        if outlines:
            variance = curvature_variance(equalised, nodes, informative_nodes(nodes), given)
            # An error of the model bends depth, too, and is part of the sd already.
            by_model = split.tau * np.maximum(LEAST_BLUR, given.blur(nodes.level)) * levels_per_pixel
            variance = np.maximum(variance - by_model**2, 0)
        return NodeDepth(equalised.beside_jumps(nodes), split, variance)
    # No outline is looked for, and filters carry one side over the other as far as blur reaches.
    variance = equalised.farther_from_jumps(nodes, FILTER_REACH * float(np.median(given.blur(nodes.level))))
    nodes = equalised.beside_jumps(nodes)
    is_between, added = between_surfaces(equalised, nodes, informative_nodes(nodes, one_waveband=False), given)
    frame.is_consistent &= ~equalised.to_blocks(is_between, shape)
    moved = np.interp(nodes.level, np.arange(equalised.levels), common_error(gains, blurs))
    return NodeDepth(replace(nodes, sd=np.hypot(nodes.sd, moved)), split, variance + added)
