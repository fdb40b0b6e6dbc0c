"""Speed of drawing frames of the Necker cube, compared with NumPy in the same run.

    python benchmarks/necker_frames.py [--repeat 5] [--out FILE.json]

The reference implementation evaluates the same closed form with NumPy and SciPy, for each edge over the whole frame,
with sigma linear from end to end: it ignores how line width and defocus add up in between, and differs by that. Both
are run alternately, so that their ratio is meaningful on a busy machine; processor time excludes the use by other
processes.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from focalgradient.psf.shapes import PIXEL_VARIANCE
from focalgradient.render.wireframe import WIDTH, Gradient, blur_at, necker_frame
from focalgradient.scenes.necker import EDGES, NeckerCube

CUBE = NeckerCube(line_width=math.radians(0.07))
SHAPE = (512, 512)
PIXEL_ANGLE = math.radians(16) / 512  # the frame contains the whole cube
FRAMES = 24  # frames of a quarter turn per run
CASES: dict[str, tuple[Gradient, float]] = {  # aperture in metres
    "none": ("none", 0.0),
    "rigid, 4 mm": ("rigid", 0.004),
    "nonrigid, 4 mm": ("nonrigid", 0.004),
    "nonrigid, 10 mm": ("nonrigid", 0.010),
    "nonrigid, 20 mm": ("nonrigid", 0.020),
    "nonrigid, 30 mm": ("nonrigid", 0.030),
}


def ours(turn: float, gradient: Gradient, aperture: float) -> NDArray[np.float32]:
    return necker_frame(CUBE, turn, shape=SHAPE, pixel_angle=PIXEL_ANGLE, gradient=gradient, aperture=aperture)


def plain(turn: float, gradient: Gradient, aperture: float) -> NDArray[np.float32]:
    """Draw the frame with NumPy."""
    lines = CUBE.project(CUBE.vertices(turn))[EDGES] / PIXEL_ANGLE + (np.array(SHAPE[::-1]) - 1) / 2
    width = CUBE.line_width / WIDTH / PIXEL_ANGLE
    blur = np.zeros(EDGES.shape)
    if gradient != "none":
        blur = blur_at(CUBE, CUBE.seen(turn, gradient)[EDGES, 2], aperture=aperture) / PIXEL_ANGLE
    sigma = np.sqrt(blur**2 + width**2 + PIXEL_VARIANCE)
    rows, columns = np.indices(SHAPE)
    image = np.zeros(SHAPE)
    for (start, end), (a, z) in zip(lines, sigma, strict=True):
        length = np.linalg.norm(end - start)
        dx, dy = (end - start) / length
        b = (z - a) / length
        x, y = columns - start[0], rows - start[1]
        qx, qy = b * x + a * dx, b * y + a * dy
        q = np.hypot(qx, qy)
        first = (qx * x + qy * y) / (math.sqrt(2) * a * q)
        last = (qx * (x - length * dx) + qy * (y - length * dy)) / (math.sqrt(2) * z * q)
        image += np.exp(-(((x * dy - y * dx) / q) ** 2) / 2) * (erf(first) - erf(last)) / q
    return (image * width / 2).astype(np.float32)


def compare(gradient: Gradient, aperture: float, repeat: int) -> dict[str, float]:
    """Return milliseconds per frame (medians of alternating runs, wall and processor time) and largest difference."""
    turns = [0.25 * i / FRAMES for i in range(FRAMES)]
    methods: dict[str, tuple[Callable[..., NDArray[np.float32]], list[float]]] = {
        "ours": (ours, turns),
        "plain": (plain, turns[:: FRAMES // 3]),
    }
    ours(0.0, gradient, aperture)  # compiles
    wall: dict[str, list[float]] = {"ours": [], "plain": []}
    work: dict[str, list[float]] = {"ours": [], "plain": []}
    for _ in range(repeat):
        for name, (method, moments) in methods.items():
            start, worked = time.perf_counter(), time.process_time()
            for turn in moments:
                method(turn, gradient, aperture)
            wall[name].append(1e3 * (time.perf_counter() - start) / len(moments))
            work[name].append(1e3 * (time.process_time() - worked) / len(moments))
    ratios = [slow / fast for slow, fast in zip(wall["plain"], wall["ours"], strict=True)]
    pictures = [method(0.1, gradient, aperture) for method in (ours, plain)]
    return {
        "greatest_blur_sd_px": float(blur_at(CUBE, CUBE.farthest, aperture=aperture)) / PIXEL_ANGLE,
        "ours_ms": statistics.median(wall["ours"]),
        "ours_processor_ms": statistics.median(work["ours"]),
        "plain_ms": statistics.median(wall["plain"]),
        "times_faster": statistics.median(ratios),
        "times_faster_least": min(ratios),
        "times_faster_most": max(ratios),
        "largest_difference_percent_of_peak": 100 * float(np.abs(pictures[0] - pictures[1]).max() / pictures[0].max()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="frames of the Necker cube against plain NumPy")
    parser.add_argument("--repeat", type=int, default=5, help="runs of each, in turn (default 5)")
    parser.add_argument("--out", type=Path, help="also write the figures here, as JSON")
    options = parser.parse_args()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    print(f"{os.cpu_count()} processors, load {load:.1f} at the start; {SHAPE[1]} x {SHAPE[0]}, milliseconds a frame")
    print(f"{'':18}{'blur':>9}{'ours':>8}{'processor':>12}{'plain':>9}{'faster':>16}{'differ':>9}")
    figures: dict[str, Any] = {}
    for name, (gradient, aperture) in CASES.items():
        found = figures[name] = compare(gradient, aperture, options.repeat)
        spread = f"({found['times_faster_least']:.0f}-{found['times_faster_most']:.0f})"
        print(
            f"{name:18}{found['greatest_blur_sd_px']:6.2f} px{found['ours_ms']:8.2f}"
            f"{found['ours_processor_ms']:12.2f}{found['plain_ms']:9.0f}"
            f"{found['times_faster']:7.0f} {spread:>8}{found['largest_difference_percent_of_peak']:7.2f} %"
        )
    if options.out:
        numbers = {"load": load, "processors": os.cpu_count(), "cases": figures}
        options.out.write_text(json.dumps(numbers, indent=2) + "\n")


if __name__ == "__main__":
    main()
