"""Mesh primitives (sheets, lathed bodies, boulders, boxes), painted by a function of position."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.scenes.fractal import fractal
from focalgradient.scenes.objects import Mesh

__all__ = ["Paint", "ball", "box", "grid_faces", "lathe", "sheet", "strewn"]

Paint = Callable[[FloatArray, float], FloatArray]
"""Function that returns reflectance (... x 3) at points (... x 3, m from the body's centre) with given detail (m)."""


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Return the triangles, 2 (rows - 1)(columns - 1) x 3, of a grid of vertices in row-major order.

    >>> grid_faces(2, 2).tolist()
    [[0, 1, 3], [0, 3, 2]]
    """
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=-1).reshape(-1, 3)


def sheet(points: FloatArray, paint: NDArray[np.floating], *, smooth: bool = True, mirror: bool = False) -> Mesh:
    """Return a surface through a grid of points, r x c x 3, with the paint stretched over it.

    >>> y, x = np.mgrid[0:1:3j, 0:1:4j]
    >>> len(sheet(np.stack([x, y, 1 + 0 * x], -1), np.full((2, 2, 3), 0.5)).faces)
    12
    """
    rows, columns = points.shape[:2]
    height, width = paint.shape[:2]
    # The first and last texels lie on the borders: texel i is centred on (i + 1/2) / n.
    v, u = np.meshgrid(
        (0.5 + np.linspace(0, height - 1, rows)) / height,
        (0.5 + np.linspace(0, width - 1, columns)) / width,
        indexing="ij",
    )
    uv = np.stack([u, v], axis=-1).reshape(-1, 2)
    return Mesh(points.reshape(-1, 3), grid_faces(rows, columns), uv, paint, smooth=smooth, mirror=mirror)


def lathe(
    centre: ArrayLike,
    profile: FloatArray,
    paint: Paint,
    *,
    texels: int = 512,
    around: int = 256,
    mirror: bool = False,
) -> Mesh:
    """Return a solid of revolution about the vertical, from a `profile` of radius and height (k x 2, m), top down.

    Heights are relative to `centre`; `texels` is the number of texels around the circumference.

    >>> upright = np.array([[0.1, 0.3], [0.1, 0.0]])
    >>> can = lathe((0, 0, 1), upright, lambda points, detail: np.full(points.shape, 0.5), around=64)
    >>> can.vertices.shape
    (130, 3)
    """
    length = np.concatenate([[0], np.hypot(*np.diff(profile, axis=0).T).cumsum()])
    widest = float(profile[:, 0].max())
    height = max(2, math.ceil(texels * length[-1] / (2 * math.pi * widest)))

    def turned(along: FloatArray, steps: int) -> FloatArray:
        radius, up = (np.interp(along, length, part) for part in profile.T)
        angle = np.linspace(-np.pi, np.pi, steps)  # the seam is at the back
        return np.stack(
            [
                radius[:, None] * np.sin(angle),
                np.broadcast_to(-up[:, None], (len(along), steps)),
                -radius[:, None] * np.cos(angle),
            ],
            axis=-1,
        )

    paint_here = paint(turned(np.linspace(0, length[-1], height), texels), 2 * math.pi * widest / texels)
    mesh = sheet(turned(length, around + 1) + np.asarray(centre, float), _clipped(paint_here), mirror=mirror)
    # Texels are evenly spaced along the profile; profile points need not be.
    v = (0.5 + length / length[-1] * (height - 1)) / height
    mesh.uv[:, 1] = np.repeat(v, around + 1)
    return mesh


def ball(
    centre: ArrayLike,
    radius: float,
    paint: Paint,
    *,
    seed: int = 0,
    lumpy: float = 0.0,
    squash: float = 1.0,
    texels: int = 512,
    mesh: int = 384,
) -> Mesh:
    """Return a sphere, or a boulder with relative radius variation `lumpy`; `squash` is height / width.

    >>> earth = ball((0, 0, 2), 0.5, lambda points, detail: np.full(points.shape, 0.5), texels=64)
    >>> bool(np.allclose(np.linalg.norm(earth.vertices - (0, 0, 2), axis=1), 0.5))
    True
    """

    def surface(rows: int, columns: int) -> FloatArray:
        down, angle = np.meshgrid(np.linspace(0, np.pi, rows), np.linspace(-np.pi, np.pi, columns), indexing="ij")
        way = np.stack([np.sin(down) * np.sin(angle), -np.cos(down), -np.sin(down) * np.cos(angle)], axis=-1)
        if lumpy:
            bumps = fractal(way, seed, coarsest=1.3, finest=0.03, roughness=0.5)
            # Flattened facets between ridges, as of broken stone.
            bumps = bumps - 0.6 * np.abs(fractal(way, seed + 1, coarsest=0.9, finest=0.05, roughness=0.45))
            way = way * (1 + lumpy * bumps)[..., None]
        return radius * way * [1, squash, 1]

    size = (texels // 2, texels)
    paint_here = paint(surface(*size), 2 * math.pi * radius / texels)
    return sheet(surface(mesh // 2 + 1, mesh + 1) + np.asarray(centre, float), _clipped(paint_here))


def strewn(kind: Mesh, places: FloatArray, sizes: ArrayLike, seed: int) -> Mesh:
    """Return n randomly rotated copies of a body at the origin, at `places` (n x 3, m), as one mesh.

    >>> stone = ball((0, 0, 0), 1.0, lambda points, detail: np.full(points.shape, 0.5), texels=16)
    >>> len(strewn(stone, np.array([[0, 0, 1.0], [0.1, 0, 2.0]]), [0.02, 0.03], seed=1).faces) == 2 * len(stone.faces)
    True
    """
    random = np.random.default_rng(seed)
    turns = random.uniform(0, 2 * np.pi, len(places))
    vertices = []
    for place, size, turn in zip(places, np.asarray(sizes, float), turns, strict=True):
        c, s = math.cos(turn), math.sin(turn)
        vertices.append(size * kind.vertices @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T + place)
    faces = np.concatenate([kind.faces + index * len(kind.vertices) for index in range(len(places))])
    return Mesh(np.concatenate(vertices), faces, np.tile(kind.uv, (len(places), 1)), kind.paint, smooth=kind.smooth)


def box(low: ArrayLike, high: ArrayLike, paint: Paint, *, texel: float = 1e-3) -> Mesh:
    """Return a box between two corners (m) as one mesh.

    >>> crate = box((0, 0, 1), (1, 1, 2), lambda points, detail: np.full(points.shape, 0.5), texel=0.1)
    >>> crate.vertices.shape
    (24, 3)
    """
    low, high = np.asarray(low, float), np.asarray(high, float)
    middle, half = (low + high) / 2, (high - low) / 2
    fine = np.clip(np.ceil(2 * half / texel), 2, 1024).astype(int)
    corners, places = [], []
    paints: list[FloatArray] = []
    width = int(fine.max())
    for axis in range(3):
        u, v = [other for other in range(3) if other != axis]
        for side in (-1, 1):
            # Sides that the camera cannot see are painted without detail.
            hidden = side * middle[axis] + half[axis] >= 0
            rows, columns = (2, 2) if hidden else (int(fine[v]), int(fine[u]))
            a, b = np.meshgrid(np.linspace(-1, 1, rows), np.linspace(-1, 1, columns), indexing="ij")
            points = np.empty((rows, columns, 3))
            points[..., axis], points[..., u], points[..., v] = side, b, a
            points *= half
            corners.append(points[[0, 0, -1, -1], [0, -1, -1, 0]])
            # One atlas for all sides, stacked vertically at full width.
            top = sum(len(other) for other in paints)
            part = np.zeros((rows, width, 3))
            part[:, :columns] = paint(points, texel)
            part[:, columns:] = part[:, columns - 1 : columns]
            paints.append(part)
            right, bottom = columns - 0.5, top + rows - 0.5
            places.append(np.array([[0.5, top + 0.5], [right, top + 0.5], [right, bottom], [0.5, bottom]]))
    atlas = np.concatenate(paints)
    vertices = np.concatenate(corners) + middle
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(6)])
    return Mesh(vertices, faces, np.concatenate(places) / [width, len(atlas)], _clipped(atlas))


def _clipped(paint: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.clip(paint, 0.005, 0.95).astype(np.float32)
