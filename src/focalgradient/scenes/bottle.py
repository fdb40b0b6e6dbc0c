"""Mirrored bottle on a checkered plane: mirror images lie at other depths than the surface (the paper's Fig. 1)."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import checked
from focalgradient.quantities import Range, Seed
from focalgradient.scenes.landscape import clouded_sky
from focalgradient.scenes.materials import grained
from focalgradient.scenes.objects import Mark, Mesh, Scene
from focalgradient.scenes.shapes import lathe
from focalgradient.scenes.texture import random_field

__all__ = ["BODY_RADIUS", "bottle"]

BODY_RADIUS = 0.045
"""Radius in metres of the bottle's cylindrical body."""

REFLECTANCE = 0.9  # reflectance of silvered glass, nearly constant over the visible band
CHECK_SIDE = 0.03  # side of a check (m)
CAMERA_HEIGHT = 0.16  # camera height above the plane (m)
WALL_RADIUS = 2.6  # radius of the surrounding wall (m)
EARTH = ((0.08, 0.07, 0.07), (0.22, 0.20, 0.17), (0.42, 0.36, 0.27), (0.66, 0.58, 0.45))  # the wall's colours


@checked
def bottle(
    seed: Seed = 0, *, distance: Annotated[float, Range("metres, for the wall to enclose the bottle", 0.3, 2)] = 1.0
) -> Scene:
    """Return a mirrored bottle, 0.26 m high, on a checkered plane within a painted cylindrical wall.

    Its body is a cylinder, which reflects like a plane mirror vertically and like a convex mirror horizontally, so that
    its images are astigmatic.

    Parameters
    ----------
    seed
        Random seed of the wall's and the plane's texture, and of the orientation of the checks.
    distance
        Distance of the bottle's axis in metres; its nearest point is `BODY_RADIUS` nearer.

    Returns
    -------
    Scene
        Scene with the marks ``"nearest"`` (on the bottle's body) and ``"farthest"`` (on the wall beside it).

    Examples
    --------
    >>> round(bottle().mark("nearest").distance, 3)
    0.955
    """
    random = np.random.default_rng([seed, 1])
    turn = random.uniform(0.1, 0.6)
    mirror = lathe(
        (0.0, CAMERA_HEIGHT, distance),
        _profile(),
        lambda points, detail: np.full(points.shape, REFLECTANCE),
        texels=8,
        around=720,
        mirror=True,
    )
    wall = lathe(
        (0.0, CAMERA_HEIGHT, 0.0),
        np.array([[WALL_RADIUS, 1.8], [WALL_RADIUS, 0.0]]),
        grained(EARTH, seed + 5, 0.5, roughness=0.95, stretch=(1, 1.6, 1)),
        texels=3072,
        around=256,
    )
    nearest = Mark("nearest", (0.0, 0.06, distance - BODY_RADIUS))
    away = 0.1
    farthest = Mark("farthest", (WALL_RADIUS * math.sin(away), -0.1, WALL_RADIUS * math.cos(away)))
    return Scene(
        (mirror, _checks(seed, turn), wall),
        sun=(-0.6, -1.0, -0.7),
        ambient=0.4,
        sky=clouded_sky(seed, cover=0.5, brightness=0.5),
        marks=(nearest, farthest),
    )


def _profile() -> FloatArray:
    """Return radius and height (m) of the bottle's profile, from the centre of its top to that of its foot."""
    share = np.linspace(0, 1, 60)[1:-1]
    neck, shoulder, body = 0.0135, 0.205, 0.14
    bend = np.stack(
        [neck + (BODY_RADIUS - neck) * (1 - np.cos(np.pi * share)) / 2, shoulder + (body - shoulder) * share], axis=1
    )
    lip = [[0.0, 0.26], [0.0145, 0.26], [0.0165, 0.258], [0.0165, 0.245], [neck, 0.243], [neck, shoulder]]
    foot = [[BODY_RADIUS, body], [BODY_RADIUS, 0.006], [0.0435, 0.0015], [0.040, 0.0], [0.0, 0.0]]
    corners = np.concatenate([lip, bend, foot])
    length = np.concatenate([[0], np.hypot(*np.diff(corners, axis=0).T).cumsum()])
    along = np.linspace(0, length[-1], 500)
    profile = np.stack([np.interp(along, length, part) for part in corners.T], axis=1)
    # Edges are rounded over some 6 mm; the body stays straight and vertical, and foot and top stay closed.
    kernel = np.exp(-(np.linspace(-2, 2, 17) ** 2))
    padded = np.pad(profile, ((8, 8), (0, 0)), mode="edge")
    soft = np.stack([np.convolve(part, kernel / kernel.sum(), "valid") for part in padded.T], axis=1)
    soft[[0, -1]] = profile[[0, -1]]
    return soft


def _checks(seed: int, turn: float) -> Mesh:
    """Return the plane: dark and light checks with 1/f grain, 8 x 8 in a repeating tile."""
    cells, texels = 8, 1024
    row, column = np.indices((texels, texels)) * cells // texels
    tone = np.where((row + column) % 2, 0.62, 0.09) * np.exp(0.13 * random_field((texels, texels), [seed, 3]))
    corners = 4.0 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    c, s = math.cos(turn), math.sin(turn)
    uv = corners @ np.array([[c, -s], [s, c]]).T / (cells * CHECK_SIDE)
    vertices = np.stack([corners[:, 0], np.full(4, CAMERA_HEIGHT), corners[:, 1]], axis=1)
    paint = np.clip(tone[..., None] * [1.0, 0.96, 0.88], 0, 1).astype(np.float32)
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), uv, paint)
