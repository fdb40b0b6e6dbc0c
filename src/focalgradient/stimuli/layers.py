"""Building blocks of drawn stimuli: blurred layers, random textures, and occlusion between layers.

A layer has radiance and coverage. A near layer occludes a far one, which continues behind it, by its *blurred*
coverage: radiance = near + (1 - coverage) far, in linear radiance. Each layer is blurred independently. This is exact
if either layer is in focus; if both are blurred, it treats the two blurs as independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_list, check_one_of
from focalgradient.optics import Side
from focalgradient.psf import Psf
from focalgradient.render.wireframe import EXTENT_SD
from focalgradient.scenes.texture import NATURAL_SLOPE, random_field

__all__ = [
    "CLIP",
    "blurred",
    "check_equalise",
    "coverage",
    "equalised",
    "fineness",
    "noise",
    "reach_of",
    "same_spectrum",
    "standard",
]

Equal = ("luminance", "contrast", "spectrum")
"""Properties that can be equalised."""

COARSE_PX, FINE_FACTOR = 1.5, 4
"""Blur (px) below which edges are blurred on a grid finer by this factor: on the pixel grid they would ring by 1 %."""

CLIP = 3.0
"""Standard deviations at which a Gaussian texture is clipped, to limit its range: affects 0.3 % of the pixels."""


def reach_of(sd_px: float) -> int:
    """Return the extent in pixels of blur with this standard deviation (px)."""
    return math.ceil(EXTENT_SD * sd_px) + 2


def blurred(image: NDArray[np.floating], sd_px: float, psf: Psf, side: Side = "beyond") -> FloatArray:
    """Blur a periodic picture by the exact transfer at every frequency of the grid, with unit gain at frequency 0.

    >>> from focalgradient.psf import Gaussian
    >>> wave = np.cos(2 * np.pi * 0.125 * np.arange(16)) * np.ones((16, 1))
    >>> bool(np.isclose(blurred(wave, 2.0, Gaussian())[0, 0], np.exp(-2 * (np.pi * 2.0 * 0.125) ** 2)))
    True
    """
    light: FloatArray = np.asarray(image, np.float64)
    if sd_px == 0:
        return light
    rows, columns = light.shape
    otf = psf.optical_transfer(fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None], psf.radius_of(sd_px))
    return fft.irfft2(fft.rfft2(light) * (np.conj(otf) if side == "nearer" else otf), s=light.shape)


def coverage(fine: NDArray[np.floating], factor: int, sd_px: float, psf: Psf, side: Side = "beyond") -> FloatArray:
    """Return the blurred coverage of pixels, 0 to 1, from coverage on a grid finer by `factor`."""
    spread = np.clip(blurred(fine, sd_px * factor, psf, side), 0, 1)
    rows, columns = fine.shape
    return spread.reshape(rows // factor, factor, columns // factor, factor).mean(axis=(1, 3))


def fineness(sd_px: float) -> int:
    """Return the factor by which the grid for blurring edges is finer than the pixels."""
    return FINE_FACTOR if 0 < sd_px < COARSE_PX else 1


def noise(shape: tuple[int, int], seed: Any, slope: float = NATURAL_SLOPE) -> FloatArray:
    """Return a periodic Gaussian random texture with mean 0, standard deviation 1 and amplitude spectrum 1/f^slope.

    It is clipped at 3 standard deviations, then standardised again.

    >>> texture = noise((64, 64), seed=1)
    >>> round(float(texture.std()), 6), bool(np.abs(texture).max() < 3.1)
    (1.0, True)
    """
    return standard(np.clip(random_field(shape, seed, slope=slope), -CLIP, CLIP))


def standard(field: FloatArray, part: Any = ...) -> FloatArray:
    """Return a field standardised to mean 0 and standard deviation 1 within a part of it; 0 if that is uniform."""
    inside = field[part]
    spread = float(inside.std())
    return (field - inside.mean()) / spread if spread > 0 else np.zeros(field.shape)


def same_spectrum(picture: FloatArray, of: FloatArray) -> FloatArray:
    """Return a picture with the amplitude spectrum of another and its own phase spectrum.

    >>> one, other = noise((32, 32), 1), noise((32, 32), 2)
    >>> made = same_spectrum(one, other)
    >>> bool(np.allclose(np.abs(np.fft.fft2(made)), np.abs(np.fft.fft2(other))))
    True
    """
    waves = fft.rfft2(picture)
    amplitude = np.abs(waves)
    phase = np.where(amplitude > 0, waves / np.where(amplitude > 0, amplitude, 1), 1)
    return fft.irfft2(np.abs(fft.rfft2(of)) * phase, s=picture.shape)


def check_equalise(equalise: Any) -> tuple[str, ...]:
    """Return the validated names of the properties to equalise."""
    names = check_list("equalise", equalise, "names")
    for name in names:
        check_one_of("equalise", name, Equal)
    return tuple(name for name in Equal if name in names)


def equalised(picture: FloatArray, sharp: FloatArray, equalise: Sequence[str], mean: float) -> FloatArray:
    """Return a picture equalised to its sharp version in amplitude spectrum, mean luminance and RMS contrast.

    Raises
    ------
    InputError
        If radiance would leave the range 0 to 1.
    """
    made = picture
    if "spectrum" in equalise:
        made = same_spectrum(made, sharp)
    if "contrast" in equalise:
        made = made.mean() + standard(made) * sharp.std()
    if "luminance" in equalise:
        made = made - made.mean() + sharp.mean()
    if made.min() < -1e-9 or made.max() > 1 + 1e-9:
        most = min(mean / (mean - made.min()), (1 - mean) / (made.max() - mean)) if equalise else 1.0
        raise InputError(
            f"equalising {' and '.join(equalise)} takes radiance to {made.min():.3g} to {made.max():.3g}, but it must "
            f"stay within 0 to 1: multiply contrast by {max(0.0, math.floor(95 * most) / 100):.2g}."
        )
    return np.clip(made, 0, 1)
