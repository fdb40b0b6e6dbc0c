"""What is truly there: the distance of surfaces, and the vergence of what mirrors show.

Light of one point P crosses the lens at a = (x, y) in a direction t(a) = t0 - V a, all directions being tangents. For a
surface seen directly V is 1/z times the unit matrix. In a curved mirror the image of P lies at different distances for
different meridians, and V is a 2 x 2 matrix: found by tracing neighbouring rays. Let h(a, t) be the place, in two
dimensions, where a ray ends on P's surface. Rays of P keep h: V = (dh/dt)^-1 (dh/da).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focalgradient.render.pathtrace import has_mirrors, trace
from focalgradient.scenes.objects import Scene

__all__ = ["ground_truth"]


def ground_truth(
    scene: Scene, shape: tuple[int, int], pixel_angle: float, variant: str
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """True distance in metres along the axis, H x W, and where there are mirrors the vergence, H x W x 2 x 2.

    Both as in `Rendered`: of rays through the pixel centres and the centre of the lens.
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
    scene: Scene, lens: NDArray[np.float64], tangents: NDArray[np.float64], *, follow: bool, variant: str
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    origins = np.concatenate([lens, np.zeros((len(lens), 1))], axis=1)
    directions = np.concatenate([tangents, np.ones((len(lens), 1))], axis=1)
    return trace(scene, origins, directions, follow=follow, variant=variant)


def _vergence(scene: Scene, tangents: NDArray[np.float64], step: float, variant: str) -> NDArray[np.float64]:
    """Vergence, n x 2 x 2, seen in each direction; neighbouring rays are a `step` of tangent, and of metres, away."""
    centre = np.zeros_like(tangents)
    point, normal, met = _ends(scene, centre, tangents, follow=True, variant=variant)
    # Two directions in the surface where the ray ends.
    aside = np.where(np.abs(normal[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    first = np.cross(normal, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    plane = np.stack([first, np.cross(normal, first)], axis=1)
    smooth = np.ones(len(tangents), bool)

    def derivative(lens: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
        """Change of the place h, n x 2, by a move on the lens (m) or a `turn` (tangent), divided by the step."""
        ends = []
        for sign in (1, -1):
            end, _, mirrors = _ends(scene, centre + sign * lens, tangents + sign * turn, follow=True, variant=variant)
            away = end - point
            # On another surface, or around a corner, neighbours are no guide.
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
