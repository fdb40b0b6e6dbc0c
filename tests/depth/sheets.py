"""Flat sheets of known reflectance and distance, as two photographs through two apertures, stored or not."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from textures import natural_spectrum

from focalgradient import Lens, View
from focalgradient.psf import pixel_transfer, transfer
from focalgradient.srgb import linear_to_srgb, srgb_to_linear

PIXEL, TILE = 3.2e-4, 512


def natural(random: np.random.Generator) -> NDArray[np.float64]:
    """Reflectance of amplitude 1/f."""
    return np.clip(0.4 + np.fft.irfft2(natural_spectrum((TILE, TILE), random, 0.1)), 0.02, 0.95)


def views(sheet: NDArray[np.float64], distance: float, quality: int | None) -> list[View]:
    """The sheet at f/16 and f/4, focused at 0.85 m; as JPEG of a quality, or as the light itself."""
    down, right = np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE)
    spectrum = np.fft.fft2(sheet) * pixel_transfer(down, right)
    made = []
    for number, lens in enumerate(Lens(0.025, n, 0.85) for n in (16, 4)):
        blur = transfer(np.hypot(down, right), lens.blur_radius(distance) / PIXEL, "disc")
        light = np.fft.ifft2(spectrum * blur).real[60:360, 50:450]
        light += np.random.default_rng(number).standard_normal(light.shape) * np.sqrt(1e-5 + 3e-5 * light.clip(0))
        made.append(View(light if quality is None else stored(light, quality), lens, PIXEL))
    return made


def stored(light: NDArray[np.float64], quality: int) -> NDArray[np.float32]:
    pixels = np.rint(255 * linear_to_srgb(light.clip(0, 1))).astype(np.uint8)
    data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return srgb_to_linear(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) / 255).astype(np.float32)
