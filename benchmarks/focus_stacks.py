"""Score `autofocus` on simulated hand-held focus stacks: exact foci, foci that are off, and jumps of depth.

A textured slant or three walls are blurred by their spectra and seen by a camera that moves from picture to picture by
1.5 pixels, 0.2 degrees and 0.3 % (standard deviations). The stated foci may be off. Run from the repository:

    python benchmarks/focus_stacks.py [--seeds N]
"""

from __future__ import annotations

import argparse
import sys
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient import FocalGradientWarning, View, recover_depth
from focalgradient.psf import pixel_transfer, transfer

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "depth"))
blurred_views = import_module("blurred")  # textures and lenses of the tests
PIXEL, TILE, lens, texture = (getattr(blurred_views, name) for name in ("PIXEL", "TILE", "lens", "texture"))

SHAPE = (200, 260)  # pixels
CASES: dict[str, dict[str, Any]] = {
    "still slant": {"still": True},
    "hand-held slant": {},
    "hand-held slant, noise 3 %": {"noise": 0.03},
    "hand-held slant, ten foci, f/2.8": {"foci": 10, "f_number": 2.8},
    "hand-held steps": {"steps": True},
    "hand-held slant, foci off by 0.03 D": {"focus_error": 0.03},
    "hand-held steps, foci off by 0.03 D": {"steps": True, "focus_error": 0.03},
}


def stack(
    seed: int,
    *,
    steps: bool = False,
    still: bool = False,
    foci: int = 6,
    f_number: float = 4.0,
    noise: float = 0.01,
    focus_error: float = 0.0,
) -> tuple[list[View], NDArray[np.float64]]:
    """Views of one stack, and the vergence of what the first shows (H x W, D)."""
    random = np.random.default_rng([seed, 77])
    stated = np.linspace(0.45, 1.15, foci)
    true = stated + focus_error * random.standard_normal(foci)
    y, x = np.mgrid[:TILE, :TILE] - TILE / 2
    walls = np.sort(random.uniform(0.52, 1.08, 3)) if steps else np.linspace(0.5, 1.1, 25)
    if steps:
        vergence = walls[(x + 0.2 * y > -40).astype(int) + (x + 0.2 * y > 40)]
    else:
        down, right = random.uniform(-0.0015, 0.0015), random.uniform(-0.0018, 0.0018)
        vergence = np.clip(0.8 + down * y + right * x, 0.5, 1.1)
    place = np.clip(np.interp(vergence, walls, np.arange(len(walls))), 0, len(walls) - 1.001)
    lower, part = place.astype(int), place % 1
    f = (np.fft.fftfreq(TILE)[:, None], np.fft.rfftfreq(TILE))
    frequency = np.hypot(*f)
    spectrum = np.fft.rfft2(texture(seed)) * pixel_transfer(*f)
    grid = np.mgrid[: SHAPE[0], : SHAPE[1]] - (np.array(SHAPE)[:, None, None] - 1) / 2
    views = []
    for number, focus in enumerate(true):
        optics = lens(f_number, 1 / focus)
        blurred = np.stack(
            [
                np.fft.irfft2(spectrum * transfer(frequency, optics.blur_radius(1 / wall) / PIXEL, "disc"), (TILE,) * 2)
                for wall in walls
            ]
        )
        picture = np.take_along_axis(blurred, lower[None], 0)[0] * (1 - part)
        picture += np.take_along_axis(blurred, lower[None] + 1, 0)[0] * part
        moves = 0.0 if still or number == 0 else 1.0
        scale, angle = 1 + moves * random.normal(0, 0.003), moves * np.radians(random.normal(0, 0.2))
        turned = scale * np.array(
            [np.cos(angle) * grid[0] + np.sin(angle) * grid[1], np.cos(angle) * grid[1] - np.sin(angle) * grid[0]]
        )
        at = turned + moves * random.normal(0, 1.5, 2)[:, None, None] + TILE / 2
        seen = ndimage.map_coordinates(picture, at, order=5, mode="grid-wrap")
        seen = seen * (1 + 0.05 * moves * random.standard_normal()) + noise * random.standard_normal(SHAPE)
        views.append(View(seen.astype(np.float32), lens(f_number, 1 / stated[number]), PIXEL))
    rows, columns = np.round(grid + TILE / 2).astype(int)
    return views, vergence[rows, columns]


def main() -> None:
    """Print a row a case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", type=int, default=3, help="number of stacks a case [3]")
    seeds = range(parser.parse_args().seeds)
    warnings.simplefilter("ignore", FocalGradientWarning)
    print(f"{'':36} valid  within 2 sd  beyond 5 sd  error sd  stated sd  focus sd (D)")
    for name, settings in CASES.items():
        rows = []
        for seed in seeds:
            views, vergence = stack(seed, **settings)
            depth = recover_depth(views, method="autofocus", align=True)
            jump = np.abs(np.diff(vergence, axis=1, prepend=vergence[:, :1])) > 0.01
            far = ndimage.distance_transform_edt(~jump) > 12 if jump.any() else np.ones(SHAPE, bool)
            found = depth.valid & far
            error, sd = (depth.vergence - vergence)[found], depth.vergence_sd[found]
            within, beyond = np.mean(np.abs(error) < 2 * sd), np.mean(np.abs(error) > 5 * sd)
            focus_sd = float(str(depth.details["focus_sd_D"]))
            rows.append([depth.valid.mean(), within, beyond, error.std(), np.median(sd), focus_sd])
        mean = np.mean(rows, axis=0)
        print(
            f"{name:36} {mean[0]:5.2f}  {mean[1]:11.3f}  {mean[2]:11.4f}  {mean[3]:8.4f}  {mean[4]:9.4f}  {mean[5]:.4f}"
        )


if __name__ == "__main__":
    main()
