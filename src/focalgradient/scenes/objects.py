"""Planes, spheres, and the scene that holds them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from focalgradient.errors import InputError
from focalgradient.scenes.texture import Texture

__all__ = ["Plane", "Point", "Scene", "Sphere"]

Point = tuple[float, float, float]
"""x (right), y (down), z (away from the camera), in metres."""


@dataclass(frozen=True, slots=True)
class Plane:
    """A textured plane, endless or cut to a rectangular card.

    Parameters
    ----------
    point
        A point of the plane, the centre of the card, in metres. The texture is anchored there.
    normal
        A vector at right angles to the plane, of any length; either side is seen.
    texture
        Its reflectance. Texture and card run along the plane's own horizontal (x as far as it lies in the plane) and
        at right angles to it.
    size
        Width and height of the card in metres; infinite for an endless plane.

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
        _check_point("point", self.point)
        _check_point("normal", self.normal)
        if not any(self.normal):
            raise InputError("normal is the zero vector, but must point at right angles to the plane.")
        if not (len(self.size) == 2 and min(self.size) > 0):
            raise InputError(f"size is {self.size!r}, but must be a positive width and height in metres.")


@dataclass(frozen=True, slots=True)
class Sphere:
    """A textured sphere.

    Parameters
    ----------
    centre
        Its centre, in metres.
    radius
        Its radius, in metres; the lens must lie outside.
    texture
        Its reflectance, laid on by equal areas from the point that faces the camera's plane (the least z).

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
        _check_point("centre", self.centre)
        if not (0 < self.radius < math.hypot(*self.centre)):
            raise InputError(
                f"radius is {self.radius!r}, but must be positive and less than the {math.hypot(*self.centre):g} m "
                "from the sphere's centre to the camera."
            )


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything in the world: objects and what lights them.

    Parameters
    ----------
    objects
        Planes and spheres, in any order.
    background
        Radiance where a ray meets nothing.
    sun
        Direction towards a distant sun, of any length; it casts shadows. None: radiance is reflectance, unshaded.
    ambient
        Share of light, 0 to 1, that comes from everywhere, the sun giving the rest to a surface that faces it.

    Examples
    --------
    >>> Scene((Sphere((0, 0, 1.0), 0.05),)).background
    0.0
    """

    objects: tuple[Plane | Sphere, ...]
    background: float = 0.0
    sun: Point | None = None
    ambient: float = 0.5

    def __post_init__(self) -> None:
        if not (self.background >= 0 and math.isfinite(self.background)):
            raise InputError(f"background is {self.background!r}, but must be a radiance of 0 or more.")
        if not 0 <= self.ambient <= 1:
            raise InputError(f"ambient is {self.ambient!r}, but must be a share of the light between 0 and 1.")
        if self.sun is not None:
            _check_point("sun", self.sun)
            if not any(self.sun):
                raise InputError("sun is the zero vector, but must point towards the sun: or give None for no sun.")


def _check_point(name: str, point: Point) -> None:
    if len(point) != 3 or not all(math.isfinite(value) for value in point):
        raise InputError(f"{name} is {point!r}, but must be three finite numbers x, y, z.")
