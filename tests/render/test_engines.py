"""Views by Mitsuba against closed forms and against the ray caster, and what is said where there is no Mitsuba."""

import math
import subprocess

import numpy as np
import pytest

from focalgradient import FocalGradientWarning, InputError, Lens
from focalgradient.optics import Aperture
from focalgradient.progress import silent
from focalgradient.render import engines, pathtrace, render, render_bands, render_series
from focalgradient.render.mitsuba_backend import LLVM, SCALAR, variant
from focalgradient.render.rendered import LUMINANCE
from focalgradient.scenes import Mesh, Plane, Scene, Sky, Sphere, Texture, plane, slant, spheres, step

PIXEL = 3e-4
FRONT = (0.0, 0.0, -1.0)
WHITE, BLACK = Texture(contrast=0, mean=1.0), Texture(contrast=0, mean=1e-9)


def square(distance: float, side: float, x: float = 0.0, y: float = 0.0, pixel: float = PIXEL) -> Mesh:
    """A white square facing the camera, its size and place in pixels, as a mesh."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * side / 2 + [x, y]
    vertices = np.concatenate([corners * pixel, np.ones((4, 1))], axis=1) * distance
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), corners, np.ones((2, 2, 3)))


def best() -> str:
    """The variant of Mitsuba that runs here; the tests need one."""
    found = variant()
    assert found is not None
    return found


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize(
    ("focus", "vergence", "x", "y"),
    [
        *((1.0, 1.5, 35, -25), (1.0, 0.7, 0, 0), (0.0, 0.6, -36, -24), (-0.1, 0.35, 0, 0), (-0.7, 0.05, 0, 0)),
        *((3.0, 3.6, 35, 0), (3.0, 2.5, 0, 25), (0.5, 0.05, 38, -28)),
    ],
)
def test_blur_disc(focus: float, vergence: float, x: float, y: float) -> None:
    """The image of a small bright square is a disc as wide as theory says, uniform, in place, and holds its light."""
    shape, pixel, aperture, side = (90, 116), 2e-3, 0.1, 4.0
    theory = aperture / 2 * abs(focus - vergence) / pixel  # in pixels
    scene = Scene((square(1 / vergence, side, x, y, pixel),))
    optics = Aperture(aperture, focus)
    image = render(scene, optics, shape, pixel, engine="shaded", samples=1024).view.image.astype(float)
    rows, columns = np.indices(shape)
    rows, columns = rows - (shape[0] - 1) / 2 - y, columns - (shape[1] - 1) / 2 - x
    assert np.all((image == 0) | (np.hypot(rows, columns) < theory + side))
    assert image.sum() == pytest.approx(side**2, rel=0.02)
    assert 2 * theory > 4
    for offset in (rows, columns):
        centre = (image * offset).sum() / image.sum()
        moment = (image * (offset - centre) ** 2).sum() / image.sum()
        assert centre == pytest.approx(0, abs=0.02 * theory)
        # Second moments add: r^2/4 an axis for a disc, 1/12 of the square's and of the pixel's own width squared.
        assert 2 * math.sqrt(moment - (side**2 + 1) / 12) == pytest.approx(theory, rel=0.01)
    middle = np.hypot(rows, columns) < theory - side
    assert image[middle].mean() == pytest.approx(side**2 / (math.pi * theory**2), rel=0.03)


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize("engine", ["shaded", "path"])
@pytest.mark.parametrize("focus", [1.0, -0.3])
@pytest.mark.parametrize("name", ["slant", "plane"])
def test_engines_agree_with_the_ray_caster(engine: engines.Engine, focus: float, name: str) -> None:
    """The same scene, lens and pixels: what differs is each one's own noise. No surface lights another."""
    scene = slant(0.9, 2.2, 48 * PIXEL, seed=2) if name == "slant" else plane(0.8, seed=3)
    optics = Aperture(0.004, focus)
    ours = render(scene, optics, (48, 48), PIXEL, engine="cast", samples=1024)
    theirs = render(scene, optics, (48, 48), PIXEL, engine=engine, samples=256)
    difference = theirs.view.image - ours.view.image
    noise = math.hypot(theirs.noise, ours.noise)
    assert theirs.view.image.std() > 10 * noise
    assert np.std(difference) < 1.15 * noise
    assert abs(difference.mean()) < 5 * noise / math.sqrt(difference.size) + 2e-5
    assert np.array_equal(theirs.distance, ours.distance)


def test_shading_of_spheres_agrees_with_the_ray_caster() -> None:
    """With sun, shadows, occlusion and projected texture, out of focus."""
    scene, optics = spheres(1, field=64 * PIXEL), Aperture(0.004, 1.2)
    ours = render(scene, optics, (48, 64), PIXEL, engine="cast", samples=1024)
    theirs = render(scene, optics, (48, 64), PIXEL, engine="shaded", samples=256)
    difference = theirs.view.image - ours.view.image
    noise = math.hypot(theirs.noise, ours.noise)
    assert np.std(difference) < 1.25 * noise
    assert abs(difference.mean()) < 0.001 * ours.view.image.mean()


def test_path_tracing_adds_what_surfaces_hide_and_give_each_other() -> None:
    """A grey floor under a grey ball darkens at its foot, to which shading alone is blind."""
    grey = Texture(contrast=0, mean=0.5)
    scene = Scene(
        (Plane((0, 0.02, 1), (0, -1, 0), grey), Sphere((0, 0.01, 1), 0.01, grey)), sun=(0, -1, 0), ambient=1.0
    )
    pinhole = Lens(0.025, math.inf, 1.0)
    path, shaded = (
        render(scene, pinhole, (48, 48), 1e-3, engine=engine, samples=256).view.image for engine in ("path", "shaded")
    )
    floor = np.s_[46, 24]
    foot = np.s_[44, 24]
    assert shaded[foot] == pytest.approx(0.5, abs=1e-5)
    assert path[foot] < 0.9 * shaded[foot]
    assert path[floor] > path[foot] * 0.9


def test_scalar_and_compiled_agree() -> None:
    """The same pictures but for noise, whatever runs Mitsuba: with Mitsuba's own lens, our own, and our shading."""
    scene = step(0.9, 1.6, seed=5)
    for traced, focus in ((True, 1.0), (True, -0.2), (False, 1.0)):
        pictures = [
            pathtrace.halves(
                *(scene, Aperture(0.004, focus), (24, 24), PIXEL),
                traced=traced,
                samples=16,
                seed=1,
                variant=which,
                progress=silent,
            )
            for which in (SCALAR, best())
        ]
        (a, b), (c, d) = pictures
        noise = math.hypot(np.std(a - b) / 2, np.std(c - d) / 2)
        assert np.std(a + b - c - d) / 2 < 1.2 * noise
        assert abs(np.mean(a + b - c - d)) / 2 < 5 * noise / math.sqrt(a.size / 3)


@pytest.mark.parametrize("engine", ["cast", "shaded"])
def test_occlusion_is_right(engine: engines.Engine) -> None:
    """A sharp edge in front of a brilliant, blurred surface stays what it is; a blurred edge veils by its own blur."""
    front = Plane((-0.6 * 60 * PIXEL, 0, 0.6), FRONT, Texture(contrast=0, mean=0.25), (0.6 * 120 * PIXEL, 1.0))
    back = Plane((0, 0, 1.5), FRONT, WHITE)
    sharp = render(Scene((back, front)), Lens(0.025, 2, 0.6), (8, 80), PIXEL, engine=engine)
    assert sharp.view.image[:, :40] == pytest.approx(0.25, abs=1e-5)
    assert sharp.view.image[:, 40:] == pytest.approx(1.0, abs=1e-5)
    assert sharp.distance[0] == pytest.approx(np.repeat([0.6, 1.5], 40))
    dark = Plane((-0.8 * 300 * PIXEL, 0, 0.8), FRONT, BLACK, (0.8 * 600 * PIXEL, 1.0))
    profiles = [
        render(Scene((dark, Plane((0, 0, wall), FRONT, WHITE))), Lens(0.025, 2, 1.5), (40, 80), PIXEL, engine=engine)
        for wall in (1.5, 4.0)
    ]
    near, far = (profile.view.image.mean(axis=0) for profile in profiles)
    assert np.ptp(near) > 0.99
    assert np.abs(near - far).max() < 1e-4
    # The share of a disc on one side of a line: a circular segment.
    radius = 0.0125 / 2 * (1 / 0.8 - 1 / 1.5) / PIXEL
    x = np.clip(((np.arange(80) - 39.5)[:, None] + np.linspace(-0.45, 0.45, 10)) / radius, -1, 1)
    assert np.abs(near - (0.5 + (np.arcsin(x) + x * np.sqrt(1 - x**2)) / np.pi).mean(axis=1)).max() < 0.01


def test_depth_is_along_the_axis_through_pixel_centres() -> None:
    """Of a mesh, off axis, where distance along the ray is another: the plane z = 1 + x/2, and nothing beside it."""
    corners = np.array([[-0.02, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.02, 0.1]])
    vertices = np.column_stack([corners, 1 + corners[:, 0] / 2])
    scene = Scene((Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), corners, np.ones((2, 2, 3))),))
    distance = render(scene, Lens(0.025, 4, 1.0), (20, 40), 3e-3, samples=2).distance
    tangent = (np.arange(40) - 19.5) * 3e-3
    truth = 1 / (1 - tangent / 2)
    inside = (tangent * truth > -0.02) & (tangent * truth < 0.1)
    assert 5 < np.count_nonzero(~inside) < 35
    assert distance[:, inside] == pytest.approx(np.broadcast_to(truth[inside], (20, inside.sum())), rel=1e-6)
    assert np.all(np.isinf(distance[:, ~inside]))


def test_noise_is_that_of_the_picture() -> None:
    """What is measured between the halves of one picture is what repeated pictures scatter by."""
    scene, optics = slant(0.9, 2.0, 32 * PIXEL), Aperture(0.006, 1.0)
    for engine in ("shaded", "cast"):
        many = [render(scene, optics, (32, 32), PIXEL, engine=engine, samples=32, seed=seed) for seed in range(8)]
        scatter = math.sqrt(np.mean(np.var([one.view.image for one in many], axis=0, ddof=1)))
        assert np.mean([one.noise for one in many]) == pytest.approx(scatter, rel=0.15)
        assert np.shape(many[0].residual) == (32, 32)


def test_common_seeds_change_nothing_but_the_focus() -> None:
    """Two foci a hair apart differ far less with one seed than with two; the same call gives the same picture."""
    scene = slant(0.9, 2.0, 32 * PIXEL)
    optics = [Aperture(0.006, 1.0), Aperture(0.006, 1.001)]
    first, second = render_series(scene, optics, (32, 32), PIXEL, engine="shaded", samples=16, seed=3)
    again = render(scene, optics[0], (32, 32), PIXEL, engine="shaded", samples=16, seed=3)
    other = render(scene, optics[0], (32, 32), PIXEL, engine="shaded", samples=16, seed=4)
    assert np.array_equal(first.view.image, again.view.image)
    assert np.std(first.view.image - second.view.image) < 0.1 * np.std(first.view.image - other.view.image)
    assert second.view.optics == optics[1]


def test_bands_are_the_colours_of_the_same_pictures() -> None:
    """Each band is the colour that its own focus makes; the view of a coloured picture is its luminance."""
    rainbow = np.random.default_rng(1).uniform(0, 1, (16, 16, 3))
    scene = Scene((Mesh(square(1.0, 40).vertices, square(1.0, 40).faces, square(1.0, 1).uv, rainbow),))
    optics = [Aperture(0.01, vergence) for vergence in (0.5, 1.0, 1.6)]
    whole = render_series(scene, optics, (24, 24), PIXEL, samples=8)
    bands = render_bands(scene, optics, (24, 24), PIXEL, samples=8)
    for band, one, full in zip(range(3), bands, whole, strict=True):
        assert full.colour is not None
        assert np.array_equal(one.view.image, full.colour[..., band])
        assert full.view.image == pytest.approx(full.colour @ np.array(LUMINANCE), abs=1e-6)
    assert bands[1].view.image.std() > 1.2 * max(bands[0].view.image.std(), bands[2].view.image.std())


def test_sky_stands_where_it_should() -> None:
    """Up is up, right is right, and the camera looks at the panorama's middle."""
    radiance = np.zeros((64, 128, 3))
    radiance[:32, 64:, 0], radiance[:32, :64, 1], radiance[32:, :, 2] = 1.0, 1.0, 1.0
    scene = Scene((), sky=Sky(radiance))
    picture = render(scene, Lens(0.025, 4, 1.0), (9, 9), 0.1, samples=16).colour
    assert picture is not None
    assert picture[1, 7] == pytest.approx([1, 0, 0], abs=1e-5)
    assert picture[1, 1] == pytest.approx([0, 1, 0], abs=1e-5)
    assert picture[7, 4] == pytest.approx([0, 0, 1], abs=1e-5)


def test_without_mitsuba_planes_are_cast_and_that_is_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines, "variant", lambda: None)
    engines._warn_once.cache_clear()
    with pytest.warns(FocalGradientWarning, match=r"ray cast instead.*focalgradient\[render\]"):
        path = render(plane(1.0), Aperture(0.0, 1.0), (8, 8), PIXEL, engine="path")
    render(plane(1.0), Aperture(0.0, 1.0), (8, 8), PIXEL, engine="shaded")  # a second warning would fail the test
    assert path.colour is None
    with pytest.raises(InputError, match=r"Mitsuba, which this scene needs.*libatomic1"):
        render(Scene((square(1.0, 4),)), Aperture(0.0, 1.0), (8, 8), PIXEL)
    engines._warn_once.cache_clear()


def test_a_crash_of_mitsuba_harms_the_probe_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def crash(command: list[str], **how: object) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess(command, -6 if command[-1] == LLVM else 0)

    monkeypatch.setattr(subprocess, "run", crash)
    assert variant.__wrapped__() == SCALAR
    monkeypatch.setattr(subprocess, "run", lambda command, **how: subprocess.CompletedProcess(command, 1))
    assert variant.__wrapped__() is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"engine": "blender"}, "engine is 'blender', but must be one of auto, path, shaded, cast"),
        ({"engine": "cast", "scene": Scene((), sky=Sky(np.ones((2, 4, 3))))}, "planes and spheres only"),
    ],
)
def test_bad_input(change, words) -> None:  # type: ignore[no-untyped-def]
    given = {"scene": plane(1.0), "optics": Lens(0.025, 4, 1.0), "shape": (5, 5), "pixel_angle": PIXEL} | change
    with pytest.raises(InputError, match=words):
        render(**given)
