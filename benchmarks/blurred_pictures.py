"""Accuracy and speed of `focalgradient.render.blur`, compared with ray casting of the same scene and lens.

    python benchmarks/blurred_pictures.py [--held-back] [--speed]

Twelve scenes with occlusion boundaries and blur up to 15 pixels on both sides of focus; `--held-back` uses twelve
others of the same kinds, which were not used to choose the constants of `focalgradient.render.hidden`. Errors are root
mean squares in percent of the picture's mean, away from boundaries and within two blur radii of them; the margin, which
depends on the scene outside the frame, is excluded. The baseline is layered convolution: the picture is divided into
layers half a pixel of blur apart, and each is convolved with its disc together with its mask, composited from far to
near. `--speed` times a picture of 1920 x 1080 with 15 pixels of blur.
"""

from __future__ import annotations

import argparse
import math
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, maximum_filter

from focalgradient import Lens
from focalgradient.psf import disc_transfer
from focalgradient.render import blur_picture, cast
from focalgradient.scenes import Plane, Scene, Texture, spheres, step

SHAPE, PIXEL = (240, 320), 3e-4
FIELD = SHAPE[1] * PIXEL
FOCAL = 0.05
TRUTH = 1024
"""Rays per pixel of the reference picture; their noise is 0.1 % of the mean."""

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Case:
    """Scene, and lens through which it is seen."""

    name: str
    scene: Scene
    focus: float
    f_number: float


def texture(seed: int, mean: float = 0.3) -> Texture:
    return Texture(texel=PIXEL, projected=True, seed=seed, mean=mean)


def bars(seed: int, widths: tuple[int, ...], near: float, far: float) -> Scene:
    """Return a scene of upright bars, `widths` pixels wide, before a wall."""
    random = np.random.default_rng(seed)
    cards = [
        Plane(
            (
                (number + 0.5 - len(widths) / 2) / len(widths) * FIELD * near,
                random.uniform(-0.1, 0.1) * FIELD * near,
                near,
            ),
            (0.0, 0.0, -1.0),
            texture(100 * seed + number, random.uniform(0.15, 0.36)),
            (width * PIXEL * near, FIELD / 2 * near),
        )
        for number, width in enumerate(widths)
    ]
    return Scene((*cards, Plane((0.0, 0.0, far), (0.0, 0.0, -1.0), texture(100 * seed + 50))))


def leaves(seed: int, count: int = 14) -> Scene:
    """Return a scene of slanted cards at all distances before a wall."""
    random = np.random.default_rng(seed)
    cards = []
    for number in range(count):
        z = random.uniform(0.7, 1.8)
        cards.append(
            Plane(
                (random.uniform(-0.45, 0.45) * FIELD * z, random.uniform(-0.35, 0.35) * FIELD * z, z),
                (random.uniform(-1, 1), random.uniform(-1, 1), -1.0),
                texture(100 * seed + number, random.uniform(0.15, 0.36)),
                (random.uniform(0.08, 0.2) * FIELD * z, random.uniform(0.05, 0.15) * FIELD * z),
            )
        )
    return Scene((*cards, Plane((0.0, 0.0, 3.0), (0.0, 0.0, -1.0), texture(100 * seed + 50))))


def cases(held_back: bool) -> list[Case]:
    shift = 40 if held_back else 0
    return [
        Case("spheres, near in focus", spheres(1 + shift, field=FIELD), 0.6, 8),
        Case("spheres, middle in focus", spheres(2 + shift, field=FIELD), 1.0, 5.6),
        Case("spheres, far in focus", spheres(3 + shift, field=FIELD), 3.0, 8),
        Case("spheres, far in focus", spheres(5 + shift, field=FIELD), 2.4, 8),
        Case("step, near in focus", step(0.8, 1.6, seed=shift), 0.8, 4),
        Case("step, far in focus", step(0.8, 1.6, seed=shift), 1.6, 4),
        Case("bars 4-20 px, far in focus", bars(1 + shift, (4, 8, 14, 20), 0.9, 1.8), 1.8, 5),
        Case("bars 4-20 px, near in focus", bars(2 + shift, (4, 8, 14, 20), 0.9, 1.8), 0.9, 5),
        Case("bars 6-16 px, between", bars(3 + shift, (6, 10, 16), 0.9, 2.5), 1.4, 5),
        Case("leaves, between", leaves(4 + shift), 1.2, 5),
        Case("leaves, near in focus", leaves(1 + shift), 0.7, 7),
        Case("leaves, far in focus", leaves(2 + shift), 3.0, 7),
    ]


def layered(picture: FloatArray, distance: FloatArray, lens: Lens) -> FloatArray:
    """Blur by layered convolution."""
    scale = lens.aperture_diameter / 2 / PIXEL
    vergence = scale / distance
    pad = 32
    frequency = np.hypot(np.fft.fftfreq(SHAPE[0] + 2 * pad)[:, None], np.fft.rfftfreq(SHAPE[1] + 2 * pad))
    shown = np.zeros_like(picture, float)
    layer = np.floor(2 * vergence)
    for number in np.unique(layer):
        inside = layer == number
        radius = abs(float(vergence[inside].mean()) - scale * lens.focus_vergence)
        transfer = disc_transfer(frequency, radius)
        parts = (np.pad(image, pad, mode="symmetric") for image in (inside * picture, inside.astype(float)))
        size = (SHAPE[0] + 2 * pad, SHAPE[1] + 2 * pad)
        spread = (np.fft.irfft2(np.fft.rfft2(part) * transfer, size) for part in parts)
        light, cover = (part[pad:-pad, pad:-pad] for part in spread)
        shown = light + (1 - np.clip(cover, 0, 1)) * shown
    return shown


def errors(case: Case, methods: dict[str, Callable[..., FloatArray]]) -> tuple[float, dict[str, tuple[float, float]]]:
    """Return the largest blur radius, and for each method the errors away from and near boundaries, in percent."""
    lens = Lens(FOCAL, case.f_number, case.focus)
    sharp = cast(case.scene, replace(lens, f_number=math.inf), SHAPE, PIXEL, samples=64)
    truth = cast(case.scene, lens, SHAPE, PIXEL, samples=TRUTH, seed=3).view.image
    vergence = lens.aperture_diameter / 2 / PIXEL / sharp.distance
    radius = lens.blur_radius(sharp.distance) / PIXEL
    jumps = [np.abs(np.diff(vergence, axis=axis, prepend=vergence.take([0], axis))) > 1 for axis in (0, 1)]
    reach = maximum_filter(radius, size=2 * int(radius.max()) + 1)
    near = distance_transform_edt(~(jumps[0] | jumps[1])) <= 2 * reach
    rim = int(radius.max()) + 3
    inside = np.zeros(SHAPE, bool)
    inside[rim:-rim, rim:-rim] = True
    found = {}
    for name, method in methods.items():
        wrong = 100 * (method(sharp.view.image, sharp.distance, lens) - truth) / truth.mean()
        away, beside = (float(np.sqrt(np.mean(wrong[part & inside] ** 2))) for part in (~near, near))
        found[name] = away, beside
    return float(radius.max()), found


def speed() -> None:
    pixel = 1e-4
    scene = spheres(1, field=1920 * pixel)
    sharp = cast(scene, Lens(FOCAL, math.inf, 1.0), (1080, 1920), pixel, samples=8)
    away = np.abs(1 - 1 / sharp.distance).max()
    lens = Lens(FOCAL, FOCAL / (2 * 15 * pixel / away), 1.0)
    blur_picture(sharp.view.image[:64, :64], sharp.distance[:64, :64], lens, pixel_angle=pixel)  # compiles
    for name, image in (("grey", sharp.view.image), ("colour", np.repeat(sharp.view.image[..., None], 3, axis=2))):
        wall, processor = time.perf_counter(), time.process_time()
        blur_picture(image, sharp.distance, lens, pixel_angle=pixel)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"1920 x 1080, 15 px, {name}: {wall:.2f} s, {processor:.2f} s of processor, {memory:.2f} GB at most")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--held-back", action="store_true")
    parser.add_argument("--speed", action="store_true")
    options = parser.parse_args()
    if options.speed:
        speed()
        return
    methods: dict[str, Callable[..., FloatArray]] = {
        "blur": lambda image, distance, lens: blur_picture(image, distance, lens, pixel_angle=PIXEL),
        "layered": layered,
    }
    print(f"{'scene':28} {'px':>5}   " + "   ".join(f"{name + ': away':>13} {'near':>6}" for name in methods))
    for case in cases(options.held_back):
        largest, found = errors(case, methods)
        print(
            f"{case.name:28} {largest:5.1f}   "
            + "   ".join(f"{away:13.2f} {near:6.2f}" for away, near in found.values()),
            flush=True,
        )


if __name__ == "__main__":
    main()
