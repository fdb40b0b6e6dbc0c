"""Planes, spheres, meshes, skies, marks, and the scenes composed of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, described
from focalgradient.quantities import Range
from focalgradient.scenes.texture import Texture

__all__ = ["Distance", "Field", "Mark", "Mesh", "Plane", "Point", "Scene", "Sky", "Sphere", "check_scene"]

Point = tuple[float, float, float]
"""Coordinates x (right), y (down), z (away from the camera), in metres."""


Field = Annotated[float, Range("columns x pixel angle", 1e-6, 100.0)]
"""Width of a frame as a tangent: from a thousandth of a camera pixel to 179 degrees."""

Distance = Annotated[float, Range("metres", positive=True)]


@dataclass(frozen=True, slots=True)
class Plane:
    """A textured plane, infinite or bounded by a rectangle.

    Parameters
    ----------
    point
        A point of the plane (the centre of the rectangle) in metres, where the texture is anchored.
    normal
        Normal vector of any length; both sides are visible.
    texture
        Reflectance. Texture and rectangle are aligned with the plane's horizontal (the projection of x onto the plane)
        and the direction perpendicular to it.
    size
        Width and height of the rectangle in metres; infinite for an infinite plane.

    Examples
    --------
    >>> wall = Plane(point=(0, 0, 2.0), normal=(0, 0, -1))
    >>> wall.size
    (inf, inf)
    """

    point: Point
    normal: Point
    texture: Texture = field(default_factory=Texture)
    size: tuple[float, float] = (math.inf, math.inf)

    def __post_init__(self) -> None:
        check_fields(self)
        _check_point("point", self.point)
        _check_point("normal", self.normal)
        if not any(self.normal):
            raise InputError("normal is the zero vector, but must be perpendicular to the plane: give three numbers.")
        if not (len(self.size) == 2 and all(side > 0 for side in self.size)):
            raise InputError(f"size is {self.size!r}, but must be a positive width and height in metres.")

    def frame(self) -> FloatArray:
        """Return unit vectors along the plane's horizontal, perpendicular to it, and its normal: 3 x 3, one per row.

        >>> Plane((0, 0, 2.0), (0, 0, -3.0)).frame()[2].tolist()
        [0.0, 0.0, -1.0]
        """
        normal = np.asarray(self.normal, float) / np.linalg.norm(self.normal)
        # The horizontal is x projected onto the plane; for planes perpendicular to x, z instead.
        axis = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.999 else np.array([0.0, 0.0, 1.0])
        across = axis - normal * (axis @ normal)
        across /= np.linalg.norm(across)
        return np.stack([across, np.cross(across, normal), normal])


@dataclass(frozen=True, slots=True)
class Sphere:
    """A textured sphere.

    Parameters
    ----------
    centre
        Centre in metres.
    radius
        Radius in metres; the lens must lie outside the sphere.
    texture
        Reflectance, mapped with an equal-area projection centred on the point with the smallest z.

    Examples
    --------
    >>> ball = Sphere(centre=(0, 0, 1.0), radius=0.05)
    >>> ball.texture.contrast
    0.2
    """

    centre: Point
    radius: float
    texture: Texture = field(default_factory=Texture)

    def __post_init__(self) -> None:
        check_fields(self)
        _check_point("centre", self.centre)
        if not (0 < self.radius < math.hypot(*self.centre)):
            raise InputError(
                f"radius is {self.radius!r}, but must be positive and less than the {math.hypot(*self.centre):g} m "
                "from the sphere's centre to the camera."
            )


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh, diffuse or mirroring, with both sides visible.

    Parameters
    ----------
    vertices
        Vertices, n x 3, in metres.
    faces
        Indices of the three vertices of each triangle, m x 3.
    uv
        Texture coordinates of each vertex, n x 2: (0, 0) is the upper left corner of the paint, (1, 1) the lower right.
        The paint repeats outside.
    paint
        Reflectance in red, green and blue, h x w x 3, between 0 and 1, interpolated linearly; of a mirror, its specular
        reflectance.
    smooth
        Whether normals are interpolated between vertices, so that the surface appears curved.
    mirror
        Whether the surface is a mirror.

    Examples
    --------
    >>> corners = np.array([[0, 0, 1.0], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> square = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), corners[:, :2] / 0.1, np.full((2, 2, 3), 0.5))
    >>> len(square.faces)
    2
    """

    vertices: FloatArray
    faces: NDArray[np.int64]
    uv: FloatArray
    paint: NDArray[np.floating]
    smooth: bool = False
    mirror: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        count = len(self.vertices)
        if not (self.vertices.shape == (count, 3) and count >= 3 and np.isfinite(self.vertices).all()):
            raise InputError(f"vertices is of shape {self.vertices.shape}, but must be n x 3 finite numbers, n >= 3.")
        if not (
            self.faces.ndim == 2
            and self.faces.shape[1] == 3
            and self.faces.size
            and 0 <= self.faces.min() <= self.faces.max() < count
        ):
            raise InputError(f"faces of shape {self.faces.shape} must be m x 3 indices of the {count} vertices.")
        if self.uv.shape != (count, 2):
            raise InputError(
                f"uv is of shape {self.uv.shape}, but must be {count} x 2, texture coordinates of each vertex."
            )
        paint = self.paint
        if not (paint.ndim == 3 and paint.shape[2] == 3 and paint.size and 0 <= paint.min() <= paint.max() <= 1):
            raise InputError(f"paint of shape {paint.shape} must be h x w x 3 reflectances between 0 and 1.")


@dataclass(frozen=True, slots=True, eq=False)
class Sky:
    """Environment map: radiance from every direction, infinitely far away.

    Parameters
    ----------
    radiance
        Red, green and blue, h x w x 3. Rows go from zenith to nadir in equal angles; columns go once around to the
        right, with the camera's axis in the middle.

    Examples
    --------
    >>> Sky(np.ones((2, 4, 3))).radiance.shape
    (2, 4, 3)
    """

    radiance: NDArray[np.floating]

    def __post_init__(self) -> None:
        check_fields(self)
        radiance = self.radiance
        if not (radiance.ndim == 3 and radiance.shape[2] == 3 and radiance.size and radiance.min() >= 0):
            raise InputError(f"radiance of shape {radiance.shape} must be h x w x 3 and nowhere negative.")


@dataclass(frozen=True, slots=True)
class Mark:
    """A named point on a surface, for fixation.

    Examples
    --------
    >>> mark = Mark("near", (0.05, 0.0, 0.5))
    >>> mark.distance, mark.direction
    (0.5, (0.1, 0.0))
    """

    name: str
    point: Point

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def distance(self) -> float:
        """Distance in metres along the camera's axis."""
        return self.point[2]

    @property
    def direction(self) -> tuple[float, float]:
        """Visual direction: tangents of the angles to the right of and below the axis."""
        x, y, z = self.point
        return x / z, y / z

    def pixel(self, shape: tuple[int, int], pixel_angle: float) -> tuple[float, float]:
        """Return row and column, from the centre of the first pixel, in a picture of `shape` and `pixel_angle` (rad).

        >>> Mark("near", (0.05, 0.0, 0.5)).pixel((64, 64), 0.01)
        (31.5, 41.5)
        """
        across, down = self.direction
        return (shape[0] - 1) / 2 + down / pixel_angle, (shape[1] - 1) / 2 + across / pixel_angle


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene: objects and their illumination.

    Parameters
    ----------
    objects
        Planes, spheres and meshes, in any order.
    background
        Radiance of rays that hit nothing, unless there is a sky.
    sun
        Direction towards a distant sun, of any length, which casts shadows. None: radiance equals reflectance,
        unshaded.
    ambient
        Fraction of illumination, 0 to 1, that is ambient; the sun provides the rest on a surface that faces it.
    sky
        Environment map seen by rays that hit nothing; in path tracing it is the source of ambient light.
    tint
        Colour of the sunlight: red, green, blue.
    marks
        Fixation points. In scenes made for experiments, ``"nearest"`` and ``"farthest"`` lie on the nearest and
        farthest objects.

    Examples
    --------
    >>> Scene((Sphere((0, 0, 1.0), 0.05),)).background
    0.0
    """

    objects: tuple[Plane | Sphere | Mesh, ...]
    background: Annotated[float, Range("radiance", 0)] = 0.0
    sun: Point | None = None
    ambient: Annotated[float, Range("fractions of the illumination", 0, 1)] = 0.5
    sky: Sky | None = None
    tint: Point = (1.0, 1.0, 1.0)
    marks: tuple[Mark, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        if self.sun is not None:
            _check_point("sun", self.sun)
            if not any(self.sun):
                raise InputError("sun is the zero vector, but must point towards the sun: or give None for no sun.")
        _check_point("tint", self.tint)

    def mark(self, name: str) -> Mark:
        """Return the mark called `name`.

        >>> Scene((), marks=(Mark("nearest", (0.0, 0.0, 0.5)),)).mark("nearest").distance
        0.5
        """
        for mark in self.marks:
            if mark.name == name:
                return mark
        names = ", ".join(mark.name for mark in self.marks) or "none"
        raise InputError(f"the scene has no mark named {name!r}: it has {names}.")


def _check_point(name: str, point: Point) -> None:
    if not all(math.isfinite(value) for value in point):
        raise InputError(f"{name} is {point!r}, but must be three finite numbers x, y, z.")


def check_scene(scene: object) -> None:
    """Raise `InputError` unless `scene` is a `Scene`."""
    if not isinstance(scene, Scene):
        raise InputError(
            f"scene is {described(scene)}, but must be a Scene: make one with focalgradient.scenes, such as plane(2.0)."
        )
