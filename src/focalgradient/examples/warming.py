"""Compilation of the depth code in a parallel process: on first use, it is half of the time of a small depth map."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["compile_depth", "depth_compiling"]


@contextmanager
def depth_compiling() -> Iterator[None]:
    """Compile the code of depth in a parallel process, which is awaited on exit; it writes only compiled code."""
    command = [sys.executable, "-P", "-c", f"from {__name__} import compile_depth; compile_depth()"]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet) as beside:
        try:
            yield
            beside.wait()
        finally:
            beside.kill()


def compile_depth() -> None:
    """Compile the code of a depth map from two photographs, by computing a small one.

    The process ends when its parent closes its standard input.
    """
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    import numpy as np
    from scipy import ndimage

    from focalgradient.depth import recover_depth
    from focalgradient.optics import Lens
    from focalgradient.view import View

    texture = np.random.default_rng(0).uniform(0.1, 0.9, (96, 128))
    views = []
    for focus, sharp in zip((0.8, 1.6), (slice(64), slice(64, None)), strict=True):
        image = ndimage.gaussian_filter(texture, 2.0)
        image[:, sharp] = ndimage.gaussian_filter(texture, 0.3)[:, sharp]
        lens = Lens(0.025, 5.6, focus)
        views.append(View(image, lens, 8e-6 / lens.sensor_distance))
    recover_depth(views)
