"""Scenes for measuring: a wall, a slanted plane, a step in depth, spheres in front of a wall."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focalgradient.errors import InputError, check_seed, described, is_number
from focalgradient.scenes.objects import Mark, Plane, Scene, Sphere, check_field
from focalgradient.scenes.texture import Texture

__all__ = ["plane", "slant", "spheres", "step"]

FINE = Texture(texel=0.3e-3, projected=True)
"""Texels of 0.3 mrad, about the pixel of a 25 mm lens with 8 um pixels, at every distance."""


def plane(distance: float, *, seed: int = 0, texture: Texture = FINE) -> Scene:
    """A wall facing the camera, `distance` metres away.

    Parameters
    ----------
    distance
        Metres along the axis.
    seed
        Seed of the texture's field.
    texture
        Everything else about the texture.

    Raises
    ------
    InputError
        If `distance` is not positive and finite.

    Examples
    --------
    >>> plane(2.0).objects[0].point
    (0.0, 0.0, 2.0)
    """
    _check_distance("distance", distance)
    _check(seed, texture)
    return Scene((Plane((0.0, 0.0, float(distance)), (0.0, 0.0, -1.0), replace(texture, seed=seed)),))


def slant(near: float, far: float, field: float, *, seed: int = 0, texture: Texture = FINE) -> Scene:
    """A slanted plane, `near` metres away at the left edge of the frame and `far` at the right edge.

    In between its *vergence* is linear in the image's x, as every plane's is.

    Parameters
    ----------
    near, far
        Distances along the axis in metres; near > far slants it the other way.
    field
        Width of the frame as a tangent: columns x pixel angle.
    seed
        Seed of the texture's field.
    texture
        Everything else about the texture. A plane that runs through metres within a few degrees is seen almost
        edge-on, so that a texture laid on it in metres is squeezed to stripes: hence one projected from the camera.

    Examples
    --------
    >>> round(slant(1.0, 3.0, 0.1).objects[0].point[2], 6)  # in the middle, 2/3 D
    1.5
    """
    _check_distance("near", near)
    _check_distance("far", far)
    check_field(field)
    _check(seed, texture)
    middle, slope = (1 / near + 1 / far) / 2, (1 / far - 1 / near) / field
    # 1/z = middle + slope x/z  is the plane  slope x + middle z = 1.
    return Scene((Plane((0.0, 0.0, 1 / middle), (-slope, 0.0, -middle), replace(texture, seed=seed)),))


def step(near: float, far: float, *, seed: int = 0, texture: Texture = FINE) -> Scene:
    """A wall that hides the left half of another: depth jumps from `near` metres to `far` at the middle of the frame.

    Parameters
    ----------
    near, far
        Distances along the axis in metres, near < far.
    seed
        Seed of the textures' fields; the two walls have different ones.
    texture
        Everything else about the textures.

    Returns
    -------
    Scene
        With the marks ``"nearest"`` and ``"farthest"``, 2 degrees to either side of the edge.

    Examples
    --------
    >>> [thing.point[2] for thing in step(1.0, 2.0).objects]
    [1.0, 2.0]
    """
    _check_distance("near", near)
    _check_distance("far", far)
    if near >= far:
        raise InputError(f"near is {near!r} m and far {far!r} m, but near must be the smaller.")
    _check(seed, texture)
    # A card so large that its other sides are out of sight.
    size = 20.0 * near
    front = Plane((-size / 2, 0.0, float(near)), (0.0, 0.0, -1.0), replace(texture, seed=seed), (size, size))
    (back,) = plane(far, seed=seed + 1, texture=texture).objects
    aside = math.tan(math.radians(2))
    marks = (Mark("nearest", (-aside * near, 0.0, float(near))), Mark("farthest", (aside * far, 0.0, float(far))))
    return Scene((front, back), marks=marks)


def spheres(seed: int = 0, *, field: float = 0.1) -> Scene:
    """Six spheres, 0.6 to 2.4 m away, on a floor in front of a wall 3 m away, in sunlight.

    Parameters
    ----------
    seed
        Seed of the places, sizes and textures.
    field
        Width of the frame that the spheres fill, as a tangent: columns x pixel angle. The frame's height is meant to
        be three quarters of it.

    Examples
    --------
    >>> len(spheres(seed=3).objects)
    8
    """
    check_field(field)
    check_seed(seed)
    random = np.random.default_rng(seed)
    floor, wall = 0.6 * 0.36 * field, 3.0

    def texture(mean: float) -> Texture:
        return replace(FINE, seed=int(random.integers(2**31)), mean=mean)

    distances = np.geomspace(0.6, 2.4, 6)
    places = random.permutation(np.linspace(-0.4, 0.4, 6)) + random.uniform(-0.04, 0.04, 6)
    # The farther ones are larger even to the eye, so that they show above the nearer.
    sizes = random.uniform(0.09, 0.13, 6) * np.linspace(1, 1.4, 6)
    balls = []
    for z, place, size in zip(distances.tolist(), places.tolist(), sizes.tolist(), strict=True):
        radius = size * field * z
        skin = replace(texture(mean=random.uniform(0.22, 0.37)), texel=FINE.texel * z, projected=False)
        balls.append(Sphere((place * field * z, floor - radius, z), radius, skin))
    ground = Plane((0.0, floor, wall / 2), (0.0, -1.0, 0.0), texture(mean=0.25))
    back = Plane((0.0, 0.0, wall), (0.0, 0.0, -1.0), texture(mean=0.3))
    return Scene((*balls, ground, back), sun=(-0.5, -0.9, -0.7), ambient=0.35)


def _check_distance(name: str, distance: float) -> None:
    if not (is_number(distance) and 0 < distance < math.inf):
        raise InputError(f"{name} is {described(distance)}, but must be a positive finite distance in metres.")


def _check(seed: int, texture: object) -> None:
    check_seed(seed)
    if not isinstance(texture, Texture):
        raise InputError(f"texture is {described(texture)}, but must be a Texture.")
