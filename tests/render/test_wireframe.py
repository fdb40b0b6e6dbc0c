"""Blurred lines against quadrature and rays, and what the cube's three gradients share and differ in."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from focalgradient import InputError, Lens
from focalgradient.render.wireframe import WIDTH, blur_at, line_light, necker_frame, necker_loop, wireframe
from focalgradient.scenes.necker import EDGES, NeckerCube

CUBE = NeckerCube(size=0.2, perspective=0.4, distance=0.5, line_width=0.003)
PICTURE = {"shape": (400, 400), "pixel_angle": 1.2e-3}
STRONG = {"aperture": 0.02}

sigmas = st.floats(0.3, 40.0)


def by_quadrature(along, across, length, sigma):
    """Light of a line, summed over points of Gaussians of sd `sigma(s)`."""

    def light(s):
        return math.exp(-((along - s) ** 2 + across**2) / (2 * sigma(s) ** 2)) / (2 * math.pi * sigma(s) ** 2)

    # The integrand's hump lies near the point's own place along the line.
    width = max(sigma(min(max(along, 0.0), length)), 1e-3)
    cuts = sorted({min(max(along + k * width, 0.0), length) for k in (-12, -3, -1, 0, 1, 3, 12)} | {0.0, length})
    # What lies between cuts that coincide is less than 1e-11.
    return sum(quad(light, a, b, epsabs=1e-12, epsrel=1e-11)[0] for a, b in pairwise(cuts) if b - a > 1e-12)


def same(one: np.ndarray, other: np.ndarray) -> bool:
    """Alike but for the rounding of 32-bit radiance."""
    return bool(np.abs(one - other).max() < 3e-6)


@given(sigmas, sigmas, st.floats(0.01, 500.0), st.floats(-0.3, 1.3), st.floats(-3, 3), st.floats(-3, 3))
@settings(max_examples=150, deadline=None)  # the first call compiles
def test_light_of_a_line_is_the_integral_along_it(first, last, length, share, beyond, across) -> None:
    along = share * length + beyond * first
    exact = by_quadrature(along, across * last, length, lambda s: first + (last - first) * s / length)
    assert line_light(along, across * last, length, first, last) == pytest.approx(exact, abs=1e-9)


@pytest.mark.parametrize("slip", [0.0, 1e-9, 1e-3])
def test_light_where_the_cone_of_blur_has_its_apex(slip) -> None:
    """On the line's extension, where sigma would reach 0, every point of a steep line is equally many sigmas away."""
    exact = by_quadrature(-2.0, slip, 10.0, lambda s: 1.0 + 0.5 * s)
    assert line_light(-2.0, slip, 10.0, 1.0, 6.0) == pytest.approx(exact, abs=1e-9)
    assert line_light(-2.0, 0.0, 10.0, 1.0, 6.0) == pytest.approx(math.exp(-2) * 10 / (2 * math.pi * 6))


def test_a_long_line_of_even_blur_has_a_gaussian_profile() -> None:
    lines = np.array([[[-300.0, 30.2], [400.0, 30.2]]])
    picture = wireframe(lines, np.full((1, 2), 4.0), (64, 80), width=3.0, brightness=2.0)
    profile = 2 * np.exp(-((np.arange(64) - 30.2) ** 2) / (2 * 5.0**2)) / (math.sqrt(2 * math.pi) * 5.0)
    profile[np.abs(np.arange(64) - 30.2) > 25] = 0  # five sigmas: no more is drawn
    assert np.abs(picture - profile[:, None]).max() < 1e-6


@given(
    st.lists(st.tuples(*[st.floats(100, 200)] * 4, *[st.floats(-15, 15)] * 2), min_size=1, max_size=4),
    st.floats(0.75, 4.0),
)
@settings(max_examples=40, deadline=None)  # the first call compiles
def test_light_is_conserved(given_lines, width) -> None:
    """However blurred, in whatever direction, and on whichever side of focus its ends lie."""
    table = np.array(given_lines)
    lines, blur = table[:, :4].reshape(-1, 2, 2), table[:, 4:]
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
    for line, its, long in zip(lines, blur, length, strict=True):
        total = wireframe(line[None], its[None], (300, 300), width=width, brightness=3.0).sum(dtype=float)
        assert total == pytest.approx(3.0 * long, rel=1e-4, abs=1e-9)
    together = wireframe(lines, blur, (300, 300), width=width).sum(dtype=float)
    assert together == pytest.approx(length.sum(), rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("ends", [(-9.0, 6.0), (0.0, 12.0), (5.0, 5.0), (-3.0, -11.0)])
def test_a_line_through_focus_has_the_blur_of_its_width_and_its_defocus_together(ends) -> None:
    start, stop, width = np.array([40.0, 50.0]), np.array([160.0, 110.0]), 1.2
    picture = wireframe(np.array([[start, stop]]), np.array([ends]), (170, 200), width=width)
    length = float(np.linalg.norm(stop - start))
    d = (stop - start) / length
    worst = 0.0
    for row, column in np.random.default_rng(3).integers((40, 30), (120, 170), size=(80, 2)):
        r = np.array([column, row]) - start
        sigma = lambda s: math.hypot(width, ends[0] + (ends[1] - ends[0]) * s / length)  # noqa: E731
        exact = by_quadrature(r @ d, r @ [-d[1], d[0]], length, sigma)
        worst = max(worst, abs(picture[row, column] - exact))
    assert worst < 2e-3 * picture.max()


def test_no_end_of_a_line_is_its_first_and_frames_only_crop() -> None:
    lines, blur = np.array([[[30.3, 20.1], [120.7, 90.9]]]), np.array([[-2.0, 7.0]])
    whole = wireframe(lines, blur, (120, 150), width=1.0)
    assert same(wireframe(lines[:, ::-1], blur[:, ::-1], (120, 150), width=1.0), whole)
    part = wireframe(lines - [40, 50], blur, (50, 60), width=1.0)
    assert same(part, whole[50:100, 40:100])
    assert not wireframe(lines + 1000, blur, (120, 150), width=1.0).any()
    assert not wireframe(lines[:, :1].repeat(2, axis=1), blur, (120, 150), width=1.0).any()  # seen end-on: no length


@pytest.mark.parametrize("focus", ["near", "far"])
def test_blur_is_a_lens_s(focus) -> None:
    natural = NeckerCube(size=0.4, perspective=0.4, distance=2.0)
    depth = np.linspace(natural.nearest, natural.farthest, 9)
    at = {"near": natural.nearest, "far": natural.farthest}[focus]
    lens = Lens(focal_length=0.05, f_number=2, focus_distance=at)
    blur = blur_at(natural, depth, aperture=0.025, focus=focus, k=0.7)
    assert np.abs(blur) == pytest.approx(0.7 * lens.blur_radius(depth), abs=1e-15)
    assert np.array_equal(np.sign(blur.round(12)), np.sign(depth - at))  # positive beyond focus
    assert blur_at(natural, depth, aperture=0.025, focus=1 / at, k=0.7) == pytest.approx(blur)
    # A picture of half the size has half the blur.
    half = NeckerCube(size=0.2, perspective=0.4, distance=2.0)
    assert blur_at(half, depth, aperture=0.025, focus=focus, k=0.7) == pytest.approx(blur / 2)


def test_blur_in_the_picture_is_that_of_rays_through_the_lens() -> None:
    """Points of one upright edge, seen where their rays through all of the pupil cross the plane of focus."""
    cube, turn, aperture = NeckerCube(size=0.4, perspective=0.4, tilt=0.0, line_width=0.003), 0.085, 0.03
    ends = cube.vertices(turn)[EDGES[cube.vertices(turn)[EDGES[:4, 0], 2].argmax()]]  # the far one, of even depth
    random = np.random.default_rng(0)
    point = ends[0] + (ends[1] - ends[0]) * random.random((200_000, 1))
    angle, radius = 2 * np.pi * random.random(len(point)), aperture / 2 * np.sqrt(random.random(len(point)))
    lens = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle], axis=1)
    met = lens + (point - lens) * (cube.nearest / point[:, 2:])
    rays = met[:, 0] / met[:, 2]  # place in the picture, across the edge
    pixel = 1.5e-3
    sharp, blurred = (
        necker_frame(cube, turn, shape=(400, 400), pixel_angle=pixel, gradient=gradient, aperture=aperture)
        for gradient in ("none", "rigid")
    )
    # The edge stands free at the left or right: a window about it holds all its light and no other upright edge's.
    place = rays.mean() / pixel + 199.5
    columns = np.arange(400)
    near = np.abs(columns - place) < 40
    variance = []
    for picture in (sharp, blurred):
        profile = picture[180:220].sum(axis=0, dtype=float) * near
        mean = profile @ columns / profile.sum()
        variance.append(profile @ (columns - mean) ** 2 / profile.sum())
        assert mean == pytest.approx(place, abs=0.05)
    assert variance[1] - variance[0] == pytest.approx(rays.var() / pixel**2, rel=0.01)


def uprights(picture: np.ndarray, turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Depth and greatest light, half way up, of the four upright edges."""
    ends = CUBE.vertices(turn)[EDGES[:4]]
    middle = CUBE.project(ends).mean(axis=1) / PICTURE["pixel_angle"] + 199.5
    light = [picture[round(y) - 1 : round(y) + 2, round(x) - 3 : round(x) + 4].max() for x, y in middle]
    return ends[..., 2].mean(axis=1), np.array(light)


def test_each_gradient_blurs_what_it_should() -> None:
    turn = 0.07
    light = {}
    for gradient in ("none", "rigid", "nonrigid"):
        depth, light[gradient] = uprights(necker_frame(CUBE, turn, **PICTURE, gradient=gradient, **STRONG), turn)
    far_first = depth.argsort()[::-1]
    assert np.ptp(light["none"]) < 0.1 * light["none"].mean()
    assert np.all(np.diff(light["rigid"][far_first]) > 0)  # near is sharp, and so bright
    assert np.all(np.diff(light["nonrigid"][far_first]) < 0)  # truly near is blurred
    swapped = necker_frame(CUBE, turn, **PICTURE, gradient="rigid", focus="far", **STRONG)
    assert np.all(np.diff(uprights(swapped, turn)[1][far_first]) < 0)  # focus on the far side, true blur


@pytest.mark.parametrize("turn", [0.0, 0.07])
def test_gradients_share_places_and_light(turn) -> None:
    """To first moments: the pictures have the same light, and it has the same centre of gravity."""
    rows, columns = np.indices(PICTURE["shape"])
    sharp = necker_frame(CUBE, turn, **PICTURE).astype(float)
    length = np.linalg.norm(np.diff(CUBE.project(CUBE.vertices(turn))[EDGES], axis=1), axis=2).sum() / 1.2e-3
    assert sharp.sum() == pytest.approx(length * math.sqrt(2 * math.pi) * 0.003 / 1.2e-3 / WIDTH, rel=1e-4)
    for gradient in ("rigid", "nonrigid"):
        blurred = necker_frame(CUBE, turn, **PICTURE, gradient=gradient, **STRONG).astype(float)
        assert blurred.sum() == pytest.approx(sharp.sum(), rel=1e-4)
        for place in (rows, columns):
            centres = [(light * place).sum() / light.sum() for light in (blurred, sharp)]
            assert centres[0] == pytest.approx(centres[1], abs=0.01)


@pytest.mark.parametrize("gradient", ["none", "rigid", "nonrigid"])
def test_the_loop_closes(gradient) -> None:
    picture = {"shape": (200, 200), "pixel_angle": 2.4e-3, "gradient": gradient, **STRONG}
    cube = NeckerCube(size=0.3, line_width=0.006)
    frames = list(necker_loop(cube, 12, **picture))
    assert len(frames) == 12
    after = necker_frame(cube, 0.25, **picture)
    assert same(after, frames[0])
    steps = [float(np.abs(b - a).sum()) for a, b in zip(frames, [*frames[1:], frames[0]], strict=True)]
    assert min(steps) > 0
    assert steps[-1] < 1.2 * max(steps[:-1])
    assert same(frames[5], necker_frame(cube, 0.25 * 5 / 12, **picture))


def test_the_picture_s_axis_is_the_middle_and_y_runs_down() -> None:
    """The cube from above, in perspective: more of the light below the middle than above, and left as right."""
    picture = necker_frame(CUBE, 0.0, **PICTURE)
    assert same(picture, picture[:, ::-1])
    rows = np.flatnonzero(picture.max(axis=1) > 0.5)
    y = CUBE.project(CUBE.vertices(0.0))[:, 1] / 1.2e-3 + 199.5
    assert rows[[0, -1]] == pytest.approx([y.min(), y.max()], abs=2)
    assert abs(y.min() - 199.5) < abs(y.max() - 199.5)


def test_lines_that_are_too_thin_for_the_pixels_are_refused() -> None:
    with pytest.raises(InputError, match=r"line_width is 1 pixels.*wider lines"):
        necker_frame(CUBE, 0.0, shape=(400, 400), pixel_angle=0.003)
