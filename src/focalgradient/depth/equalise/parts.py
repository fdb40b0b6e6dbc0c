"""Parts of a frame: tiles of large frames, the likelihood of each, its outliers rejected and its depth refined.

Memory is that of one tile, and time grows with the pixels. Tiles overlap by more than any filter or window reaches, and
noise and the scene's spectrum are estimated once for all, so that the depths of two tiles at their seam differ by far
less than a standard deviation.

Pixels whose views contradict each other at every depth mislead the windows around them; so do those that blur reaches
from beyond the frame. They are found, left out, and looked for again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.arrays import Mask
from focalgradient.depth.equalise.likelihood import Equalised, Nodes, ResidualStatistics
from focalgradient.depth.equalise.signal import informative_nodes, own_texture, rests_on_texture
from focalgradient.depth.equalise.split_band import DetailHalves
from focalgradient.depth.filters import Image
from focalgradient.depth.numerics import at_levels
from focalgradient.depth.planes import HELD_APART, SMOOTH, Growth
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.validity import BLUR_ERROR

__all__ = [
    "ERRS",
    "Likelihood",
    "Refined",
    "Tile",
    "detail_halves",
    "join_nodes",
    "refine",
    "refine_without",
    "tiles",
    "usable_at_first",
]

CORE = 1920
"""Approximate maximum side in pixels of a tile without its overlap: one tile covers a frame of video."""

CORE_OF_MANY = 960
"""`CORE` of frames that need several tiles: boundaries all over a tile of 1920 pixels and its overlap take 2.2 GB."""

LEAST_CORE = 640
"""Minimum side in pixels of a tile without its overlap; smaller ones would be mostly overlap (2 x 160 pixels)."""

HELD = 110_000_000
"""Approximate maximum number of pixels of filtered images per tile: 0.44 GB."""

MUCH = 0.75
"""Maximum proportion of the frame in which parts are processed one by one; limits the time. Chosen by hand."""

OVERLAP = 160
"""Overlap of tiles in pixels: twice the widest filter (64), and two sd of the largest window (28)."""


@dataclass(frozen=True, slots=True)
class Tile:
    """A part of a frame: rows and columns of its core, and of the core with its overlap."""

    core: tuple[slice, slice]
    outer: tuple[slice, slice]

    @classmethod
    def about(cls, core: tuple[slice, slice], overlap: int, step: int, shape: tuple[int, int]) -> Tile:
        """Return the tile of a `core` in a frame of `shape`, with `overlap` pixels in whole blocks of `step` pixels."""
        beyond = step * -(-overlap // step)
        rows, columns = (
            slice(max(0, part.start - beyond), min(n, part.stop + beyond)) for part, n in zip(core, shape, strict=True)
        )
        return cls(core, (rows, columns))

    def inner(self, step: int) -> tuple[slice, slice]:
        """Return the core's blocks of `step` pixels among those of the tile with its overlap."""
        return tuple(  # type: ignore[return-value]
            slice((core.start - outer.start) // step, -(-(core.stop - outer.start) // step))
            for core, outer in zip(self.core, self.outer, strict=True)
        )

    def outer_nodes(self, step: int) -> tuple[slice, slice]:
        """Return the blocks of `step` pixels of the tile with its overlap."""
        return tuple(slice(part.start // step, -(-part.stop // step)) for part in self.outer)  # type: ignore[return-value]

    @property
    def within(self) -> tuple[slice, slice]:
        """Return the pixels of the core within the tile with its overlap."""
        return tuple(  # type: ignore[return-value]
            slice(core.start - outer.start, core.stop - outer.start)
            for core, outer in zip(self.core, self.outer, strict=True)
        )


def tiles(shape: tuple[int, int], step: int, images: int = 1) -> Iterator[Tile]:
    """Yield tiles that cover a frame of `shape`, aligned to blocks of `step` pixels; a small frame is one tile.

    The more filtered `images` a tile has to hold, the smaller it is.

    >>> [tile.core[1].start for tile in tiles((1000, 5000), 5)]
    [0, 1000, 2000, 3000, 4000]
    >>> [len([*tiles((1000, width), 5)]) for width in (2800, 3200)]
    [1, 3]
    """
    edges = []
    most = CORE if max(shape) < 1.5 * CORE else min(CORE, CORE_OF_MANY)
    side = float(np.clip(np.sqrt(HELD / images) - 2 * OVERLAP, min(LEAST_CORE, most), most))
    for n in shape:
        count = max(1, round(n / side))
        size = step * -(-n // (count * step))
        edges.append([slice(start, min(n, start + size)) for start in range(0, n, size)])
    for rows, columns in product(*edges):
        yield Tile.about((rows, columns), OVERLAP, step, shape)


def tiles_about(some: Mask, step: int, shape: tuple[int, int], reach: int, overlap: int) -> list[Tile]:
    """Return tiles of a frame of `shape` whose cores cover `reach` pixels about `some` of its nodes (h x w).

    Where they would hold much of the frame, the whole frame is one tile.

    >>> one = np.zeros((200, 300), bool)
    >>> one[20, 20] = one[150, 250] = True
    >>> [tile.core for tile in tiles_about(one, 5, (1000, 1500), 40, 100)]
    [(slice(60, 145, None), slice(60, 145, None)), (slice(710, 795, None), slice(1210, 1295, None))]
    """
    grown = -(-reach // step)
    near = ndimage.distance_transform_edt(~some) <= grown if some.any() else some
    boxes = [[[part.start, part.stop] for part in box] for box in ndimage.find_objects(ndimage.label(near)[0])]
    cores: list[list[list[int]]] = []
    for box in boxes:
        # What overlaps another is joined with it.
        while meeting := [c for c in cores if all(c[a][0] < box[a][1] and box[a][0] < c[a][1] for a in (0, 1))]:
            cores = [core for core in cores if core not in meeting]
            box = [[min(b[a][0] for b in [box, *meeting]), max(b[a][1] for b in [box, *meeting])] for a in (0, 1)]
        cores.append(box)
    found = []
    for core in cores:
        rows, columns = (slice(step * first, min(n, step * last)) for (first, last), n in zip(core, shape, strict=True))
        found.append(Tile.about((rows, columns), overlap, step, shape))
    area = sum(math.prod(part.stop - part.start for part in tile.outer) for tile in found)
    whole = (slice(0, shape[0]), slice(0, shape[1]))
    return found if area <= MUCH * math.prod(shape) else [Tile(whole, whole)]


def join_nodes(parts: Sequence[tuple[Tile, Nodes]], shape: tuple[int, int], step: int) -> Nodes:
    """Return the nodes of a whole frame of `shape` from those of its tiles."""
    size = tuple(-(-n // step) for n in shape)
    first = parts[0][1]
    whole = {name: np.empty(size, getattr(first, name).dtype) for name in Nodes.__slots__}
    for tile, nodes in parts:
        place = tuple(slice(core.start // step, -(-core.stop // step)) for core in tile.core)
        for name, values in whole.items():
            values[place] = getattr(nodes, name)[tile.inner(step)]
    return Nodes(**whole)


CHECK_SIDE = 5
"""Side in pixels of the squares in which agreement of the views is tested: much smaller than windows. Chosen by hand.
"""

ERRS = 1.1
"""Median misfit above which the residual exceeds the noise: correct models have 0.99 to 1.01, JPEG of quality 90 about
1.5."""

SPECK_NODES = 3
"""Minimum width in grid points of a textured region with valid depth: two standard deviations of a window."""

RIM_REACH = 1.2
"""Distance over which light from outside the frame reaches into it, in blur radii: filters reach little more than one.
On walls, planes and steps with or without a lamp outside the frame, 95 to 98 % of the rim lies within two sd with 1.0,
1.2, 1.5 and 2.0."""

MAX_REJECTIONS = 6
"""Maximum number of outlier-rejection iterations: chosen by hand."""

REJECTION_SETTLED = 2e-3
"""Proportion of pixels that change in an iteration, below which outlier rejection ends. Chosen by hand."""


def _inward(views: RegisteredViews) -> NDArray[np.intp]:
    """Return the distance of each pixel from the border of the whole frame, in pixels (H x W)."""
    ways = zip(views.start, views.shape, views.whole or views.shape, strict=True)
    places = ((first + np.arange(count), whole) for first, count, whole in ways)
    return np.minimum.outer(*(np.minimum(place, whole - 1 - place) for place, whole in places))


def _rim(views: RegisteredViews, equalised: Equalised) -> int:
    """Return the width in pixels of the frame's border in which nothing is used."""
    return min(round(equalised.window), min(views.shape) // 8)


def usable_at_first(views: RegisteredViews, equalised: Equalised) -> Mask:
    """Return the pixels that may be used before depth is known (H x W)."""
    return views.usable & (_inward(views) >= _rim(views, equalised))


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """Cost of every candidate (minus twice the log likelihood), and the depth of least cost."""

    energy: Image  # L x h x w: squared residuals, summed over each node's block
    is_summed: Mask  # H x W: the pixels that they are summed over
    nodes: Nodes

    @classmethod
    def of(cls, equalised: Equalised, is_used: Mask, energy: Image | None = None) -> Likelihood:
        """Sum the residuals over the pixels of `is_used` (H x W), unless their `energy` is known; it is kept."""
        weight = is_used.astype(np.float32)
        energy = equalised.energy(weight) if energy is None else energy
        return cls(energy, is_used, equalised.minima(*equalised.averages(energy, weight)))

    def over(self, equalised: Equalised, is_used: Mask) -> Likelihood:
        """Sum the residuals over other pixels; `energy` is changed in place."""
        weight = is_used.astype(np.float32)
        equalised.sum_again(self.energy, weight, self.is_summed ^ is_used)
        return Likelihood(self.energy, is_used, equalised.minima(*equalised.averages(self.energy, weight)))


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """Depth of a part of the frame by local planes through the pixels whose views agree."""

    nodes: Nodes
    likelihood: Likelihood  # over the inliers, but for a share `REJECTION_SETTLED` at most
    is_consistent: Mask  # H x W: whether a pixel's views agree
    is_within: Mask  # H x W: usable pixels that light from beyond the frame does not reach
    is_textured: Mask  # H x W: depth rests on texture at the pixel itself
    other_surface: Image  # H x W: probability that a pixel belongs to a surface without texture beside that seen
    images: list[tuple[Image, Image]]  # each comparison's residual at depth in the first windows, and its derivative


def _inliers(
    equalised: Equalised, views: RegisteredViews, found: Likelihood, false_alarm: float
) -> tuple[Likelihood, Mask, Mask, ResidualStatistics]:
    """Reject pixels whose views contradict each other at the depth found, and find depth without them, in turn.

    Returns the likelihood, `Refined.is_consistent`, `Refined.is_within`, and what each pixel leaves at the depth by
    which it was judged. `found` is changed.
    """
    blur = equalised.radii.max(axis=0)  # L
    tolerance = BLUR_ERROR * blur * equalised.levels_per_pixel
    is_usable, inward = views.usable, _inward(views)
    # Blur carries light in from beyond the frame: its rim is left out, and takes the depth of what lies next to it.
    rim = _rim(views, equalised)
    middle = (slice(rim, -rim), slice(rim, -rim))
    for _ in range(MAX_REJECTIONS):
        local = equalised.evaluate(found.nodes)
        agreement = equalised.agreement(local, CHECK_SIDE, false_alarm, tolerance)
        reach = np.clip(at_levels(RIM_REACH * blur, local.level), rim, min(views.shape) / 6)
        is_consistent = is_usable & np.pad(agreement[middle], rim, mode="edge")
        is_within = is_usable & (inward >= reach)
        if (found.is_summed ^ (is_consistent & is_within)).mean() < REJECTION_SETTLED:
            break
        found = found.over(equalised, is_consistent & is_within)
    return found, is_consistent, is_within, local


def refine(
    equalised: Equalised, views: RegisteredViews, found: Likelihood, false_alarm: float, growth: Growth = SMOOTH
) -> Refined:
    """Reject outliers, refine depth by local planes in windows of `growth`, and find where it rests on texture."""
    likelihood, is_consistent, is_within, local = _inliers(equalised, views, found, false_alarm)
    nodes, weight = likelihood.nodes, (is_consistent & is_within).astype(np.float32)
    local = equalised.evaluate_to_refine(nodes, local)
    first = replace(equalised.refine(nodes, local, weight, growth.first), sd=nodes.sd)
    local, images = equalised.evaluate_images(first)
    nodes = equalised.refine(first, equalised.evaluate_to_refine(first, local), weight, growth)
    nodes = _with_texture_of_its_own(equalised, nodes, local, weight)
    is_textured, other_surface = own_texture(equalised, local, weight)
    return Refined(nodes, likelihood, is_consistent, is_within, is_textured, other_surface, images)


def detail_halves(equalised: Equalised, refined: Refined, one_waveband: bool) -> DetailHalves:
    """Return depth from either half of the detail, for the split-band test of a part of the frame."""
    weight = (refined.is_consistent & refined.is_within).astype(np.float32)
    kept = weight if one_waveband else refined.is_within.astype(np.float32)
    images = [(kept * value, kept * derivative) for value, derivative in refined.images]
    return DetailHalves.of(equalised, refined.nodes, images, weight, informative_nodes(refined.nodes))


def refine_without(found: Likelihood, equalised: Equalised, tile: Tile, is_kept: Mask) -> tuple[Nodes, Mask]:
    """Re-estimate depth at nodes from the pixels `is_kept` (H x W); return also the nodes that rest on signal."""
    is_summed, energy = found.is_summed[tile.outer], found.energy[:, *tile.outer_nodes(equalised.step)].copy()
    is_used = is_summed & is_kept
    nodes = Likelihood(energy, is_summed, found.nodes).over(equalised, is_used).nodes
    sd = nodes.sd
    for growth in (HELD_APART.first, HELD_APART):
        beside = equalised.evaluate_to_refine(nodes, equalised.evaluate(nodes))
        nodes = equalised.refine(replace(nodes, sd=sd), beside, is_used.astype(np.float32), growth)
    return nodes, informative_nodes(nodes)


def _with_texture_of_its_own(equalised: Equalised, nodes: Nodes, local: ResidualStatistics, weight: Image) -> Nodes:
    """Set texture to 0 where it lies far from a node, or shows in one or two nodes alone."""
    near, by_depth = rests_on_texture(equalised, nodes, local, weight)
    nodes = replace(nodes, texture=np.where(near, nodes.texture, 0), curved_by_depth=by_depth)
    found = informative_nodes(nodes)
    # Noise that rises with contrast takes in what compression leaves.
    if not equalised.compressed and (not found.any() or np.median(nodes.misfit[found]) < ERRS):
        return nodes
    # Windows overlap, so that texture shows in several nodes side by side; compression of blank paper, in one or two.
    specks = found & ~ndimage.binary_opening(found, np.ones((SPECK_NODES, SPECK_NODES), np.bool_))
    return replace(nodes, texture=np.where(specks, 0, nodes.texture))
