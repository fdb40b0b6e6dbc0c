"""Scenes with occlusion boundaries and known depth, and scores of depth near boundaries.

Spheres are ray cast by `focalgradient.render.cast`. The other scenes are flat or slanted layers of given shapes, traced
here so that each point of the lens sees past a boundary correctly. The scenes `HELD_BACK` were not used while the
boundary treatment was developed on `MADE_WITH`; `CONTROLS` have no boundaries; `drawn` generates any number of random
scenes.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.errors import FocalGradientWarning
from focalgradient.render import cast, noisy
from focalgradient.scenes import spheres

Array = NDArray[np.float64]

SHAPE = (240, 320)
PIXEL = 3.2e-4  # rad
NEAR_OUTLINES = 10  # px
JUMP = 1.05  # ratio of distances from one pixel to the next
PAD = 48  # px by which layers extend beyond the frame
FINE = 4  # samples of a layer's shape per pixel
RAYS = 256
CLIP = 2.5  # brightest value that a sensor records, where lamps are beyond


def lens(f_number: float, focus: float) -> Lens:
    return Lens(focal_length=0.025, f_number=f_number, focus_distance=focus)


@dataclass(frozen=True)
class Layer:
    """Plane of 1/f texture with a shape: vergence (D) at the centre of the frame, and slopes in D per pixel."""

    vergence: float
    shape: Callable[[Array, Array], NDArray[np.bool_]] | None = None  # of x and y from the centre; None: everywhere
    slope: tuple[float, float] = (0.0, 0.0)  # right, down
    mean: float = 1.0


def half(angle: float, offset: float = 0.0) -> Callable[[Array, Array], NDArray[np.bool_]]:
    """Return a half-plane."""
    return lambda x, y: x * np.cos(angle) + y * np.sin(angle) < offset


def bar(angle: float, width: float, offset: float = 0.0) -> Callable[[Array, Array], NDArray[np.bool_]]:
    return lambda x, y: np.abs(x * np.cos(angle) + y * np.sin(angle) - offset) < width / 2


def leaf(right: float, down: float, angle: float, length: float, width: float) -> Callable[..., NDArray[np.bool_]]:
    """Return a leaf shape, two arcs that meet in points."""

    def inside(x: Array, y: Array) -> NDArray[np.bool_]:
        u = (x - right) * np.cos(angle) + (y - down) * np.sin(angle)
        v = (y - down) * np.cos(angle) - (x - right) * np.sin(angle)
        return np.abs(v) < width / 2 * (1 - (2 * u / length) ** 2)

    return inside


def blob(right: float, down: float, radius: float, seed: int) -> Callable[..., NDArray[np.bool_]]:
    """Return a disc with an undulating rim."""
    random = np.random.default_rng(seed)
    size, phase = random.uniform(0.05, 0.12, 3), random.uniform(0, 2 * np.pi, 3)

    def inside(x: Array, y: Array) -> NDArray[np.bool_]:
        angle = np.arctan2(y - down, x - right)
        waves = sum(s * np.cos((n + 2) * angle + p) for n, (s, p) in enumerate(zip(size, phase, strict=True)))
        return np.hypot(x - right, y - down) < radius * (1 + waves)

    return inside


def either(*shapes: Callable[..., NDArray[np.bool_]]) -> Callable[..., NDArray[np.bool_]]:
    return lambda x, y: np.any([one(x, y) for one in shapes], axis=0)


@dataclass(frozen=True)
class Case:
    """Scene with lenses, noise (relative to the mean light), and limits of the search."""

    lenses: tuple[Lens, ...]
    layers: tuple[Layer, ...] = ()  # nearest first; empty: spheres
    seed: int = 0
    noise: float = 0.01
    limits: dict[str, float] = field(default_factory=dict)
    size: tuple[int, int] = SHAPE  # px
    rays: int = RAYS  # per pixel
    lamps: int = 0  # points on the farthest layer that are too bright for the sensor
    vignette: float = 0.0  # displacement of a second stop of the pupil's size, in radii, as beside the optical axis


FRONT, FRONT_LIMIT = (lens(16, 0.55), lens(5.6, 0.55)), {"near": 0.55}  # two apertures, focus nearer than the scene
BACK, BACK_LIMIT = (lens(16, 3.0), lens(5.6, 3.0)), {"far": 3.0}  # focus beyond the scene
FOCI = (lens(8, 0.7), lens(8, 1.5))
WIDE_FOCI = (lens(5.6, 0.7), lens(5.6, 1.6))

BARS = tuple(
    Layer(v, bar(0.35, width, offset), mean=1 + 0.15 * number)
    for number, (v, width, offset) in enumerate([(1.6, 4, -110), (1.5, 8, -45), (1.6, 14, 25), (1.45, 20, 100)])
)
LEAVES = tuple(
    Layer(v, leaf(*place), slope, mean)
    for v, place, slope, mean in [
        (1.65, (-90, -40, 0.4, 110, 44), (8e-4, 0), 1.1),
        (1.45, (20, 55, -0.5, 120, 40), (0, 1e-3), 0.9),
        (1.3, (90, -45, 1.2, 100, 50), (0, 0), 1.0),
        (1.15, (-40, 70, 1.9, 90, 36), (-6e-4, 0), 1.2),
    ]
)
MADE_WITH = {
    "spheres, apertures": Case(FRONT, seed=5, limits=FRONT_LIMIT),
    "spheres, foci": Case((lens(8, 0.8), lens(8, 1.6)), seed=5),
    "step, foci": Case(FOCI, (Layer(1.4, half(0.2)), Layer(0.8)), 1),
    "step, front": Case(FRONT, (Layer(1.5, half(0.2)), Layer(0.7)), 2, limits=FRONT_LIMIT),
    "blob and bar, front": Case(
        FRONT, (Layer(1.4, either(blob(-60, 0, 55, 1), bar(0.1, 14, 80))), Layer(0.6)), 3, limits=FRONT_LIMIT
    ),
    "leaves, foci": Case(FOCI, (*LEAVES, Layer(0.5, slope=(4e-4, 0))), 4, 0.005),
    "bars, back": Case(BACK, (*BARS, Layer(0.5)), 5, 0.002, BACK_LIMIT),
    "slanted, front": Case(
        FRONT, (Layer(1.4, half(-0.7), (1e-3, 5e-4)), Layer(0.7, slope=(-8e-4, 0))), 6, 0.03, FRONT_LIMIT
    ),
}
HELD_BACK = {
    "spheres 2, back": Case(BACK, seed=11, limits=BACK_LIMIT),
    "spheres 2, foci": Case((lens(8, 0.8), lens(8, 1.6)), seed=12, noise=0.005),
    "step 2, back": Case(BACK, (Layer(1.5, half(1.4)), Layer(0.8)), 21, 0.01, BACK_LIMIT),
    "blob and bar 2, foci": Case(
        WIDE_FOCI, (Layer(1.35, either(blob(50, 10, 60, 2), bar(-0.2, 14, -90))), Layer(0.65)), 22
    ),
    "leaves 2, back": Case(
        (lens(11, 3.0), lens(4, 3.0)), (*LEAVES[::-1], Layer(0.45, slope=(0, 5e-4))), 23, 0.01, BACK_LIMIT
    ),
    "bars 2, foci": Case(WIDE_FOCI, (*BARS, Layer(0.6, slope=(5e-4, 0))), 24, 0.03),
    "slanted 2, foci": Case(FOCI, (Layer(1.3, half(0.9), (-8e-4, 4e-4)), Layer(0.75, slope=(6e-4, 0))), 25, 0.002),
    "blob and bar 2, front": Case(
        FRONT, (Layer(1.3, either(blob(-40, 0, 70, 3), bar(0.6, 14, 100))), Layer(0.7)), 26, 0.005, FRONT_LIMIT
    ),
}
# two views, a third, and limits of the search
DRAWN_FROM: dict[str, tuple[tuple[Lens, ...], Lens, dict[str, float]]] = {
    "front": (FRONT, lens(9, 0.55), FRONT_LIMIT),
    "back": (BACK, lens(9, 3.0), BACK_LIMIT),
    "foci": (FOCI, lens(8, 1.0), {}),
    "wide foci": (WIDE_FOCI, lens(8, 1.0), {}),
}


def drawn(number: int) -> tuple[str, Case]:
    """Return a random scene with its views.

    Scenes have one to three layers before a wall (half planes, bars and blobs); two views, for every fourth scene
    three; frames from 90 pixels, in which boundaries occupy a large part; noise of 0.2 to 3 %.
    """
    random = np.random.default_rng(number)
    size = int(random.integers(90, 260)), int(random.integers(90, 330))
    kind = str(random.choice(list(DRAWN_FROM)))
    lenses, third, limits = DRAWN_FROM[kind]
    if random.random() < 0.25:
        lenses, kind = (*lenses, third), f"{kind}, three views"
    layers = []
    for _ in range(random.integers(1, 4)):
        right, down = (float(random.uniform(-0.4, 0.4)) * n for n in (size[1], size[0]))
        angle = float(random.uniform(0, 2 * np.pi))
        shape = (
            half(angle, float(random.uniform(-30, 30))),
            bar(angle, float(random.uniform(3, 40)), right),
            blob(right, down, float(random.uniform(5, 80)), int(random.integers(9))),
        )[random.integers(3)]
        slope = tuple(random.uniform(-1e-3, 1e-3, 2).tolist())
        layers.append(Layer(float(random.uniform(0.75, 1.5)), shape, slope, float(random.uniform(0.6, 1.4))))
    layers.sort(key=lambda layer: -layer.vergence)
    wall = Layer(float(random.uniform(0.4, 0.65)))
    noise = float(np.exp(random.uniform(np.log(0.002), np.log(0.03))))
    return kind, Case(lenses, (*layers, wall), number, noise, limits, size, rays=1024)


THINGS = (
    Layer(1.45, blob(-85, -30, 45, 1), (6e-4, -4e-4), 1.1),
    Layer(1.2, blob(75, 40, 55, 2), (-5e-4, 0), 0.9),
    Layer(1.0, half(1.2, -70), (0, 4e-4), 1.05),
    Layer(0.65, None, (3e-4, 2e-4)),
)
"""Three objects before a wall."""

SEVERAL = {count: tuple(lens(8, 1 / v) for v in np.linspace(0.55, 1.55, count)) for count in (2, 3, 5)}
"""Numbers of foci of one aperture that share a range of vergence."""

SLIGHT = (lens(16, 3.0), lens(8, 3.0))  # two apertures of little blur, focus beyond the scene
DARK = {"bars of 5 px": (5, 45), "bars of 9 px": (9, 45), "bars of 14 px": (14, 60), "fence of 3 px": (3, 22)}
"""Width and spacing of dark bars, in pixels."""


def dark_bars(width: int, pitch: int) -> tuple[Layer, Layer]:
    """Return blank dark bars before a textured wall."""
    everywhere = [float(pitch * number) for number in range(-8, 9)]
    shape = either(*(bar(0.3, width, offset) for offset in everywhere))
    return Layer(1.0, shape, mean=0.0), Layer(0.6, slope=(2e-4, 0))


FINE_RAYS = 2048  # whose own noise is below that of the views
UNCERTAINTY = {
    "control, two foci": Case(SEVERAL[2], (Layer(1.05, slope=(1e-3, 5e-4)),), 41, 0.0022, rays=FINE_RAYS),
    "control, apertures": Case(FRONT, (Layer(1.1, slope=(1e-3, 0)),), 42, 0.0022, FRONT_LIMIT, rays=FINE_RAYS),
    "three things, apertures": Case(FRONT, THINGS, 43, 0.0022, FRONT_LIMIT, rays=FINE_RAYS),
    **{f"three things, {n} foci": Case(SEVERAL[n], THINGS, 43, 0.0022, rays=FINE_RAYS) for n in SEVERAL},
    "lamps, apertures": Case(FRONT, THINGS, 43, 0.0022, FRONT_LIMIT, lamps=12, rays=FINE_RAYS),
    "slant, apertures": Case(FRONT, (Layer(1.1, slope=(2.5e-3, 1e-3)),), 44, 0.005, FRONT_LIMIT, rays=FINE_RAYS),
    **{
        f"{name}, apertures": Case(SLIGHT, dark_bars(*size), 45, 0.0022, BACK_LIMIT, rays=FINE_RAYS)
        for name, size in DARK.items()
    },
}
"""Scenes on which the stated standard deviation is compared with the error (`z` of `score`)."""

PAINTED = blob(-50, 0, 60, 4)
CONTROLS = {
    "plane, front": Case(FRONT, (Layer(1.1, slope=(2.5e-3, 0)),), 31, limits=FRONT_LIMIT),
    "plane, foci": Case(FOCI, (Layer(1.1, slope=(2e-3, 1e-3)),), 32),
    "steep plane, back": Case(BACK, (Layer(1.0, slope=(3.5e-3, 0)),), 33, limits=BACK_LIMIT),
    "wall, front": Case(FRONT, (Layer(1.0),), 34, 0.03, FRONT_LIMIT),
    # one plane, part of which has another texture: a painted edge, not an occlusion boundary
    "painted wall, foci": Case(FOCI, (Layer(1.0, PAINTED, mean=1.5), Layer(1.0)), 35),
    "painted plane, front": Case(
        FRONT, (Layer(1.1, PAINTED, (2e-3, 0), 1.5), Layer(1.1, slope=(2e-3, 0))), 36, 0.003, FRONT_LIMIT
    ),
}


def texture(seed: int, mean: float, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return a 1/f field, two samples per pixel, with detail up to half a cycle per pixel and a contrast of 0.2."""
    shape = [2 * (n + 2 * PAD) for n in size]
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    frequency[0, 0] = np.inf
    white = np.fft.rfft2(np.random.default_rng(seed).standard_normal(shape))
    field = np.fft.irfft2(np.where(frequency < 0.25, white / frequency, 0), shape)
    return (mean * (1 + 0.2 * field / field.std())).astype(np.float32)


@njit(nogil=True, cache=True)
def _trace(masks, textures, planes, rays, blur, focus, image):  # type: ignore[no-untyped-def]
    height, width = image.shape
    for i in range(height):
        for j in range(width):
            total = 0.0
            for n in range(rays.shape[0]):
                # the ray pattern of each pixel has its own rotation
                turn = 2 * np.pi * ((i * 0.7548776662 + j * 0.5698402910) % 1.0)
                a = blur * (rays[n, 0] * np.cos(turn) - rays[n, 1] * np.sin(turn))
                b = blur * (rays[n, 0] * np.sin(turn) + rays[n, 1] * np.cos(turn))
                x, y = j - (width - 1) / 2 + rays[n, 2], i - (height - 1) / 2 + rays[n, 3]
                for k in range(planes.shape[0]):
                    v, right, down = planes[k]
                    lever = right * a + down * b
                    there = (v + right * x + down * y - lever * focus) / (1 - lever)
                    u, w = x + a * (there - focus), y + b * (there - focus)
                    s, t = u + (width - 1) / 2 + PAD + 0.5, w + (height - 1) / 2 + PAD + 0.5
                    row = min(max(int(t * FINE), 0), masks.shape[1] - 1)
                    column = min(max(int(s * FINE), 0), masks.shape[2] - 1)
                    if masks[k, row, column]:
                        p = min(max(2 * t - 0.5, 0.0), textures.shape[1] - 1.001)
                        q = min(max(2 * s - 0.5, 0.0), textures.shape[2] - 1.001)
                        e, f = int(p), int(q)
                        g, h = p - e, q - f
                        total += (1 - g) * ((1 - h) * textures[k, e, f] + h * textures[k, e, f + 1])
                        total += g * ((1 - h) * textures[k, e + 1, f] + h * textures[k, e + 1, f + 1])
                        break
            image[i, j] = total / rays.shape[0]


def layered(case: Case) -> tuple[list[View], Array]:
    """Return noise-free views of layers, and the true vergence."""
    from scipy.stats import qmc

    points = qmc.Sobol(4, rng=np.random.default_rng(case.seed)).random(case.rays)
    radius, angle = np.sqrt(points[:, 0]), 2 * np.pi * points[:, 1]
    rays = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), points[:, 2:] - 0.5])
    rays = rays[np.hypot(rays[:, 0] - case.vignette, rays[:, 1]) <= 1] if case.vignette else rays
    fine = [(np.arange(FINE * (n + 2 * PAD)) + 0.5) / FINE - PAD - n / 2 for n in case.size]
    y, x = np.meshgrid(*fine, indexing="ij")
    masks = np.stack([np.ones(x.shape, bool) if one.shape is None else one.shape(x, y) for one in case.layers])
    textures = np.stack([texture(1000 * case.seed + n, one.mean, case.size) for n, one in enumerate(case.layers)])
    planes = np.array([[one.vergence, *one.slope] for one in case.layers])
    spots = np.random.default_rng([case.seed, 7])
    for _ in range(case.lamps):
        row, column = (int(spots.uniform(2 * PAD, 2 * (n + PAD))) for n in case.size)
        textures[-1, row : row + 3, column : column + 3] = 200
    views = []
    for optics in case.lenses:
        image = np.empty(case.size)
        blur = optics.aperture_diameter / 2 / PIXEL
        _trace(masks, textures, planes, rays, blur, optics.focus_vergence, image)
        views.append(View(image.astype(np.float32), optics, PIXEL))
    y, x = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in case.size), indexing="ij")
    vergence = np.empty(case.size)
    for one in reversed(case.layers):
        inside = np.ones(case.size, bool) if one.shape is None else one.shape(x, y)
        vergence[inside] = (one.vergence + one.slope[0] * x + one.slope[1] * y)[inside]
    return views, vergence


def views_and_truth(name: str, case: Case, cache: Path | None = None) -> tuple[list[View], Array]:
    """Return noisy views of a case, and its true vergence (H x W)."""
    place = None if cache is None else cache / f"{name.replace(' ', '_').replace(',', '')}.npz"
    if place is not None and place.exists():
        with np.load(place) as kept:
            images, vergence = kept["images"], kept["vergence"]
        clean = [View(image, optics, PIXEL) for image, optics in zip(images, case.lenses, strict=True)]
    elif case.layers:
        clean, vergence = layered(case)
    else:
        casts = [cast(spheres(case.seed), optics, case.size, PIXEL, samples=case.rays) for optics in case.lenses]
        clean, vergence = [one.view for one in casts], 1 / casts[0].distance
    if place is not None and not place.exists():
        place.parent.mkdir(parents=True, exist_ok=True)
        np.savez(place, images=[view.image for view in clean], vergence=vergence)
    noise = case.noise * float(np.minimum(clean[0].image, CLIP).mean())
    views = [noisy(view, noise, 100 * case.seed + n) for n, view in enumerate(clean)]
    if case.lamps:
        views = [replace(view, image=np.minimum(view.image, CLIP), mask=view.image < CLIP) for view in views]
    return views, vergence


def near_outlines(vergence: Array) -> NDArray[np.bool_]:
    """Return a mask of pixels within `NEAR_OUTLINES` pixels of a discontinuity of the true vergence."""
    whole = np.ones(vergence.shape, bool)
    for axis in (0, 1):
        jump = np.abs(np.diff(np.log(vergence), axis=axis)) > np.log(JUMP)
        first = [slice(None), slice(None)]
        second = [slice(None), slice(None)]
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        whole[tuple(first)] &= ~jump
        whole[tuple(second)] &= ~jump
    return np.asarray(ndimage.distance_transform_edt(whole) <= NEAR_OUTLINES) if not whole.all() else ~whole


def score(depth: DepthMap, vergence: Array, where: NDArray[np.bool_]) -> dict[str, float]:
    """Return percentages over the pixels of `where`: valid, and of these off by > 10 %, by > 5 SD, within 2 SD."""
    use = depth.valid & where
    if not use.any():
        return {"valid": 0.0}
    error = (depth.vergence - vergence)[use]
    off = np.abs(depth.distance[use] * vergence[use] - 1)
    size = np.abs(error) / depth.vergence_sd[use]
    return {
        "valid": 100 * float(use.sum() / where.sum()),
        "off_10_percent": 100 * float((off > 0.1).mean()),
        "beyond_5_sd": 100 * float((size > 5).mean()),
        "within_2_sd": 100 * float((size <= 2).mean()),
        "z": 1.48 * float(np.median(size)),
        "error_D": float(np.median(np.abs(error))),
        "sd_D": float(np.median(depth.vergence_sd[use])),
        "median_percent": 100 * float(np.median(off)),
        "p90_percent": 100 * float(np.quantile(off, 0.9)),
    }


def recovered(case: Case, views: list[View], outlines: bool) -> tuple[DepthMap, float]:
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        depth = recover_depth(views, **case.limits, **({} if outlines else {"outlines": False}))  # type: ignore[arg-type]
    return depth, time.process_time() - start
