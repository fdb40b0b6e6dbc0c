"""Naturalistic scenes: a near object and several farther ones on fractal ground, with mountains and a sky.

They are the scenes of the depth-rating experiment, in which subjects fixate the nearest or the farthest object while
the rest is blurred.
"""

from __future__ import annotations

import math

import numpy as np

from focalgradient.errors import checked
from focalgradient.quantities import Seed
from focalgradient.scenes.landscape import GROUNDS, Land, clouded_sky, sunlight
from focalgradient.scenes.materials import NATURAL, material
from focalgradient.scenes.objects import Field, Mark, Mesh, Scene
from focalgradient.scenes.shapes import ball, lathe, strewn

__all__ = ["naturalistic"]

TRIES = 1000


@checked
def naturalistic(seed: Seed = 0, *, field: Field = 0.35) -> Scene:
    """Return a near sphere and five or six farther bodies on textured ground, with mountains and a sky.

    Neighbouring seeds differ in ground and material; all seeds differ in layout, textures, clouds and light.

    Parameters
    ----------
    seed
        Random seed of the whole scene.
    field
        Width of the frame as a tangent: number of columns x pixel angle. The intended frame height is at least three
        quarters of it.

    Returns
    -------
    Scene
        Scene with the marks ``"nearest"`` and ``"farthest"``: the visible points of these two objects on the lines of
        sight to their centres.

    Examples
    --------
    >>> scene = naturalistic(seed=3)
    >>> scene.mark("nearest").distance < 1 < scene.mark("farthest").distance
    True
    """
    random = np.random.default_rng([seed, 2])
    distances, across, sizes = _layout(random, field)
    land = Land(
        seed=int(random.integers(2**20)),
        eye=random.uniform(0.30, 0.35) * field * distances[0],
        relief=random.uniform(0.006, 0.014),
        mountains=random.uniform(0.05, 0.11),
        ground=list(GROUNDS)[(2 * seed) % len(GROUNDS)],
    )
    kinds = list(NATURAL)
    materials = [kinds[(seed + 3 * index) % len(kinds)] for index in range(len(distances))]
    shapes = ["sphere", *random.permutation(["boulder", "sphere", "column", "cone", "boulder", "sphere"])]
    bodies, tops = [], []
    for index, (z, x, radius) in enumerate(zip(distances.tolist(), across.tolist(), sizes.tolist(), strict=True)):
        foot = float(land.eye - land.height(x * z, z))
        body, middle = _body(
            shapes[index], (x * z, foot, z), radius * z, materials[index], 64 * seed + index, index == 0
        )
        bodies.append(body)
        tops.append(middle)
    sun, tint, warmth = sunlight(random)
    sky = clouded_sky(int(random.integers(2**20)), cover=random.uniform(0.1, 0.8), brightness=0.42, warmth=warmth)
    objects = (*bodies, *_stones(land, random, field, across, sizes), land.mesh(field))
    marks = (Mark("nearest", _front(bodies[0], tops[0])), Mark("farthest", _front(bodies[-1], tops[-1])))
    return Scene(objects, sun=sun, ambient=0.35, sky=sky, tint=tint, marks=marks)


def _layout(random: np.random.Generator, field: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return distances (m), lateral positions and radii (tangents) of the bodies, near to far, all centres visible."""
    count = int(random.integers(6, 8))
    for _ in range(TRIES):
        z = np.concatenate([[random.uniform(0.52, 0.7)], np.geomspace(1.1, random.uniform(3.6, 5.0), count - 1)])
        z[1:-1] *= random.uniform(0.9, 1.1, count - 2)
        radius = np.concatenate([[random.uniform(0.12, 0.16)], random.uniform(0.04, 0.075, count - 1)]) * field
        across = np.full(count, np.inf)
        across[0] = random.choice([-1, 1]) * random.uniform(0.08, 0.24) * field
        for index in (count - 1, *range(1, count - 1)):
            far = index == count - 1
            # The farthest is fully visible; no other body occludes another's centre.
            keep = 1.15 * (radius[index] + radius) if far else 1.05 * np.maximum(radius[index], radius)
            keep[-1] = 1.15 * (radius[index] + radius[-1])
            places = random.uniform(-0.42, 0.42, 100) * field
            free = places[np.all(np.abs(places[:, None] - across) > keep, axis=1)]
            if free.size == 0:
                break
            across[index] = free[0]
        else:
            return z, across, radius
    raise AssertionError("no layout was found")


def _body(
    shape: str, foot: tuple[float, float, float], radius: float, stuff: str, seed: int, near: bool
) -> tuple[Mesh, tuple[float, float, float]]:
    """Return a body standing at `foot`, and its centre."""
    x, y, z = foot
    paint = material(stuff, seed, 2 * radius)
    texels = 1024 if near else 512
    sunk = 0.06 * radius
    match shape:
        case "sphere":
            middle = (x, y - radius + sunk, z)
            return ball(middle, radius, paint, texels=texels, mesh=384 if near else 256), middle
        case "boulder":
            middle = (x, y - 0.75 * radius, z)
            return ball(middle, 1.1 * radius, paint, seed=seed, lumpy=0.35, squash=0.95, texels=texels), middle
        case "column":
            up = np.linspace(0, 1, 200)
            flutes = 0.72 + 0.06 * np.cos(2 * np.pi * up * 3) * (up > 0.75) + 0.12 * (up > 0.93) + 0.10 * (up < 0.05)
            profile = np.stack([radius * flutes, 3.4 * radius * up - sunk], axis=1)[::-1]
            profile = np.concatenate([[[0.0, profile[0, 1]]], profile])
            return lathe(foot, profile, paint, texels=texels), (x, y - 1.7 * radius, z)
        case _:
            up = np.linspace(0, 1, 100)
            profile = np.stack([0.95 * radius * (1 - up) ** 0.8, 2.6 * radius * up - sunk], axis=1)[::-1]
            return lathe(foot, profile, paint, texels=texels), (x, y - 1.0 * radius, z)


def _front(body: Mesh, middle: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the first intersection of the line of sight to a body's centre with its surface."""
    sight = np.array(middle) / np.linalg.norm(middle)
    a, b, c = (body.vertices[corner] for corner in body.faces.T)
    # Intersection with each triangle, by Cramer's rule for a + u (b - a) + v (c - a) = t sight.
    across = np.cross(sight, c - a)
    volume = np.einsum("ni,ni->n", across, b - a)
    volume[volume == 0] = np.inf  # seen edge-on
    along = np.cross(-a, b - a)
    u, v, t = (
        part / volume
        for part in (np.einsum("ni,ni->n", across, -a), along @ sight, np.einsum("ni,ni->n", along, c - a))
    )
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    x, y, z = (sight * t[hit].min()).tolist()
    return x, y, z


def _stones(land: Land, random: np.random.Generator, field: float, across: np.ndarray, sizes: np.ndarray) -> list[Mesh]:
    """Return scattered pebbles and rocks, small relative to the bodies and clear of them."""
    made = []
    for kind in range(2):
        paint = material(
            str(random.choice(["granite", "slate", "sandstone", "moss"])), int(random.integers(2**20)), 2.0
        )
        stone = ball(
            (0, 0, 0), 1.0, paint, seed=int(random.integers(2**20)), lumpy=0.4, squash=0.7, texels=128, mesh=48
        )
        count = int(random.integers(80, 160))
        z = np.exp(random.uniform(math.log(0.5), math.log(14), count))
        where = random.uniform(-0.7, 0.7, count) * field
        size = 0.006 * field * z * random.pareto(2.2, count).clip(0, 5) + 0.002 * field * z
        clear = np.all(np.abs(where[:, None] - across) > 1.2 * sizes + (size / z)[:, None], axis=1) | (
            size / z < 0.008 * field
        )
        x, z, size = (where * z)[clear], z[clear], size[clear]
        places = np.stack([x, land.eye - land.height(x, z) - 0.3 * size, z], axis=1)
        made.append(strewn(stone, places, size, int(random.integers(2**20)) + kind))
    return made
