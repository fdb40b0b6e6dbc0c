"""Scenes made of meshes: what each promises, before and after it is looked at."""

import math

import numpy as np
import pytest

from focalgradient import InputError, Lens
from focalgradient.render.ground_truth import ground_truth
from focalgradient.render.mitsuba_backend import variant
from focalgradient.scenes import Mark, Mesh, Scene, scene, step, terrain
from focalgradient.scenes.fractal import fractal
from focalgradient.scenes.landscape import Land
from focalgradient.scenes.materials import NATURAL, material, ramp
from focalgradient.scenes.naturalistic import _layout
from focalgradient.scenes.shapes import ball, box, grid_faces, lathe, sheet, strewn


def grey(points: np.ndarray, detail: float) -> np.ndarray:
    return np.full(points.shape, 0.5)


def seen_at(scene: Scene, mark: Mark, pixel: float = 1e-3) -> float:
    """True distance at the pixel of a mark, rendered in a frame around it."""
    how = variant()
    assert how is not None
    side = 2 * math.ceil(max(map(abs, mark.direction)) / pixel) + 3
    distance, _ = ground_truth(scene, (side, side), pixel, how)
    row, column = mark.pixel((side, side), pixel)
    return float(distance[round(row), round(column)])


def test_fractal_is_as_fine_and_as_rough_as_asked() -> None:
    """Each octave adds its share of change over its own wavelength, and none is there below the finest."""
    along = np.stack([np.linspace(0, 50, 40001), np.full(40001, 0.3), np.zeros(40001)], axis=-1)

    def change(values: np.ndarray, step: int) -> float:
        return float(np.sqrt(np.mean((values[step:] - values[:-step]) ** 2)))

    fine, coarse = (fractal(along, 3, coarsest=2.0, finest=finest, roughness=0.7) for finest in (0.02, 0.5))
    assert abs(fine.mean()) < 0.1
    # An octave's slope grows by 2 x 0.7 to the next. The coarse noise has two octaves, 2 and 1 m; the fine one six in
    # full, to 1/16 m, and 9/16 of the seventh. Each noise is divided by the root of its octaves' squared amplitudes.
    octave = np.arange(7)
    slope, size = 1.4 ** (2 * octave) * np.array([1, 1, 1, 1, 1, 1, (9 / 16) ** 2]), 0.7 ** (2 * octave)
    expected = math.sqrt(slope[:2].sum() / size[:2].sum() / (slope.sum() / size.sum()))
    assert change(coarse, 1) / change(fine, 1) == pytest.approx(expected, rel=0.15)
    # Rough by 0.7 an octave: twice the step, 1/0.7 times the change (midrange, where octaves abound).
    assert change(fine, 160) / change(fine, 80) == pytest.approx(1 / 0.7, rel=0.12)
    smooth = fractal(along, 3, coarsest=2.0, finest=0.5)
    assert np.abs(np.diff(smooth)).max() < 0.02  # no seams between lattice cells


def test_fractal_is_its_seed_and_takes_detail_by_place() -> None:
    places = np.random.default_rng(1).uniform(-5, 5, (3000, 3))
    first, same, other = (fractal(places, seed, coarsest=1.0, finest=0.1) for seed in (1, 1, 2))
    assert np.array_equal(first, same)
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.1
    mixed = fractal(places, 1, coarsest=1.0, finest=np.where(np.arange(3000) < 1500, 0.1, 0.4))
    assert np.array_equal(mixed[:1500], first[:1500])
    assert not np.allclose(mixed[1500:], first[1500:])


def test_shapes_are_closed_and_where_they_should_be() -> None:
    earth = ball((0.1, -0.2, 2.0), 0.3, grey, texels=64)
    assert np.allclose(np.linalg.norm(earth.vertices - (0.1, -0.2, 2.0), axis=1), 0.3)
    rock = ball((0, 0, 1), 0.1, grey, seed=4, lumpy=0.3, texels=64, mesh=64)
    size = np.linalg.norm(rock.vertices - (0, 0, 1), axis=1)
    assert 0.02 < size.min() < 0.095
    assert 0.1 < size.max() < 0.17
    crate = box((-0.1, -0.2, 1.0), (0.1, 0.2, 1.3), grey, texel=0.05)
    assert crate.vertices.min(axis=0) == pytest.approx([-0.1, -0.2, 1.0])
    assert crate.vertices.max(axis=0) == pytest.approx([0.1, 0.2, 1.3])
    can = lathe((0, 1, 2), np.array([[0.0, 0.4], [0.2, 0.4], [0.2, 0.0]]), grey, texels=64, around=64)
    assert can.vertices[:, 1].min() == pytest.approx(0.6)  # height is up, and y is down
    assert np.hypot(can.vertices[:, 0], can.vertices[:, 2] - 2).max() == pytest.approx(0.2)
    stone = ball((0, 0, 0), 1.0, grey, texels=16, mesh=8)
    stones = strewn(stone, np.array([[0, 0, 1.0], [1, 0, 3]]), [0.1, 0.2], seed=1)
    assert len(stones.vertices) == 2 * 45
    assert stones.vertices[:45].mean(axis=0) == pytest.approx([0, 0, 1], abs=0.02)


def test_paint_of_a_sheet_runs_from_edge_to_edge() -> None:
    y, x = np.mgrid[0:1:3j, 0:1:4j]
    flat = sheet(np.stack([x, y, 1 + 0 * x], -1), np.full((5, 10, 3), 0.5))
    assert flat.uv.min(axis=0) == pytest.approx([0.05, 0.1])  # the middle of the first texel
    assert flat.uv.max(axis=0) == pytest.approx([0.95, 0.9])


@pytest.mark.parametrize("name", NATURAL)
def test_materials_are_reflectances_with_contrast(name: str) -> None:
    down, around = np.meshgrid(np.linspace(0, np.pi, 60), np.linspace(-np.pi, np.pi, 120), indexing="ij")
    skin = np.stack([np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], axis=-1)
    paint = material(name, 5, 2.0)(skin, 0.02)
    assert paint.shape == (60, 120, 3)
    assert 0 < paint.min() <= paint.max() < 1
    grey_value = paint.mean(axis=-1)
    assert grey_value.std() > 0.15 * grey_value.mean()
    assert ramp(5.0, NATURAL[name]) == pytest.approx(NATURAL[name][-1])


def test_twelve_seeds_make_twelve_layouts() -> None:
    """In each all stand apart, the farthest is hidden by nobody; no two layouts are alike."""
    places = []
    for seed in range(40):
        distance, across, radius = _layout(np.random.default_rng([seed, 2]), 0.35)
        assert len(distance) in (6, 7)
        assert distance[0] < 0.71
        assert np.all(np.diff(distance) > 0)
        assert distance[-1] >= 3.6
        apart = np.abs(across[:-1] - across[-1])
        assert np.all(apart > radius[:-1] + radius[-1])
        assert np.abs(across).max() < 0.5 * 0.35
        places.append((across[0], across[-1]))
    gap = np.linalg.norm(np.array(places)[:12, None] - np.array(places)[:12], axis=-1)
    assert gap[~np.eye(12, dtype=bool)].min() > 0.002


@pytest.fixture
def coarse_land(monkeypatch: pytest.MonkeyPatch) -> None:
    """Land of fewer texels, which are what takes time."""
    assert Land.mesh.__kwdefaults__["texels"] > 1000
    monkeypatch.setitem(Land.mesh.__kwdefaults__, "texels", 200)


@pytest.mark.usefixtures("coarse_land")
def test_terrain_lies_under_the_camera_and_ends_in_mountains() -> None:
    made = terrain(2)
    land = made.objects[0]
    assert isinstance(land, Mesh)
    assert land.vertices[:, 2].min() < made.mark("nearest").distance
    assert land.vertices[:, 2].max() == pytest.approx(400)
    for mark, least, most in ((made.mark("nearest"), 0.3, 2.0), (made.mark("farthest"), 60.0, 400.0)):
        assert least < mark.distance < most
        assert seen_at(made, mark) == pytest.approx(mark.distance, rel=0.05)
    flat = Land(seed=3, eye=0.1, relief=0.0, mountains=0.0)
    assert np.abs(flat.height(np.linspace(-1, 1, 9), np.full(9, 4.0))).max() < 1e-12
    steep = Land(seed=3, eye=0.1, mountains=0.1)
    assert steep.height(np.linspace(-60, 60, 200), np.full(200, 190.0)).max() > 5


def test_step_has_its_edge_in_the_middle() -> None:
    from focalgradient.render import cast

    distance = cast(step(0.8, 1.6), Lens(0.025, 4, 1.0), (4, 10), 3e-4, samples=1).distance
    assert np.all(distance[:, :5] == 0.8)
    assert np.all(distance[:, 5:] == 1.6)
    with pytest.raises(InputError, match=r"near is 2.0 m and far 1.0 m"):
        step(2.0, 1.0)


FACES, CORNERS = grid_faces(2, 2), np.array([[0, 0, 1.0], [1, 0, 1], [0, 1, 1], [1, 1, 1]])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"vertices": CORNERS[:, :2]}, r"vertices is of shape \(4, 2\)"),
        ({"faces": FACES + 1}, "indices of the 4 vertices"),
        ({"uv": CORNERS[:3, :2]}, r"uv is of shape \(3, 2\), but must be 4 x 2"),
        ({"paint": np.full((2, 2, 3), 1.5)}, "reflectances between 0 and 1"),
    ],
)
def test_bad_mesh(change, words) -> None:  # type: ignore[no-untyped-def]
    given = {"vertices": CORNERS, "faces": FACES, "uv": CORNERS[:, :2], "paint": np.ones((2, 2, 3))} | change
    with pytest.raises(InputError, match=words):
        Mesh(**given)


def test_scenes_by_name() -> None:
    assert scene("step", 3) == step(0.8, 1.6, seed=3)
    with pytest.raises(InputError, match="scene is 'castle', but must be one of spheres"):
        scene("castle")
    with pytest.raises(InputError, match="seed is -1"):
        scene("plane", -1)
