"""Depth about outlines: where one surface ends before another, each goes on to the outline by its own depth.

About an outline the blur of the near surface lies over the far one, and filters and windows reach across: a band of
pixels contradicts every depth. On either side of it surfaces are known, and each is continued into it as a plane. How
far the band reaches to either side of the outline follows from the blur: the near surface's residual is large up to
where the filters that compare it reach the outline, the far surface's up to where the near one's blur reaches. So the
outline lies where the distances to the pixels that either surface explains say that it does; beyond it, each surface is
continued from nodes that the band does not reach: depth is read again without the pixels of the band, and the outline
is moved to an edge of the views (`outline_edges`). Near the outline the standard deviation holds the probability of
being on its other side; the band's width says how sure its place is.

A jump too small for views to contradict each other is found by depth on either side of it (`outline_jumps`). One too
small even for that blurs into a steep stretch of one surface, which the views cannot tell from it: where depth departs
from a plane within the reach of blur, the departure is part of the standard deviation, outline or not.

How far residuals reach (`ONSET`), and the other choices here, were made on the scenes `MADE_WITH` of
`benchmarks/depth_at_outlines.py`, and tried on others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from focalgradient.depth.equalise import surfaces
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.outline_edges import FARTHEST, blurs_at, moved_to_edges
from focalgradient.depth.equalise.outline_jumps import find_small_jumps
from focalgradient.depth.equalise.tiles import Tile
from focalgradient.depth.filters import FloatArray, Image
from focalgradient.depth.model_error import LEAST_BLUR
from focalgradient.depth.numerics import block_sum
from focalgradient.depth.validity import BLUR_ERROR, blur_is_known

__all__ = ["Outlines", "curvature_variance", "find_outlines"]

GAP = 0.5
"""Difference of blur radius, in pixels of the widest view, from which depth jumps."""

SAME = 0.75
"""Difference of blur radius, in pixels, up to which depths may belong to one curved surface."""

ONSET = 0.75
"""Share of the reach of blur and filters (`_reach`) within which residuals are larger than noise."""

LARGE = 4.0
"""Squared residual, over what is expected, that is large: of noise alone one in twenty is."""

PATCH, MOST = 1.5, 0.22
"""Standard deviation in pixels of the window in which large residuals are counted, and the share that is too many."""

EXPLAINED = 0.9
"""Share of a node's pixels that its depth must explain for a surface to be continued from there."""

BETTER, BROAD = 0.3, 3.0
"""Mean difference of residuals that decides between surfaces, and standard deviation in pixels of its window."""

SPECK = 20
"""Pixels up to which a patch that one surface explains is put down to chance."""

SMOOTH = 1.5
"""Standard deviation in pixels by which an outline is smoothed."""

CLEAR = 1.25
"""Reaches from an outline from which pixels are used when depth is read again, without what outlines reach."""

AGREE = 2.0
"""Standard deviations of their difference up to which depth read again agrees with what it was at first."""

AWAY = 1.0
"""Windows beyond these pixels from which depth that windows gave at first stays."""

FEW = 2
"""Nodes clear of outlines up to which a side is continued from all of its nodes."""

OUTLINE_SD = 2.0
"""Standard deviation in pixels of an outline's place, moved to an edge."""

SMALL_SD = 4.0
"""The same where only depth shows the jump."""

CHANGED = 0.3
"""Share of depth's change beside a small jump that is its standard deviation."""

UNDECIDED = 0.4
"""Share, of what the band between the two surfaces is wider or narrower than blur explains, that the outline's place is
uncertain by: where it is narrower, both surfaces explain the views."""

REJECTED = 2.0
"""Pixels to either side of an outline where no depth is claimed."""

HALF = 0.5
"""Share of the pixels that a surface must explain beside an outline for it to be continued to there; and of a node's
pixels that must be clear of outlines."""

SLACK = 3.0
"""Pixels beyond the reach of an outline where a contradiction may still be due to it."""

BEYOND = 2.0
"""Windows beyond the reach of an outline in which windows may give no depth because of it."""


Value = TypeVar("Value", bound=np.generic)
ReadAgain = Callable[[NDArray[np.bool_]], tuple[Nodes, NDArray[np.bool_]]]


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


@dataclass(frozen=True, slots=True, eq=False)
class _Located:
    """Where outlines lie."""

    zone: surfaces.Zone
    planes: FloatArray
    near: NDArray[np.bool_]  # H x W: the near side
    distance: FloatArray  # pixels from the nearest outline
    place_sd: FloatArray  # standard deviation in pixels of the nearest outline's place
    reach: FloatArray  # how far residuals reach from the outline on each pixel's side
    clean: NDArray[np.bool_]  # what the surface on each pixel's side explains

    @property
    def free(self) -> NDArray[np.bool_]:
        """H x W: pixels that outlines do not reach."""
        return ~self.zone.inside | (self.distance > CLEAR * self.reach)


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
) -> Outlines | None:
    """Outlines among the depths of `nodes`, and depth on either side of them; None where there are none.

    Parameters
    ----------
    equalised
        The views, compared at every level.
    nodes
        Depth as windows give it, without contradicting pixels.
    read_again
        Given the pixels that may be used (H x W), depth at nodes from these alone, and where it rests on signal.
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
    """
    shape, gap = agrees.shape, GAP * levels_per_pixel
    widest = radii.max(axis=0)

    def locate(nodes: Nodes, good: NDArray[np.bool_], known: NDArray[np.bool_]) -> _Located | None:
        blur = np.maximum(LEAST_BLUR, np.interp(nodes.level, np.arange(equalised.levels), widest))
        jump_sd = np.hypot(nodes.sd, tau * levels_per_pixel * blur)
        known = equalised.to_blocks(known, shape)
        return _locate(equalised, nodes, jump_sd, good, known, radii, levels_per_pixel, noise, images)

    level, sd = (equalised.to_pixels(values, nodes.sd, shape) for values in (nodes.level, nodes.sd))
    clean = _few_large(_residual(equalised, level, sd, radii, levels_per_pixel, noise)) & agrees
    good = informative & blur_is_known(nodes.sd / levels_per_pixel, 0.0)
    good &= _share(clean, equalised.step) >= EXPLAINED
    located = locate(nodes, good, good)
    small = _small(
        equalised, nodes, good, agrees & equalised.to_blocks(informative, shape), radii, levels_per_pixel, images
    )
    if located is None:
        return small
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
    located = locate(nodes, good, known)
    if located is None:
        return small
    clear = good & (_share(located.free, equalised.step) >= HALF)
    clear |= _if_few(clear, good, located, equalised.step)
    curved = np.sqrt(nodes.sd**2 + curvature_variance(nodes, good, radii, equalised, levels_per_pixel))
    large = _continued(equalised, nodes, curved, clear, located, gap)
    return large if small is None else large.before(small)


def _continued(
    equalised: Equalised,
    nodes: Nodes,
    node_sd: FloatArray,
    clear: NDArray[np.bool_],
    located: _Located,
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
    good: NDArray[np.bool_],
    sound: NDArray[np.bool_],
    radii: FloatArray,
    levels_per_pixel: float,
    images: Sequence[Image],
) -> Outlines | None:
    """Depth on either side of jumps that depth alone shows, valid where it is `sound` (H x W); None without any."""
    jumps = find_small_jumps(equalised, nodes, good, radii, levels_per_pixel, images)
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


def _locate(
    equalised: Equalised,
    nodes: Nodes,
    jump_sd: FloatArray,
    good: NDArray[np.bool_],
    known: NDArray[np.bool_],
    radii: FloatArray,
    levels_per_pixel: float,
    noise: float,
    images: Sequence[Image],
) -> _Located | None:
    """Outlines between the surfaces that are continued from `good` nodes (h x w); None where there are none.

    No outline runs through what is `known` (H x W) from windows.
    """
    planes = surfaces.planes(nodes.level, nodes.sd, good, GAP * levels_per_pixel)
    pairs = surfaces.pairs(planes, jump_sd, good, GAP * levels_per_pixel)
    if pairs is None:
        return None
    zone = surfaces.spread(
        pairs, planes, nodes.sd, equalised.step, known.shape, int(2 * radii.max() + 3 * equalised.window)
    )
    near, far = (
        _residual(equalised, level, sd, radii, levels_per_pixel, noise)
        for level, sd in ((zone.near, zone.near_sd), (zone.far, zone.far_sd))
    )
    clean_near, clean_far = _few_large(near), _few_large(far)
    # Where both surfaces explain the views, the better one does, if it is clearly better.
    better = ndimage.gaussian_filter(np.clip(far - near, -LARGE, LARGE), BROAD)
    only_near = _without_specks(clean_near & (better > BETTER) & zone.inside)
    only_far = _without_specks(clean_far & (better < -BETTER) & zone.inside)
    if not (only_near.any() and only_far.any()):
        return None
    del near, far, better  # each as large as the tile
    reach_near, reach_far = _reach(*(blurs_at(level, radii) for level in (zone.near, zone.far)))
    to_near, to_far = (ndimage.distance_transform_edt(~part) for part in (only_near, only_far))
    inward = ndimage.gaussian_filter(((to_far - ONSET * reach_far) - (to_near - ONSET * reach_near)) / 2, SMOOTH)
    side = _at_edges(inward > 0, zone, known, images, blurs_at(zone.near, radii))
    distance, nearest = _distance(side, zone, known)
    undecided = to_near + to_far - ONSET * (reach_near + reach_far)
    return _Located(
        zone,
        planes,
        side,
        distance,
        np.hypot(OUTLINE_SD, UNDECIDED * undecided)[nearest],
        np.where(side, reach_near, reach_far),
        np.where(side, clean_near, clean_far),
    )


def _at_edges(
    near: NDArray[np.bool_],
    zone: surfaces.Zone,
    known: NDArray[np.bool_],
    images: Sequence[Image],
    blur: FloatArray,
) -> NDArray[np.bool_]:
    """The `near` side (H x W) with its outlines moved to where the views have edges."""
    distance, nearest = _distance(near, zone, known)
    inward = np.where(near, distance, -distance) if np.isfinite(distance).all() else np.where(near, 1e3, -1e3)
    moved = moved_to_edges(inward, distance < 1, images, blur)[nearest]
    return np.where(distance < FARTHEST + 1, inward > moved, near)


def _distance(
    near: NDArray[np.bool_], zone: surfaces.Zone, known: NDArray[np.bool_]
) -> tuple[FloatArray, tuple[NDArray[np.intp], ...]]:
    """Pixels from the nearest outline, a border of the `near` side (H x W) between the surfaces of one jump; its place.

    No outline runs through what is `known` (H x W) from windows.
    Where three surfaces meet, the middle one is on the far side of one outline and on the near side of another.
    """
    own, other = np.where(near, zone.near, zone.far), np.where(near, zone.far, zone.near)
    beside = np.zeros(near.shape, np.bool_)
    for axis in (0, 1):
        first, second = ((slice(None),) * axis + (part,) for part in (slice(-1), slice(1, None)))
        border = (near[first] != near[second]) & zone.inside[first] & zone.inside[second]
        border &= ~(known[first] & known[second])
        for one, two in ((first, second), (second, first)):
            border &= np.abs(own[two] - other[one]) < np.abs(own[two] - own[one])
        beside[first] |= border
        beside[second] |= border
    if not beside.any():
        return np.full(near.shape, np.inf), tuple(np.indices(near.shape))
    distance, nearest = ndimage.distance_transform_edt(~beside, return_indices=True)
    return distance + 0.5, tuple(nearest)


def _supported(located: _Located) -> NDArray[np.bool_]:
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


def _if_few(clear: NDArray[np.bool_], good: NDArray[np.bool_], located: _Located, step: int) -> NDArray[np.bool_]:
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


def _reach(near: FloatArray, far: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Pixels to the near and to the far side of an outline that residuals reach; blur radii are n x H x W.

    A view meets the outline within the near surface's blur; the filter that compares it widens that by the other
    view's blur, at the depth that it is compared at.
    """
    pairs = [(i, j) for i in range(len(near)) for j in range(len(near)) if i != j]
    return (
        np.max([near[i] + near[j] for i, j in pairs], axis=0),
        np.max([near[i] + far[j] for i, j in pairs], axis=0),
    )


def _residual(
    equalised: Equalised, level: FloatArray, sd: FloatArray, radii: FloatArray, levels_per_pixel: float, noise: float
) -> FloatArray:
    """Squared residual at `level` (H x W, known to `sd`) over what noise, that, and the blur's own error leave."""
    level = np.clip(level, 0, equalised.levels - 1)
    left, slope = np.zeros(level.shape, np.float32), np.zeros(level.shape, np.float32)
    for residual in equalised.residuals:
        value, derivative = residual.at(level.astype(np.float32))
        left += value**2
        slope += derivative**2
    place = np.arange(equalised.levels)
    expected = noise * np.interp(level, place, sum(residual.noise for residual in equalised.residuals))
    error = BLUR_ERROR * levels_per_pixel * np.interp(level, place, radii.max(axis=0))
    return left / (expected + slope * (sd**2 + error**2))


def _few_large(residual: FloatArray) -> NDArray[np.bool_]:
    """Whether few of the squared residuals about a pixel are large."""
    large = (residual > LARGE).astype(np.float32)
    return np.asarray(ndimage.gaussian_filter(large, PATCH) < MOST)


def _without_specks(part: NDArray[np.bool_]) -> NDArray[np.bool_]:
    label, count = ndimage.label(part)
    size = np.bincount(label.ravel(), minlength=count + 1)
    size[0] = 0
    return np.asarray((size > SPECK)[label])
