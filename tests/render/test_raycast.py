"""Rendered views against closed forms: the geometry of rays, never the blur of a convolution."""

import math

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from focalgradient import Lens, View
from focalgradient.optics import Aperture
from focalgradient.psf import Annulus, Blend, Gaussian, Polygon, Psf
from focalgradient.render import cast, noisy
from focalgradient.render.raycast import _spline
from focalgradient.scenes import Plane, Scene, Sphere, Texture, plane, slant

PIXEL = 3e-4
FRONT = (0.0, 0.0, -1.0)
WHITE = Texture(contrast=0, mean=1.0)


def card(
    distance: float, width: float, height: float, x: float = 0.0, y: float = 0.0, texture: Texture = WHITE
) -> Plane:
    """A card facing the camera, its size and place in pixels."""
    metres = PIXEL * distance
    return Plane((x * metres, y * metres, distance), FRONT, texture, (width * metres, height * metres))


@pytest.mark.parametrize(("focus", "vergence"), [(1.0, 1.5), (1.0, 0.4), (0.0, 0.5), (-0.7, 0.05)])
def test_blur_disc(focus: float, vergence: float) -> None:
    """The image of a small bright square is a disc as wide as theory says, uniform, and holds all its light."""
    side, theory = 4, 0.025 / 2 * abs(focus - vergence) / PIXEL  # in pixels
    scene = Scene((card(1 / vergence, side, side),))
    image = cast(scene, Aperture(0.025, focus), (70, 72), PIXEL, samples=1024).view.image
    assert image.sum() == pytest.approx(side**2, rel=0.01)
    rows, columns = np.indices(image.shape)
    # Second moments add: r^2/4 an axis for a disc, 1/12 of the square's and of the pixel's own width squared.
    for offset in (rows - 34.5, columns - 35.5):
        moment = (image * offset**2).sum() / image.sum()
        assert 2 * math.sqrt(moment - (side**2 + 1) / 12) == pytest.approx(theory, rel=0.01)
    # And it is flat: its middle as bright as its light over its area.
    middle = np.hypot(rows - 34.5, columns - 35.5) < theory - side
    assert image[middle].mean() == pytest.approx(side**2 / (math.pi * theory**2), rel=0.015)


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize("psf", [Polygon(blades=5), Annulus(), Gaussian(), Blend()], ids=str)
@pytest.mark.parametrize("distance", [0.7, 1.7])
def test_a_point_shows_the_shape_of_the_aperture(psf: Psf, distance: float) -> None:
    """The transfer of a small square's picture is the shape's closed form; nearer than focus its conjugate."""
    lens = Lens(focal_length=0.025, f_number=2.5, focus_distance=1.0)
    radius = abs(1 - 1 / distance) * lens.aperture_diameter / 2 / PIXEL
    image = cast(Scene((card(distance, 3, 3),)), lens, (64, 64), PIXEL, samples=2048, psf=psf).view.image
    at = np.arange(64) - 31.5
    for way, frequency in [(way, share / radius) for way in (0.0, 0.4, 1.9) for share in (0.15, 0.4, 0.8)]:
        fy, fx = frequency * math.sin(way), frequency * math.cos(way)
        found = (image * np.exp(-2j * np.pi * (fy * at[:, None] + fx * at))).sum() / image.sum()
        theory = psf.optical_transfer(fy, fx, radius) * np.prod([np.sinc(f) * np.sinc(3 * f) for f in (fy, fx)])
        assert abs(found - (theory if distance > 1 else np.conj(theory))) < 0.005


def test_a_pinhole_and_what_is_in_focus_are_sharp_and_a_pixel_is_a_box() -> None:
    """A bright half that covers three tenths of a pixel lends it three tenths of its light, and others nothing."""
    image = cast(Scene((card(2.0, 40, 40, x=20.2),)), Lens(0.025, math.inf, 0.5), (4, 9), PIXEL, samples=256).view.image
    assert image == pytest.approx(np.broadcast_to([0, 0, 0, 0, 0.3, 1, 1, 1, 1], (4, 9)), abs=0.005)
    scene = plane(0.8, seed=3)
    views = [cast(scene, Lens(0.025, n, 0.8), (48, 48), PIXEL, samples=256).view.image for n in (math.inf, 2)]
    assert views[0].std() > 0.02
    assert np.abs(views[0] - views[1]).max() < 1e-5


def test_directions() -> None:
    """x to the right and y down, in focus or out of it; no image upside down on either side of focus."""
    for distance in (0.6, 1.0, 3.0):
        spot = Scene((card(distance, 4, 4, x=12, y=-7),))
        image = cast(spot, Lens(0.025, 4, 1.0), (64, 80), PIXEL, samples=256).view.image
        rows, columns = np.indices(image.shape)
        assert (image * columns).sum() / image.sum() == pytest.approx(39.5 + 12, abs=0.05)
        assert (image * rows).sum() / image.sum() == pytest.approx(31.5 - 7, abs=0.05)


def test_texture_is_where_it_should_be() -> None:
    """Texels of one pixel, seen by a pinhole: pixels are the texels' means over a pixel, in place and upright."""
    texture = Texture(seed=9, texel=PIXEL * 2.0)
    wall = plane(2.0, seed=9, texture=texture)
    image = cast(wall, Lens(0.025, math.inf, 1.0), (33, 41), PIXEL, samples=64).view.image
    fine = (np.arange(-20 * 8 - 4, 20 * 8 + 4) + 0.5) / 8
    places = np.meshgrid(fine[4 * 8 : -4 * 8], fine, indexing="ij")
    seen = map_coordinates(texture.values().astype(float), places, order=3, mode="grid-wrap")
    seen = seen.reshape(33, 8, 41, 8).mean(axis=(1, 3))
    assert np.abs(image / seen - 1).max() < 2e-3


def test_splines_are_scipy_s_and_projected_texture_is_as_fine_at_every_distance() -> None:
    texture = Texture(seed=7)
    places = np.random.default_rng(0).uniform(-3000, 3000, (2, 200))
    ours = [_spline(texture.coefficients(), u, v) for v, u in places.T]
    theirs = map_coordinates(texture.values().astype(float), places, order=3, mode="grid-wrap")
    assert np.abs(ours - theirs).max() < 1e-6
    # To a pinhole, a wall painted from the camera's place looks the same wherever it stands.
    pinhole = Lens(0.025, math.inf, 1.0)
    near, far = (cast(plane(z, seed=1), pinhole, (20, 20), PIXEL).view.image for z in (0.5, 5.0))
    assert np.abs(near - far).max() < 1e-6


def test_depth_of_a_slanted_plane() -> None:
    """Vergence is linear in the columns, from near at the left edge of the frame to far at its right edge."""
    distance = cast(slant(0.9, 2.2, 50 * PIXEL), Lens(0.025, 4, 0.85), (4, 50), PIXEL, samples=1).distance
    share = (np.arange(50) + 0.5) / 50
    assert 1 / distance == pytest.approx(np.broadcast_to((1 - share) / 0.9 + share / 2.2, (4, 50)), rel=1e-12)


def test_depth_of_a_sphere() -> None:
    """Every point lies on the sphere, on the near side of it; around it there is nothing."""
    centre, radius = np.array([0.002, -0.001, 1.0]), 0.01
    scene = Scene((Sphere(tuple(centre.tolist()), radius),), background=0.5)
    rendered = cast(scene, Lens(0.025, math.inf, 1.0), (101, 121), PIXEL, samples=4)
    hit = np.isfinite(rendered.distance)
    rows, columns = np.indices(hit.shape)
    ray = np.stack([(columns - 60) * PIXEL, (rows - 50) * PIXEL, np.ones(hit.shape)], -1)
    away = ray[hit] * rendered.distance[hit][:, None] - centre
    assert np.linalg.norm(away, axis=1) == pytest.approx(radius, rel=1e-10)
    assert np.all(np.einsum("ij,ij->i", away, ray[hit]) <= 0)
    # A cone of half-angle asin(r/|c|) about the centre's direction: what it does not hold is background.
    cosine = (ray @ centre) / np.linalg.norm(ray, axis=-1) / np.linalg.norm(centre)
    assert np.array_equal(hit, np.arccos(cosine) < math.asin(radius / np.linalg.norm(centre)))
    assert np.all(rendered.distance[~hit] == np.inf)
    assert rendered.view.image[0, 0] == 0.5


def test_light_is_neither_lost_nor_made_nor_seen_behind_the_camera() -> None:
    """A world that is white all over looks white through any lens, whatever hides what."""
    things = (card(0.5, 30, 30), Sphere((0, 0, 0.9), 0.005, WHITE), *plane(3.0, texture=WHITE).objects)
    image = cast(Scene(things, background=1.0), Lens(0.025, 1.4, 0.9), (32, 32), PIXEL).view.image
    assert image == pytest.approx(1.0, abs=1e-6)
    scene = Scene((Sphere((0, 0, -1.0), 0.2), Plane((0, 0, -2.0), FRONT)))
    rendered = cast(scene, Lens(0.025, 2, 1.0), (4, 4), PIXEL)
    assert not rendered.view.image.any()
    assert np.isinf(rendered.distance).all()


def test_sun_shades_and_shadows() -> None:
    """A white ball under a low sun: Lambert's cosine where the sun sees it, the ambient share elsewhere."""
    wall = plane(2.0, texture=WHITE).objects
    ball = Sphere((0, 0, 1.5), 0.01, WHITE)
    scene = Scene((ball, *wall), sun=(-1.0, 0.0, -1.0), ambient=0.2)
    image = cast(scene, Lens(0.025, math.inf, 1.0), (101, 1901), PIXEL, samples=16).view.image
    row = image[50]
    assert row[0] == pytest.approx(0.2 + 0.8 * math.sqrt(0.5), rel=1e-5)
    assert row[950] == pytest.approx(0.2 + 0.8 * math.sqrt(0.5), rel=0.01)  # the ball's middle faces the camera
    assert row[950 + 20] == pytest.approx(0.2, rel=1e-5)  # its right side faces away: normal beyond 90 degrees
    # Half a metre behind the ball, its shadow falls half a metre to the right.
    shadow = 1000 + np.flatnonzero(row[1000:] < 0.5)
    assert shadow.mean() == pytest.approx(950 + 0.5 / 2.0 / PIXEL, abs=1)


@pytest.mark.parametrize(("blur", "most"), [(0.0, 0.0001), (4.0, 0.002)])
def test_noise_of_sampling(blur: float, most: float) -> None:
    """256 rays leave noise far below a camera's on fine natural texture, blur discs of up to 4 pixels radius."""
    optics = Aperture(2 * blur * PIXEL, 2.0)
    first, second = (cast(plane(1.0, seed=2), optics, (48, 48), PIXEL, samples=256, seed=s).view.image for s in (0, 1))
    assert first.std() > 0.05 * first.mean()
    assert np.std(first - second) / math.sqrt(2) < most * first.mean()


def test_noisy() -> None:
    view = View(np.full((200, 200), 0.5, np.float32), Lens(0.025, 4, 1.0), PIXEL)
    image = noisy(view, 0.02, seed=1).image
    assert image.dtype == np.float32
    assert image.mean() == pytest.approx(0.5, abs=0.0005)
    assert image.std() == pytest.approx(0.02, rel=0.02)
    assert not np.array_equal(image, noisy(view, 0.02, seed=2).image)
