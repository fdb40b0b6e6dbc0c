"""Ground truth of a scene: surface distance, and the vergence of images seen in mirrors.

Light from a point P crosses the lens at a = (x, y) in direction t(a) = t0 - V a, directions being tangents. For a
surface seen directly, V is 1/z times the unit matrix. A curved mirror images P at different distances in different
meridians, so V is a 2 x 2 matrix, found by tracing neighbouring rays. Let h(a, t) be the two-dimensional position at
which a ray meets the surface of P. Rays from P share the same h, hence V = (dh/dt)^-1 (dh/da).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.render.pathtrace import has_mirrors, trace
from focalgradient.scenes.objects import Scene

__all__ = ["ground_truth"]


def ground_truth(
    scene: Scene, shape: tuple[int, int], pixel_angle: float, variant: str
) -> tuple[FloatArray, FloatArray | None]:
    """Return true distance in metres along the axis, H x W, and, if there are mirrors, vergence, H x W x 2 x 2.

    Both are defined as in `Rendered`, for rays through the pixel centres and the centre of the lens.
    """
    height, width = shape
    rows, columns = np.indices(shape).reshape(2, -1)
    tangents = np.stack([columns - (width - 1) / 2, rows - (height - 1) / 2], axis=1) * pixel_angle
    points, _, met = _ends(scene, np.zeros_like(tangents), tangents, follow=False, variant=variant)
    distance = np.where(met < 0, np.inf, points[:, 2]).reshape(shape)
    if not has_mirrors(scene):
        return distance, None
    return distance, _vergence(scene, tangents, pixel_angle, variant).reshape(*shape, 2, 2)


def _ends(
    scene: Scene, lens: FloatArray, tangents: FloatArray, *, follow: bool, variant: str
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    origins = np.concatenate([lens, np.zeros((len(lens), 1))], axis=1)
    directions = np.concatenate([tangents, np.ones((len(lens), 1))], axis=1)
    return trace(scene, origins, directions, follow=follow, variant=variant)


def _vergence(scene: Scene, tangents: FloatArray, step: float, variant: str) -> FloatArray:
    """Return the vergence, n x 2 x 2, in each direction; rays are perturbed by `step` (tangent, and metres)."""
    centre = np.zeros_like(tangents)
    point, normal, met = _ends(scene, centre, tangents, follow=True, variant=variant)
    # Two orthogonal directions in the surface where the ray ends.
    aside = np.where(np.abs(normal[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(normal, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    plane = np.stack([first, np.cross(normal, first)], axis=1)
    smooth = np.ones(len(tangents), bool)

    def derivative(lens: FloatArray, turn: FloatArray) -> FloatArray:
        """Return the change of the position h, n x 2, for a shift on the lens (m) or a `turn` (tangent), per step."""
        ends = []
        for sign in (1, -1):
            end, _, mirrors = _ends(scene, centre + sign * lens, tangents + sign * turn, follow=True, variant=variant)
            away = end - point
            # Neighbouring rays that end on another surface, or around a corner, are invalid.
            np.logical_and(smooth, mirrors == met, out=smooth)
            off = np.abs(np.einsum("ni,ni->n", away, normal))
            np.logical_and(smooth, off <= 0.2 * np.linalg.norm(away, axis=1) + 1e-6, out=smooth)
            ends.append(end)
        return np.einsum("nki,ni->nk", plane, ends[0] - ends[1]) / (2 * step)

    still, moves = np.zeros(2), step * np.eye(2)
    by_turn = np.stack([derivative(still, move) for move in moves], axis=-1)
    by_lens = np.stack([derivative(move, still) for move in moves], axis=-1)
    usable = smooth & (np.abs(np.linalg.det(by_turn)) > 0)
    found = np.full((len(tangents), 2, 2), np.nan)
    found[usable] = np.linalg.solve(by_turn[usable], by_lens[usable])
    direct = met == 0
    found[direct] = np.eye(2) / point[direct, 2, None, None]
    found[met == -1] = 0.0
    return found
