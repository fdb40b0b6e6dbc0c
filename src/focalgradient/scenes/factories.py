"""Measurement scenes: a wall, a slanted plane, a depth step, spheres in front of a wall."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focalgradient.errors import InputError, checked
from focalgradient.quantities import Seed
from focalgradient.scenes.objects import Distance, Field, Mark, Plane, Scene, Sphere
from focalgradient.scenes.texture import Texture

__all__ = ["plane", "slant", "spheres", "step"]

PROJECTED_TEXTURE = Texture(texel=0.3e-3, projected=True)
"""Projected texture with texels of 0.3 mrad at every distance, about the pixel of a 25 mm lens with 8 um pixels."""


@checked
def plane(distance: Distance, *, seed: Seed = 0, texture: Texture = PROJECTED_TEXTURE) -> Scene:
    """Return a wall facing the camera at `distance` metres.

    Parameters
    ----------
    distance
        Distance along the axis in metres.
    seed
        Random seed of the texture.
    texture
        All other parameters of the texture.

    Raises
    ------
    InputError
        If `distance` is not positive and finite.

    Examples
    --------
    >>> plane(2.0).objects[0].point
    (0.0, 0.0, 2.0)
    """
    return Scene((Plane((0.0, 0.0, float(distance)), (0.0, 0.0, -1.0), replace(texture, seed=seed)),))


@checked
def slant(
    near: Distance, far: Distance, field: Field, *, seed: Seed = 0, texture: Texture = PROJECTED_TEXTURE
) -> Scene:
    """Return a slanted plane, at `near` metres at the left edge of the frame and `far` at the right edge.

    In between, its *vergence* is linear in image position x, as for any plane.

    Parameters
    ----------
    near, far
        Distances along the axis in metres; near > far reverses the slant.
    field
        Width of the frame as a tangent: number of columns x pixel angle.
    seed
        Random seed of the texture.
    texture
        All other parameters of the texture. A plane that covers metres of depth within a few degrees is seen almost
        edge-on, which would compress a texture defined on the surface to stripes; the default is therefore projected
        from the camera.

    Examples
    --------
    >>> round(slant(1.0, 3.0, 0.1).objects[0].point[2], 6)  # 2/3 D at the centre
    1.5
    """
    middle, slope = (1 / near + 1 / far) / 2, (1 / far - 1 / near) / field
    # 1/z = middle + slope x/z  is the plane  slope x + middle z = 1.
    return Scene((Plane((0.0, 0.0, 1 / middle), (-slope, 0.0, -middle), replace(texture, seed=seed)),))


@checked
def step(near: Distance, far: Distance, *, seed: Seed = 0, texture: Texture = PROJECTED_TEXTURE) -> Scene:
    """Return two walls: one at `near` metres occludes the left half of another at `far` metres.

    Parameters
    ----------
    near, far
        Distances along the axis in metres, near < far.
    seed
        Random seed of the textures; the two walls have different ones.
    texture
        All other parameters of the textures.

    Returns
    -------
    Scene
        Scene with the marks ``"nearest"`` and ``"farthest"``, 2 degrees to either side of the edge.

    Examples
    --------
    >>> [thing.point[2] for thing in step(1.0, 2.0).objects]
    [1.0, 2.0]
    """
    if near >= far:
        raise InputError(f"near is {near!r} m and far {far!r} m, but near must be the smaller: swap them.")
    # A card large enough for its other sides to lie outside the frame.
    size = 20.0 * near
    front = Plane((-size / 2, 0.0, float(near)), (0.0, 0.0, -1.0), replace(texture, seed=seed), (size, size))
    (back,) = plane(far, seed=seed + 1, texture=texture).objects
    aside = math.tan(math.radians(2))
    marks = (Mark("nearest", (-aside * near, 0.0, float(near))), Mark("farthest", (aside * far, 0.0, float(far))))
    return Scene((front, back), marks=marks)


@checked
def spheres(seed: Seed = 0, *, field: Field = 0.1) -> Scene:
    """Return six spheres at 0.6 to 2.4 m on a floor, in front of a wall at 3 m, in sunlight.

    Parameters
    ----------
    seed
        Random seed of the positions, sizes and textures.
    field
        Width of the frame that the spheres fill, as a tangent: number of columns x pixel angle. The intended frame
        height is three quarters of it.

    Examples
    --------
    >>> len(spheres(seed=3).objects)
    8
    """
    random = np.random.default_rng(seed)
    floor, wall = 0.6 * 0.36 * field, 3.0

    def texture(mean: float) -> Texture:
        return replace(PROJECTED_TEXTURE, seed=int(random.integers(2**31)), mean=mean)

    distances = np.geomspace(0.6, 2.4, 6)
    places = random.permutation(np.linspace(-0.4, 0.4, 6)) + random.uniform(-0.04, 0.04, 6)
    # Farther spheres subtend larger angles, so that they are visible above the nearer ones.
    sizes = random.uniform(0.09, 0.13, 6) * np.linspace(1, 1.4, 6)
    balls = []
    for z, place, size in zip(distances.tolist(), places.tolist(), sizes.tolist(), strict=True):
        radius = size * field * z
        skin = replace(texture(mean=random.uniform(0.22, 0.37)), texel=PROJECTED_TEXTURE.texel * z, projected=False)
        balls.append(Sphere((place * field * z, floor - radius, z), radius, skin))
    ground = Plane((0.0, floor, wall / 2), (0.0, -1.0, 0.0), texture(mean=0.25))
    back = Plane((0.0, 0.0, wall), (0.0, 0.0, -1.0), texture(mean=0.3))
    return Scene((*balls, ground, back), sun=(-0.5, -0.9, -0.7), ambient=0.35)
