"""Views of textured walls blurred by a shape over the plane of frequencies, turned nearer than focus."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from textures import natural_spectrum

from focalgradient import Lens, View
from focalgradient.psf import Psf, pixel_transfer

PIXEL = 3.2e-4  # rad
FROM_ONE_FOCUS = [Lens(0.025, number, 0.85) for number in (16, 4)]
FOCI = [Lens(0.025, 5, focus) for focus in (0.7, 1.1)]


def walls(shape: Psf, lenses: Sequence[Lens], distance: float, *, seed: int = 1, side: int = 160) -> list[View]:
    """Views through `lenses` of a wall of 1/f texture at `distance`, with 0.5 % noise."""
    random, size = np.random.default_rng(seed), side + 96
    down, right = np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)
    spectrum = natural_spectrum((size, size), random)
    seen = []
    for lens in lenses:
        blur = shape.optical_transfer(down, right, float(lens.blur_radius(distance)) / PIXEL)
        if distance < lens.focus_distance:
            blur = np.conj(blur)
        image = np.fft.irfft2(spectrum * blur * pixel_transfer(down, right), (size, size))[48:-48, 48:-48]
        image = 1 + image + 0.005 * random.standard_normal(image.shape)
        seen.append(View(image.astype(np.float32), lens, PIXEL))
    return seen
