"""Split large frames into tiles: memory is that of one tile, and time grows with the pixels.

Tiles overlap by more than any filter or window reaches, and noise and the scene's spectrum are estimated once for all,
so that the depths of two tiles at their seam differ by far less than a standard deviation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.depth.equalise.likelihood import Nodes
from focalgradient.depth.equalise.split_band import SplitBand
from focalgradient.depth.filters import FloatArray
from focalgradient.depth.registration import RegisteredViews

__all__ = ["Tile", "join_nodes", "join_splits", "tiles"]

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

    def of(self, views: RegisteredViews) -> RegisteredViews:
        """Return the tile of registered views, with its overlap."""
        return views.part(*self.outer)

    def inward(self, shape: tuple[int, int]) -> FloatArray:
        """Return the distance of each of the tile's pixels from the border of the whole frame of `shape`."""
        rows, columns = (
            np.minimum(np.arange(n), np.arange(n)[::-1])[part] for n, part in zip(shape, self.outer, strict=True)
        )
        return np.minimum.outer(rows, columns)


def tiles(shape: tuple[int, int], step: int, images: int = 1) -> Iterator[Tile]:
    """Yield tiles that cover a frame of `shape`, aligned to blocks of `step` pixels; a small frame is one tile.

    The more filtered `images` a tile has to hold, the smaller it is.

    >>> [tile.core[1].start for tile in tiles((1000, 5000), 5)]
    [0, 1000, 2000, 3000, 4000]
    """
    edges = []
    most = CORE if max(shape) < 1.5 * CORE else min(CORE, CORE_OF_MANY)
    side = float(np.clip(np.sqrt(HELD / images) - 2 * OVERLAP, min(LEAST_CORE, most), most))
    for n in shape:
        count = max(1, round(n / side))
        size = step * -(-n // (count * step))
        edges.append([(start, min(n, start + size)) for start in range(0, n, size)])
    overlap = step * -(-OVERLAP // step)
    for top, bottom in edges[0]:
        for left, right in edges[1]:
            core = (slice(top, bottom), slice(left, right))
            outer = tuple(
                slice(max(0, part.start - overlap), min(n, part.stop + overlap))
                for part, n in zip(core, shape, strict=True)
            )
            yield Tile(core, (outer[0], outer[1]))


def tiles_about(some: NDArray[np.bool_], step: int, shape: tuple[int, int], reach: int, overlap: int) -> list[Tile]:
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
    beyond = step * -(-overlap // step)
    found = []
    for core in cores:
        inner = tuple(slice(first * step, min(n, last * step)) for (first, last), n in zip(core, shape, strict=True))
        outer = tuple(
            slice(max(0, p.start - beyond), min(n, p.stop + beyond)) for p, n in zip(inner, shape, strict=True)
        )
        found.append(Tile((inner[0], inner[1]), (outer[0], outer[1])))
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


def join_splits(splits: Sequence[SplitBand]) -> SplitBand:
    """Return the model error of a whole frame from those of its tiles, each with the weight of its nodes."""
    some = [split for split in splits if split.taus]
    if len(some) < 2:
        return some[0] if some else splits[0]
    weight = np.array([split.nodes for split in some], float)

    def mean(values: list[tuple[float, ...]]) -> tuple[float, ...]:
        return tuple(float(value) for value in weight @ np.array(values) / weight.sum())

    def root_mean_square(values: list[tuple[float, ...]]) -> tuple[float, ...]:
        return tuple(float(np.sqrt(v)) for v in mean([tuple(one**2 for one in some) for some in values]))

    taus, directions = (root_mean_square([getattr(split, name) for split in some]) for name in ("taus", "directions"))
    return SplitBand(
        max(*taus, *directions),
        mean([split.cuts for split in some]),
        taus,
        mean([split.differences for split in some]),
        directions,
        int(weight.sum()),
    )
