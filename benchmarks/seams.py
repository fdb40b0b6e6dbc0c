"""Accuracy of blurred pictures near occlusion boundaries, and detection of places sharper than their blur allows.

    python benchmarks/seams.py [--scenes N,N] [--held-back DATA] [--before SRC] [--pictures FILE]

Thirty scenes of `lens_rays`, complete behind their boundaries, are traced through a lens (1,024 rays per pixel), and
compared with `focalgradient.render.blur_picture` of their pinhole picture and depth. Errors are within 3 pixels of
boundaries, in percent of the picture's mean; the margin, which depends on the scene outside the frame, is excluded.
`gradient` is the largest difference between neighbouring pixels relative to the largest in the reference; `local` is
relative to the maximum of the reference within 2 pixels. A picture does not contain hidden surfaces: `shown` is the
error where the reference changes by at most 1 % if they have other textures. References are cached in a temporary
folder. `--before` takes a folder `src` of other code, for which the same is printed. `--held-back` uses the scenes of
`held_back_scenes` instead, on which no constant was chosen: other seeds, polygons and Gaussians, photographs; DATA is
the folder `indoor_pairs`, or "none".
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import held_back_scenes
import numpy as np
from lens_rays import MARGIN, Ball, Layered, Sheet, picture_of, scenes, seen_through_lens
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, maximum_filter

from focalgradient.psf import Disc, Gaussian, Polygon
from focalgradient.render import blur_picture

PIXEL = 1e-3
AHEAD = 10.0
"""Vergence in pixels added to that of a scene, which is arbitrary, so that all surfaces lie in front of the lens."""

FloatArray = NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class Pupil:
    """Aperture diameter (m) and vergence in focus (D); with a diameter of 2 `PIXEL`, 1 D blurs by 1 pixel."""

    aperture_diameter: float
    focus_vergence: float


@dataclass(frozen=True, slots=True)
class Found:
    """Errors near boundaries in percent of the mean, and gradients relative to the reference."""

    median: float
    worst: float
    shown: float
    gradient: float
    local: float


def blurred(scene: Layered, picture: FloatArray, vergence: FloatArray) -> FloatArray:
    psf = {1: Disc(), 2: Gaussian()}.get(int(scene.lens)) or Polygon(int(scene.lens))
    optics = Pupil(2 * PIXEL, scene.focus + AHEAD)
    return blur_picture(picture, 1 / (vergence + AHEAD), optics, pixel_angle=PIXEL, psf=psf).astype(float)


def gradient(image: FloatArray) -> FloatArray:
    """Return the larger of the differences to the next pixel, down and to the right."""
    down, right = np.zeros_like(image), np.zeros_like(image)
    down[:-1], right[:, :-1] = np.abs(np.diff(image, axis=0)), np.abs(np.diff(image, axis=1))
    return np.maximum(down, right)


def compared(
    scene: Layered, made: FloatArray, vergence: FloatArray, seen: FloatArray, known: NDArray[np.bool_]
) -> Found:
    """Compare a blurred picture with the reference; `known` is True where hidden surfaces have no influence."""
    jumps = [np.abs(np.diff(vergence, axis=axis, prepend=vergence.take([0], axis))) > 1 for axis in (0, 1)]
    near = distance_transform_edt(~(jumps[0] | jumps[1])) <= 3
    rim = min(int(np.abs(vergence - scene.focus).max()) + 3, 30)
    inside = np.zeros(near.shape, bool)
    inside[rim:-rim, rim:-rim] = True
    wrong = 100 * np.abs(made - seen) / seen.mean()
    of_made, of_seen = gradient(made), gradient(seen)
    around = maximum_filter(of_seen, 5) + 0.005 * seen.mean()
    return Found(
        float(np.median(wrong[near & inside])),
        float(np.quantile(wrong[near & inside], 0.99)),
        float(np.quantile(wrong[near & inside & known], 0.99)),
        float(of_made.max() / of_seen.max()),
        float((of_made / around).max()),
    )


def with_other_hidden(scene: Layered, vergence: FloatArray) -> Layered:
    """Return the scene with other light on surfaces that its pinhole picture does not show."""
    things: list[Sheet | Ball] = []
    inside = (slice(MARGIN, -MARGIN), slice(MARGIN, -MARGIN))
    for number, thing in enumerate(scene.things):
        if not isinstance(thing, Sheet):
            things.append(thing)
            continue
        hidden = np.zeros(thing.light.shape)
        hidden[inside] = thing.vergence[inside] < vergence - 0.3
        other = np.roll(thing.light, (37 + number, 53), axis=(0, 1))
        light = thing.light + gaussian_filter(hidden, 0.3) * (other - thing.light)
        things.append(Sheet(thing.vergence, light, thing.there))
    return Layered(scene.name, tuple(things), scene.focus, scene.lens)


def reference(number: str, scene: Layered) -> dict[str, FloatArray]:
    """Return picture, vergence, view through the lens, and mask without influence of hidden surfaces; cached."""
    kept = Path(tempfile.gettempdir()) / "focalgradient-seams" / f"{number}.npz"
    if not kept.exists():
        kept.parent.mkdir(exist_ok=True)
        picture, vergence = picture_of(scene)
        seen = seen_through_lens(scene)
        other = seen_through_lens(with_other_hidden(scene, vergence), rays=256)
        known = gaussian_filter(np.abs(other - seen), 1) < 0.01 * seen.mean()
        np.savez(kept, picture=picture, vergence=vergence, seen=seen, known=known)
    with np.load(kept) as held:
        return {name: held[name] for name in held}


def table(given: list[Layered], numbers: list[int], pictures: Path | None, prefix: str = "") -> list[dict[str, float]]:
    print(f"{'scene':22} {'px':>5} {'median':>7} {'99 %':>6} {'shown':>6} {'gradient':>9} {'local':>6}")
    rows, shown = [], []
    for number, scene in enumerate(given):
        if number not in numbers:
            continue
        held = reference(f"{prefix}{number}", scene)
        made = blurred(scene, held["picture"], held["vergence"])
        found = compared(scene, made, held["vergence"], held["seen"], held["known"].astype(bool))
        largest = np.abs(held["vergence"] - scene.focus).max()
        print(
            f"{scene.name:22} {largest:5.1f} {found.median:7.2f} {found.worst:6.2f} {found.shown:6.2f} "
            f"{found.gradient:9.3f} {found.local:6.2f}",
            flush=True,
        )
        rows.append({name: getattr(found, name) for name in ("median", "worst", "shown", "gradient", "local")})
        shown.append(np.hstack([held["picture"], held["seen"], made, 0.5 + 4 * (made - held["seen"])]))
    for name, take in (("median of scenes", np.median), ("worst of scenes", np.max)):
        values = [float(take([row[key] for row in rows])) for key in rows[0]]
        print(f"{name:28} {values[0]:7.2f} {values[1]:6.2f} {values[2]:6.2f} {values[3]:9.3f} {values[4]:6.2f}")
    if pictures is not None:
        cv2.imwrite(str(pictures), (255 * np.clip(np.vstack(shown), 0, 1) ** 0.45).astype(np.uint8))
    return rows


def speed() -> float:
    """Return processor seconds per million pixels with 15 pixels of blur: balls on a floor, six times enlarged."""
    held = reference("0", scenes()[0])
    picture, vergence = (np.kron(held[name], np.ones((6, 6))) for name in ("picture", "vergence"))
    vergence = vergence + np.linspace(0, 0.1, vergence.shape[1])
    scene = Layered("", (), 0.0)
    blurred(scene, picture[:64, :64], vergence[:64, :64])  # compiles
    begin = time.process_time()
    blurred(scene, picture, vergence)
    return 1e6 * (time.process_time() - begin) / picture.size


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", help="numbers of some")
    parser.add_argument("--held-back", metavar="DATA", help="folder indoor_pairs, or none")
    parser.add_argument("--before", type=Path, help="folder src of the code to compare with")
    parser.add_argument("--pictures", type=Path, help="PNG of pinhole, reference, blurred and their difference")
    options = parser.parse_args()
    given = scenes() if options.held_back is None else held_back_scenes.scenes(options.held_back)
    numbers = [int(number) for number in options.scenes.split(",")] if options.scenes else list(range(len(given)))
    table(given, numbers, options.pictures, "" if options.held_back is None else "held-back-")
    print(json.dumps({"processor_s_per_megapixel": round(speed(), 2)}), flush=True)
    if options.before is not None:
        print(f"\n{options.before}", flush=True)
        again = [sys.executable, __file__, "--scenes", ",".join(map(str, numbers))]
        again += ["--held-back", options.held_back] if options.held_back is not None else []
        subprocess.run(again, check=True, env={**os.environ, "PYTHONPATH": str(options.before)})


if __name__ == "__main__":
    main()
