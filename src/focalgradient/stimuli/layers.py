"""Blur of whole layers, random textures, and layers over one another: what the drawn stimuli are composed of.

A layer has light and coverage. What lies in front hides by its *blurred* coverage what lies behind, which goes on
complete behind it: light = near + (1 - coverage) far, in linear light. Each is blurred by its own blur alone. That is
exact where either of the two is in focus; where both are blurred it takes the two blurs as independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from focalgradient.errors import InputError, check_list
from focalgradient.optics import Side
from focalgradient.psf import Psf

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
"""What can be equalised over blur."""

REACH = 5.0
"""Standard deviations to which a Gaussian is followed: 6e-7 of its light lies beyond."""

COARSE_PX, FINE = 1.5, 4
"""Blur (px) below which edges are blurred on a grid this many times finer: on that of the pixels they ring by 1 %."""

CLIP = 3.0
"""Standard deviations at which a Gaussian texture is clipped, so that its light stays in range: 0.3 % of its pixels."""


def reach_of(sd_px: float) -> int:
    """Pixels to which a blur of this standard deviation reaches."""
    return math.ceil(REACH * sd_px) + 2


def blurred(image: NDArray[np.floating], sd_px: float, psf: Psf, side: Side = "beyond") -> NDArray[np.float64]:
    """Blur a picture, taken as periodic, by its exact transfer at every frequency of the grid; light is kept.

    >>> from focalgradient.psf import Gaussian
    >>> wave = np.cos(2 * np.pi * 0.125 * np.arange(16)) * np.ones((16, 1))
    >>> bool(np.isclose(blurred(wave, 2.0, Gaussian())[0, 0], np.exp(-2 * (np.pi * 2.0 * 0.125) ** 2)))
    True
    """
    light: NDArray[np.float64] = np.asarray(image, np.float64)
    if sd_px == 0:
        return light
    rows, columns = light.shape
    otf = psf.optical_transfer(fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None], psf.radius_of(sd_px))
    return fft.irfft2(fft.rfft2(light) * (np.conj(otf) if side == "nearer" else otf), s=light.shape)


def coverage(
    fine: NDArray[np.floating], factor: int, sd_px: float, psf: Psf, side: Side = "beyond"
) -> NDArray[np.float64]:
    """Blurred coverage of pixels, from coverage on a grid that is finer by `factor`; within 0 to 1."""
    spread = np.clip(blurred(fine, sd_px * factor, psf, side), 0, 1)
    rows, columns = fine.shape
    return spread.reshape(rows // factor, factor, columns // factor, factor).mean(axis=(1, 3))


def fineness(sd_px: float) -> int:
    """How many times finer than the pixels edges of this blur are blurred."""
    return FINE if 0 < sd_px < COARSE_PX else 1


def noise(shape: tuple[int, int], seed: Any, slope: float = 1.0) -> NDArray[np.float64]:
    """Random Gaussian texture, periodic, mean 0 and standard deviation 1, whose amplitude falls as 1/f^slope.

    It is clipped at 3 standard deviations, then brought to mean 0 and standard deviation 1 again.

    >>> texture = noise((64, 64), seed=1)
    >>> round(float(texture.std()), 6), bool(np.abs(texture).max() < 3.1)
    (1.0, True)
    """
    rows, columns = shape
    white = fft.rfft2(np.random.default_rng(seed).standard_normal(shape))
    frequency = np.hypot(fft.fftfreq(rows)[:, None], fft.rfftfreq(columns)[None])
    frequency[0, 0] = np.inf
    field: NDArray[np.float64] = fft.irfft2(white / frequency**slope, s=shape)
    return standard(np.clip(field / field.std(), -CLIP, CLIP))


def standard(field: NDArray[np.float64]) -> NDArray[np.float64]:
    """A field with mean 0 and standard deviation 1; 0 where it is uniform."""
    spread = float(field.std())
    return (field - field.mean()) / spread if spread > 0 else np.zeros(field.shape)


def same_spectrum(picture: NDArray[np.float64], of: NDArray[np.float64]) -> NDArray[np.float64]:
    """The picture with the amplitude of another at each spatial frequency, and its own phase.

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
    """The names of what is to be equalised, refused unless each can be."""
    names = check_list("equalise", equalise, "names")
    for name in names:
        if name not in Equal:
            raise InputError(f"equalise has {name!r}, but must be some of {', '.join(Equal)}.")
    return tuple(name for name in Equal if name in names)


def equalised(
    picture: NDArray[np.float64], sharp: NDArray[np.float64], equalise: Sequence[str], mean: float
) -> NDArray[np.float64]:
    """A picture made alike to its sharp version: in amplitude spectrum, in mean luminance, in RMS contrast.

    Raises
    ------
    InputError
        If light would leave 0 to 1.
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
            f"equalising {' and '.join(equalise)} takes light to {made.min():.3g} to {made.max():.3g}, but it must "
            f"stay within 0 to 1: multiply contrast by {max(0.0, math.floor(95 * most) / 100):.2g}."
        )
    return np.clip(made, 0, 1)
