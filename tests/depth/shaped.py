"""Views of textured walls blurred over the plane of frequencies: by a shape, turned nearer than focus, or by any."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from textures import natural_spectrum

from focalgradient import Lens, View
from focalgradient.psf import Psf, pixel_transfer

PIXEL = 3.2e-4  # rad
FROM_ONE_FOCUS = [Lens(0.025, number, 0.85) for number in (16, 4)]
FOCI = [Lens(0.025, 5, focus) for focus in (0.7, 1.1)]


def filtered(
    lenses: Sequence[Any],
    blur: Callable[[Any, Any, Any], Any],
    *,
    seed: int = 1,
    shape: tuple[int, int] = (160, 160),
    noise: float | Sequence[float] = 0.005,
    pixel: float = PIXEL,
) -> list[View]:
    """Views of 1/f texture wider than the frame, blurred by `blur` of frequency down and right (1/px) and the lens."""
    random, size = np.random.default_rng(seed), (shape[0] + 96, shape[1] + 96)
    down, right = np.fft.fftfreq(size[0])[:, None], np.fft.rfftfreq(size[1])
    spectrum = natural_spectrum(size, random) * pixel_transfer(down, right)
    seen = []
    for lens, sd in zip(lenses, np.broadcast_to(noise, len(lenses)), strict=True):
        image = 1 + np.fft.irfft2(spectrum * blur(down, right, lens), size)[48:-48, 48:-48]
        seen.append(View((image + sd * random.standard_normal(shape)).astype(np.float32), lens, pixel))
    return seen


def walls(shape: Psf, lenses: Sequence[Lens], distance: float, *, seed: int = 1) -> list[View]:
    """Views through `lenses` of a wall at `distance`, with 0.5 % noise."""

    def blur(down: np.ndarray, right: np.ndarray, lens: Lens) -> np.ndarray:
        found = shape.optical_transfer(down, right, float(lens.blur_radius(distance)) / PIXEL)
        return np.conj(found) if distance < lens.focus_distance else found

    return filtered(lenses, blur, seed=seed)
