"""Named scenes, each generated from a seed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from focalgradient.errors import check_one_of, checked
from focalgradient.quantities import Range, Seed
from focalgradient.scenes.bottle import bottle
from focalgradient.scenes.factories import plane, slant, spheres, step
from focalgradient.scenes.landscape import terrain
from focalgradient.scenes.naturalistic import naturalistic
from focalgradient.scenes.objects import Field, Scene
from focalgradient.scenes.room import room

__all__ = ["SCENES", "SCENES_IN_DEPTH", "scene", "scene_about"]

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


@checked
def scene(name: str, seed: Seed = 0) -> Scene:
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
    check_one_of("scene", name, SCENES)
    return SCENES[name][0](seed)


SCENES_IN_DEPTH = ("spheres", "slant", "step", "plane")
"""Names of `scene_about`."""


@checked
def scene_about(
    name: str, vergence: Annotated[float, Range("dioptres", 0)], *, field: Field = 0.1, seed: Seed = 0
) -> Scene:
    """Return one of `SCENES_IN_DEPTH` with surfaces nearer and farther than a fixation.

    Parameters
    ----------
    name
        "spheres" at 0.6 to 3 m; "slant" and "step" from 0.8 D nearer to 0.6 D farther than the fixation; "plane", 0.6 D
        farther. The farthest distance is 10 m.
    vergence
        Vergence of the fixation in dioptres.
    field
        Width of the frame as a tangent: number of columns x pixel angle.
    seed
        Random seed.

    Raises
    ------
    InputError
        If the name is unknown, or a number is out of its range.

    Examples
    --------
    >>> len(scene_about("step", 1.0).objects)
    2
    """
    check_one_of("name", name, SCENES_IN_DEPTH)
    near, far = 1 / (vergence + 0.8), 1 / max(vergence - 0.6, 0.1)
    if name == "slant":
        return slant(near, far, field, seed=seed)
    if name == "step":
        return step(near, far, seed=seed)
    return plane(far, seed=seed) if name == "plane" else spheres(seed, field=field)
