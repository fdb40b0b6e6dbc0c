"""Named scenes, each generated from a seed."""

from __future__ import annotations

from collections.abc import Callable

from focalgradient.errors import InputError, check_seed, described
from focalgradient.scenes.bottle import bottle
from focalgradient.scenes.factories import plane, slant, step
from focalgradient.scenes.landscape import terrain
from focalgradient.scenes.naturalistic import naturalistic
from focalgradient.scenes.objects import Scene
from focalgradient.scenes.room import room

__all__ = ["SCENES", "scene"]

SCENES: dict[str, tuple[Callable[[int], Scene], float]] = {
    "spheres": (naturalistic, 0.35),
    "bottle": (bottle, 0.35),
    "room": (room, 0.45),
    "terrain": (terrain, 0.35),
    "plane": (lambda seed: plane(1.0, seed=seed), 0.1),
    "slant": (lambda seed: slant(0.8, 2.0, 0.1, seed=seed), 0.1),
    "step": (lambda seed: step(0.8, 1.6, seed=seed), 0.1),
}
"""Function that generates the scene from a seed, and intended width of the frame as a tangent, by name."""


def scene(name: str, seed: int = 0) -> Scene:
    """Return the named scene for a seed.

    Raises
    ------
    InputError
        If the name is unknown, or the seed is negative.

    Examples
    --------
    >>> len(scene("step", seed=1).objects)
    2
    """
    if not isinstance(name, str) or name not in SCENES:
        raise InputError(f"scene is {described(name)}, but must be one of {', '.join(SCENES)}.")
    check_seed(seed)
    return SCENES[name][0](seed)
