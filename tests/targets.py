"""A printed target before the ray caster's camera: a dark square, and a little of another, on a white sheet."""

from __future__ import annotations

from focalgradient import Lens, View
from focalgradient.render import cast, noisy
from focalgradient.scenes.objects import Plane, Scene
from focalgradient.scenes.texture import Texture

FOCAL_LENGTH, PITCH = 0.025, 8e-6  # m
WHITE, BLACK = (Texture(mean=mean, contrast=0.0) for mean in (0.7, 0.05))


def sheet(optical_distance: float) -> Scene:
    """The target, that many metres before the optical centre of the lens; as large on every view."""
    z = optical_distance

    def patch(x: float, y: float, side: float, layer: int, texture: Texture) -> Plane:
        return Plane((x * z, y * z, z * (1 - 1e-5 * layer)), (0.0, 0.0, -1.0), texture, size=(side * z, side * z))

    wall = Plane((0.0, 0.0, z), (0.0, 0.0, -1.0), WHITE)
    return Scene((wall, patch(-0.0093, 0.0014, 0.0272, 1, BLACK), patch(-0.0301, 0.0009, 0.0031, 1, BLACK)))


def target(lens: Lens, optical_distance: float, *, seed: int = 0, shape: tuple[int, int] = (144, 192)) -> View:
    """The target through `lens`, with 0.3 % noise."""
    view = cast(sheet(optical_distance), lens, shape, PITCH / lens.sensor_distance, samples=64, seed=seed).view
    return noisy(view, 0.003, seed)
