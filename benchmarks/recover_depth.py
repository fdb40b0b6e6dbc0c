"""Speed and accuracy of `recover_depth`, compared with simple blur equalisation in the same run.

    python benchmarks/recover_depth.py [--repeat 5] [--out FILE.json]

The reference is a straightforward SciPy implementation: at each of 35 depths, blur each view with the point spread
function of the other, square the difference, average it with the same Gaussian window, and find the minimum, refined by
a parabola. Both run alternately on the same views, so that their ratio is meaningful on a busy machine. Then full
frames follow, each in its own process, for seconds and peak memory.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, signal

from focalgradient import Lens, View, recover_depth
from focalgradient.psf import DISC_K, PsfName, transfer
from focalgradient.render import cast, noisy
from focalgradient.scenes import slant

Image = NDArray[np.float32]

NEAR, FAR = 0.9, 2.2  # m, the slanted plane's left and right edges
FOCUS = 0.85  # m
LEVELS = 35
WINDOW = 8.0  # px
NOISE = 0.01  # relative to the mean radiance
APERTURES = [Lens(focal_length=0.025, f_number=number, focus_distance=FOCUS) for number in (16, 5.6)]
FOCI = [Lens(focal_length=0.025, f_number=8, focus_distance=focus) for focus in (0.8, 1.25)]


@dataclass(frozen=True)
class Trial:
    """Views, true distance of each pixel, and blur model."""

    views: list[View]
    distance: NDArray[np.float64]
    psf: PsfName


def slanted(lenses: Sequence[Lens], near: float, far: float, shape: tuple[int, int], samples: int) -> Trial:
    """Return ray-traced views of a slanted plane, whose blur is a disc."""
    pixel = 8e-6 / lenses[0].sensor_distance
    casts = [cast(slant(near, far, shape[1] * pixel, seed=1), lens, shape, pixel, samples=samples) for lens in lenses]
    sd = NOISE * float(casts[0].view.image.mean())
    return Trial([noisy(one.view, sd, seed) for seed, one in enumerate(casts)], casts[0].distance, "disc")


def gaussian_wall(distance: float, shape: tuple[int, int]) -> Trial:
    """Return a wall with Gaussian blur, by filtering, as rays do not produce it."""
    pixel = 8e-6 / APERTURES[0].sensor_distance
    size = [n + 128 for n in shape]  # wider than the frame, to avoid wrap-around
    frequency = np.hypot(np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1]))
    spectrum = np.fft.rfft2(np.random.default_rng(1).standard_normal(size))
    spectrum *= np.where(frequency > 0, 1 / np.maximum(frequency, 1e-9), 0)
    scale = 0.2 / np.fft.irfft2(spectrum, size).std()
    views = []
    for seed, lens in enumerate(APERTURES, 2):
        blurred = spectrum * transfer(frequency, lens.blur_radius(distance) / pixel, "gaussian", DISC_K)
        image = 1 + scale * np.fft.irfft2(blurred, size)[64:-64, 64:-64]
        views.append(
            View((image + NOISE * np.random.default_rng(seed).standard_normal(shape)).astype("f4"), lens, pixel)
        )
    return Trial(views, np.full(shape, distance), "gaussian")


def blur(image: Image, radius: float, psf: PsfName) -> Image:
    """Blur an image with a disc, or with a Gaussian of the disc's second moment."""
    if psf == "gaussian":
        return np.asarray(ndimage.gaussian_filter(image, DISC_K * radius, mode="reflect"))
    kernel = disc(radius)
    if kernel.size <= 1:
        return image
    if kernel.size <= 25:  # direct summation is faster for small kernels, the Fourier transform for others
        return np.asarray(ndimage.convolve(image, kernel, mode="reflect"))
    reach = kernel.shape[0] // 2
    return np.asarray(signal.fftconvolve(np.pad(image, reach, mode="symmetric"), kernel, mode="valid"), np.float32)


def disc(radius: float) -> Image:
    """Return a uniform disc, antialiased by 8 x 8 points per pixel, with sum 1."""
    reach = int(np.ceil(radius))
    if radius < 0.1:
        return np.ones((1, 1), np.float32)
    place = (np.arange(8 * (2 * reach + 1)) + 0.5) / 8 - reach - 0.5
    inside = np.hypot(place[:, None], place) <= radius
    share = inside.reshape(2 * reach + 1, 8, 2 * reach + 1, 8).sum(axis=(1, 3))
    return np.asarray(share / share.sum(), np.float32)


def plain(trial: Trial) -> NDArray[np.float64]:
    """Return vergence by simple blur equalisation, H x W."""
    one, other = trial.views
    focus = one.optics.focus_vergence
    levels = np.linspace(0, focus, LEVELS)
    cost = np.empty((LEVELS, *one.shape), np.float32)
    for index, level in enumerate(levels):
        first, second = (v.optics.aperture_diameter / 2 * (focus - level) / v.pixel_angle for v in (one, other))
        difference = blur(one.image, second, trial.psf) - blur(other.image, first, trial.psf)
        cost[index] = ndimage.gaussian_filter(difference**2, WINDOW)
    best = np.clip(cost.argmin(axis=0), 1, LEVELS - 2)
    below, least, above = (np.take_along_axis(cost, best[None] + i, axis=0)[0].astype(float) for i in (-1, 0, 1))
    curve = below - 2 * least + above
    shift = np.clip((below - above) / np.where(curve > 0, 2 * curve, np.inf), -1, 1)
    return np.asarray((best + shift) * (levels[1] - levels[0]))


def ours(trial: Trial) -> NDArray[np.float64]:
    """Return vergence by `recover_depth`, H x W."""
    return recover_depth(trial.views, near=FOCUS, psf=trial.psf, window=WINDOW).vergence.astype(float)


def compare(trial: Trial, repeat: int) -> dict[str, float]:
    """Return the median seconds of both, run alternately, and their errors over *all* pixels, valid or not."""
    seconds: dict[str, list[float]] = {"ours": [], "plain": []}
    error = {}
    methods: dict[str, Callable[[Trial], NDArray[np.float64]]] = {"ours": ours, "plain": plain}
    ours(trial)  # compiles
    for _ in range(repeat):
        for name, method in methods.items():
            start = time.perf_counter()
            vergence = method(trial)
            seconds[name].append(time.perf_counter() - start)
            error[name] = float(np.median(np.abs(1 / np.maximum(vergence, 1e-3) / trial.distance - 1)))
    median = {name: statistics.median(times) for name, times in seconds.items()}
    ratios = [slow / fast for slow, fast in zip(seconds["plain"], seconds["ours"], strict=True)]
    return {
        "ours_s": median["ours"],
        "plain_s": median["plain"],
        "times_faster": median["plain"] / median["ours"],
        "times_faster_least": min(ratios),
        "times_faster_most": max(ratios),
        "ours_error": error["ours"],
        "plain_error": error["plain"],
    }


FRAMES: dict[str, tuple[list[Lens], float | None, float, float]] = {  # lenses, limit of the search, edges of the plane
    "apertures": (APERTURES, FOCUS, NEAR, FAR),
    "foci": (FOCI, None, 0.7, 1.6),
}


def full_frame(kind: str, shape: tuple[int, int]) -> dict[str, float]:
    """Return seconds and peak memory of one full frame, measured in this process."""
    import resource  # not available on all systems

    lenses, limit, near, far = FRAMES[kind]
    unit = 1 if sys.platform == "darwin" else 1024  # bytes on macOS, kibibytes elsewhere
    recover_depth(slanted(lenses, near, far, (96, 128), 16).views, near=limit)  # compiles
    trial = slanted(lenses, near, far, shape, 16)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
    start = time.perf_counter()
    depth = recover_depth(trial.views, near=limit)
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
    error = np.abs(depth.distance / trial.distance - 1)[depth.valid]
    return {
        "seconds": seconds,
        "peak_GB": peak / 1e9,
        "peak_before_GB": before / 1e9,
        "error": float(np.median(error)),
        "share_valid": float(depth.valid.mean()),
    }


def in_a_process(kind: str) -> dict[str, float]:
    done = subprocess.run([sys.executable, __file__, "--frame", kind], check=True, capture_output=True, text=True)
    found: dict[str, float] = json.loads(done.stdout)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description="recover_depth against plain blur equalisation")
    parser.add_argument("--repeat", type=int, default=5, help="runs of each, in turn (default 5)")
    parser.add_argument("--out", type=Path, help="also write the figures here, as JSON")
    parser.add_argument("--frame", choices=FRAMES, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.frame:
        print(json.dumps(full_frame(options.frame, (1080, 1920))))
        return

    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{os.cpu_count()} processors, load {load:.1f} at the start")
    print(f"\n640 x 480, two apertures, medians of {options.repeat} runs in turn; errors are medians over all pixels")
    print(f"{'':30}{'ours':>9}{'plain':>9}{'faster':>15}{'error':>10}{'plain':>9}")
    pairs = {}
    for name, trial in {
        "slanted plane, disc": slanted(APERTURES, NEAR, FAR, (480, 640), 256),
        "wall at 1.4 m, Gaussian": gaussian_wall(1.4, (480, 640)),
    }.items():
        found = pairs[name] = compare(trial, options.repeat)
        spread = f"({found['times_faster_least']:.1f}-{found['times_faster_most']:.1f})"
        print(
            f"{name:30}{found['ours_s']:7.2f} s{found['plain_s']:7.2f} s{found['times_faster']:5.1f} {spread:>9}"
            f"{100 * found['ours_error']:8.2f} %{100 * found['plain_error']:7.2f} %"
        )
    print(f"\n1920 x 1080, each in a process of its own\n{'':30}{'seconds':>9}{'peak':>10}{'error':>10}")
    frames = {}
    for kind in FRAMES:
        found = frames[kind] = in_a_process(kind)
        print(f"two {kind:26}{found['seconds']:7.2f} s{found['peak_GB']:7.2f} GB{100 * found['error']:8.2f} %")
    if options.out:
        figures = {"load": load, "processors": os.cpu_count(), "pairs_640x480": pairs, "frames_1920x1080": frames}
        options.out.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
