"""Speed of the real-time form compared with the same pipeline of separate calls, and accuracy of its depth.

    python benchmarks/realtime.py [--repeat 15] [--stream] [--out FILE.json]

The reference implementations compute the steps listed in the paper, one call per operation: the Laplacian of each view,
its square, its mean over 4 x 4 pixels, a Gaussian of the view for local brightness, and the divisions; in OpenCV on two
threads, and in scipy.ndimage. All run alternately on the same images in one process, so that ratios are meaningful on a
busy machine. A copy of the same bytes gives the limit of memory bandwidth. Then errors are printed: of the bands under
Gaussian blur, and of depth on a slanted plane. ``--stream`` adds the memory use of `focalgradient stream` for a short
and for a long video.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from recover_depth import APERTURES, FAR, FOCUS, NEAR
from scipy import ndimage

from focalgradient import Lens, recover_depth
from focalgradient.depth.ratio.disparity import BRIGHTNESS, focal_disparity, read_depth, table_for
from focalgradient.depth.ratio.table import DisparityTable
from focalgradient.depth.search import Search
from focalgradient.parallel import MOST_THREADS, cores
from focalgradient.psf import pixel_transfer, transfer
from focalgradient.render import cast, noisy
from focalgradient.scenes import slant
from focalgradient.scenes.texture import Texture

Image = NDArray[Any]

FULL = (1080, 1920)
PAPER = (256, 256)  # pixels, processed in half a second in 1987
PIXEL = 8e-6 / APERTURES[0].sensor_distance


def textured(shape: tuple[int, int]) -> list[Image]:
    """Return two float32 images with the values of 8-bit video: 1/f texture, and a blurred version."""
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    frequency[0, 0] = np.inf
    white = np.random.default_rng(1).standard_normal(shape)
    field = np.fft.irfft2(np.fft.rfft2(white) / frequency, shape)
    sharp = 128 + 30 * field / field.std()
    return [np.rint(np.clip(i, 1, 255)).astype(np.float32) for i in (sharp, ndimage.gaussian_filter(sharp, 2.0))]


def opencv(small: Image, large: Image) -> Image:
    """Compute the paper's steps, one call of OpenCV each."""
    contents = []
    for image in (small, large):
        second = cv2.Laplacian(image, cv2.CV_32F)
        energy = cv2.multiply(second, second)
        squares = cv2.resize(energy, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        light = cv2.GaussianBlur(image, (0, 0), BRIGHTNESS)
        light = cv2.resize(light, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA, dst=None)
        contents.append(cv2.divide(cv2.sqrt(squares), np.asarray(light, np.float32)))
    disparity = cv2.divide(contents[1], contents[0])
    disparity[contents[0] < 0.01] = 0
    return disparity


def opencv_reduced(small: Image, large: Image) -> Image:
    """Compute the same with our shortcut: the Gaussian over the means of 4 x 4 pixels."""
    contents = []
    for image in (small, large):
        second = cv2.Laplacian(image, cv2.CV_32F)
        energy = cv2.multiply(second, second)
        squares = cv2.resize(energy, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        light = cv2.resize(image, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        light = cv2.GaussianBlur(np.asarray(light, np.float32), (0, 0), BRIGHTNESS / 4)
        contents.append(cv2.divide(cv2.sqrt(squares), light))
    disparity = cv2.divide(contents[1], contents[0])
    disparity[contents[0] < 0.01] = 0
    return disparity


def scipy(small: Image, large: Image) -> Image:
    """Compute the paper's steps with scipy.ndimage."""
    contents = []
    for image in (small, large):
        image = image.astype(np.float32, copy=False)
        energy = ndimage.uniform_filter(ndimage.laplace(image) ** 2, 4)[2::4, 2::4]
        light = ndimage.gaussian_filter(image, BRIGHTNESS)[2::4, 2::4]
        contents.append(np.sqrt(energy) / light)
    return np.where(contents[0] < 0.01, 0, contents[1] / np.maximum(contents[0], 1e-6))


def speeds(shape: tuple[int, int], repeat: int) -> dict[str, dict[str, float]]:
    """Return median and minimum milliseconds of each implementation, run alternately, for float32 and uint8 images."""
    floats = textured(shape)
    stored = [image.astype(np.uint8) for image in floats]
    spare = [np.empty_like(image) for image in (*floats, *stored)]
    search = Search.over(APERTURES, PIXEL, FOCUS, None)
    table = table_for(search, "disc", 0.5)

    def copy(images: list[Image], to: list[Image]) -> None:
        for image, place in zip(images, to, strict=True):
            np.copyto(place, image)

    ways: dict[str, Callable[[], Any]] = {}
    for kind, images, to in (("float32", floats, spare[:2]), ("uint8", stored, spare[2:])):
        one, other = images
        ways |= {
            f"copy of both, {kind}": partial(copy, images, to),
            f"focal_disparity, {kind}": partial(focal_disparity, one, other),
            f"the paper's |Laplacian|, {kind}": partial(focal_disparity, one, other, absolute=True),
            f"with a window of 8 px, {kind}": partial(focal_disparity, one, other, window=8),
            f"depth from four bands, {kind}": partial(read_depth, one, other, table, search),
            f"OpenCV, {kind}": partial(opencv, one, other),
            f"OpenCV with our short cut, {kind}": partial(opencv_reduced, one, other),
            f"scipy.ndimage, {kind}": partial(scipy, one, other),
        }
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for way in ways.values():
        way()
    for _ in range(repeat):
        for name, way in ways.items():
            way()  # as in a video, where the preceding frame has warmed the caches
            start = time.perf_counter()
            way()
            taken[name].append(1e3 * (time.perf_counter() - start))
    return {name: {"median_ms": statistics.median(t), "least_ms": min(t)} for name, t in taken.items()}


def band_errors(sigma: float, noise: float = 0.01, tries: int = 4) -> dict[str, list[float]]:
    """Return the RMS error (%) of sigma, by each band and by all, and the fraction of valid places.

    The blur is Gaussian, of sigma and sigma / 2. The scene is a wall of 1/f texture with a contrast of 0.2, averaged in
    a window of 8 pixels; valid: a stated relative SD below one half.
    """
    lenses = [Lens(0.025, number, 1.0) for number in (8, 4)]
    defocus = sigma / 0.5 / (lenses[1].aperture_diameter / 2 / PIXEL)
    search = Search.over(lenses, PIXEL, 1.0, None)
    size = (384, 384)
    down, right = np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1])
    frequency = np.hypot(down, right)
    natural = np.where((frequency > 0) & (frequency <= 0.5), 1 / np.maximum(frequency, 1e-9), 0)
    found: dict[str, list[tuple[float, float]]] = {}
    for seed in range(tries):
        random = np.random.default_rng(seed)
        spectrum = np.fft.rfft2(random.standard_normal(size)) * natural
        scale = 0.2 / np.fft.irfft2(spectrum, size).std()
        images = []
        for lens in lenses:
            gain = transfer(frequency, defocus * lens.aperture_diameter / 2 / PIXEL, "gaussian")
            seen = spectrum * gain * pixel_transfer(down, right)
            image = 1 + scale * np.fft.irfft2(seen, size) + noise * random.standard_normal(size)
            images.append(image.astype(np.float32))
        for bands in ((1,), (2,), (4,), (8,), (1, 2, 4, 8)):
            table = DisparityTable.of(lenses, PIXEL, psf="gaussian", bands=bands)
            vergence, sd, _ = read_depth(images[0], images[1], table, search, noise=noise, least=0)
            valid = sd < 0.5 * defocus
            error = (1 - vergence[valid]) / defocus - 1
            rms = 100 * float(np.sqrt(np.mean(error**2))) if valid.any() else float("nan")
            found.setdefault("+".join(map(str, bands)), []).append((rms, float(valid.mean())))
    return {name: np.mean(values, axis=0).tolist() for name, values in found.items()}


def plane_errors(texture: Texture, shape: tuple[int, int] = (240, 320)) -> dict[str, dict[str, float]]:
    """Return median distance error (%), fractions valid and within 2 SD, for the slanted plane by noise level."""
    scene = slant(NEAR, FAR, shape[1] * PIXEL, seed=1, texture=texture)
    casts = [cast(scene, lens, shape, PIXEL, samples=256) for lens in APERTURES]
    rows = {}
    for noise in (0.002, 0.01, 0.03):
        sd = noise * float(casts[0].view.image.mean())
        views = [noisy(one.view, sd, seed) for seed, one in enumerate(casts)]
        depth = recover_depth(views, near=FOCUS, method="ratio")
        error = (depth.distance / casts[0].distance - 1)[depth.valid]
        away = (depth.vergence - 1 / casts[0].distance)[depth.valid] / depth.vergence_sd[depth.valid]
        rows[f"{100 * noise:g} %"] = {
            "median_error_percent": 100 * float(np.median(np.abs(error))),
            "bias_percent": 100 * float(np.median(error)),
            "share_valid": float(depth.valid.mean()),
            "within_2_sd": float(np.mean(np.abs(away) <= 2)),
        }
    return rows


def stream_memory(frames: int, shape: tuple[int, int] = (480, 640)) -> dict[str, float]:
    """Return peak memory (MB) and frames per second of `focalgradient stream` on a video of `frames` frames."""
    program = (
        "import resource, sys; from focalgradient.cli import main\n"
        "try: main(sys.argv[1:])\n"
        "except SystemExit: pass\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"
    )
    optics = ["--focal-length=25", "--f-number=16", "--f-number=5.6", "--focus-distance=0.85", "--pixel-pitch=8"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "video.avi")
        images = [np.repeat(image.astype(np.uint8)[..., None], 3, axis=2) for image in textured(shape)]
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30, (shape[1], shape[0]))
        for number in range(frames):
            writer.write(images[number % 2])
        writer.release()
        asked = ["stream", str(path), "--out", str(Path(folder, "depth.avi")), *optics]
        done = subprocess.run([sys.executable, "-c", program, *asked], check=True, capture_output=True, text=True)
        summary = json.loads(Path(folder, "depth.json").read_text())
    return {"peak_MB": float(done.stdout.split()[-1]), "fps": summary["fps_of_processing"]}


def main() -> None:
    parser = argparse.ArgumentParser(description="the real-time form against OpenCV, scipy.ndimage and a plain copy")
    parser.add_argument("--repeat", type=int, default=15, help="runs of each, in turn (default 15)")
    parser.add_argument("--stream", action="store_true", help="also measure the memory of focalgradient stream")
    parser.add_argument("--out", type=Path, help="also write the figures here, as JSON")
    options = parser.parse_args()

    threads = min(MOST_THREADS, cores())
    cv2.setNumThreads(threads)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(
        f"{threads} threads, load {load:.1f} at the start; medians of {options.repeat} runs in turn, least in brackets"
    )
    figures: dict[str, Any] = {"threads": threads, "load": load}
    for shape in (FULL, PAPER):
        found = figures[f"{shape[1]}x{shape[0]}"] = speeds(shape, options.repeat)
        print(f"\n{shape[1]} x {shape[0]}{'':34}ms{'least':>10}{'x ours':>10}{'a second':>10}")
        for name, taken in found.items():
            ours = found[f"focal_disparity, {name.rsplit(', ', 1)[1]}"]["median_ms"]
            ms = taken["median_ms"]
            print(f"{name:38}{ms:9.2f}{taken['least_ms']:10.2f}{ms / ours:10.2f}{1e3 / ms:10.0f}")
    print("\nGaussian blur of sigma and sigma / 2, 1 % noise: RMS error of sigma (%) by bands, in pixels (share valid)")
    figures["bands"] = {}
    for sigma in (1.0, 2.0, 3.0, 4.0):
        errors = figures["bands"][f"sigma {sigma:g}"] = band_errors(sigma)
        print(
            f"sigma {sigma:g}:  "
            + "   ".join(f"{name} {error:.1f} ({valid:.0%})" for name, (error, valid) in errors.items())
        )
    print("\nslanted plane, f/16 and f/5.6, 0.9 to 2.2 m: median error, bias, share valid, within 2 sd")
    figures["plane"] = {}
    for label, texture in {
        "texture of the scenes": Texture(texel=0.3e-3, projected=True),
        "twice as coarse": Texture(texel=0.6e-3, projected=True),
        "twice as fine": Texture(texel=0.15e-3, projected=True),
        "contrast 5 %": Texture(texel=0.3e-3, projected=True, contrast=0.05),
    }.items():
        rows = figures["plane"][label] = plane_errors(texture)
        for noise, row in rows.items():
            print(
                f"{label:24} noise {noise:6}{row['median_error_percent']:6.2f} %{row['bias_percent']:+7.2f} %"
                f"{row['share_valid']:7.2f}{row['within_2_sd']:7.2f}"
            )
    if options.stream:
        print("\nfocalgradient stream, from start to end")
        figures["stream"] = {}
        for frames, shape in ((100, (480, 640)), (1000, (480, 640)), (200, FULL)):
            taken = stream_memory(frames, shape)
            figures["stream"][f"{frames} frames of {shape[1]}x{shape[0]}"] = taken
            print(
                f"{frames:5} frames of {shape[1]} x {shape[0]}: peak {taken['peak_MB']:.0f} MB, "
                f"{taken['fps']:.1f} frames a second"
            )
    if options.out:
        options.out.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
