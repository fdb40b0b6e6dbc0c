"""What mirrors show, against the mirror equations of the tangential and the sagittal fan."""

import math
import sys

import numpy as np
import pytest

from focalgradient import Lens
from focalgradient.render import render
from focalgradient.render.ground_truth import ground_truth
from focalgradient.render.mitsuba_backend import variant
from focalgradient.scenes import Mesh, Plane, Scene, Sky, Texture, bottle
from focalgradient.scenes.bottle import BODY_RADIUS, CAMERA_HEIGHT
from focalgradient.scenes.shapes import grid_faces

WALL = 0.5  # metres behind the camera, of the wall that is mirrored


def mirror_ball(radius: float, distance: float, *, upright: bool) -> Mesh:
    """The front of a mirroring sphere, or of an upright cylinder, nearest at `distance`, finely meshed."""
    down, across = np.meshgrid(np.linspace(-1.1, 1.1, 401), np.linspace(-1.1, 1.1, 401), indexing="ij")
    tall = np.ones_like(down) if upright else np.cos(down)
    y = 2 * radius * down if upright else radius * np.sin(down)
    points = np.stack([radius * tall * np.sin(across), y, distance + radius - radius * tall * np.cos(across)], axis=-1)
    count = down.size
    return Mesh(
        points.reshape(-1, 3), grid_faces(401, 401), np.zeros((count, 2)), np.ones((1, 1, 3)), smooth=True, mirror=True
    )


def before_wall(mirror: Mesh) -> Scene:
    """The mirror, and behind the camera a wall that faces it."""
    return Scene((mirror, Plane((0.0, 0.0, -WALL), (0.0, 0.0, 1.0), Texture(contrast=0))))


def found(scene: Scene, shape: tuple[int, int], pixel_angle: float) -> tuple[np.ndarray, np.ndarray]:
    how = variant()
    assert how is not None
    distance, vergence = ground_truth(scene, shape, pixel_angle, how)
    assert vergence is not None
    return distance, vergence


@pytest.mark.parametrize("upright", [False, True])
def test_convex_mirror_is_astigmatic_as_its_equations_say(upright: bool) -> None:
    """Along the middle row, at incidences up to 50 degrees: 1/s + 1/s' = -2/(R cos i) in the plane of incidence, and
    -2 cos(i)/R across it; a cylinder does nothing across. Distances run along the ray; vergence is by the axis."""
    radius, near, pixel, width = 0.2, 1.0, 8e-4, 301
    distance, vergence = found(before_wall(mirror_ball(radius, near, upright=upright)), (3, width), pixel)
    checked = 0
    for column in range(20, width - 20, 20):
        tangent = (column - (width - 1) / 2) * pixel
        # Where the ray (t, 0, 1) z meets the circle about (0, 1.2), and how it goes on.
        centre = near + radius
        a, b, c = 1 + tangent**2, -2 * centre, centre**2 - radius**2
        z = (-b - math.sqrt(b * b - 4 * a * c)) / (2 * a)
        hit = np.array([z * tangent, z])
        normal = (hit - [0, centre]) / radius
        way = np.array([tangent, 1]) / math.sqrt(a)
        cosine = float(-way @ normal)
        out = way + 2 * cosine * normal
        if out[1] > -0.1:
            continue
        to_mirror, to_wall = z * math.sqrt(a), (z + WALL) / -out[1]
        image_in = to_mirror + 1 / (2 / (radius * cosine) + 1 / to_wall)
        image_across = to_mirror + (to_wall if upright else 1 / (2 * cosine / radius + 1 / to_wall))
        # From distances along the ray to those along the axis.
        secant = math.sqrt(a)
        expected = np.array([secant / image_in, secant / image_across])
        assert distance[1, column] == pytest.approx(z, rel=1e-4)
        assert vergence[1, column, [0, 1], [0, 1]] == pytest.approx(expected, rel=2e-3)
        assert abs(vergence[1, column, [0, 1], [1, 0]]).max() < 2e-3
        checked += 1
    assert checked >= 8


def test_flat_mirror_shows_things_as_far_behind_as_they_are_before() -> None:
    corners = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
    flat = Mesh(
        np.concatenate([corners, np.ones((4, 1))], axis=1),
        np.array([[0, 1, 2], [0, 2, 3]]),
        corners,
        np.ones((1, 1, 3)),
        mirror=True,
    )
    distance, vergence = found(before_wall(flat), (5, 7), 0.05)
    assert distance == pytest.approx(1.0, rel=1e-6)
    assert vergence == pytest.approx(np.broadcast_to(np.eye(2) / (2 + WALL), (5, 7, 2, 2)), rel=1e-3, abs=1e-4)


@pytest.fixture
def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bottle of the same shapes in grey: paint takes nearly all of the time."""
    module, grey = sys.modules[bottle.__module__], lambda points, detail: np.full(points.shape, 0.5)
    monkeypatch.setattr(module, "grained", lambda *colours, **how: grey)
    monkeypatch.setattr(module, "clouded_sky", lambda *seed, **how: Sky(np.ones((2, 4, 3))))


@pytest.mark.usefixtures("unpainted")
def test_what_is_seen_directly_has_its_own_vergence() -> None:
    rendered = render(bottle(1), Lens(0.025, 4, 1.0), (24, 32), 0.35 / 32, samples=2)
    assert rendered.vergence is not None
    corner = rendered.vergence[2, 2]
    assert corner == pytest.approx(np.eye(2) / rendered.distance[2, 2])


@pytest.mark.usefixtures("unpainted")
def test_the_bottle_by_hand() -> None:
    """The middle of its body shows the checkered plane: across as in a convex mirror, upright as in a flat one."""
    pixel, front = 1e-3, 1.0 - BODY_RADIUS
    distance, vergence = found(bottle(3), (301, 5), pixel)
    for row in range(202, 300, 12):
        tangent = (row - 150) * pixel
        to_floor = CAMERA_HEIGHT / tangent - front  # along the axis, from the mirror back
        across = front + 1 / (2 / BODY_RADIUS + 1 / to_floor)
        assert distance[row, 2] == pytest.approx(front, rel=1e-5)
        assert vergence[row, 2, 1, 1] == pytest.approx(1 / (front + to_floor), rel=2e-3)
        assert vergence[row, 2, 0, 0] == pytest.approx(1 / across, rel=3e-4)
        # The reflection is farther than the surface that shows it.
        assert vergence[row, 2, 1, 1] < vergence[row, 2, 0, 0] < 1 / front
