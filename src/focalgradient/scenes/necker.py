"""The rotating Necker cube: a perspective wireframe with two interpretations.

In the rigid interpretation it is a rotating cube. Reversed in depth, each vertex moves along its line of sight to the
other side of the centre: the picture is identical, but near and far are exchanged, the shape rotates in the opposite
direction, and, since perspective enlarged its near edges, it must stretch and shrink as it rotates.
`departure_from_rigid` quantifies this deformation.

Lengths are in metres, x right, y down, z away from the viewer at the origin; angles are in radians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite, check_number, checked
from focalgradient.quantities import ARCMIN, DEGREES, METRES, POSITIVE, Range

__all__ = [
    "EDGES",
    "SYMMETRY",
    "Departure",
    "Direction",
    "NeckerCube",
    "Reading",
    "departure_from_rigid",
    "edge_lengths",
]

Direction = Literal["right", "left"]
"""Direction in which the near side moves."""

Reading = Literal["rigid", "nonrigid"]
"""Interpretation of the picture: the depicted cube (rigid), or its depth reversal (nonrigid)."""

CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
"""Vertices of a unit cube centred on the origin, 8 x 3."""

EDGES = np.array([(i, i | bit) for bit in (2, 1, 4) for i in range(8) if not i & bit])
"""Vertex indices of each edge, 12 x 2: four edges parallel to the axis of rotation, then the eight others."""

SYMMETRY = 0.25
"""Rotation in turns after which the picture repeats: the cube stands on a face, and all edges are alike."""


@dataclass(frozen=True, slots=True)
class NeckerCube:
    """A wireframe cube rotating about its vertical axis, and its picture.

    The picture is a central projection. With `size` equal to `perspective` it subtends the angles of the cube itself;
    any other size scales the picture, including its blur, as on a screen.

    Parameters
    ----------
    size
        Visual angle of an edge, frontal and at the distance of the cube's centre.
    perspective
        Strength of perspective: edge of the cube / distance of its centre. 0.1 is weak, 0.8 strong.
    distance
        Distance from the centre of projection (the pupil of eye or lens) to the cube's centre, in metres.
    tilt
        Tilt of the axis in radians, positive with its top towards the viewer, so that the cube is seen from above.
    direction
        Direction in which the near side moves.
    speed
        Turns per second.
    line_width
        Full width at half maximum of a sharp line, of Gaussian profile.

    Angles are in radians.

    Raises
    ------
    InputError
        If a value is out of range, or the rotating cube would come too close to the viewer.

    Examples
    --------
    >>> cube = NeckerCube(size=0.2, perspective=0.5, distance=1.0)
    >>> cube.edge, round(cube.nearest, 3), round(cube.farthest, 3)
    (0.5, 0.582, 1.418)
    """

    size: Annotated[float, DEGREES.si, Range("radians", positive=True)] = math.radians(8)
    perspective: Annotated[float, POSITIVE, Range("edge length / distance", positive=True), "P"] = 0.4
    distance: Annotated[float, METRES, Range("metres", positive=True)] = 0.5
    tilt: Annotated[float, DEGREES.si, Range("radians, below a right angle", -1.5707, 1.5707)] = math.radians(20)
    direction: Direction = "right"
    speed: Annotated[float, POSITIVE.between(1e-3, 100), Range("turns per second", positive=True), "T"] = 0.125
    line_width: Annotated[float, ARCMIN.si, Range("radians", positive=True)] = math.radians(3 / 60)

    def __post_init__(self) -> None:
        check_fields(self)
        if self._reach > 0.95:
            raise InputError(
                f"perspective is {self.perspective:g}, with which the rotating cube comes within "
                f"{max(1 - self._reach, 0):.2g} of its distance from the viewer, but 0.05 must be left: "
                f"take at most {math.floor(950 * (self.perspective / self._reach)) / 1000:g}."
            )

    @property
    def _reach(self) -> float:
        """Largest depth of a vertex relative to the centre, divided by the distance."""
        return self.perspective * (math.cos(self.tilt) / math.sqrt(2) + abs(math.sin(self.tilt)) / 2)

    @property
    def edge(self) -> float:
        """Length of the cube's edges in metres."""
        return self.perspective * self.distance

    @property
    def nearest(self) -> float:
        """Smallest depth z in metres during a rotation, in either interpretation."""
        return self.distance * (1 - self._reach)

    @property
    def farthest(self) -> float:
        """Largest depth z in metres during a rotation, in either interpretation."""
        return self.distance * (1 + self._reach)

    @property
    def magnification(self) -> float:
        """Ratio of angles in the picture to angles at the centre of projection."""
        return self.size / self.perspective

    @property
    def extent(self) -> tuple[float, float]:
        """Half-width and half-height, in radians, of the smallest frame that contains the rotating cube.

        >>> tuple(round(angle, 4) for angle in NeckerCube(size=0.2, perspective=0.2, tilt=0.0).extent)
        (0.1429, 0.1165)
        """
        half, radius = self.perspective / 2, self.perspective / math.sqrt(2)  # relative to the distance
        sin, cos = abs(math.sin(self.tilt)), math.cos(self.tilt)
        width = radius / math.sqrt((1 - half * sin) ** 2 - (radius * cos) ** 2)
        # Along a vertex's circle, y / z has its extremes at the nearest and farthest points.
        height = max(abs(y * cos - z * sin) / (1 + y * sin + z * cos) for y in (-half, half) for z in (-radius, radius))
        return self.magnification * width, self.magnification * height

    def vertices(self, turn: ArrayLike) -> FloatArray:
        """Return the vertices of the true cube after `turn` turns (any shape) in its direction, ... x 8 x 3, in metres.

        >>> cube = NeckerCube(perspective=0.5, distance=1.0, tilt=0.0)
        >>> cube.vertices(0.125)[0].round(3).tolist()  # the left upper near vertex, rotated to the front
        [-0.0, -0.25, 0.646]
        """
        return self.turned(self.edge * CORNERS.T, np.asarray(turn, dtype=float)[..., None])

    def turned(self, points: ArrayLike, turn: ArrayLike) -> FloatArray:
        """Return points x, y, z (m, about the cube's centre) after `turn` turns about its tilted axis, ... x 3."""
        angle = 2 * np.pi * np.asarray(turn, dtype=float) * (1 if self.direction == "right" else -1)
        x, y, z = np.asarray(points, dtype=float)
        x, z = x * np.cos(angle) - z * np.sin(angle), x * np.sin(angle) + z * np.cos(angle)
        y, z = y * math.cos(self.tilt) - z * math.sin(self.tilt), y * math.sin(self.tilt) + z * math.cos(self.tilt)
        return np.stack([x, y, self.distance + z], axis=-1)

    def reversed(self, turn: ArrayLike) -> FloatArray:
        """Return the vertices of the depth-reversed shape (nonrigid interpretation), ... x 8 x 3, in metres.

        Each true vertex moves along its line of sight to the depth mirrored about the cube's centre, z' = 2 `distance`
        - z. Edges stay straight.

        >>> cube = NeckerCube(perspective=0.5, distance=1.0, tilt=0.0)
        >>> cube.reversed(0.125)[0].round(3).tolist()  # the front vertex, now at the back and stretched
        [-0.0, -0.523, 1.354]
        """
        true = self.vertices(turn)
        depth = true[..., 2:]
        return true * (2 * self.distance - depth) / depth

    @checked
    def seen(self, turn: ArrayLike, reading: Reading) -> FloatArray:
        """Return the vertices of the shape under an interpretation (`reading`), ... x 8 x 3, in metres."""
        return self.vertices(turn) if reading == "rigid" else self.reversed(turn)

    def direction_seen(self, reading: Reading) -> Direction:
        """Return the direction in which the near side moves under an interpretation; depth reversal inverts it.

        >>> NeckerCube(direction="right").direction_seen("nonrigid")
        'left'
        """
        if reading == "rigid":
            return self.direction
        return "left" if self.direction == "right" else "right"

    def project(self, points: ArrayLike) -> FloatArray:
        """Return the picture coordinates, ... x 2 (right, down) in radians, of `points` (... x 3, in metres).

        >>> NeckerCube(size=0.2, perspective=0.4).project([0.1, 0.0, 0.5]).round(3).tolist()
        [0.1, 0.0]
        """
        points = np.asarray(points, dtype=float)
        return self.magnification * points[..., :2] / points[..., 2:]

    def loop_frames(self, frame_rate: float) -> int:
        """Return the number of frames per quarter turn, after which the picture repeats, at `frame_rate` (Hz).

        Raises
        ------
        InputError
            If the number is not an integer, or too small to define the direction of rotation.

        Examples
        --------
        >>> NeckerCube(speed=0.125).loop_frames(60)
        120
        """
        check_number("frame_rate", frame_rate, "frames per second", positive=True)
        frames = SYMMETRY * frame_rate / self.speed
        whole = round(frames)
        if abs(frames - whole) > 1e-4 * frames or whole < 3:
            better = max(whole, 3)
            speed = SYMMETRY * frame_rate / better
            raise InputError(
                f"speed is {self.speed:g} turns per second, which makes {frames:.6g} frames in a quarter turn, but a "
                f"seamless loop needs a whole number of 3 or more: use {speed:.6g}, which makes {better}."
            )
        return whole


@dataclass(frozen=True, slots=True, eq=False)
class Departure:
    """Deformation of a shape during a rotation.

    Parameters
    ----------
    whole
        Root mean square, over the rotation and the 12 edges, of the relative deviation of each edge's length from its
        mean over the rotation; 0 for a rigid shape.
    by_frame
        Root mean square over the 12 edges in each frame.
    """

    whole: float
    by_frame: FloatArray


def edge_lengths(shape: FloatArray) -> FloatArray:
    """Return the lengths of the 12 edges, ... x 12, from vertices ... x 8 x 3.

    >>> edge_lengths(NeckerCube(perspective=0.5, distance=1.0).vertices(0.1)).round(6).tolist() == [0.5] * 12
    True
    """
    ends = shape[..., EDGES, :]
    return np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)


def departure_from_rigid(shape: FloatArray) -> Departure:
    """Return the deformation of a shape during a rotation.

    For an upright cube in weak perspective p, the reversed shape has a deformation of p / sqrt(2): a vertical edge is
    longer by sqrt(2) p where it is truly nearest (seen farthest), and shorter by the same amount half a turn later.

    Parameters
    ----------
    shape
        Vertices in frames evenly spaced over one whole turn, n x 8 x 3, as returned by `NeckerCube.vertices` or
        `NeckerCube.reversed`.

    Raises
    ------
    InputError
        If the array has another shape.

    Examples
    --------
    >>> cube = NeckerCube(perspective=0.4, tilt=0.0)
    >>> turn = np.arange(360) / 360
    >>> [round(departure_from_rigid(cube.seen(turn, reading)).whole, 3) for reading in ("rigid", "nonrigid")]
    [0.0, 0.278]
    """
    shape = check_finite("shape", shape, "metres")
    if shape.ndim != 3 or shape.shape[1:] != CORNERS.shape or len(shape) == 0:
        raise InputError(f"shape is {shape.shape}, but must be n x 8 x 3: give the vertices in n frames of a turn.")
    lengths = edge_lengths(shape)
    change = lengths / lengths.mean(axis=0) - 1
    return Departure(float(np.sqrt(np.mean(change**2))), np.sqrt(np.mean(change**2, axis=1)))
