"""What a scene holds, before anybody looks at it."""

import math

import numpy as np
import pytest

from focalgradient import InputError, Lens, cast
from focalgradient.depth.filters import SCENE_SLOPE
from focalgradient.scenes import Plane, Scene, Sphere, Texture, bottle, scene_about, spheres
from focalgradient.scenes.texture import NATURAL_SLOPE


def test_texture_is_an_isotropic_reflectance_of_the_stated_contrast() -> None:
    for seed in range(3):
        values = Texture(seed, mean=0.25, contrast=0.25).values()
        assert 0 < values.min() < values.max() <= 1
        assert values.mean() == pytest.approx(0.25, rel=1e-3)
        assert values.std() / values.mean() == pytest.approx(0.25, rel=0.04)
    values = Texture(seed=2).values()
    across, down = (np.std(np.diff(values, axis=axis)) for axis in (1, 0))
    assert across == pytest.approx(down, rel=0.02)


def test_texture_is_natural() -> None:
    """Equal power in every octave of frequency, the mark of an amplitude of 1/frequency in two dimensions."""
    values = Texture(seed=5).values().astype(float)
    power = np.abs(np.fft.fft2(values - values.mean())) ** 2
    frequency = np.hypot(np.fft.fftfreq(1024)[:, None], np.fft.fftfreq(1024))
    octaves = [power[(frequency >= 0.5 / 2**k) & (frequency < 1 / 2**k)].sum() for k in range(2, 6)]
    assert np.array(octaves) / np.mean(octaves) == pytest.approx(1, abs=0.1)
    assert 2 * NATURAL_SLOPE == SCENE_SLOPE  # what scenes are made by is what depth assumes
    assert power[frequency > 0.5].sum() < 0.003 * power.sum()


def test_splines_pass_through_the_texels() -> None:
    texture = Texture(seed=4)
    seen = texture.coefficients().astype(float)
    for axis in (0, 1):
        seen = (np.roll(seen, 1, axis) + 4 * seen + np.roll(seen, -1, axis)) / 6
    assert np.abs(seen - texture.values()).max() < 1e-6


def test_spheres_stand_on_the_floor_and_apart_in_depth() -> None:
    for seed in range(4):
        scene = spheres(seed)
        balls = [thing for thing in scene.objects if isinstance(thing, Sphere)]
        floor = next(thing for thing in scene.objects if isinstance(thing, Plane) and thing.normal[1])
        assert [ball.centre[1] + ball.radius for ball in balls] == pytest.approx([floor.point[1]] * len(balls))
        distances = np.array([ball.centre[2] for ball in balls])
        assert distances.min() == pytest.approx(0.6)
        assert np.diff(1 / distances).max() < -0.1
    assert spheres(0) == spheres(0) != spheres(1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Texture(seed=-1), "seed is -1"),
        (lambda: Texture(texel=math.nan, projected=True), "texel is nan, .*radians"),
        (lambda: Plane((0, 0, 1), (0, 0, 0)), "normal is the zero vector"),
        (lambda: Scene((), ambient=1.5), "ambient is 1.5"),
        (lambda: Plane((0, 0, 1), (0, 0, 1), size=(0.1, math.nan)), r"size is \(0.1, nan\)"),
        (lambda: bottle(-1), "seed is -1"),
    ],
)
def test_bad_input(make, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize(("name", "ends"), [("slant", (0.4, 1.8)), ("step", (0.4, 1.8)), ("plane", (0.4, 0.4))])
def test_a_scene_lies_about_the_fixation(name: str, ends: tuple[float, float]) -> None:
    seen = cast(scene_about(name, 1.0, field=0.1), Lens(0.02, 8, 1.0), (24, 32), 0.1 / 32, samples=4)
    assert [1 / seen.distance.max(), 1 / seen.distance.min()] == pytest.approx(ends, abs=0.03)
    with pytest.raises(InputError, match="name is 'rock'"):
        scene_about("rock", 1.0)
