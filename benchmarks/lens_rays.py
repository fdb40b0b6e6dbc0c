"""Scenes that are complete behind their boundaries, traced through a lens: a reference for `render.blur`.

A scene is defined in the space of the pinhole picture: column and row in pixels, and vergence in pixels (vergence x
half the aperture / pixel angle), where rays are straight. The ray through the lens at u (radius 1) that reaches the
sensor at pixel p is at p + u (V - Vf) in vergence V, so that planes remain planes and spheres become ellipsoids. Every
sheet and ball continues behind the others and beyond the frame, which picture and depth of the pinhole do not show. No
code is shared with `focalgradient.render`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

SHAPE = (144, 192)
"""Rows and columns of the frame."""

MARGIN = 64
"""Margin in pixels by which scenes extend beyond the frame."""

FINE = 4
"""Samples of a sheet's shape per pixel, in each direction."""

WIDE = (SHAPE[0] + 2 * MARGIN, SHAPE[1] + 2 * MARGIN)

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Thin surface: vergence and light at the pixels of the wide frame, and its mask, at `FINE` samples per pixel."""

    vergence: FloatArray
    light: FloatArray
    there: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """Solid ellipsoid: centre (row, column), vergence of the centre, radius in pixels and in vergence, light."""

    middle: tuple[float, float]
    vergence: float
    radius: float
    depth: float
    light: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Layered:
    """Scene with name, vergence in focus, and lens.

    `lens` is 1 for a disc, 2 for a Gaussian with a standard deviation of 1/2, and from 3 the number of straight blades.
    """

    name: str
    things: tuple[Sheet | Ball, ...]
    focus: float
    lens: float = 1.0


def picture_of(scene: Layered, samples: int = 64, seed: int = 1) -> tuple[FloatArray, FloatArray]:
    """Return the light averaged over each pixel, and the vergence at its centre, as seen by a pinhole."""
    light = _traced(scene, samples, 0.0, False, seed)[0]
    return light, _traced(scene, 1, 0.0, True, seed)[1]


def seen_through_lens(scene: Layered, rays: int = 1024, seed: int = 2) -> FloatArray:
    """Return the light of every pixel from `rays` rays over the scene's lens."""
    return _traced(scene, rays, scene.lens, False, seed)[0]


def _traced(scene: Layered, rays: int, lens: float, middle: bool, seed: int) -> tuple[FloatArray, FloatArray]:
    sheets = [thing for thing in scene.things if isinstance(thing, Sheet)]
    balls = [thing for thing in scene.things if isinstance(thing, Ball)]
    shifts = np.random.default_rng(seed).random((*SHAPE, 4))
    return _trace(
        np.stack([one.vergence for one in sheets]).astype(np.float32),
        np.stack([one.light for one in sheets]).astype(np.float32),
        np.stack([one.there for one in sheets]),
        np.array([(*one.middle, one.vergence, one.radius, one.depth) for one in balls]).reshape(-1, 5),
        np.stack([one.light for one in balls] or [np.zeros(WIDE)]).astype(np.float32),
        *(scene.focus, rays, lens, middle, shifts, np.zeros(SHAPE), np.zeros(SHAPE)),
    )


@njit(nogil=True, cache=True, error_model="numpy")
def _at(picture, y, x):  # type: ignore[no-untyped-def]
    """Interpolate linearly at a row and column of the frame."""
    y = min(max(y + MARGIN, 0.0), picture.shape[0] - 1.001)
    x = min(max(x + MARGIN, 0.0), picture.shape[1] - 1.001)
    i, j = int(y), int(x)
    v, w = y - i, x - j
    above = picture[i, j] * (1 - w) + picture[i, j + 1] * w
    below = picture[i + 1, j] * (1 - w) + picture[i + 1, j + 1] * w
    return above * (1 - v) + below * v


@njit(nogil=True, cache=True, error_model="numpy", parallel=False)
def _trace(  # type: ignore[no-untyped-def]
    vergences, lights, there, balls, skins, focus, rays, lens, middle, shifts, light, depth
):
    # Kronecker sequence of four dimensions, from powers of the root of x^5 = x + 1
    step = 1.1673039782614187 ** -np.arange(1.0, 5.0)
    for i in range(light.shape[0]):
        for j in range(light.shape[1]):
            total, place = 0.0, 0.0
            for n in range(rays):
                a, b, c, d = (shifts[i, j] + n * step) % 1.0
                y, x = (float(i), float(j)) if middle else (i + a - 0.5, j + b - 0.5)
                far = 0.0
                if lens == 1:
                    far = math.sqrt(c)
                elif lens == 2:
                    far = math.sqrt(-2 * math.log(1 - c)) / 2
                down, right = far * math.sin(2 * math.pi * d), far * math.cos(2 * math.pi * d)
                if lens >= 3:  # a triangle between the centre and two corners of a polygon with the disc's area
                    part = 2 * math.pi / lens
                    corner = math.sqrt(2 * math.pi / (lens * math.sin(part))) * math.sqrt(c * lens % 1.0)
                    first, second = part * int(c * lens), part * (int(c * lens) + 1)
                    down = corner * ((1 - d) * math.sin(first) + d * math.sin(second))
                    right = corner * ((1 - d) * math.cos(first) + d * math.cos(second))
                best, shown = -1e9, 0.0
                for k in range(len(vergences)):
                    # secant steps to the intersection of ray and sheet
                    v0 = _at(vergences[k], y, x)
                    f0 = v0 - _at(vergences[k], y + down * (v0 - focus), x + right * (v0 - focus))
                    v = v0 - f0
                    for _ in range(5):
                        f = v - _at(vergences[k], y + down * (v - focus), x + right * (v - focus))
                        if abs(f - f0) < 1e-7:
                            break
                        v0, f0, v = v, f, v - f * (v - v0) / (f - f0)
                    if v > best:
                        row, column = y + down * (v - focus), x + right * (v - focus)
                        p, q = int(FINE * (row + MARGIN + 0.5)), int(FINE * (column + MARGIN + 0.5))
                        p, q = min(max(p, 0), there.shape[1] - 1), min(max(q, 0), there.shape[2] - 1)
                        if there[k, p, q]:
                            best, shown = v, _at(lights[k], row, column)
                for k in range(len(balls)):
                    # nearer root of a quadratic in V
                    ratio = (balls[k, 3] / balls[k, 4]) ** 2
                    down0 = y + down * (balls[k, 2] - focus) - balls[k, 0]
                    right0 = x + right * (balls[k, 2] - focus) - balls[k, 1]
                    square = down**2 + right**2 + ratio
                    half = down * down0 + right * right0
                    root = half**2 - square * (down0**2 + right0**2 - balls[k, 3] ** 2)
                    if root > 0:
                        v = balls[k, 2] + (math.sqrt(root) - half) / square
                        if v > best:
                            best = v
                            shown = _at(skins[k], y + down * (v - focus), x + right * (v - focus))
                total += shown
                place += best
            light[i, j], depth[i, j] = total / rays, place / rays
    return light, depth


# Scenes.

ROWS, COLUMNS = (np.arange(side) - MARGIN for side in WIDE)
FINE_ROWS, FINE_COLUMNS = ((np.arange(FINE * side) + 0.5) / FINE - 0.5 - MARGIN for side in WIDE)
Y, X = np.meshgrid(FINE_ROWS, FINE_COLUMNS, indexing="ij")


def texture(random: np.random.Generator, mean: float, contrast: float = 0.18) -> FloatArray:
    """Return light with an amplitude spectrum of 1 / frequency, with some edges."""
    noise = random.standard_normal(WIDE)
    waves = np.fft.rfft2(noise)
    frequency = np.hypot(np.fft.fftfreq(WIDE[0])[:, None], np.fft.rfftfreq(WIDE[1]))
    frequency[0, 0] = np.inf
    field = np.fft.irfft2(waves / np.maximum(frequency, 1 / 128), WIDE)
    field = field / field.std() + 0.5 * np.sign(gaussian_filter(random.standard_normal(WIDE), 9))
    return mean * np.clip(1 + contrast * (field - field.mean()), 0.15, 1.85)


def plane(at: float, down: float = 0.0, right: float = 0.0) -> FloatArray:
    """Return a plane with vergence `at` at the centre of the frame, and a slope in each direction (px per px)."""
    return at + down * (ROWS - SHAPE[0] / 2)[:, None] + right * (COLUMNS - SHAPE[1] / 2)[None, :]


EVERYWHERE = np.ones((FINE * WIDE[0], FINE * WIDE[1]), bool)


def card(middle: tuple[float, float], half: tuple[float, float], turn: float = 0.0) -> NDArray[np.bool_]:
    """Return the mask of a rectangle, given centre, half height and width, and rotation (radians)."""
    y, x = Y - middle[0], X - middle[1]
    down, right = y * math.cos(turn) - x * math.sin(turn), y * math.sin(turn) + x * math.cos(turn)
    return np.asarray((np.abs(down) < half[0]) & (np.abs(right) < half[1]))


def leaf(middle: tuple[float, float], half: tuple[float, float], turn: float = 0.0) -> NDArray[np.bool_]:
    """Return the mask of an ellipse."""
    y, x = Y - middle[0], X - middle[1]
    down, right = y * math.cos(turn) - x * math.sin(turn), y * math.sin(turn) + x * math.cos(turn)
    return np.asarray((down / half[0]) ** 2 + (right / half[1]) ** 2 < 1)


def blob(random: np.random.Generator, scale: float, share: float) -> NDArray[np.bool_]:
    """Return an irregular mask that covers about a fraction `share` of the frame."""
    field = gaussian_filter(random.standard_normal(WIDE), scale)
    field = field / field.std()
    wide = np.kron(field, np.ones((FINE, FINE)))
    return np.asarray(gaussian_filter(wide, FINE) > np.quantile(field, 1 - share))


def _balls_on_floor(seed: int, reach: float, focus: float) -> Layered:
    """Return balls on a floor before a wall; vergence from 0 (the wall) to `reach`."""
    random = np.random.default_rng(seed)
    # the floor rises from the foot of the wall, in the middle row, to `reach` at the bottom
    horizon = 0.35 * SHAPE[0]
    slope = reach / (SHAPE[0] - horizon)
    things: list[Sheet | Ball] = [
        Sheet(plane(0.0), texture(random, 0.35), EVERYWHERE),
        Sheet(plane(slope * (SHAPE[0] / 2 - horizon), slope), texture(random, 0.45), horizon < Y),
    ]
    for number in range(5):
        radius = random.uniform(14, 26)
        foot = horizon + (0.15 + 0.17 * number) * (SHAPE[0] - horizon)
        across = random.uniform(0.1, 0.9) * SHAPE[1]
        # contact with the floor near its lowest point
        vergence = slope * (foot - horizon)
        depth = random.uniform(0.15, 0.4) * radius * min(1.0, reach / 25)
        things.append(
            Ball((foot - radius, across), vergence - slope * radius * 0.2, radius, depth, texture(random, 0.5))
        )
    return Layered(f"balls on a floor {seed}", tuple(things), focus)


def _curved(seed: int, count: int, reach: float, focus: float, contrast: float = 0.18) -> Layered:
    """Return smoothly curved layers of irregular shape, as in photographed rooms."""
    random = np.random.default_rng(seed)
    things = []
    for number in range(count):
        bend = gaussian_filter(random.standard_normal(WIDE), 25)
        at = reach * number / (count - 1) if count > 1 else reach
        vergence = plane(at, *random.uniform(-0.03, 0.03, 2)) + 0.04 * reach * bend / bend.std()
        form = EVERYWHERE if number == 0 else blob(random, 14, 0.5 / number**0.5)
        things.append(Sheet(vergence, texture(random, random.uniform(0.3, 0.6), contrast), form))
    return Layered(f"curved layers {seed}", tuple(things), focus)


def _cards(seed: int, reach: float, focus: float, thin: bool) -> Layered:
    """Return cards, leaves, bars and rings with any vergence and orientation."""
    random = np.random.default_rng(seed)
    things = [Sheet(plane(0.0, *random.uniform(-0.02, 0.02, 2)), texture(random, 0.4), EVERYWHERE)]
    for number in range(10):
        middle = (random.uniform(0, SHAPE[0]), random.uniform(0, SHAPE[1]))
        turn = random.uniform(0, math.pi)
        if thin and number % 2:
            form = card(middle, (random.uniform(0.8, 4), random.uniform(30, 70)), turn)
        elif thin and number % 4 == 0:
            half = random.uniform(14, 24)
            form = leaf(middle, (half, half)) & ~leaf(middle, (0.7 * half, 0.6 * half), turn)
        else:
            form = (card if number % 2 else leaf)(middle, (random.uniform(9, 22), random.uniform(12, 34)), turn)
        vergence = plane(random.uniform(0.2, 1) * reach)
        slope = random.uniform(-0.15, 0.15, 2) * reach / 20
        vergence = vergence + slope[0] * (ROWS - middle[0])[:, None] + slope[1] * (COLUMNS - middle[1])[None, :]
        things.append(Sheet(vergence, texture(random, random.uniform(0.25, 0.65)), form))
    return Layered(f"{'thin things' if thin else 'cards and leaves'} {seed}", tuple(things), focus)


def _contact(seed: int, slope: float, focus: float) -> Layered:
    """Return a card that leans on a wall: they touch along a slanted line, and diverge from there."""
    random = np.random.default_rng(seed)
    turn = random.uniform(-0.3, 0.3)
    wall = plane(4.0, 0.05, 0.02)
    leaning = plane(4.0, 0.05 + slope * math.sin(turn), 0.02 - slope * math.cos(turn))
    form = card((0.5 * SHAPE[0], 0.42 * SHAPE[1]), (0.3 * SHAPE[0], 0.36 * SHAPE[1]), 0.1) & (0.5 * SHAPE[1] + 20 > X)
    things = (Sheet(wall, texture(random, 0.35), EVERYWHERE), Sheet(leaning, texture(random, 0.55), form))
    return Layered(f"slanted contact {seed}", things, focus)


def _three(seed: int, reach: float, focus: float) -> Layered:
    """Return three surfaces that meet in places, and a hole."""
    random = np.random.default_rng(seed)
    middle = (SHAPE[0] / 2, SHAPE[1] / 2)
    half = random.uniform(0.4, 0.6)
    things = (
        Sheet(plane(0.0), texture(random, 0.3), EVERYWHERE),
        Sheet(plane(half * reach, 0.04, -0.03), texture(random, 0.45), middle[1] + 0.25 * (Y - middle[0]) > X),
        Sheet(
            plane(reach, -0.05, 0.05),
            texture(random, 0.6),
            card((0.75 * SHAPE[0], middle[1]), (0.28 * SHAPE[0], 50), random.uniform(-0.2, 0.2))
            & ~leaf((0.7 * SHAPE[0], middle[1] - 4), (11, 15)),
        ),
    )
    return Layered(f"three surfaces {seed}", things, focus)


def scenes() -> list[Layered]:
    """Return thirty scenes; blur from 0 to 40 pixels in radius."""
    return [
        *(_balls_on_floor(1 + n, reach, focus) for n, (reach, focus) in enumerate(
            [(15, 13), (15, 0), (8, 4), (25, 12), (25, 25), (38, 20), (40, 0), (5, 2)])),
        *(_curved(21 + n, count, reach, focus) for n, (count, reach, focus) in enumerate(
            [(4, 12, 6), (5, 20, 20), (5, 20, 0), (4, 30, 10), (6, 16, 8), (3, 6, 3), (4, 36, 36), (4, 10, 12)])),
        *(_cards(41 + n, reach, focus, thin) for n, (reach, focus, thin) in enumerate(
            [(15, 0, False), (15, 8, False), (25, 20, False), (12, 0, True), (12, 12, True), (20, 10, True)])),
        *(_contact(61 + n, slope, focus) for n, (slope, focus) in enumerate(
            [(0.05, 4), (0.1, 14), (0.2, 4), (0.2, 20), (0.3, -6)])),
        *(_three(81 + n, reach, focus) for n, (reach, focus) in enumerate([(12, 6), (20, 0), (20, 22)])),
    ]  # fmt: skip
