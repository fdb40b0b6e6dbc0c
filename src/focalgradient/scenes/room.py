"""Indoor scene: a sand castle on a table, a refrigerator, and a door in the far wall (for the paper's Fig. 4)."""

from __future__ import annotations

import math

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import checked
from focalgradient.quantities import Seed
from focalgradient.scenes.fractal import fractal
from focalgradient.scenes.materials import grained, ramp
from focalgradient.scenes.objects import Mark, Mesh, Point, Scene
from focalgradient.scenes.shapes import Paint, box, lathe

__all__ = ["room"]

CAMERA_HEIGHT = 1.0  # camera height above the floor (m)
TABLE_DEPTH = 0.14  # depth of the table top below the camera (m)
WALL_DISTANCE = 4.4  # distance of the far wall (m)

SAND = ((0.25, 0.17, 0.10), (0.46, 0.34, 0.21), (0.56, 0.43, 0.28), (0.68, 0.56, 0.40))
PLASTER = ((0.42, 0.40, 0.34), (0.55, 0.53, 0.46), (0.61, 0.58, 0.51), (0.68, 0.65, 0.58))
ENAMEL = ((0.62, 0.63, 0.63), (0.74, 0.75, 0.75), (0.78, 0.79, 0.79), (0.84, 0.85, 0.85))
GREEN = ((0.07, 0.11, 0.10), (0.15, 0.23, 0.20), (0.19, 0.28, 0.245), (0.26, 0.36, 0.31))
STEEL = ((0.10, 0.10, 0.11), (0.22, 0.22, 0.23), (0.30, 0.30, 0.31), (0.45, 0.45, 0.46))


@checked
def room(seed: Seed = 0) -> Scene:
    """Return a sunlit room with a sand castle on a table at 1 m, a refrigerator at 3 m and a door at 4.4 m.

    Intended for a frame about 0.45 wide and high (a tangent: number of columns x pixel angle).

    Parameters
    ----------
    seed
        Random seed of all materials, the castle's layout and the illumination.

    Returns
    -------
    Scene
        Scene with the marks ``"nearest"`` (the castle's gate tower), ``"refrigerator"`` and ``"farthest"`` (the door).

    Examples
    --------
    >>> [round(mark.distance, 1) for mark in room(seed=1).marks]
    [0.8, 3.0, 4.4]
    """
    random = np.random.default_rng([seed, 3])
    towers, gate = _castle(seed, random)
    things = [*towers, *_fridge(seed), *_door(seed, grained(GREEN, seed + 11, 0.8, 0.8))]
    # Table, floor, far wall and left wall; the sun shines in from behind the camera.
    wall, left = (-2.4, -1.6, WALL_DISTANCE), (-1.5, -1.6, 1.8)
    things += _boxes(
        ((-0.5, TABLE_DEPTH, 0.62), (0.45, TABLE_DEPTH + 0.04, 1.5), _planks(seed + 1, 0.12, 0), 0.5e-3),
        ((-2.4, CAMERA_HEIGHT, 0.5), (2.4, CAMERA_HEIGHT + 0.05, WALL_DISTANCE), _planks(seed + 2, 0.14, 1), 2.5e-3),
        (wall, (2.4, CAMERA_HEIGHT, WALL_DISTANCE + 0.1), grained(PLASTER, seed + 3, 1.5, 0.8), 2.5e-3),
        (left, (-1.4, CAMERA_HEIGHT, WALL_DISTANCE), grained(PLASTER, seed + 4, 1.5, 0.8), 2.5e-3),
    )
    side = random.uniform(0.35, 0.8)
    return Scene(
        tuple(things),
        background=0.3,
        sun=(side, -random.uniform(0.55, 0.9), -1.0),
        ambient=0.4,
        tint=(1.05, 0.97, 0.84),
        marks=(gate, Mark("refrigerator", (0.52, -0.2, 3.0)), Mark("farthest", (-0.25, -0.6, WALL_DISTANCE - 0.02))),
    )


def _boxes(*given: tuple[Point, Point, Paint, float]) -> list[Mesh]:
    """Return boxes between corners (m), each with its paint and size of a texel (m)."""
    return [box(low, high, paint, texel=texel) for low, high, paint, texel in given]


def _planks(seed: int, width: float, axis: int) -> Paint:
    """Return a paint of boards running across (axis 0) or away (1), with grain along them and gaps between."""
    colours = ((0.10, 0.05, 0.025), (0.26, 0.15, 0.08), (0.38, 0.24, 0.13), (0.50, 0.35, 0.21))

    def paint(points: FloatArray, detail: float) -> FloatArray:
        across, along = (points[..., 2], points[..., 0]) if axis == 0 else (points[..., 0], points[..., 2])
        board = np.floor(across / width)
        stretched = np.stack([across * 6, points[..., 1], along * 0.5 + 7.3 * board], axis=-1)
        grain = fractal(stretched, seed, coarsest=0.4, finest=4 * detail, roughness=0.8)
        fine = fractal(points, seed + 1, coarsest=0.03, finest=2 * detail, roughness=0.9)
        tone = 0.9 * grain + 0.35 * fine + 0.5 * np.sin(12.9898 * board + seed)
        gap = np.abs(across / width - np.round(across / width)) * width < 0.003
        return ramp(tone, colours) * np.where(gap, 0.3, 1.0)[..., None]

    return paint


def _castle(seed: int, random: np.random.Generator) -> tuple[list[Mesh], Mark]:
    """Return four round towers, battlemented walls and a keep of sand, and the mark on the foremost tower."""
    sand = grained(SAND, seed + 20, 0.05, 1.0)
    half, z0 = 0.085, 0.86
    made = [box((-0.16, TABLE_DEPTH - 0.012, z0 - 0.06), (0.14, TABLE_DEPTH, z0 + 0.24), sand, texel=0.4e-3)]
    foot = TABLE_DEPTH - 0.012
    corners = [(-half - 0.01, z0), (half - 0.01, z0), (-half - 0.01, z0 + 0.17), (half - 0.01, z0 + 0.17)]
    for index, (x, z) in enumerate(corners):
        radius, height = 0.026 * random.uniform(0.9, 1.1), 0.115 * random.uniform(0.85, 1.15)
        made.append(_tower((x, foot, z), radius, height, sand, pointed=index in (0, 3)))
    top = foot - 0.065
    for z in (z0, z0 + 0.17):
        made.append(box((corners[0][0], top, z - 0.010), (corners[1][0], foot, z + 0.010), sand, texel=0.4e-3))
        for x in np.linspace(corners[0][0] + 0.03, corners[1][0] - 0.03, 5):
            made.append(box((x - 0.008, top - 0.013, z - 0.010), (x + 0.008, top, z + 0.010), sand, texel=0.4e-3))
    for x in (corners[0][0], corners[1][0]):
        made.append(box((x - 0.010, top, z0), (x + 0.010, foot, z0 + 0.17), sand, texel=0.4e-3))
    made.append(_tower((-0.01, foot, z0 + 0.085), 0.038, 0.165 * random.uniform(0.95, 1.1), sand, pointed=True))
    x, z = corners[0]
    nearest = made[1].vertices
    front = float(nearest[np.abs(nearest[:, 1] - (foot - 0.05)) < 0.004][:, 2].min())
    return made, Mark("nearest", (x * front / z, foot - 0.05, front))


def _tower(foot: tuple[float, float, float], radius: float, height: float, paint: Paint, *, pointed: bool) -> Mesh:
    up = np.linspace(0, 1, 160)
    width = radius * (1.12 - 0.16 * up)
    width = np.where(up > 0.86, radius * 1.18, width)  # a gallery juts out
    profile = np.stack([width, height * up], axis=1)[::-1]
    roof = [[0.0, height + 1.9 * radius], [1.1 * radius, height]] if pointed else [[0.0, height]]
    return lathe(foot, np.concatenate([roof, profile]), paint, texels=512, around=128)


def _fridge(seed: int) -> list[Mesh]:
    enamel, steel = grained(ENAMEL, seed + 40, 0.6, 0.7), grained(STEEL, seed + 41, 0.05, 1.0)
    left, right, top, front = 0.28, 0.96, -0.62, 3.06
    foot = CAMERA_HEIGHT - 0.03
    made = _boxes(
        ((left, top, front), (right, foot, front + 0.65), enamel, 2e-3),
        ((left + 0.02, foot, front + 0.03), (right - 0.02, CAMERA_HEIGHT, front + 0.6), steel, 4e-3),
    )
    for high, low in ((top + 0.005, top + 0.47), (top + 0.485, CAMERA_HEIGHT - 0.04)):
        made.append(box((left + 0.005, high, front - 0.06), (right - 0.005, low, front - 0.008), enamel, texel=2e-3))
        bar = (high + 0.08, high + 0.36) if high > top + 0.1 else (low - 0.3, low - 0.06)
        made.append(box((left + 0.05, bar[0], front - 0.105), (left + 0.075, bar[1], front - 0.085), steel, texel=1e-3))
        ends = [((left + 0.05, y - 0.012, front - 0.09), (left + 0.075, y + 0.012, front - 0.06)) for y in bar]
        made += _boxes(*((*end, steel, 1e-3) for end in ends))
    return made


def _door(seed: int, leaf: Paint) -> list[Mesh]:
    left, right, top, front = -0.86, -0.02, -1.05, WALL_DISTANCE
    frame = grained(ENAMEL, seed + 50, 0.4, 0.9)
    made = _boxes(
        ((left, top, front - 0.02), (right, CAMERA_HEIGHT, front), leaf, 2e-3),
        ((left - 0.09, top - 0.09, front - 0.05), (left, CAMERA_HEIGHT, front), frame, 2e-3),
        ((right, top - 0.09, front - 0.05), (right + 0.09, CAMERA_HEIGHT, front), frame, 2e-3),
        ((left, top - 0.09, front - 0.05), (right, top, front), frame, 2e-3),
    )
    # Stiles and rails stand out from the panels.
    middle = (left + right) / 2
    upright = [(left, left + 0.11), (middle - 0.045, middle + 0.045), (right - 0.11, right)]
    across = [(top, top + 0.12), (-0.12, 0.02), (0.48, 0.62), (CAMERA_HEIGHT - 0.2, CAMERA_HEIGHT)]
    bars = [((a, top), (b, CAMERA_HEIGHT)) for a, b in upright] + [((left, a), (right, b)) for a, b in across]
    depths = [front - 0.045] * 3 + [front - 0.046] * 4
    corners = [((*low, depth), (*high, front - 0.015)) for depth, (low, high) in zip(depths, bars, strict=True)]
    made += _boxes(*((*pair, leaf, 2e-3) for pair in corners))
    knob = np.stack([0.03 * np.sin(np.linspace(0, math.pi, 40)), 0.03 * np.cos(np.linspace(0, math.pi, 40))], axis=1)
    made.append(
        lathe((right - 0.055, 0.06, front - 0.09), knob, grained(STEEL, seed + 51, 0.05, 1.0), texels=64, around=64)
    )
    return made
