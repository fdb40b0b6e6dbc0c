"""Frames of a Necker-cube trial: a quarter rotation, and two unambiguous examples.

The rigid example is an opaque cube, with hidden edges omitted. The nonrigid example twists, shrinks and tapers as it
rotates: neither it nor its depth reversal is rigid.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.design import NeckerDesign, NeckerTrial
from focalgradient.display import Display
from focalgradient.render import necker_loop
from focalgradient.render.wireframe import blur_at, draw_edges
from focalgradient.scenes import NeckerCube
from focalgradient.scenes.necker import CORNERS, EDGES, SYMMETRY

__all__ = ["LEVEL", "cube_of", "frame_count", "frames_of", "room_of", "shape_of", "shown", "wobbling"]

LEVEL = 0.5  # radiance of a sharp line as a fraction of the display's white: crossings of two are white
SHRINK, TWIST = 0.6, 0.5  # nonrigid example: relative change of its sides, and rotation (rad) of its top and bottom
REACH = 4.0  # margin around the cube in standard deviations of the blur


def cube_of(design: NeckerDesign, direction: str = "right") -> NeckerCube:
    """Return the cube of a design."""
    return NeckerCube(
        size=math.radians(design.size_deg),
        perspective=design.perspective,
        distance=design.distance_m,
        tilt=math.radians(design.tilt_deg),
        direction="right" if direction == "right" else "left",
        speed=design.turns_per_s,
        line_width=math.radians(design.line_width_deg),
    )


def frame_count(design: NeckerDesign, frame_rate: float) -> int:
    """Return the number of frames per quarter rotation that best matches the cube's speed."""
    return max(3, round(SYMMETRY * frame_rate / design.turns_per_s))


def shape_of(design: NeckerDesign, pixel_angle: float) -> tuple[int, int]:
    """Return the height and width of all pictures of a design, in pixels, even."""
    return room_of(cube_of(design), max(design.strengths_mm) / 1000, pixel_angle)


def room_of(cube: NeckerCube, aperture: float, pixel_angle: float) -> tuple[int, int]:
    """Return the even height and width in pixels that contain a rotating cube blurred by an `aperture` (m).

    >>> room_of(NeckerCube(), 0.004, 1e-3)
    (260, 234)
    """
    wide, high = cube.extent
    blur = blur_at(cube, [cube.nearest, cube.farthest], aperture=aperture)
    rim = REACH * (float(np.abs(blur).max()) + cube.line_width)
    return 2 * math.ceil((high + rim) / pixel_angle), 2 * math.ceil((wide + rim) / pixel_angle)


def frames_of(
    trial: NeckerTrial, design: NeckerDesign, frames: int, pixel_angle: float
) -> Iterator[NDArray[np.float32]]:
    """Yield the radiance of each frame of a quarter rotation, H x W; 1 is the peak of a sharp line."""
    cube, shape = cube_of(design, trial.direction), shape_of(design, pixel_angle)
    if trial.is_ambiguous:
        blur: dict[str, Any] = {"gradient": trial.gradient, "aperture": trial.strength / 1000}
        yield from necker_loop(cube, frames, shape=shape, pixel_angle=pixel_angle, **blur)
        return
    for frame in range(frames):
        turn = SYMMETRY * frame / frames
        solid = cube.vertices(turn)
        points, edges = (solid, EDGES[_in_sight(solid)]) if trial.shape == "rigid" else (wobbling(cube, turn), EDGES)
        yield draw_edges(cube, points, edges, np.zeros(edges.shape), shape, pixel_angle)


def shown(light: NDArray[np.float32], display: Display) -> NDArray[np.uint8]:
    """Return the 8-bit values of a frame, H x W or H x W x 3, with a sharp line at `LEVEL` of white.

    >>> shown(np.array([[0.0, 1.0, 2.0]], np.float32), Display(gamma=1.0)).tolist()
    [[0, 128, 255]]
    """
    lit = light > 0  # a few per cent of the pixels
    values = display.encode(LEVEL * light[lit])
    pixels = np.zeros((*light.shape, *values.shape[1:]), np.uint8)
    pixels[lit] = values
    return pixels


def wobbling(cube: NeckerCube, turn: float) -> FloatArray:
    """Return the vertices, 8 x 3 in metres, of the nonrigid example after `turn` turns."""
    phase = 2 * math.pi * turn / SYMMETRY
    x, y, z = cube.edge * CORNERS.T
    twist = TWIST * math.sin(phase) * np.sign(y) / (2 * np.pi) * (1 if cube.direction == "right" else -1)
    level = 1 - SHRINK * (1 - math.sin(phase) * np.sign(y)) / 2  # the top is widest where the bottom is narrowest
    return cube.turned([level * x, y * (1 - SHRINK * (1 - math.cos(phase)) / 2), level * z], turn + twist)


def _in_sight(vertices: FloatArray) -> NDArray[np.bool_]:
    """Return which of the 12 edges of an opaque cube bound a face that is visible from the origin."""
    middle = vertices.mean(axis=0)
    seen = np.zeros(len(EDGES), bool)
    for axis in range(3):
        for sign in (-0.5, 0.5):
            corners = np.flatnonzero(CORNERS[:, axis] == sign)
            face = vertices[corners].mean(axis=0)
            if (face - middle) @ face < 0:
                seen |= np.isin(EDGES, corners).all(axis=1)
    return seen
