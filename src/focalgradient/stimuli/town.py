"""Oblique view of a town: flat-roofed houses on a plain, as in pictures with the miniature effect."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.stimuli.layers import noise

__all__ = ["draw_town"]

PITCH, YAW = math.radians(35), math.radians(25)
"""Downward pitch of the camera, and rotation of the streets relative to its line of sight (rad)."""

HOUSES, STREET = 11, 0.12
"""Number of houses per side, and their spacing, relative to the distance of the town's centre."""

SIDES, HEIGHTS = (0.025, 0.045), (0.02, 0.11)
"""Ranges of half the side and of the height of a house, relative to the distance of the town's centre."""

SUN = np.array([-0.5, -0.35, 0.8])
"""Direction towards the sun: along the two street directions, and up."""

AMBIENT, PLAIN, TEXTURE = 0.4, 0.3, 0.12
"""Ambient fraction of the illumination; reflectance of the plain; RMS contrast of the texture of all surfaces."""

SAMPLES = 3
"""Rays per side of a pixel; the middle ray gives the depth."""

MIN_HOUSE_DISTANCE = 0.2
"""Distance, relative to the town's centre, within which houses are omitted."""


def draw_town(shape: tuple[int, int], field: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Draw a town as seen through a pinhole.

    Parameters
    ----------
    shape
        Height and width in pixels.
    field
        Width of the picture, as a tangent.
    seed
        Random seed of the houses and their texture.

    Returns
    -------
    tuple
        Linear luminance, 0 to 1, and distance along the axis relative to the town's centre, H x W each.

    Examples
    --------
    >>> light, depth = draw_town((48, 64), 0.5, seed=1)
    >>> bool(0 < light.min() < light.max() <= 1), bool(depth.min() > 0.2)
    (True, True)
    """
    rows, columns = (SAMPLES * side for side in shape)
    pixel = field / columns
    random = np.random.default_rng(seed)
    texture = TEXTURE * noise((rows, columns), [seed, 1])
    # Unit vectors of the town in camera coordinates: right, down, ahead.
    up = np.array([0.0, -math.cos(PITCH), -math.sin(PITCH)])
    level = np.array([0.0, -math.sin(PITCH), math.cos(PITCH)])
    right = np.array([1.0, 0.0, 0.0])
    axes = np.stack([math.cos(YAW) * right + math.sin(YAW) * level, math.cos(YAW) * level - math.sin(YAW) * right, up])
    y, x = np.meshgrid(*((np.arange(n) - (n - 1) / 2) * pixel for n in (rows, columns)), indexing="ij")
    eye = axes @ np.array([0.0, 0.0, -1.0])  # relative to the town's centre
    ways = np.stack([x, y, np.ones(x.shape)], axis=-1) @ axes.T  # unit component along the axis
    ground = np.where(ways[..., 2] < 0, -eye[2] / np.minimum(ways[..., 2], -1e-9), 1e9)
    depth, light = ground, PLAIN * _shade(2, 1) * (1 + texture)
    for row in range(HOUSES):
        for column in range(HOUSES):
            half, height = random.uniform(*SIDES), random.uniform(*HEIGHTS)
            mean, shift = random.uniform(0.15, 0.75), random.integers(0, min(rows, columns), 2)
            place = STREET * np.array([column - HOUSES // 2, row - HOUSES // 2])
            low = np.array([place[0] - half, place[1] - half, 0.0])
            high = np.array([place[0] + half, place[1] + half, height])
            part = _part(low, high, axes, eye, pixel, (rows, columns))
            if part is None:
                continue
            distance, axis = _hit(low - eye, high - eye, ways[part])
            nearer = distance < depth[part]
            own = np.roll(texture, tuple(shift), axis=(0, 1))[part]
            facing = [math.copysign(1, eye[n] - place[n]) for n in range(2)]
            shade = np.choose(axis, [_shade(0, facing[0]), _shade(1, facing[1]), _shade(2, 1)])
            depth[part] = np.where(nearer, distance, depth[part])
            light[part] = np.where(nearer, mean * shade * (1 + own), light[part])
    middle = SAMPLES // 2
    kept = depth[middle::SAMPLES, middle::SAMPLES]
    return np.clip(light.reshape(shape[0], SAMPLES, shape[1], SAMPLES).mean(axis=(1, 3)), 0, 1), kept


def _shade(axis: int, sign: float) -> float:
    """Return the illumination of a face whose outward normal is plus or minus an axis of the town."""
    facing = float(SUN[axis] * sign / np.linalg.norm(SUN))
    return AMBIENT + (1 - AMBIENT) * max(facing, 0.0)


def _part(
    low: FloatArray,
    high: FloatArray,
    axes: FloatArray,
    eye: FloatArray,
    pixel: float,
    shape: tuple[int, int],
) -> tuple[slice, slice] | None:
    """Return the part of the picture that may contain a house; None if it is not visible."""
    corners = np.array([[(low, high)[n >> k & 1][k] for k in range(3)] for n in range(8)])
    seen = (corners - eye) @ axes
    if seen[:, 2].min() < MIN_HOUSE_DISTANCE:
        return None
    place = seen[:, 1::-1] / seen[:, 2:] / pixel + (np.array(shape) - 1) / 2
    first = np.clip(np.floor(place.min(axis=0)).astype(int), 0, shape)
    last = np.clip(np.ceil(place.max(axis=0)).astype(int) + 1, 0, shape)
    if (first >= last).any():
        return None
    return slice(first[0], last[0]), slice(first[1], last[1])


def _hit(low: FloatArray, high: FloatArray, ways: FloatArray) -> tuple[FloatArray, NDArray[np.int_]]:
    """Return where rays from the origin enter a box, in multiples of their `ways` (inf: miss), and the axis crossed."""
    safe = np.where(np.abs(ways) < 1e-12, 1e-12, ways)
    one, other = low / safe, high / safe
    entering, leaving = np.minimum(one, other), np.maximum(one, other).min(axis=-1)
    first = entering.max(axis=-1)
    return np.where((first < leaving) & (first > 0), first, np.inf), entering.argmax(axis=-1)
