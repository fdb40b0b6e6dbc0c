"""Depth near occlusion boundaries: each surface is continued to the boundary by its own depth.

`docs/report/method.md` derives the place of a boundary from the reach of blur and filters (`outline_places`); it is
then moved to an edge of the views, and depth is estimated again without the pixels that it reaches.
Jumps too small for views to contradict each other are found by depth on either side (`outline_jumps`). All this in
windows narrower than elsewhere, whose depth replaces what wider ones carry over a boundary.

Constants without a figure were chosen on the scenes `MADE_WITH` of `benchmarks/depth_at_outlines.py` and tried on
others. With spheres seen through two foci, half and twice `ONSET`, `LARGE_RESIDUAL`, `OUTLINE_SD` and `CLEAR_REACHES`
change the share valid within 10 pixels of outlines (81.7 %) by 2 points at most, the share off by more than 10 % (7.3 %
of it) to 6.2 to 7.7 %, and what lies beyond 5 standard deviations (0.4 %) to 0.3 to 1.0 %.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.outline_jumps import SCATTER_WINDOWS, between_surfaces, find_small_jumps
from focalgradient.depth.equalise.outline_places import (
    CLEAR_REACHES,
    OUTLINE_SD,
    Located,
    few_large,
    locate,
    squared_residual,
)
from focalgradient.depth.equalise.parts import (
    Likelihood,
    Refined,
    Tile,
    refine,
    refine_without,
    tiles_about,
    usable_at_first,
)
from focalgradient.depth.equalise.signal import informative_nodes
from focalgradient.depth.filters import Image
from focalgradient.depth.numerics import NEIGHBOURS, at_nodes, block_mean, block_sum
from focalgradient.depth.planes import (
    HELD_APART,
    PLANE_SPAN,
    SMOOTH,
    continue_surfaces,
    departure_from_planes,
    jump_pairs,
    surface_planes,
)
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.validity import LEAST_BLUR, blur_is_known

__all__ = ["HALF", "Outlines", "curvature_variance", "curves", "find_outlines"]

FINER, LEAST_WINDOW = 0.625, 2.0
"""Size of the windows near boundaries relative to that of the settings, and its minimum in pixels. Near boundaries of
eight scenes of spheres (seeds 5, 6, 8, 11 and 12) 12.1 % of valid depth is in error by more than 10 % with windows of
the settings' size, 10.0 % with 0.75 of it, 8.7 % with this, and 9.0 % with 0.5."""

SAME_SURFACE = 0.75
"""Maximum difference of blur radius, in pixels of the widest view, between depths of one curved surface: 1.5
`MIN_JUMP`. Chosen on `MADE_WITH`."""

MIN_EXPLAINED = 0.9
"""Minimum proportion of a grid point's pixels that its depth must explain for a surface to be extended from it. Chosen
on `MADE_WITH`."""

AGREE_SDS = 2.0
"""Maximum difference, in its standard deviations, between the second and the first estimate for them to agree: a test
at 5 %."""

KEPT_WINDOWS = 1.0
"""Distance from a boundary, in windows beyond `CLEAR_REACHES`, from which the first-pass estimate is kept. Chosen on
`MADE_WITH`."""

MIN_CLEAR_NODES = 2
"""Minimum number of unoccluded grid points per side; with fewer, a side is extended from all of its points. Chosen on
`MADE_WITH`."""

SMALL_OUTLINE_SD = 2 * OUTLINE_SD
"""Localisation standard deviation, in pixels, of boundaries that only depth reveals: twice `OUTLINE_SD`. Chosen on
`MADE_WITH`."""

CHANGE_SD = 0.3
"""Standard deviation of depth next to a small discontinuity, relative to the change caused by its treatment. Chosen on
`MADE_WITH`."""

REJECTED = 1.5
"""Distance in pixels on either side of a boundary within which depth is invalid: less than `OUTLINE_SD`. Chosen on
`MADE_WITH`."""

HALF = 0.5
"""Minimum proportion of the pixels next to a boundary that a surface must explain to be extended to it; and of a grid
point's pixels that must be unoccluded, or consistent: a majority."""

SLACK = 1.5 * OUTLINE_SD
"""Distance in pixels beyond the reach of a boundary within which a contradiction may be caused by it: 1.5 `OUTLINE_SD`.
Chosen on `MADE_WITH`."""

GROWN_WINDOWS = 4.0
"""Distance in windows within which pixels contribute to a grid point's depth: 2.2 times the widest of
`planes.SMOOTH`, 1.7, rounded up."""

MIN_CONTRADICTION = 3
"""Minimum width in grid points of a region of contradicting views in which a boundary is searched: blank paper and
steep planes have contradictions one or two points wide."""

IMPROBABLE = 0.00135
"""Probability that a pixel lies on the other side of a boundary, below which that adds nothing to its standard
deviation: beyond three standard deviations of the boundary's place."""


@dataclass(frozen=True, slots=True, eq=False)
class Outlines:
    """Depth near outlines, H x W each."""

    side: NDArray[np.int8]  # 1 at an outline on its near side, -1 on its far side, 0 elsewhere
    is_replaced: Mask  # where this replaces the depth that windows give
    is_valid: Mask
    level: NDArray[np.float32]
    sd: NDArray[np.float32]  # of the surface, in levels
    side_sd: NDArray[np.float32]  # because a pixel may lie on the other side, in levels

    @classmethod
    def none(cls, shape: tuple[int, int]) -> Outlines:
        """Return a frame of `shape` without outlines, to be filled by tiles; only written pages take memory."""
        return cls(
            *(np.zeros(shape, np.int8), np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)),
            *(np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.zeros(shape, np.float32)),
        )

    def fill(self, tile: Tile, part: Outlines) -> None:
        """Store the outlines of a tile; to save memory, depth only where it is replaced."""
        for name in ("side", "is_replaced", "is_valid"):
            getattr(self, name)[tile.core] = getattr(part, name)[tile.within]
        at = part.is_replaced[tile.within]
        for name in ("level", "sd", "side_sd"):
            getattr(self, name)[tile.core][at] = getattr(part, name)[tile.within][at]

    def is_clear(self, equalised: Equalised, nodes: Nodes) -> Mask:
        """Return the nodes (h x w) whose widest window, with blur, holds one side only."""
        step, widest = equalised.step, SMOOTH.windows[-1] * equalised.window
        distance = at_nodes(ndimage.distance_transform_edt(self.side == 0), step)
        return np.asarray(distance > SCATTER_WINDOWS * widest + equalised.blur(nodes.level))

    def before(self, other: Outlines) -> Outlines:
        """Return these outlines, and the `other` ones where these replace nothing."""
        return Outlines(*(np.where(self.is_replaced, getattr(self, n), getattr(other, n)) for n in self.__slots__))


def find_outlines(
    equalised: Equalised, refined: Refined, views: RegisteredViews, false_alarm: float, model_error: float
) -> Outlines | None:
    """Return outlines of a part of the frame, and depth near them, from narrower windows; None where there are none.

    Parameters
    ----------
    equalised, refined, views
        The views, compared at every level; their depth as windows give it; and the views themselves.
    false_alarm
        Probability with which pixels are rejected whose views do agree.
    model_error
        Error of the blur model as a share of the blur: what it explains is not a jump.
    """
    narrow = equalised.in_windows(max(LEAST_WINDOW, FINER * equalised.window))
    is_consistent, found = refined.is_consistent, None
    shape = is_consistent.shape
    may_jump = _may_jump(equalised, refined.nodes, is_consistent, model_error)
    may_jump = block_sum(equalised.to_blocks(may_jump, shape).astype(np.float32), narrow.step) > 0
    reach = equalised.zone_reach()
    for tile in tiles_about(may_jump, narrow.step, shape, reach, _overlap(narrow)):
        finer, here = narrow.part(*tile.outer), views.part(*tile.outer)
        is_used = usable_at_first(here, finer) & refined.likelihood.is_summed[tile.outer]
        fine = refine(finer, here, Likelihood.of(finer, is_used), false_alarm, HELD_APART)
        outlines = _outlines_of_tile(finer, fine, here.images, model_error, equalised.window)
        if outlines is not None:
            found = found or Outlines.none(shape)
            found.fill(tile, outlines)
    return found


def _outlines_of_tile(
    equalised: Equalised, refined: Refined, images: Sequence[Image], model_error: float, wider: float
) -> Outlines | None:
    """Return outlines among the depths of narrow windows, and depth on either side of them; None where there are none.

    `images` are the views themselves, H x W each. `wider` are the windows, in pixels, in which depth is estimated away
    from outlines: as far as these reach over an outline, depth from narrow ones replaces it, too.
    """
    nodes, is_consistent = refined.nodes, refined.is_consistent
    shape, step, is_informative = is_consistent.shape, equalised.step, informative_nodes(nodes)
    level, sd = (equalised.to_pixels(values, nodes.sd, shape) for values in (nodes.level, nodes.sd))
    is_explained = few_large(squared_residual(equalised, level, sd)) & is_consistent
    is_reliable = is_informative & blur_is_known(nodes.sd / equalised.levels_per_pixel, 0.0)
    is_reliable &= block_mean(is_explained, step) >= MIN_EXPLAINED
    jump_sd, gap = _jump_sd(equalised, nodes, model_error), equalised.jump_gap()
    is_valid = is_consistent & equalised.to_blocks(is_informative, shape)
    small = _small(equalised, nodes, jump_sd, is_reliable, is_valid, images)
    planes = surface_planes(nodes.level, nodes.sd, is_reliable, gap)
    found, is_jump = None, jump_pairs(planes, jump_sd, is_reliable, gap)[..., 0] >= 0
    for tile in tiles_about(is_jump, step, shape, equalised.zone_reach(), _overlap(equalised)):
        within = tile.outer_nodes(step)
        here = equalised.part(*tile.outer)
        large = _find_large(
            here,
            nodes.part(*within),
            partial(refine_without, refined.likelihood, here, tile),
            np.ascontiguousarray(is_reliable[within]),
            np.ascontiguousarray(is_explained[tile.outer]),
            model_error,
            [np.ascontiguousarray(image[tile.outer]) for image in images],
        )
        if large is not None:
            found = found or Outlines.none(shape)
            found.fill(tile, large)
    ends = found.before(small) if found and small else found or small
    if ends is None or not ends.side.any():
        return ends
    # Beside outlines, what these windows give takes the place of what wider ones carry over them.
    curved = nodes.sd**2 + curvature_variance(equalised, nodes, is_informative)
    is_beside = ndimage.distance_transform_edt(ends.side == 0) <= equalised.blur(level) + SCATTER_WINDOWS * wider
    is_beside &= ~ends.is_replaced
    ends.is_replaced[is_beside] = True
    ends.level[is_beside] = level[is_beside]
    ends.sd[is_beside] = equalised.to_pixels(np.sqrt(curved), nodes.sd, shape)[is_beside]
    ends.is_valid[is_beside] = is_valid[is_beside]
    return ends


def _may_jump(equalised: Equalised, nodes: Nodes, is_consistent: Mask, model_error: float) -> Mask:
    """Return nodes (h x w) at or near which depth may jump: where it does, or where the views contradict each other.

    `is_consistent` (H x W): pixels whose views agree.
    """
    sd, is_informative = _jump_sd(equalised, nodes, model_error), informative_nodes(nodes)
    planes = surface_planes(nodes.level, nodes.sd, is_informative, equalised.jump_gap())
    is_jump = jump_pairs(planes, sd, is_informative, equalised.jump_gap())[..., 0] >= 0
    is_between, _ = between_surfaces(equalised, replace(nodes, sd=sd), is_informative)
    contradicts = block_mean(is_consistent, equalised.step) < HALF
    return is_jump | is_between | ndimage.binary_opening(contradicts, np.ones((MIN_CONTRADICTION,) * 2, np.bool_))


def _jump_sd(equalised: Equalised, nodes: Nodes, model_error: float) -> FloatArray:
    """Standard deviation of depth at nodes where it may jump, in levels: with the error of the blur model."""
    blur = np.maximum(LEAST_BLUR, equalised.blur(nodes.level))
    return np.hypot(nodes.sd, model_error * equalised.levels_per_pixel * blur)


def _overlap(equalised: Equalised) -> int:
    """Return the overlap in pixels that the depth in a tile's core requires."""
    return equalised.step * PLANE_SPAN + round(GROWN_WINDOWS * equalised.window)


def _find_large(
    equalised: Equalised,
    nodes: Nodes,
    refine_again: Callable[[Mask], tuple[Nodes, Mask]],
    is_reliable: Mask,
    is_explained: Mask,
    model_error: float,
    images: Sequence[Image],
) -> Outlines | None:
    """Depth on either side of jumps at which views contradict each other; None where there are none.

    Windows give the depth of reliable nodes (h x w), and it explains the views at `is_explained` (H x W).
    """
    shape, step = is_explained.shape, equalised.step

    def located_by(nodes: Nodes, is_reliable: Mask, is_settled: Mask) -> Located | None:
        is_settled = equalised.to_blocks(is_settled, shape)
        return locate(equalised, nodes, _jump_sd(equalised, nodes, model_error), is_reliable, is_settled, images)

    located = located_by(nodes, is_reliable, is_reliable)
    if located is None:
        return None
    # Again from windows that leave out what the outlines just found reach.
    is_unoccluded = located.is_unoccluded
    again, is_new = refine_again(is_unoccluded)
    is_new &= blur_is_known(again.sd / equalised.levels_per_pixel, 0.0)
    is_new &= block_mean(is_unoccluded & is_explained, step) >= HALF
    is_inside = at_nodes(located.zone.is_inside, step)
    is_new = np.where(is_inside, is_new, is_reliable)
    is_kept = ~is_inside | _if_few(is_new, is_reliable, located, step)
    # Where the two agree (Hausman's test), depth from all pixels is the more certain one.
    added = np.sqrt(np.maximum(again.sd**2 - nodes.sd**2, 0))
    is_kept |= is_reliable & is_new & (np.abs(again.level - nodes.level) <= AGREE_SDS * added)
    level, sd = (np.where(is_kept, *pair) for pair in ((nodes.level, again.level), (nodes.sd, again.sd)))
    nodes, is_settled = replace(nodes, level=level, sd=sd), is_reliable
    is_reliable = is_new | (is_kept & is_reliable)
    located = located_by(nodes, is_reliable, is_settled)
    if located is None:
        return None
    is_clear = is_reliable & (block_mean(located.is_unoccluded, step) >= HALF)
    is_clear |= _if_few(is_clear, is_reliable, located, step)
    curved = np.sqrt(nodes.sd**2 + curvature_variance(equalised, nodes, is_reliable))
    return _continued(equalised, nodes, curved, is_clear, located)


def _continued(equalised: Equalised, nodes: Nodes, node_sd: FloatArray, is_clear: Mask, located: Located) -> Outlines:
    """Depth on either side of outlines: from windows clear of them (h x w), and continued from there."""
    zone, is_near, distance = located.zone, located.is_near, located.distance
    shape, gap = is_near.shape, equalised.jump_gap()
    own, own_sd = continue_surfaces(zone, is_near, located.planes, nodes.level, node_sd, is_clear, equalised.step, gap)
    # What a window clear of outlines gives is better than any continuation.
    level, sd = (equalised.to_pixels(values, nodes.sd, shape) for values in (nodes.level, node_sd))
    is_own = equalised.to_blocks(is_clear, shape) & ((np.abs(level - own) < gap) | (distance > located.reach))
    own, own_sd = np.where(is_own, level, own), np.where(is_own, sd, own_sd)
    is_replaced = zone.is_inside & (distance <= located.reach + SCATTER_WINDOWS * equalised.window)
    is_replaced &= ~(is_own & (distance > CLEAR_REACHES * located.reach + KEPT_WINDOWS * equalised.window))
    return Outlines(
        _sides(distance < 1, is_near),
        is_replaced,
        is_replaced & (distance >= REJECTED) & _is_supported(located),
        own.astype(np.float32),
        own_sd.astype(np.float32),
        _side_sd(distance, located.place_sd, zone.near - zone.far),
    )


def _small(
    equalised: Equalised, nodes: Nodes, jump_sd: FloatArray, is_reliable: Mask, is_valid: Mask, images: Sequence[Image]
) -> Outlines | None:
    """Depth on either side of jumps that depth alone shows, valid where windows are (H x W); None without any."""
    jumps = find_small_jumps(equalised, replace(nodes, sd=jump_sd), is_reliable, images)
    if jumps is None:
        return None
    is_inside, is_near, distance, own, rise = jumps
    level, sd = (equalised.to_pixels(values, nodes.sd, is_valid.shape) for values in (nodes.level, nodes.sd))
    return Outlines(
        _sides(is_inside & (distance < 1), is_near),
        is_inside,
        is_inside & is_valid & (distance >= REJECTED),
        own.astype(np.float32),
        np.hypot(sd, CHANGE_SD * (own - level)).astype(np.float32),
        _side_sd(distance, SMALL_OUTLINE_SD, rise),
    )


def _sides(is_beside: Mask, is_near: Mask) -> NDArray[np.int8]:
    """+1 at the pixels beside an outline on its near side, -1 at those on its far side, 0 elsewhere."""
    return np.where(is_beside, np.where(is_near, 1, -1), 0).astype(np.int8)


def _side_sd(distance: FloatArray, place_sd: FloatArray | float, rise: FloatArray) -> Image:
    """Return the sd of depth, in levels, due to the position of the outline, known to `place_sd`."""
    wrong = special.ndtr(-distance / place_sd)
    return np.asarray(np.where(wrong > IMPROBABLE, np.sqrt(wrong * (1 - wrong)) * rise, 0), np.float32)


def curvature_variance(equalised: Equalised, nodes: Nodes, is_informative: Mask) -> FloatArray:
    """Variance of depth at `nodes`, in levels squared, where it is not plane as far as blur and window reach."""
    same = SAME_SURFACE * equalised.levels_per_pixel
    return departure_from_planes(nodes.level, nodes.sd, is_informative, equalised.reach(nodes), same)


def _is_supported(located: Located) -> Mask:
    """Return whether the surface on each pixel's side explains the views where the outline does not reach; H x W.

    Tested at the nearest such pixel. A pixel that outlines reach from all around counts as supported.
    """
    is_inside, is_reached = located.zone.is_inside, located.distance <= located.reach + SLACK
    share = ndimage.uniform_filter(located.is_explained.astype(np.float32), 9)
    is_supported = is_inside.copy()
    for side in (located.is_near, ~located.is_near):
        is_free = side & is_inside & ~is_reached
        if not is_free.any():
            continue
        distance, index = ndimage.distance_transform_edt(~is_free, return_indices=True)
        use = side & is_inside & (distance <= 2 * located.reach + SLACK)
        is_supported[use] = (share[tuple(index)] > HALF)[use]
    return is_supported


def _if_few(is_clear: Mask, is_reliable: Mask, located: Located, step: int) -> Mask:
    """Return all reliable nodes of each part of a side that has few unaffected nodes; h x w each."""
    is_inside, is_near = located.zone.is_inside, located.is_near
    found = np.zeros_like(is_reliable)
    for side in (is_near & is_inside, ~is_near & is_inside):
        part = at_nodes(ndimage.label(side)[0], step)
        count = np.bincount(part[is_clear], minlength=int(part.max()) + 1)
        found |= is_reliable & (part > 0) & (count[part] <= MIN_CLEAR_NODES)
    return found


SHORTEST = 8
"""Length in points up to which a curve is dropped: about a window. Chosen by hand."""

Point = tuple[int, int]


def curves(side: NDArray[np.int8]) -> list[list[list[float]]]:
    """Return the curves between pixels where `side` (H x W) is 1 and where it is -1.

    The near side (1) lies to the right of the way along a curve. Each is a list of points (column, row), in pixels from
    the first pixel's centre, midway between two pixels.

    >>> side = np.ones((10, 4), np.int8)
    >>> side[:, 2:] = -1
    >>> curves(side)[0][:2]
    [[1.5, 0.0], [1.5, 1.0]]
    """
    # Borders between pixels, from corner to corner; corner (i, j) is the upper left one of pixel (i, j).
    follows: dict[Point, list[Point]] = {}
    for axis, (first, second) in enumerate(NEIGHBOURS):
        for i, j in np.argwhere(side[first] * side[second] < 0).tolist():
            start, end = ((i + 1, j), (i + 1, j + 1)) if axis == 0 else ((i + 1, j + 1), (i, j + 1))
            if side[i, j] > 0:
                start, end = end, start
            follows.setdefault(start, []).append(end)
    ends = {end for some in follows.values() for end in some}
    found = []
    for start in [point for point in follows if point not in ends] + list(follows):
        corners = [start]
        while follows.get(corners[-1]):
            corners.append(follows[corners[-1]].pop())
        if len(corners) > SHORTEST:
            place = np.array(corners, float)[:, ::-1] - 0.5
            found.append(((place[1:] + place[:-1]) / 2).tolist())
    return found
