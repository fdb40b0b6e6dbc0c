"""Depth maps, pictures and stimuli of fixed inputs, to compare two states of the package while its structure changes.

    python tests/oracle/light.py make FOLDER
    python tests/oracle/light.py compare OLD NEW

Run `make` with each state of the package (`PYTHONPATH=OTHER/src` selects another checkout), on one machine, because
processors differ in the last digits. `compare` prints, per set, the largest difference: of depth in units of its
standard deviation, of everything else relative to the largest value. It exits with 1 where one exceeds `TOLERANCE`.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from focalgradient import DualPixel, Eye, Lens, View, recover_depth
from focalgradient.errors import FocalGradientWarning
from focalgradient.render import blur_picture, cast, necker_frame, noisy, render_bands
from focalgradient.scenes import NeckerCube, plane, scene_about, slant, spheres, step

TOLERANCE = 1e-6
SHAPE, PIXEL = (96, 128), 6e-4
Arrays = dict[str, np.ndarray]


def lens(f_number: float, focus: float) -> Lens:
    return Lens(focal_length=0.025, f_number=f_number, focus_distance=focus)


def views_of(scene: object, *optics: object, noise: float = 0.003, **settings: object) -> list[View]:
    views = [cast(scene, lens, SHAPE, PIXEL, samples=64, seed=1, **settings).view for lens in optics]
    return [noisy(view, noise * float(view.image.mean()), seed) for seed, view in enumerate(views)]


def compressed(views: list[View]) -> list[View]:
    """Return the views after JPEG at quality 75, decoded from a square-root encoding."""
    import cv2

    decoded = []
    for view in views:
        encoded = np.clip(255 * np.sqrt(view.image / view.image.max()), 0, 255).astype(np.uint8)
        pixels = cv2.imdecode(cv2.imencode(".jpg", encoded, [cv2.IMWRITE_JPEG_QUALITY, 75])[1], cv2.IMREAD_GRAYSCALE)
        decoded.append(replace(view, image=(pixels.astype(np.float32) / 255) ** 2))
    return decoded


def card() -> View:
    """Return a printed card: squares blurred by a Gaussian that grows across the frame."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    squares = 0.2 + 0.6 * (((y // 24 + x // 24) % 2) > 0)
    sharp, soft = (gaussian_filter(squares, sigma) for sigma in (1.0, 3.0))
    return noisy(View(np.where(x < SHAPE[1] // 2, sharp, soft).astype(np.float32), WIDE, PIXEL), 3e-3, 0)


def halves(vergence: float) -> list[View]:
    """Return the halves of a dual-pixel lens before a flat sheet, blurred by their transfer."""
    pair = DualPixel.pair(WIDE, 0.35)
    texture = cast(plane(1 / vergence, seed=1), lens(1e5, 0.8), SHAPE, PIXEL, samples=16).view.image
    fy, fx = np.fft.fftfreq(SHAPE[0])[:, None] / PIXEL, np.fft.rfftfreq(SHAPE[1])[None] / PIXEL
    views = []
    for number, optics in enumerate(pair):
        transfer = optics.optical_transfer(fy, fx, vergence)
        image = np.fft.irfft2(np.fft.rfft2(texture) * transfer, SHAPE).astype(np.float32)
        views.append(noisy(View(image, optics, PIXEL), 3e-3, number))
    return views


def eye_pair(*kinds: object) -> list[View]:
    from focalgradient.eye import Oscillation, accommodation_views, band_views

    eye, scene = Eye(4e-3, 1.0), slant(0.75, 1.6, 0.04, seed=1)
    if "bands" in kinds:
        rendered = band_views(scene, eye, SHAPE, 3e-4, noise=1e-3)
    else:
        rendered = accommodation_views(scene, eye, (0.125, 0.375), Oscillation(), SHAPE, 3e-4, noise=1e-3)
    return [each.view for each in rendered]


def depth(make: Callable[[], list[View]], **settings: object) -> Callable[[], Arrays]:
    def run() -> Arrays:
        found = recover_depth(make(), **settings)
        return {"vergence": found.vergence, "vergence_sd": found.vergence_sd, "valid": found.valid}

    return run


WIDE, NARROW = lens(4, 0.8), lens(16, 0.8)
SLANT = slant(0.9, 1.8, 0.08, seed=1)
MAPS: dict[str, Callable[[], Arrays]] = {
    "two apertures": depth(lambda: views_of(SLANT, NARROW, WIDE), near=0.82),
    "three apertures": depth(lambda: views_of(SLANT, NARROW, lens(8, 0.8), WIDE), near=0.82),
    "two foci": depth(lambda: views_of(SLANT, lens(8, 0.7), lens(8, 1.5))),
    "three foci": depth(lambda: views_of(SLANT, lens(8, 0.7), lens(8, 1.0), lens(8, 1.5))),
    "occluders": depth(lambda: views_of(spheres(5), lens(8, 0.8), lens(8, 1.6))),
    "step, without boundaries": depth(
        lambda: views_of(step(0.9, 1.5, seed=1), NARROW, WIDE), near=0.82, outlines=False
    ),
    "Gaussian blur": depth(lambda: views_of(SLANT, NARROW, WIDE, psf="gaussian"), near=0.82, psf="gaussian"),
    "JPEG room": depth(lambda: compressed(views_of(scene_about("spheres", 0.8, seed=1), NARROW, WIDE)), near=0.82),
    "dual pixels": depth(lambda: halves(1.6)),
    "edges": depth(lambda: [card()], method="edges", near=0.82, psf="gaussian"),
    "ratio": depth(lambda: views_of(SLANT, NARROW, WIDE), method="ratio", near=0.82),
    "spectra": depth(lambda: views_of(SLANT, NARROW, WIDE), method="spectra", near=0.82),
    "bands of an eye": depth(lambda: eye_pair("bands")),
    "moments of an eye": depth(lambda: eye_pair("moments")),
}


def blurred(optics: object) -> Callable[[], Arrays]:
    def run() -> Arrays:
        picture = cast(spheres(2), lens(1e5, 0.8), SHAPE, PIXEL, samples=16)
        return {"picture": blur_picture(picture.view.image, picture.distance, optics, pixel_angle=PIXEL)}

    return run


PICTURES: dict[str, Callable[[], Arrays]] = {
    "blurred by a lens": blurred(WIDE),
    "blurred by an eye": blurred(Eye(5e-3, 1.0)),
    "cast": lambda: {"image": cast(spheres(4), WIDE, SHAPE, PIXEL, samples=16).view.image},
    "bands": lambda: {
        f"{n}": rendered.view.image
        for n, rendered in enumerate(render_bands(spheres(1), [WIDE, NARROW, WIDE], SHAPE, PIXEL, samples=16))
    },
    "cube": lambda: {"frame": necker_frame(NeckerCube(), 0.1, shape=(320, 320), pixel_angle=5e-4, gradient="rigid")},
}


def make(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, run in {**MAPS, **PICTURES}.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FocalGradientWarning)
            try:
                arrays = run()
            except Exception as error:
                if "--strict" in sys.argv:
                    raise
                print(f"{name}: {type(error).__name__}: {error}")
                continue
        np.savez(folder / f"{name}.npz", **arrays)
        valid = f", {100 * arrays['valid'].mean():.1f} % valid" if "valid" in arrays else ""
        print(f"{name}{valid}", flush=True)


def difference(old: Arrays, new: Arrays) -> float:
    """Return the largest difference of two results; infinity where pixels are valid in one of them only."""
    if "valid" in old:
        if (old["valid"] != new["valid"]).any():
            return float("inf")
        apart = np.abs(old["vergence"] - new["vergence"]) / old["vergence_sd"]
        spread = np.abs(new["vergence_sd"] / old["vergence_sd"] - 1)
        return float(np.maximum(apart, spread)[old["valid"]].max(initial=0.0))
    return max(float(np.abs(new[name] - old[name]).max() / np.abs(old[name]).max()) for name in old)


def compare(old: Path, new: Path) -> bool:
    """Print the differences of all sets; return whether all are within the tolerance."""
    same = True
    for path in sorted(old.glob("*.npz")):
        with np.load(path) as before, np.load(new / path.name) as after:
            apart = difference(dict(before), dict(after))
        print(f"{path.stem:28}{apart:12.3g}{'' if apart <= TOLERANCE else '   differs'}")
        same &= apart <= TOLERANCE
    return same


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["make", folder, *_]:
            make(Path(folder))
        case ["compare", old, new]:
            sys.exit(not compare(Path(old), Path(new)))
        case _:
            sys.exit(__doc__)
