"""Depth about outlines: where one surface ends before another, each goes on to the outline by its own depth.

About an outline the blur of the near surface lies over the far one, and filters and windows reach across: a band of
pixels contradicts every depth. On either side of it surfaces are known, and each is continued into it as a plane. How
far the band reaches to either side of the outline follows from the blur: the near surface's residual is large up to
where the filters that compare it reach the outline, the far surface's up to where the near one's blur reaches. So the
outline lies where the distances to the pixels that either surface explains say that it does; beyond it, each surface is
continued from nodes that the band does not reach: depth is estimated again without the pixels of the band, and the
outline is moved to an edge of the views (`outline_edges`). Near the outline the standard deviation holds the
probability of being on its other side; the band's width says how sure its place is.

All this from windows narrower than elsewhere, in which depth about an outline takes less of the other side's; what
wider windows carry over an outline is replaced by what these give.

A jump too small for views to contradict each other is found by depth on either side of it (`outline_jumps`). One too
small even for that blurs into a steep stretch of one surface, which the views cannot tell from it: where depth departs
from a plane within the reach of blur, the departure is part of the standard deviation, outline or not.

How far residuals reach (`ONSET`), and the other choices here, were made on the scenes `MADE_WITH` of
`benchmarks/depth_at_outlines.py`, and tried on others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from focalgradient.depth.equalise import surfaces
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.outline_jumps import find_small_jumps, small_jumps
from focalgradient.depth.equalise.outline_places import (
    CLEAR,
    GAP,
    Located,
    few_large,
    locate,
    squared_residual,
    zone_reach,
)
from focalgradient.depth.equalise.tiles import Tile, tiles_about
from focalgradient.depth.filters import FloatArray, Image
from focalgradient.depth.model_error import LEAST_BLUR
from focalgradient.depth.numerics import block_sum
from focalgradient.depth.validity import blur_is_known

__all__ = ["Outlines", "curvature_variance", "find_outlines", "may_jump", "overlap"]

SAME = 0.75
"""Difference of blur radius, in pixels, up to which depths may belong to one curved surface."""

EXPLAINED = 0.9
"""Share of a node's pixels that its depth must explain for a surface to be continued from there."""

AGREE = 2.0
"""Standard deviations of their difference up to which depth read again agrees with what it was at first."""

AWAY = 1.0
"""Windows beyond these pixels from which depth that windows gave at first stays."""

FEW = 2
"""Nodes clear of outlines up to which a side is continued from all of its nodes."""

SMALL_SD = 4.0
"""The same where only depth shows the jump."""

CHANGED = 0.3
"""Share of depth's change beside a small jump that is its standard deviation."""

REJECTED = 1.5
"""Pixels to either side of an outline where no depth is claimed."""

HALF = 0.5
"""Share of the pixels that a surface must explain beside an outline for it to be continued to there; and of a node's
pixels that must be clear of outlines."""

SLACK = 3.0
"""Pixels beyond the reach of an outline where a contradiction may still be due to it."""

WIDE = 4.0
"""Windows within which pixels contribute to a node's depth, as windows grow: beyond 2.2 of the widest of 1.7."""

BEYOND = 2.0
"""Windows beyond the reach of an outline in which windows may give no depth because of it."""

BROAD = 3
"""Nodes across which views must contradict each other for an outline to be looked for there: on blank paper and steep
planes they do so in one or two."""

OVER = 2.0
"""Windows from an outline in which they carry depth of either side over it."""


Value = TypeVar("Value", bound=np.generic)
Again = tuple[Nodes, NDArray[np.bool_]]
ReadAgain = Callable[[Equalised, Tile, NDArray[np.bool_]], Again]


@dataclass(frozen=True, slots=True, eq=False)
class Outlines:
    """Depth about outlines, H x W each."""

    side: NDArray[np.int8]  # 1 at an outline on its near side, -1 on its far side, 0 elsewhere
    replaced: NDArray[np.bool_]  # where the depth that windows give gives way to this
    valid: NDArray[np.bool_]
    level: NDArray[np.float32]
    sd: NDArray[np.float32]  # of the surface, in levels
    side_sd: NDArray[np.float32]  # because a pixel may lie on the other side, in levels

    @classmethod
    def none(cls, shape: tuple[int, int]) -> Outlines:
        """No outlines in a frame of `shape`, to be filled by tiles: what is not touched takes no memory."""
        return cls(
            *(np.zeros(shape, np.int8), np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)),
            *(np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)),
        )

    def fill(self, tile: Tile, part: Outlines) -> None:
        """Take the outlines of a tile; of depth what is replaced alone, for memory."""
        for name in ("side", "replaced", "valid"):
            getattr(self, name)[tile.core] = getattr(part, name)[tile.within]
        at = part.replaced[tile.within]
        for name in ("level", "sd", "side_sd"):
            getattr(self, name)[tile.core][at] = getattr(part, name)[tile.within][at]

    def before(self, other: Outlines) -> Outlines:
        """These outlines, and the `other` ones where these replace nothing."""
        return Outlines(*(np.where(self.replaced, getattr(self, n), getattr(other, n)) for n in self.__slots__))


def find_outlines(
    equalised: Equalised,
    nodes: Nodes,
    read_again: ReadAgain,
    informative: NDArray[np.bool_],
    agrees: NDArray[np.bool_],
    radii: FloatArray,
    levels_per_pixel: float,
    noise: float,
    images: Sequence[Image],
    tau: float = 0.0,
    wider: float = 0.0,
) -> Outlines | None:
    """Outlines among the depths of `nodes`, and depth on either side of them; None where there are none.

    Parameters
    ----------
    equalised
        The views, compared at every level.
    nodes
        Depth as windows give it, without contradicting pixels.
    read_again
        Given a part of the comparison, the tile that it is, and those of its pixels that may be used (H x W): depth at
        its nodes from these alone, and where it rests on signal.
    informative
        h x w: nodes whose depth rests on signal.
    agrees
        H x W: pixels whose views agree.
    radii
        Each view's blur radius in pixels at each level.
    levels_per_pixel
        Levels to a pixel of blur radius.
    noise
        Noise variance in units of the one assumed.
    images
        The views themselves, H x W each.
    tau
        Error of the blur model as a share of the blur: what it explains is no jump.
    wider
        Windows, in pixels, in which depth is estimated where there are no outlines: as far as these reach over an
        outline, depth of `nodes` replaces it, too.
    """
    shape, gap, step = agrees.shape, GAP * levels_per_pixel, equalised.step
    level, sd = (equalised.to_pixels(values, nodes.sd, shape) for values in (nodes.level, nodes.sd))
    clean = few_large(squared_residual(equalised, level, sd, radii, levels_per_pixel, noise)) & agrees
    good = informative & blur_is_known(nodes.sd / levels_per_pixel, 0.0) & (_share(clean, step) >= EXPLAINED)
    jump_sd = _jump_sd(equalised, nodes, radii, levels_per_pixel, tau)
    sound = agrees & equalised.to_blocks(informative, shape)
    small = _small(equalised, nodes, jump_sd, good, sound, radii, levels_per_pixel, images)
    jumps = surfaces.pairs(surfaces.planes(nodes.level, nodes.sd, good, gap), jump_sd, good, gap)
    found, there = None, np.zeros(good.shape, np.bool_) if jumps is None else jumps[..., 0] >= 0
    for tile in tiles_about(there, step, shape, zone_reach(radii, equalised.window), overlap(equalised)):
        within = tile.outer_nodes(step)
        here = equalised.part(*tile.outer)
        large = _find_large(
            here,
            nodes.part(*within),
            partial(read_again, here, tile),
            np.ascontiguousarray(good[within]),
            np.ascontiguousarray(clean[tile.outer]),
            radii,
            levels_per_pixel,
            noise,
            [np.ascontiguousarray(image[tile.outer]) for image in images],
            tau,
        )
        if large is not None:
            found = found or Outlines.none(shape)
            found.fill(tile, large)
    ends = found.before(small) if found and small else found or small
    if ends is None or not ends.side.any():
        return ends
    # Beside outlines, what these windows give takes the place of what wider ones carry over them.
    curved = nodes.sd**2 + curvature_variance(nodes, informative, radii, equalised, levels_per_pixel)
    reach = np.interp(level, np.arange(equalised.levels), radii.max(axis=0)) + OVER * wider
    beside = (ndimage.distance_transform_edt(ends.side == 0) <= reach) & ~ends.replaced
    ends.replaced[beside] = True
    ends.level[beside] = level[beside]
    ends.sd[beside] = equalised.to_pixels(np.sqrt(curved), nodes.sd, shape)[beside]
    ends.valid[beside] = (agrees & equalised.to_blocks(informative, shape))[beside]
    return ends


def may_jump(
    equalised: Equalised,
    nodes: Nodes,
    informative: NDArray[np.bool_],
    agrees: NDArray[np.bool_],
    radii: FloatArray,
    levels_per_pixel: float,
    tau: float,
) -> NDArray[np.bool_]:
    """Nodes (h x w) at or near which depth may jump: where it does, or where the views contradict each other.

    Arguments are those of `find_outlines`.
    """
    gap = GAP * levels_per_pixel
    sd = _jump_sd(equalised, nodes, radii, levels_per_pixel, tau)
    jumps = surfaces.pairs(surfaces.planes(nodes.level, nodes.sd, informative, gap), sd, informative, gap)
    some = small_jumps(equalised, replace(nodes, sd=sd), informative, radii, levels_per_pixel)
    some |= ndimage.binary_opening(_share(agrees, equalised.step) < HALF, np.ones((BROAD, BROAD), np.bool_))
    return some if jumps is None else some | (jumps[..., 0] >= 0)


def _jump_sd(equalised: Equalised, nodes: Nodes, radii: FloatArray, levels_per_pixel: float, tau: float) -> FloatArray:
    """Standard deviation of depth at nodes where it may jump, in levels: with the error of the blur model."""
    blur = np.maximum(LEAST_BLUR, np.interp(nodes.level, np.arange(equalised.levels), radii.max(axis=0)))
    return np.hypot(nodes.sd, tau * levels_per_pixel * blur)


def overlap(equalised: Equalised) -> int:
    """Pixels beyond a tile's core from which depth in it is worked out."""
    return equalised.step * surfaces.FARTHEST + round(WIDE * equalised.window)


def _find_large(
    equalised: Equalised,
    nodes: Nodes,
    read_again: Callable[[NDArray[np.bool_]], Again],
    good: NDArray[np.bool_],
    clean: NDArray[np.bool_],
    radii: FloatArray,
    levels_per_pixel: float,
    noise: float,
    images: Sequence[Image],
    tau: float,
) -> Outlines | None:
    """Depth on either side of jumps at which views contradict each other; None where there are none.

    `good` nodes (h x w) are known from windows, `clean` pixels (H x W) are explained by them.
    """
    shape, gap = clean.shape, GAP * levels_per_pixel

    def located_by(nodes: Nodes, good: NDArray[np.bool_], known: NDArray[np.bool_]) -> Located | None:
        jump_sd = _jump_sd(equalised, nodes, radii, levels_per_pixel, tau)
        known = equalised.to_blocks(known, shape)
        return locate(equalised, nodes, jump_sd, good, known, radii, levels_per_pixel, noise, images)

    located = located_by(nodes, good, good)
    if located is None:
        return None
    # Again from windows that leave out what the outlines just found reach.
    kept = located.free
    again, sure = read_again(kept)
    sure &= blur_is_known(again.sd / levels_per_pixel, 0.0) & (_share(kept & clean, equalised.step) >= HALF)
    inside = _at_nodes(located.zone.inside, equalised.step)
    sure = np.where(inside, sure, good)
    old = ~inside | _if_few(sure, good, located, equalised.step)
    # Where the two agree (Hausman's test), depth from all pixels is the more certain one.
    added = np.sqrt(np.maximum(again.sd**2 - nodes.sd**2, 0))
    old |= good & sure & (np.abs(again.level - nodes.level) <= AGREE * added)
    nodes = replace(nodes, level=np.where(old, nodes.level, again.level), sd=np.where(old, nodes.sd, again.sd))
    known, good = good, sure | (old & good)
    located = located_by(nodes, good, known)
    if located is None:
        return None
    clear = good & (_share(located.free, equalised.step) >= HALF)
    clear |= _if_few(clear, good, located, equalised.step)
    curved = np.sqrt(nodes.sd**2 + curvature_variance(nodes, good, radii, equalised, levels_per_pixel))
    return _continued(equalised, nodes, curved, clear, located, gap)


def _continued(
    equalised: Equalised,
    nodes: Nodes,
    node_sd: FloatArray,
    clear: NDArray[np.bool_],
    located: Located,
    gap: float,
) -> Outlines:
    """Depth on either side of outlines: what windows `clear` of them (h x w) give, and what is continued from there."""
    zone, near, distance = located.zone, located.near, located.distance
    shape = near.shape
    own, own_sd = surfaces.continued(zone, near, located.planes, nodes, node_sd, clear, equalised.step, gap)
    # What a window clear of outlines gives is better than any continuation.
    level, sd = (equalised.to_pixels(values, nodes.sd, shape) for values in (nodes.level, node_sd))
    alone = equalised.to_blocks(clear, shape) & ((np.abs(level - own) < gap) | (distance > located.reach))
    own, own_sd = np.where(alone, level, own), np.where(alone, sd, own_sd)
    replaced = zone.inside & (distance <= located.reach + BEYOND * equalised.window)
    replaced &= ~(alone & (distance > CLEAR * located.reach + AWAY * equalised.window))
    return Outlines(
        _sides(distance < 1, near),
        replaced,
        replaced & (distance >= REJECTED) & _supported(located),
        own.astype(np.float32),
        own_sd.astype(np.float32),
        _side_sd(distance, located.place_sd, zone.near - zone.far),
    )


def _small(
    equalised: Equalised,
    nodes: Nodes,
    jump_sd: FloatArray,
    good: NDArray[np.bool_],
    sound: NDArray[np.bool_],
    radii: FloatArray,
    levels_per_pixel: float,
    images: Sequence[Image],
) -> Outlines | None:
    """Depth on either side of jumps that depth alone shows, valid where it is `sound` (H x W); None without any."""
    jumps = find_small_jumps(equalised, replace(nodes, sd=jump_sd), good, radii, levels_per_pixel, images)
    if jumps is None:
        return None
    level, sd = (equalised.to_pixels(values, nodes.sd, sound.shape) for values in (nodes.level, nodes.sd))
    return Outlines(
        _sides(jumps.inside & (jumps.distance < 1), jumps.near),
        jumps.inside,
        jumps.inside & sound & (jumps.distance >= REJECTED),
        jumps.level.astype(np.float32),
        np.hypot(sd, CHANGED * (jumps.level - level)).astype(np.float32),
        _side_sd(jumps.distance, SMALL_SD, jumps.rise),
    )


def _sides(beside: NDArray[np.bool_], near: NDArray[np.bool_]) -> NDArray[np.int8]:
    """+1 at the pixels `beside` an outline that are on its `near` side, -1 at those on the far one, 0 elsewhere."""
    return np.where(beside, np.where(near, 1, -1), 0).astype(np.int8)


def _side_sd(distance: FloatArray, place_sd: FloatArray | float, rise: FloatArray) -> Image:
    """Standard deviation, in levels, for the side that a pixel is on; the outline's place is known to `place_sd`."""
    wrong = special.ndtr(-distance / place_sd)
    return np.asarray(np.sqrt(wrong * (1 - wrong)) * rise, np.float32)


def curvature_variance(
    nodes: Nodes, good: NDArray[np.bool_], radii: FloatArray, equalised: Equalised, levels_per_pixel: float
) -> FloatArray:
    """Variance of depth at `nodes`, in levels squared, where it is not plane as far as blur and window reach."""
    reach = equalised.reach(nodes, radii)
    return surfaces.curvature_variance(nodes.level, nodes.sd, good, reach, SAME * levels_per_pixel)


def _supported(located: Located) -> NDArray[np.bool_]:
    """Whether the surface on each pixel's side explains the views where the outline does not reach; H x W.

    Looked at where that is nearest. What is reached by outlines from all around is given the benefit of the doubt.
    """
    inside, reached = located.zone.inside, located.distance <= located.reach + SLACK
    share = ndimage.uniform_filter(located.clean.astype(np.float32), 9)
    supported = inside.copy()
    for side in (located.near, ~located.near):
        free = side & inside & ~reached
        if not free.any():
            continue
        distance, index = ndimage.distance_transform_edt(~free, return_indices=True)
        use = side & inside & (distance <= 2 * located.reach + SLACK)
        supported[use] = (share[tuple(index)] > HALF)[use]
    return supported


def _if_few(clear: NDArray[np.bool_], good: NDArray[np.bool_], located: Located, step: int) -> NDArray[np.bool_]:
    """Of each part of a side that has few `clear` nodes, all that are `good`; h x w each."""
    inside, near = located.zone.inside, located.near
    found = np.zeros_like(good)
    for side in (near & inside, ~near & inside):
        part = _at_nodes(ndimage.label(side)[0], step)
        count = np.bincount(part[clear], minlength=int(part.max()) + 1)
        found |= good & (part > 0) & (count[part] <= FEW)
    return found


def _at_nodes(values: NDArray[Value], step: int) -> NDArray[Value]:
    """Values (H x W) at the middle of each node's block: h x w."""
    return values[np.ix_(*(np.minimum(np.arange(0, n, step) + step // 2, n - 1) for n in values.shape))]


def _share(pixels: NDArray[np.bool_], step: int) -> FloatArray:
    """Share of each node's block that is true in `pixels` (H x W): h x w."""
    return block_sum(pixels.astype(np.float32), step) / block_sum(np.ones(pixels.shape, np.float32), step)
