"""Views of textured walls made by filtering their spectra: a second way to make views, beside the ray caster."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient import Lens, View
from focalgradient.psf import pixel_transfer, transfer

PIXEL = 3.2e-4  # rad: 8 um behind 25 mm
SHAPE = (240, 320)
TILE = 512  # pixels from one copy of a texture to the next: wider than a view with its blur, so that nothing wraps


def lens(f_number: float, focus: float = 0.85) -> Lens:
    return Lens(focal_length=0.025, f_number=f_number, focus_distance=focus)


@dataclass(frozen=True)
class Camera:
    """Where what an undisturbed view shows at p is found, centre + scale R (p - centre) + shift, and how bright.

    R turns by `turn` radians, from right towards down.
    """

    scale: float = 1.0
    down: float = 0.0
    right: float = 0.0
    gain: float = 1.0
    turn: float = 0.0


def texture(seed: int, contrast: float = 0.2) -> NDArray[np.float64]:
    """A periodic field of mean 1 whose amplitude falls as 1/frequency."""
    frequency = np.hypot(np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE))
    frequency[0, 0] = np.inf
    white = np.fft.fft2(np.random.default_rng([seed, 0]).standard_normal((TILE, TILE)))
    field = np.fft.ifft2(np.where(frequency < 0.5, white / frequency, 0)).real
    return 1 + contrast * field / field.std()


def wall(
    lenses: Sequence[Lens],
    distance: float,
    *,
    seed: int = 0,
    psf: str = "disc",
    k: float = 0.5,
    noise: float = 0.01,
    field: NDArray[np.float64] | None = None,
    cameras: Sequence[Camera] | None = None,
) -> list[View]:
    """Views through `lenses` of a textured wall at `distance`, with noise of its own in each.

    The wall is a Fourier series, so that a view displaced or magnified by its camera is sampled from it exactly.
    """
    down, right = np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE)
    spectrum = np.fft.fft2(texture(seed) if field is None else field) / TILE**2 * pixel_transfer(down, right)
    views = []
    for number, (optics, camera) in enumerate(zip(lenses, cameras or [Camera()] * len(lenses), strict=True)):
        blurred = spectrum * transfer(np.hypot(down, right), optics.blur_radius(distance) / PIXEL, psf, k)
        rows, columns = (
            TILE / 2 + (np.arange(n) - (n - 1) / 2 - shift) / camera.scale
            for n, shift in zip(SHAPE, (camera.down, camera.right), strict=True)
        )
        image = (np.exp(2j * np.pi * rows[:, None] * right) @ blurred @ np.exp(2j * np.pi * down * columns)).real
        if camera.turn:
            image = _turned(blurred, rows - TILE / 2, columns - TILE / 2, camera.turn)
        random = np.random.default_rng([seed, 1 + number])
        image = camera.gain * (image + noise * random.standard_normal(SHAPE))
        views.append(View(image.astype(np.float32), optics, PIXEL))
    return views


def _turned(
    spectrum: NDArray[np.complex128], rows: NDArray[np.float64], columns: NDArray[np.float64], turn: float
) -> NDArray[np.float64]:
    """The series of `spectrum` at places turned back by `turn`: by quintic splines between four times its pixels."""
    fine = 4 * TILE
    padded = np.zeros((fine, fine), complex)
    at = np.fft.fftfreq(TILE, 1 / TILE).astype(int)
    padded[np.ix_(at, at)] = spectrum
    image = np.fft.ifft2(padded).real * fine**2
    down = np.cos(turn) * rows[:, None] - np.sin(turn) * columns
    right = np.cos(turn) * columns + np.sin(turn) * rows[:, None]
    places = 4 * np.stack([down + TILE / 2, right + TILE / 2])
    return ndimage.map_coordinates(image, places, order=5, mode="grid-wrap")
