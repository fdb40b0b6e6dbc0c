"""Photographs by a camera that is not quite as its marks say: written as files, for the commands to read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from textures import natural_spectrum

from focalgradient import Lens
from focalgradient.psf import PsfName, transfer

FOCAL, PITCH, SHAPE, TILE = 0.035, 20e-6, (224, 320), 512
MARKS = (4, 11)


@dataclass(frozen=True)
class RealCamera:
    """Marks off by `scale` and `focus`, blur of some shape, which vignetting varies over the field."""

    scale: float = 1.05  # effective f-numbers over the marks
    focus: float = 0.97  # m, where the mark says 1
    psf: PsfName = "disc"
    k: float = 0.5
    curvature: float = 0.06  # share of the blur from the middle to the sides

    def take(self, path: Path, distance: float, mark: float, *, seed: int, exposure: float = 1.0) -> Path:
        """An 8-bit sRGB file of a flat textured sheet, with photon and read noise."""
        random = np.random.default_rng([seed, int(mark)])
        frequency = np.hypot(np.fft.fftfreq(TILE)[:, None], np.fft.rfftfreq(TILE))
        spectrum = natural_spectrum((TILE, TILE), np.random.default_rng(seed), 0.12) * np.sinc(frequency)
        lens = Lens(FOCAL, mark * self.scale, self.focus)
        height, width = SHAPE
        y, x = np.mgrid[:height, :width]
        across, down = (2 * x + 1 - width) / width, (2 * y + 1 - height) / width
        aperture = lens.aperture_diameter * (1 + self.curvature * (across**2 + down**2))
        radius = aperture / 2 * np.abs(lens.focus_vergence - 1 / distance) / (PITCH / lens.sensor_distance)
        radii = np.linspace(radius.min(), radius.max() + 1e-3, 8)
        blurred = np.stack([self._blurred(spectrum, frequency, one) for one in radii])
        place = np.clip((radius - radii[0]) / (radii[1] - radii[0]), 0, 6.999)
        low = place.astype(int)
        light = blurred[low, y, x] * (low + 1 - place) + blurred[low + 1, y, x] * (place - low)
        light = exposure * (0.4 + light)
        light += random.standard_normal(SHAPE) * np.sqrt(1e-5 + 2e-5 * np.clip(light, 0, 1))
        return write(path, encoded(light))

    def _blurred(
        self, spectrum: NDArray[np.complex128], frequency: NDArray[np.float64], radius: float
    ) -> NDArray[np.float64]:
        image = np.fft.irfft2(spectrum * transfer(frequency, radius, self.psf, self.k))
        return image[90 : 90 + SHAPE[0], 70 : 70 + SHAPE[1]]


def encoded(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """sRGB values, 0 to 1 (IEC 61966-2-1)."""
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def write(path: Path, values: NDArray[np.float64]) -> Path:
    path.write_bytes(cv2.imencode(path.suffix, np.rint(255 * values).astype(np.uint8))[1].tobytes())
    return path


def targets(folder: Path, camera: RealCamera, distances: tuple[float, ...], head: str = "") -> Path:
    """TARGETS.toml and its photographs of sheets at some distances."""
    text = f"[camera]\nfocal_length_mm = 35\npixel_pitch_um = 20\n{head}"
    for number, distance in enumerate(distances):
        for mark in MARKS:
            path = camera.take(folder / f"{distance}_{mark}.png", distance, mark, seed=number)
            text += (
                f'[[view]]\nimage = "{path.name}"\ndistance_m = {distance}\nf_number = {mark}\nfocus_distance_m = 1.0\n'
            )
    (folder / "targets.toml").write_text(text)
    return folder / "targets.toml"
